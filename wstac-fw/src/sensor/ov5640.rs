//! OV5640: 320 × 240, a quarter in both directions of every second column and row, 30 times per second.
//!
//! Register addresses and bits are those of the drivers of Linux and Espressif. There was no data sheet and no sensor,
//! so nothing of this is confirmed on hardware. The rate is arithmetic, as both have it: the PLL makes 896 MHz of 24,
//! divided by 3 and times 112, which are divided by 2 four times for the array, and a frame takes 1896 × 984 of these
//! clocks of 56 MHz. Slower rates have more lines.
//!
//! The port has a clock of its own, a quarter of 112 MHz, as Espressif's driver makes it for this size: a row is sent
//! while the array reads four. Linux's has 112 MHz, which is for all pixels of the array.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x3008 | 7: reset, 6: off |
//! | 0x300A, 0x300B | identity |
//! | 0x300E | 4, 3: MIPI off; 2: 0 for the parallel port |
//! | 0x3017, 0x3018 | 6–4: VSYNC, HREF, PCLK; 3–0 and 7–2: data |
//! | 0x3034, 0x3035, 0x3036 | 3–0: 8 to divide by 2; 7–4: divider; multiplier |
//! | 0x3037 | 4: by 2, 3–0: divider before the PLL |
//! | 0x3103 | 1: clock of the PLL |
//! | 0x3108 | 5–4 and 1–0: dividers of the port and of the array, powers of 2 |
//! | 0x3400–0x3406 | gains of red, green and blue, 0x400 for 1; 0: fixed |
//! | 0x3500–0x3502 | exposure in sixteenths of a line |
//! | 0x3503 | 1, 0: fixed gain and exposure |
//! | 0x350A, 0x350B | gain in sixteenths |
//! | 0x350C, 0x350D | lines that are added |
//! | 0x3800–0x3807 | window of the array: first and last column and row |
//! | 0x3808–0x380B | width and height |
//! | 0x380C–0x380F | clocks of a line, lines of a frame |
//! | 0x3810–0x3813 | columns and rows on each side that are left out |
//! | 0x3814, 0x3815 | steps from column to column and from row to row |
//! | 0x3820, 0x3821 | 2–1: upside down, mirrored; 0: binning |
//! | 0x3824, 0x460C | divider of the port's clock, if bit 1 of the other is set |
//! | 0x4300, 0x501F | order of bytes, 0x30 for YUYV; 0 for YUV |
//! | 0x4740 | polarities |
//! | 0x5000 | 7: lens correction, 5: gamma, 2–1: defects, 0: colors of all pixels |
//! | 0x5001 | 7: effects, 5: scaler, 1: color matrix, 0: automatic white balance |
//! | 0x503D | 7: test picture |
//! | 0x5308 | 6, 4: sharper edges and less noise by themselves |
//! | 0x5580, 0x5583, 0x5584 | 4–3: fixed U and V; their values |

use super::ov7690::ov7690;
use super::{
    Addressing, CameraSensor, ExposurePart, FIXED_CHROMA, Setting, Suspects, WHOLE_FPS, dump, frame_lines, readout_at,
    runs, set, usual_exposure,
};
use crate::setup;

/// The OV5640, which has at most 30 frames per second.
pub const OV5640: CameraSensor = ov5640::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }>();

/// Creates the OV5640 at a rate of 15 to 30 frames per second.
pub(super) const fn ov5640<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "OV5640",
        address: 0x3C,
        addressing: Addressing::Word,
        identity: [set(0x300A, 0x56), set(0x300B, 0x40)],
        reset: set(0x3008, 0x82),
        reset_ms: 25,
        once: &TUNING,
        settings: const { &[&table(frame_lines(LINES, FPS))] },
        start: &START,
        switches: 0x3503,
        suspects: Suspects { size: 0x3808, format: 0x4300, rate: 0x3035 },
        slower: Some([0x41, 0x81]),
        exposure: &EXPOSURE,
        readout: readout_at(4 * CLOCKS, 56_000),
        longest_exposure: frame_lines(LINES, FPS) - 10,
        // Its signals are those of the OV7690.
        ..ov7690::<FPS>()
    }
}

/// The clocks of a line, and the lines of a frame in 1/30 s.
const CLOCKS: u16 = 1896;
const LINES: u32 = 984;
static EXPOSURE: [ExposurePart; 3] = [HIGH, MIDDLE, LOW];
const HIGH: ExposurePart = ExposurePart { register: 0x3500, from: 16, mask: 0x0F };
const MIDDLE: ExposurePart = ExposurePart { register: 0x3501, from: 8, mask: 0xFF };
const LOW: ExposurePart = ExposurePart { register: 0x3502, from: 0, mask: 0xF0 };

/// Returns the settings of a frame of so many lines.
const fn table(lines: u16) -> [Setting; 59] {
    let ([most, least], [left, right]) = (lines.to_be_bytes(), CLOCKS.to_be_bytes());
    // Nearly all of a frame, at most 31 ms.
    let exposure = usual_exposure(920, lines, 18);
    let [high, middle, low] = [HIGH.of(0, exposure), MIDDLE.of(0, exposure), LOW.of(0, exposure)];
    runs(&[
        // 24 MHz by 3, times 112, by 2, 2 and 2; that by 4 for the port and by 2 for the array.
        (0x3034, &[0x18, 0x21, 112, 0x13]),
        (0x3108, &[0x25]),
        (0x3824, &[0x01]),
        (0x460C, &[0x22]),
        // The parallel port. VSYNC is high between frames and HREF in lines; data at the rising edge.
        (0x300E, &[0x18]),
        (0x3017, &[0x7F, 0xFC]),
        (0x4740, &[0x20]),
        // YUV 4:2:2, Y first. Chroma is fixed at its middle, which tells luma from chroma without a picture.
        (0x4300, &[0x30]),
        (0x501F, &[0x00]),
        (0x5000, &[0x07, 0xA2]), // no lens correction, gamma or automatic white balance; effects, the scaler
        (0x5580, &[0x18]),       // of the effects, only fixed U and V
        (0x5583, &[FIXED_CHROMA, FIXED_CHROMA]),
        (0x503D, &[0x00]), // no test picture
        // Of columns 0 to 2623 and rows 4 to 1947 every second one; of these 1280 x 960 in the middle, as 320 x 240.
        (0x3800, &[0x00, 0x00, 0x00, 0x04, 0x0A, 0x3F, 0x07, 0x9B, 0x01, 0x40, 0x00, 0xF0]),
        (0x380C, &[left, right, most, least]),
        (0x3810, &[0x00, 16, 0x00, 6, 0x31, 0x31]),
        (0x3820, &[0x41, 0x01]), // neither mirrored nor upside down
        (0x350C, &[0x00, 0x00]),
        // No automatic exposure or gain, which is 1.
        (0x3503, &[0x03]),
        (0x3500, &[high, middle, low]),
        (0x350A, &[0x00, 0x10]),
        // No automatic white balance; its gains are 1. Nothing sharpens edges by itself.
        (0x3406, &[0x01]),
        (0x3400, &[0x04, 0x00, 0x04, 0x00, 0x04, 0x00]),
        (0x5308, &[0x00]),
    ])
}

/// The sensor sleeps until its table is written, on the PLL's clock. Then registers without a public meaning, as Linux
/// sets them.
static TUNING: [Setting; 53] = dump(
    "3008: 42  3103: 03  3000: 00  3002: 1C  3004: FF  3006: C3  302D: 60 08  3600: 08 33  3612: 29  3618: 00
     3620: 52 E0 01  3630: 36 0E E2 12 40 13 03  3703: 5A A0 1A  3708: 64 52  370B: 60 03  3715: 78  3717: 01
     371B: 20  3731: 12  3901: 0A  3905: 02 10  4001: 02  4004: 02  4407: 04  460B: 35  471C: 50
     5300: 08 30 10 00 08 30 08 16  5309: 08 30 04 06",
);

/// Frames begin.
static START: [Setting; 1] = [set(0x3008, 0x02)];
