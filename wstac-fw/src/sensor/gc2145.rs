//! GC2145: 320 × 240 in the middle of its 1600 × 1200 pixels, 15 to 30 times per second.
//!
//! Register addresses and bits are those of Galaxycore's data sheet as public drivers quote it: those of Linux,
//! Espressif, OpenMV and MediaTek. There was no data sheet and no sensor, so nothing of this is confirmed on hardware.
//!
//! The rate is arithmetic. A row takes blank columns + delay + width / 2 + 4 clocks, and a frame blank rows + height +
//! 16 rows. With 24 MHz / 4 × (1 + multiplier) / (1 + divider), these are the 30.0 and 20.0 frames per second of
//! Linux's 1280 × 720 and 1600 × 1200, and the 47 µs per row of MediaTek. Whether 16 or 8 rows are added is within 2 %.
//!
//! The port's clock is up to four times that one, which is 6 MHz. So more pixels do not fit in 1/30 s: the lens must
//! show the whiskers in a fifth of the array's width.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0xF0, 0xF1 | identity |
//! | 0xF2 | pins |
//! | 0xF8, 0xFA | 5–0: multiplier; 7–4: divider |
//! | 0xFD | scaler |
//! | 0xFE | 7: reset; 2–0: bank |
//!
//! | register of bank 0 | bits that are used |
//! | --- | --- |
//! | 0x03, 0x04 | exposure in rows |
//! | 0x05–0x08, 0x11, 0x12 | blank columns and rows; delay |
//! | 0x09–0x10 | window of the array: first row and column, height and width |
//! | 0x17 | 1: upside down, 0: mirrored |
//! | 0x80 | 7–6: gamma, 5: color correction, 4: edges, 3: colors of all pixels, 0: lens correction |
//! | 0x81, 0x82 | automatic controls, of which 0x82, 1 is white balance |
//! | 0x83 | effect, 0x12 for no color |
//! | 0x84 | 4–0: order of bytes, 2 for YUYV |
//! | 0x86 | polarities |
//! | 0x90–0x98 | output: switch, first row and column, height and width |
//! | 0x99, 0x9A–0xA2 | rows and columns of the array for each; which of them |
//! | 0xB0, 0xB3–0xB5 | gain; gains of red, green and blue, 0x40 for 1 |
//! | 0xB6 | 0: automatic exposure and gain |

use super::ov7690::ov7690;
use super::{
    CameraSensor, ExposurePart, Setting, Signals, Suspects, WHOLE_FPS, dump, frame_lines, readout_at, runs, set,
    usual_exposure,
};
use crate::setup;

/// The GC2145, which has at most 30 frames per second.
pub const GC2145: CameraSensor = gc2145::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }>();

/// Creates the GC2145 at a rate of 15 to 30 frames per second.
pub(super) const fn gc2145<const FPS: u32>() -> CameraSensor {
    let ov7690 = ov7690::<FPS>();
    CameraSensor {
        name: "GC2145",
        address: 0x3C,
        identity: [set(0xF0, 0x21), set(0xF1, 0x45)],
        reset: set(0xFE, 0xF0),
        reset_ms: 20,
        once: &TUNING,
        settings: const { &[&table(frame_lines(ROWS, FPS))] },
        switches: 0xB6,
        suspects: Suspects { size: 0x97, format: 0x84, rate: 0xFA },
        slower: Some([0x50, 0xB0]),
        exposure: &EXPOSURE,
        readout: readout_at(CLOCKS, 6_000),
        longest_exposure: frame_lines(ROWS, FPS) - 16,
        signals: Signals { vsync_high_between_frames: false, ..ov7690.signals },
        ..ov7690
    }
}

/// The blank columns, a few less than Espressif's, so that the 8 rows are less than 2 %; and the clocks of a row.
const BLANK: u16 = 264;
const DELAY: u16 = 46;
const WIDTH: u16 = 320 + 16;
const HEIGHT: u16 = 240 + 8;
const CLOCKS: u16 = BLANK + DELAY + WIDTH / 2 + 4;
/// The rows of a frame in 1/30 s.
const ROWS: u32 = 415;
static EXPOSURE: [ExposurePart; 2] =
    [ExposurePart { register: 0x03, from: 12, mask: 0x1F }, ExposurePart::byte(0x04, false)];

/// Returns the settings of a frame of so many rows.
const fn table(rows: u16) -> [Setting; 43] {
    let [more_high, more_low] = (rows - HEIGHT - 16).to_be_bytes();
    // Nearly all of a frame, at most 31 ms.
    let [high, low] = usual_exposure(376, rows, 18).to_be_bytes();
    let ([wide_high, wide_low], [tall_high, tall_low]) = (WIDTH.to_be_bytes(), HEIGHT.to_be_bytes());
    runs(&[
        (0xF8, &[0x82]), // 3 times
        (0xFA, &[0x20]), // by 3
        (0x05, &[(BLANK >> 8) as u8, BLANK as u8, more_high, more_low]),
        (0x11, &[0x00, DELAY as u8]),
        (0xB6, &[0x00]), // no automatic exposure or gain
        (0x03, &[high, low]),
        // From row 480 and column 640 on, 320 x 240, each pixel as it is.
        (0x09, &[0x01, 0xE0, 0x02, 0x80, tall_high, tall_low, wide_high, wide_low]),
        (0x90, &[0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0xF0, 0x01, 0x40, 0x11, 0x06]),
        (0xFD, &[0x00]),
        // No gamma, color correction, edges, lens correction or automatic white balance. No color, which tells luma
        // from chroma without a picture. YUV 4:2:2, Y first.
        (0x80, &[0x08, 0x00, 0x00, 0x12, 0x02]),
        (0x86, &[0x03]), // VSYNC and HREF are high in frames and lines; data at the rising edge
        (0x17, &[0x14]), // neither mirrored nor upside down
        (0xB0, &[0x55]),
        (0xB3, &[0x40, 0x40, 0x40]), // gains 1
        (0xF2, &[0x0F]),             // all pins on
    ])
}

/// Registers without a public meaning, which Linux, OpenMV and Zephyr set to the same values: those of bank 2, then of
/// bank 0.
static TUNING: [Setting; 69] = dump(
    "FE: 02  40: BF  46: CF  48: 15 00  4B: 0B  90: 6C 03 CB  94: 33 84  97: 65  A2: 11  FE: 00  FC: 06
     F6: 00 1D  F9: FE  18: 22 0E 01 4B 07 10 88 78 03 40 A0  24: 16 01 10  2D: 60  30: 01 90  33: 06 01
     40: 42 00  43: 5B  5E: 00 00 00 00 00 00 00 00  66: 20 20 20 20 08 08 08 08 08 08 08 08 F0  76: 00
     7E: 3C 00  85: 08  88: 03 03 00 00",
);
