//! OV7692: a sister of the OV7690 with a MIPI port beside the parallel one, and two banks of registers.
//!
//! Register addresses and bits are those of public drivers, Analog Devices' for its MAX78000 boards and MediaTek's for
//! phones, which both use the parallel port. There was no data sheet and no sensor, so nothing of this is confirmed on
//! hardware. Least certain are the clocks behind 0x31, 0x37, 0x5E and 0x64: their values are those of a driver that
//! runs at another clock. The firmware measures the rate and reports another one.
//!
//! The registers of size, gamma, exposure and automatic controls are those of the [OV7690](super::ov7690). These
//! differ:
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x31 | dividers of the system clock and of the PLL's loop |
//! | 0x37 | 3–2: 0 for a pixel clock that is the system clock |
//! | 0x3E, 0x5E, 0x64 | the pixel clock |
//! | 0xFF | bank: 0 for the sensor, 1 for MIPI |
//! | 0xB5 of bank 1 | 6: MIPI on, as at reset |

use super::ov7690::{At, GAMMA, LOCKS, WINDOW, ov7690};
use super::{CameraSensor, FIXED_CHROMA, Setting, runs, set};
use crate::setup;

/// The OV7692.
pub const OV7692: CameraSensor = ov7692::<{ setup::FPS }>();

/// Creates the OV7692 at a rate of 15 to 60 frames per second.
pub(super) const fn ov7692<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "OV7692",
        address: 0x3C,
        identity: [set(0x0A, 0x76), set(0x0B, 0x92)],
        once: &BANKED,
        settings: At::<FPS>::OV7692,
        ..ov7690::<FPS>()
    }
}

impl<const FPS: u32> At<FPS> {
    const OV7692: &[&[Setting]] = &[&FORMAT, &Self::RATE, &WINDOW, &GAMMA, &LOCKS];
}

/// MIPI off. The bank of the other settings is the last one chosen.
static BANKED: [Setting; 3] = [set(0xFF, 0x01), set(0xB5, 0x30), set(0xFF, 0x00)];

/// YUV 4:2:2, Y first, with chroma fixed at its middle, which tells luma from chroma without a picture.
static FORMAT: [Setting; 12] = runs(&[
    (0x0E, &[0x00]), // awake
    (0x82, &[0x03]), // 4:2:2
    (0x31, &[0x82]), // both dividers by 2
    (0x37, &[0x00]), // a pixel clock that is the system clock
    (0x3E, &[0x20]),
    (0x5E, &[0x10]),
    (0x64, &[0x11]),
    (0x81, &[0x3F]), // scaler both ways, special effects
    (0xD2, &[0x18]), // of these, only fixed U and V
    (0xDA, &[FIXED_CHROMA, FIXED_CHROMA]),
    (0x0C, &[0x16]), // all pins on, Y first, nothing mirrored
]);
