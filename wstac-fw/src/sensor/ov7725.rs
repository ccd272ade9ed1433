//! OV7725: 320 × 240, scaled down from the whole array, which a clock of 24 MHz reads 30 times per second.
//!
//! Register addresses and bits are those of OmniVision's data sheet as public drivers quote it. There was no data sheet
//! and no sensor, so nothing of this is confirmed on hardware. The rate is arithmetic: 24 MHz / (784 × 510 × 2 clocks
//! per frame) = 30.0.
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

use super::ov7690::OV7690;
use super::{CameraSensor, FIXED_CHROMA, Setting, Suspects, readout, set};

/// The OV7725.
pub const OV7725: CameraSensor = CameraSensor {
    name: "OV7725",
    identity: [set(0x0A, 0x77), set(0x0B, 0x21)],
    reset_ms: 10,
    settings: &[&FORMAT, &WINDOW, &LOCKS],
    suspects: Suspects { size: 0x29, format: 0x0C, rate: 0x11 },
    slower: Some([0x03, 0x07]),
    exposure: [0x08, 0x10],
    // Two rows of the array, with two clocks per pixel.
    readout: readout(2 * 784 * 2),
    // Its address, the register of its reset and its signals are those of the OV7690.
    ..OV7690
};

/// YUV 4:2:2, Y first, at 30 frames per second from a clock of 24 MHz. Chroma is fixed at its middle, which tells luma
/// from chroma without a picture.
static FORMAT: [Setting; 13] = [
    set(0x12, 0x00), // the whole array, YUV
    set(0x0C, 0x10), // Y first
    set(0x67, 0x00), // YUV
    set(0x0D, 0x41), // 4 times
    set(0x11, 0x01), // by 4: 24 MHz again
    set(0x2B, 0x00), // no more pixels or lines
    set(0x2D, 0x00),
    set(0x2E, 0x00),
    set(0x33, 0x00),
    set(0x34, 0x00),
    set(0xA6, 0x18), // of the special effects, only fixed U and V
    set(0x60, FIXED_CHROMA),
    set(0x61, FIXED_CHROMA),
];

/// 640 × 480 of the array, scaled to 320 × 240.
static WINDOW: [Setting; 10] = [
    set(0x17, 0x22),
    set(0x18, 0xA4),
    set(0x19, 0x07),
    set(0x1A, 0xF0),
    set(0x32, 0x00),
    set(0x29, 0x50), // 320 / 4
    set(0x2C, 0x78), // 240 / 2
    set(0x2A, 0x00),
    set(0x65, 0x2F), // scale and zoom, both ways
    set(0xAC, 0xFF),
];

/// Switches automatic controls off, then sets values. No setting bends the light's curve.
static LOCKS: [Setting; 10] = [
    set(0x13, 0x00), // no automatic exposure, gain, white balance
    set(0x0E, 0x01), // the rate stays
    set(0x64, 0xFB), // no gamma; special effects, which 0xA6 chooses
    set(0x46, 0x00), // no lens correction
    set(0x00, 0x00), // gain 1
    set(0x01, 0x80), // blue 1
    set(0x02, 0x80), // red 1
    set(0x03, 0x80), // green 1
    set(0x08, 0x01), // 480 lines: nearly all of a frame
    set(0x10, 0xE0),
];
