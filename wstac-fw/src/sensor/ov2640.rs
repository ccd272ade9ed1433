//! OV2640: 320 × 240, scaled down from 800 × 600, 15 to 30 times per second.
//!
//! Register addresses and bits are those of OmniVision's data sheet as public drivers quote it: those of Linux, OpenMV,
//! Espressif and Zephyr. There was no data sheet and no sensor, so nothing of this is confirmed on hardware.
//!
//! The rate is that of the data sheet: a frame of 800 × 600 takes 1190 × 672 clocks of 24 MHz, which are 30.0 per
//! second. OpenMV's driver counts exposures with 18 MHz. A module that has these sends 22.5 frames per second, and is
//! refused with that number. Slower rates have more lines.
//!
//! Registers have two banks. Of bank 0, the picture's processor, everything is read back once: after a reset the other
//! one is no longer chosen, which the settings of bank 1 show.
//!
//! | register of bank 0 | bits that are used |
//! | --- | --- |
//! | 0x05 | 0: no processor |
//! | 0x50 | 4–3, 2–0: height and width are divided by 2 to this power |
//! | 0x51–0x57 | width / 4, height / 4, where they begin, and their high bits |
//! | 0x5A–0x5C | output: width / 4, height / 4, and their high bits |
//! | 0x7C, 0x7D | number and value of a register of the effects; then the next one's. 0: 4–3 fix V and U; 5, 6: U and V |
//! | 0x86 | 5: scaler, 4: effects |
//! | 0x8C, 0xC0, 0xC1 | low bits, width / 8 and height / 8 of what comes in |
//! | 0xC2 | 3, 2: YUV |
//! | 0xC3 | 5: gamma, 4: digital gain, 3: automatic white balance, 2: its gains, 1: lens correction |
//! | 0xD3 | 7: automatic; 6–0: the port has 48 MHz / these |
//! | 0xDA | 6, 4, 3–2: other formats; 0: chroma first |
//! | 0xE0 | 2: the port is in reset |
//!
//! | register of bank 1 | bits that are used |
//! | --- | --- |
//! | 0x00 | gain |
//! | 0x03 | 7–6: frames that are left out; 3–2, 1–0: low bits of the window's rows |
//! | 0x04 | 7: mirrored, 6: upside down, 3: HREF; 1–0: low bits of the exposure |
//! | 0x09 | 4: sleep |
//! | 0x0A, 0x0B | product identity |
//! | 0x10, 0x45 | exposure in lines, bits 9–2 and 15–10 |
//! | 0x11 | 7: doubled; 5–0: the clock is divided by 1 + these |
//! | 0x12 | 7: reset; 6–4: 4 for 800 × 600; 1: color bars |
//! | 0x13 | 5: flicker control, 2: automatic gain, 0: automatic exposure |
//! | 0x15 | polarities |
//! | 0x17–0x1A, 0x32 | window of the array; 0x32, 7–6: the clock is divided |
//! | 0x2A, 0x2B, 0x2D, 0x2E, 0x46, 0x47 | pixels and lines that are added |

use super::ov7670::{LOW, MIDDLE};
use super::ov7690::ov7690;
use super::{
    CameraSensor, ExposurePart, FIXED_CHROMA, Setting, Signals, Suspects, WHOLE_FPS, dump, frame_lines, readout, runs,
    set, usual_exposure,
};
use crate::setup;

/// The OV2640, which has at most 30 frames per second.
pub const OV2640: CameraSensor = ov2640::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }>();

/// Creates the OV2640 at a rate of 15 to 30 frames per second.
pub(super) const fn ov2640<const FPS: u32>() -> CameraSensor {
    let ov7690 = ov7690::<FPS>();
    CameraSensor {
        name: "OV2640",
        address: 0x30,
        bank: Some(set(0xFF, 0x01)),
        identity: [set(0x0A, 0x26), set(0x0B, 0x42)],
        reset_ms: 20,
        once: &ONCE,
        settings: const { &[&table(frame_lines(ARRAY as u32, FPS))] },
        start: &START,
        suspects: Suspects { size: 0x17, format: 0x15, rate: 0x11 },
        slower: Some([0x01, 0x03]),
        exposure: &EXPOSURE,
        // Two and a half rows of the array.
        readout: readout(PIXELS * 5 / 2),
        longest_exposure: frame_lines(ARRAY as u32, FPS) - 10,
        signals: Signals { vsync_high_between_frames: false, ..ov7690.signals },
        // The register of its reset is that of the OV7690.
        ..ov7690
    }
}

/// The clocks of a line, and the lines of a frame without added ones.
const PIXELS: u16 = 1190;
const ARRAY: u16 = 672;
static EXPOSURE: [ExposurePart; 3] = [LOW, MIDDLE, HIGH];
const HIGH: ExposurePart = ExposurePart { register: 0x45, from: 14, mask: 0x3F };

/// Returns the settings of a frame of so many lines.
const fn table(lines: u16) -> [Setting; 21] {
    let [more_high, more_low] = (lines - ARRAY).to_be_bytes();
    // Nearly all of a frame, at most 31 ms.
    let exposure = usual_exposure(630, lines, 18);
    runs(&[
        (0x12, &[0x40]), // 800 x 600
        (0x11, &[0x00]), // undivided
        // No more pixels, and lines only in 0x2D and 0x2E.
        (0x2A, &[0x00, 0x00]),
        (0x46, &[0x00, 0x00]),
        (0x2D, &[more_low, more_high]),
        (0x13, &[0xC0]),                   // no automatic exposure or gain
        (0x04, &[LOW.of(0x28, exposure)]), // not mirrored
        (0x10, &[MIDDLE.of(0, exposure)]),
        (0x45, &[HIGH.of(0, exposure)]),
        (0x00, &[0x00]), // gain 1
        // 800 x 600 of the array.
        (0x17, &[0x11, 0x43, 0x00, 0x4B]),
        (0x32, &[0x09]),
        (0x03, &[0x0A]),
        (0x15, &[0x00]), // VSYNC and HREF are high in frames and lines; data at the rising edge
        (0x09, &[0x02]),
    ])
}

/// Bank 0, then those registers of bank 1 that have no public meaning, as Espressif's driver sets them for 800 × 600.
///
/// The port is in reset (0xE0). 800 × 600 come in as YUV, without gamma, white balance or lens correction (from 0xC0
/// on), and all of it leaves as 320 × 240 (from 0x50 on), Y first. The port has 12 MHz, as Linux has it for this size
/// (0xD3).
static ONCE: [Setting; 80] = dump(
    "FF: 00  2C: FF  2E: DF  E0: 04  05: 00  33: A0  41: 24 20 18  4C: 00  76: FF  7F: 00  87: 50 3F  A4: 00
     A8: 00  BF: 80  C5: 11 51 10  C8: 08 80  D7: 03  D9: 10  DD: 7F  E1: 67  E5: 1F  C0: 64 4B 0E C1  8C: 00
     86: 3D  50: 89 C8 96 00 00 00  57: 00  5A: 50 3C 00  D3: 04  DA: 00  FF: 01  06: 88 C0  0D: 87 41  16: 10
     20: 80 99 1A 00  28: 30  2C: 0C  33: 78 C0 DA  37: C3  39: 92 33 FB 32 38 00  42: 03 11  4A: 81  4C: 00
     5C: 00  63: 00  6C: 00 00 00  70: 02 94  73: C1  7C: 05",
);
/// The effects, of which each value moves on to the next register: fixed U and V. Then the port starts. Espressif's
/// tables of gamma, edges and noise are left out: what is off, or has no public meaning, keeps its default.
static START: [Setting; 9] = [
    set(0xFF, 0x00),
    set(0xF9, 0xC0), // the microcontroller is in reset
    set(0x7C, 0x00),
    set(0x7D, 0x18),
    set(0x7C, 0x05),
    set(0x7D, FIXED_CHROMA),
    set(0x7D, FIXED_CHROMA),
    set(0xE0, 0x00),
    set(0xFF, 0x01),
];
