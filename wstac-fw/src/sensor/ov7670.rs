//! OV7670: 320 × 240, scaled down from the whole array, which a clock of 24 MHz reads at most 30 times per second.
//!
//! Register addresses and bits are those of OmniVision's data sheet as public drivers quote it: those of Linux, OpenMV,
//! Zephyr and Adafruit. There was no data sheet and no sensor, so nothing of this is confirmed on hardware. The rate is
//! arithmetic, as Linux and Adafruit have it: the PLL makes 96 MHz of 24 MHz, which are divided by 4, and a frame takes
//! 784 × 510 × 2 clocks. Slower rates have more lines.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x00–0x03, 0x6A | gain; blue and red gains; 7–6: more gain, 3–0: low bits of the window; green gain |
//! | 0x04 | 6: codes in place of syncs, 1–0: low bits of the exposure |
//! | 0x07, 0x10 | exposure in lines, bits 15–10 and 9–2 |
//! | 0x0A, 0x0B | product identity |
//! | 0x0C | 2: scaled down |
//! | 0x11 | 6: no divider; 5–0: the clock is the PLL's / (1 + these) |
//! | 0x12 | 7: reset; 5–3: other sizes; 2, 0: 0 for YUV; 1: color bars |
//! | 0x13 | 5: flicker control, 2: automatic gain, 1: automatic white balance, 0: automatic exposure |
//! | 0x15 | 6–0: polarities of syncs and clock |
//! | 0x17–0x1A, 0x32 | window of the pixel array, of which 640 × 480 are taken |
//! | 0x1E | 5: mirrored, 4: upside down |
//! | 0x2A, 0x2B, 0x2D, 0x2E, 0x92, 0x93 | pixels and lines that are added |
//! | 0x3A | 5: negative, 4: fixed U and V, 3: chroma first |
//! | 0x3B | 7: lower the frame rate in the dark |
//! | 0x3D | 7: gamma |
//! | 0x3E, 0x73 | clock of the scaled picture: half of the array's |
//! | 0x3F, 0x41 | sharper edges; gains of white balance |
//! | 0x40 | 7–6: range of luma, 3 for 0 to 255 |
//! | 0x42 | 3: color bars |
//! | 0x55–0x57 | brightness, contrast with 0x40 for 1, and its center |
//! | 0x66 | 0: lens correction |
//! | 0x67, 0x68 | U and V, if they are fixed |
//! | 0x69 | gains of each color |
//! | 0x6B | 7–6: PLL, 1 for 4 times |
//! | 0x70–0x72 | 7: test pictures; scale, 1 for half of width and height |
//! | 0x74 | 4: digital gain of bits 1–0, 0 for none |
//! | 0x8C | 1: RGB of 12 bits |
//! | 0xA2 | delay of the scaled picture |

use super::ov7690::ov7690;
use super::{
    CameraSensor, ExposurePart, FIXED_CHROMA, Setting, Suspects, WHOLE_FPS, dump, frame_lines, readout, runs, set,
    usual_exposure,
};
use crate::setup;

/// The OV7670, which has at most 30 frames per second.
pub const OV7670: CameraSensor = ov7670::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }>();

/// Creates the OV7670 at a rate of 15 to 30 frames per second.
pub(super) const fn ov7670<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "OV7670",
        identity: [set(0x0A, 0x76), set(0x0B, 0x73)],
        reset_ms: 10,
        once: &TUNING,
        settings: const { &[&table(frame_lines(ARRAY as u32, FPS))] },
        suspects: Suspects { size: 0x72, format: 0x3A, rate: 0x11 },
        slower: Some([0x07, 0x0F]),
        exposure: &EXPOSURE,
        // Two rows of the array, with two clocks per pixel.
        readout: readout(2 * PIXELS * 2),
        longest_exposure: frame_lines(ARRAY as u32, FPS) - 10,
        // Its address, the register of its reset and its signals are those of the OV7690.
        ..ov7690::<FPS>()
    }
}

/// The pixels of a line, and the lines of a frame without added ones.
const PIXELS: u16 = 784;
const ARRAY: u16 = 510;
static EXPOSURE: [ExposurePart; 3] = [LOW, MIDDLE, HIGH];
pub(super) const LOW: ExposurePart = ExposurePart { register: 0x04, from: 4, mask: 0x03 };
pub(super) const MIDDLE: ExposurePart = ExposurePart { register: 0x10, from: 6, mask: 0xFF };
const HIGH: ExposurePart = ExposurePart { register: 0x07, from: 14, mask: 0x3F };

/// Returns the settings of a frame of so many lines.
const fn table(lines: u16) -> [Setting; 48] {
    let [more_high, more_low] = (lines - ARRAY).to_be_bytes();
    // Nearly all of a frame, at most 31 ms.
    let exposure = usual_exposure(480, lines, 18);
    runs(&[
        // YUV 4:2:2, Y first. Chroma is fixed at its middle, which tells luma from chroma without a picture.
        (0x3A, &[0x14]), // fixed U and V, Y first
        (0x67, &[FIXED_CHROMA, FIXED_CHROMA]),
        (0x3D, &[0x00]), // no gamma
        (0x40, &[0xC0]), // luma of 0 to 255
        (0x8C, &[0x00]),
        (0x15, &[0x00]), // VSYNC is high between frames and HREF in lines; data at the rising edge
        (0x1E, &[0x00]),
        (0x12, &[0x00]), // the whole array; YUV
        (0x6B, &[0x4A]), // 4 times
        (0x11, &[0x03]), // by 4: 24 MHz again
        // No more pixels, and lines only in 0x2D and 0x2E.
        (0x2A, &[0x00, 0x00]),
        (0x92, &[0x00, 0x00]),
        (0x2D, &[more_low, more_high]),
        (0x13, &[0x00]), // no automatic exposure, gain, white balance
        (0x04, &[LOW.of(0, exposure)]),
        (0x10, &[MIDDLE.of(0, exposure)]),
        (0x07, &[HIGH.of(0, exposure)]),
        // 640 x 480 of the array, scaled to 320 x 240, where Linux and Zephyr place them.
        (0x0C, &[0x04]),                   // scaled down
        (0x3E, &[0x19]),                   // half of the clock
        (0x70, &[0x3A, 0x35, 0x11, 0xF1]), // half of width and height, and of the clock
        (0xA2, &[0x02]),
        (0x17, &[0x15, 0x03, 0x02, 0x7A]), // columns 168 to 24, of 784; lines 10 to 490
        (0x32, &[0x80]),
        (0x03, &[0x0A]),
        (0x42, &[0x00]),
        // Values of automatic controls, which are off. No setting bends the light's curve.
        (0x3B, &[0x00]), // the rate stays
        (0x41, &[0x00]), // no gains of white balance, nor edges
        (0x3F, &[0x00]),
        (0x55, &[0x00, 0x40, 0x80]), // brightness 0, contrast 1
        (0x66, &[0x00]),             // no lens correction
        (0x69, &[0x00]),
        (0x74, &[0x10]),             // no digital gain
        (0x00, &[0x00, 0x40, 0x40]), // gain, blue and red 1
        (0x6A, &[0x40]),             // green 1
    ])
}

/// Registers without a public meaning, which Linux, OpenMV and Zephyr set to the same values. By 0xB1, the black level
/// is that of covered pixels.
static TUNING: [Setting; 16] =
    dump("0E: 61 4B  16: 02  21: 02 91  29: 07  33: 0B  35: 0B  37: 1D 71 2A  B0: 84 0C 0E 82  B8: 0A");
