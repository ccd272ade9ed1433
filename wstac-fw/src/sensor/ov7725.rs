//! OV7725: 320 × 240, scaled down from the whole array, which a clock of 24 MHz reads 30 times per second; above that
//! rate, a quarter of the array, as OpenMV's driver chooses it.
//!
//! Register addresses and bits are those of OmniVision's data sheet as public drivers quote it. There was no data sheet
//! and no sensor, so nothing of this is confirmed on hardware. The rate is arithmetic: 24 MHz / (784 × 510 × 2 clocks
//! per frame) = 30.0. Other rates
//! have other numbers of lines; a line of a quarter of the array has 576 pixels.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x00–0x03 | gain; blue, red and green gains, 0x80 for 1 |
//! | 0x08, 0x10 | exposure in lines, high and low byte |
//! | 0x0A, 0x0B | product identity |
//! | 0x0C | 4: Y before U and V |
//! | 0x0D | 7–6: PLL, 1 for 4 times; the others keep their default |
//! | 0x0E | 7: lower the frame rate in the dark |
//! | 0x11 | 6: no divider; 5–0: the clock is the PLL's / (2 × (1 + these)) |
//! | 0x12 | 7: reset; 6: a quarter of the array; 1–0: 0 for YUV |
//! | 0x13 | 2: automatic gain, 1: automatic white balance, 0: automatic exposure |
//! | 0x17–0x1A, 0x32 | window of the pixel array |
//! | 0x29, 0x2C, 0x2A | width / 4 and height / 2 of the output, and their low bits |
//! | 0x2B, 0x2D, 0x2E, 0x33, 0x34 | pixels and lines that are added |
//! | 0x46 | 0: lens correction |
//! | 0x60, 0x61, 0xA6 | fixed U and V; effects, of which bits 4–3 fix U and V |
//! | 0x64 | 5: special effects, 2: gamma |
//! | 0x65 | 3–0: scale and zoom, both ways |
//! | 0x67 | 1–0: 0 for YUV or RGB |
//! | 0xAC | 3–2: scale factors follow from the sizes |

use super::ov7690::ov7690;
use super::{
    CameraSensor, ExposurePart, FIXED_CHROMA, Setting, Suspects, WHOLE_FPS, frame_lines, readout, runs, set,
    usual_exposure,
};
use crate::setup;

/// The OV7725.
pub const OV7725: CameraSensor = ov7725::<{ setup::FPS }>();

/// Creates the OV7725 at a rate of 15 to 60 frames per second.
pub(super) const fn ov7725<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "OV7725",
        identity: [set(0x0A, 0x77), set(0x0B, 0x21)],
        reset_ms: 10,
        settings: At::<FPS>::SETTINGS,
        suspects: Suspects { size: 0x29, format: 0x0C, rate: 0x11 },
        slower: Some([0x03, 0x07]),
        exposure: &EXPOSURE,
        // Rows of the array, with two clocks per pixel.
        readout: readout(At::<FPS>::ROWS * At::<FPS>::PIXELS * 2),
        longest_exposure: At::<FPS>::LINES - 10,
        // Its address, the register of its reset and its signals are those of the OV7690.
        ..ov7690::<FPS>()
    }
}

static EXPOSURE: [ExposurePart; 2] = [ExposurePart::byte(0x08, true), ExposurePart::byte(0x10, false)];

/// Makes a rate of the table.
struct At<const FPS: u32>;

impl<const FPS: u32> At<FPS> {
    const IS_WHOLE: bool = FPS <= WHOLE_FPS;
    /// The rows of the array for each row of the picture.
    const ROWS: u16 = if Self::IS_WHOLE { 2 } else { 1 };
    /// The pixels of a line and the lines of a frame, blank ones too.
    const PIXELS: u16 = if Self::IS_WHOLE { 784 } else { 576 };
    const LINES: u16 = frame_lines(if Self::IS_WHOLE { 510 } else { 510 * 784 / 576 }, FPS);
    /// The lines that are added to those of the array.
    const MORE: [u8; 2] = (Self::LINES - if Self::IS_WHOLE { 510 } else { 278 }).to_le_bytes();
    const EXPOSURE: [u8; 2] = usual_exposure((480 * 784 / Self::PIXELS as u32) as u16, Self::LINES, 18).to_be_bytes();
    /// The window: where it begins, and its width / 4 and height / 2.
    const BEGIN_AND_SIZE: [u8; 4] = if Self::IS_WHOLE { [0x22, 0xA4, 0x07, 0xF0] } else { [0x3F, 0x50, 0x03, 0x78] };

    const RATE: [Setting; 10] = runs(&[
        (0x12, &[if Self::IS_WHOLE { 0x00 } else { 0x40 }]), // the whole array, or a quarter; YUV
        (0x2D, &Self::MORE),
        (0x17, &Self::BEGIN_AND_SIZE),
        (0x13, &[0x00]),              // no automatic exposure, gain, white balance
        (0x08, &[Self::EXPOSURE[0]]), // nearly all of a frame, at most 31 ms
        (0x10, &[Self::EXPOSURE[1]]),
    ]);
    const SETTINGS: &[&[Setting]] = &[&FORMAT, &Self::RATE, &WINDOW, &LOCKS];
}

/// YUV 4:2:2, Y first, from a clock of 24 MHz. Chroma is fixed at its middle, which tells luma from chroma without a
/// picture.
static FORMAT: [Setting; 10] = runs(&[
    (0x0C, &[0x10]), // Y first
    (0x67, &[0x00]), // YUV
    (0x0D, &[0x41]), // 4 times
    (0x11, &[0x01]), // by 4: 24 MHz again
    (0x2B, &[0x00]), // no more pixels, and lines only in 0x2D and 0x2E
    (0x33, &[0x00, 0x00]),
    (0xA6, &[0x18]), // of the special effects, only fixed U and V
    (0x60, &[FIXED_CHROMA, FIXED_CHROMA]),
]);

/// What the array gives, scaled to 320 × 240.
static WINDOW: [Setting; 6] = [
    set(0x32, 0x00),
    set(0x29, 0x50), // 320 / 4
    set(0x2C, 0x78), // 240 / 2
    set(0x2A, 0x00),
    set(0x65, 0x2F), // scale and zoom, both ways
    set(0xAC, 0xFF),
];

/// Sets the values of automatic controls, which are off. No setting bends the light's curve.
static LOCKS: [Setting; 7] = runs(&[
    (0x0E, &[0x01]),                   // the rate stays
    (0x64, &[0xFB]),                   // no gamma; special effects, which 0xA6 chooses
    (0x46, &[0x00]),                   // no lens correction
    (0x00, &[0x00, 0x80, 0x80, 0x80]), // gain, blue, red and green 1
]);
