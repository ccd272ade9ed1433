//! HM0360: 640 × 480 gray pixels, of which every second one in both directions is sent, from a clock of 24 MHz over
//! eight data wires.
//!
//! Register addresses and bits are those of Himax's register list as public drivers quote it: OpenMV's, from which
//! Zephyr's comes, and Espressif's. There was no data sheet and no sensor, so nothing of this is confirmed on hardware.
//!
//! Drivers contradict themselves about the rate. As OpenMV counts an exposure, a line of 376 pixels takes as many
//! clocks of 24 MHz / 2, and a frame of 532 lines 1/60 s; as it sets rates, that is 1/30 s. So the firmware begins with
//! this divider, measures the rate, and divides the clock once more if frames come twice as fast.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x0000, 0x0001 | model |
//! | 0x0100 | 1 for streaming |
//! | 0x0101 | 1: upside down, 0: mirrored |
//! | 0x0103 | 1 for reset |
//! | 0x0104 | 1: settings take effect |
//! | 0x0202, 0x0203 | exposure in lines |
//! | 0x0205 | 6–4: analog gain, a power of 2 |
//! | 0x020E, 0x020F | digital gain; 0x0100 for 1 |
//! | 0x0300 | 1–0: the clock is divided by 2 to this power |
//! | 0x0301, 0x0302 | clocks of MIPI and power management |
//! | 0x0340, 0x0341 | lines of a frame |
//! | 0x0342, 0x0343 | pixel clocks of a line |
//! | 0x0370–0x0372, 0x100A | gray pixels |
//! | 0x0380, 0x0381 | columns and rows: 1 for every second one |
//! | 0x0382 | binning |
//! | 0x0601 | 0: test pattern |
//! | 0x1000–0x1009 | black level |
//! | 0x1014 | shift of the syncs |
//! | 0x102F | 0: curve |
//! | 0x2000, 0x2001 | 0: automatic exposure and gain; 0x2000 also: automatic rate |
//! | 0x203B, 0x2080 | flicker control; 0: motion detection |
//! | 0x3024 | 3: no change of contexts |
//! | 0x3030 | 0: the window of 640 × 480 |
//! | 0x310F | pixels of 8 bits |
//! | 0x3112 | edge of PCLK |

use super::hm01b0::HM01B0;
use super::{
    CameraSensor, Run, Setting, Signals, Suspects, count, frame_lines, readout, runs, set, six_frames, usual_exposure,
};
use crate::setup;

/// The HM0360.
pub const HM0360: CameraSensor = hm0360::<{ setup::FPS }>();

/// Creates the HM0360 at a rate of 15 to 60 frames per second.
pub(super) const fn hm0360<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "HM0360",
        identity: [set(0x0000, 0x03), set(0x0001, 0x60)],
        reset_ms: 10,
        once: &TUNING,
        settings: const { &[&table(frame_lines(LINES, FPS))] },
        switches: 0x2000,
        settle_ms: six_frames(FPS),
        readout: readout(CLOCKS * 4),
        signals: Signals { sample_at_rising_edge: false, border: 0, ..HM01B0.signals },
        suspects: Suspects { size: 0x0380, format: 0x310F, rate: 0x0300 },
        slower: Some([0x0A, 0x0B]),
        longest_exposure: frame_lines(LINES, FPS) - 4,
        pattern: &[],
        // Its address, the size of its frames, and the registers of reset, start and exposure are those of the HM01B0.
        ..HM01B0
    }
}

/// The pixel clocks of a line, and the lines of a frame in 1/30 s.
const CLOCKS: u16 = 376;
const LINES: u32 = 532;

/// Returns the settings of a frame of so many lines.
const fn table(lines: u16) -> [Setting; 37] {
    let ([most, least], [left, right]) = (lines.to_be_bytes(), CLOCKS.to_be_bytes());
    // It is at most 27 ms.
    let [high, low] = usual_exposure(480, lines, 26).to_be_bytes();
    runs(&[
        (0x3030, &[0x01]),             // 640 x 480
        (0x0380, &[0x01, 0x01, 0x00]), // every second column and row, without binning
        (0x0370, &[0x00, 0x01, 0x01]), // gray
        (0x100A, &[0x01]),
        (0x1014, &[0x0C]),
        (0x0101, &[0x00]),             // neither mirrored nor upside down
        (0x0601, &[0x00]),             // no test pattern
        (0x310F, &[0x00]),             // pixels of 8 bits
        (0x3112, &[0x00]),             // data is to be taken at the falling edge of PCLK
        (0x0300, &[0x09, 0x0A, 0x77]), // by 2
        (0x0340, &[most, least, left, right]),
        (0x2000, &[0x00, 0x00]), // no automatic exposure, gain or rate
        (0x0202, &[high, low]),
        (0x203B, &[0x00]), // no flicker control
        (0x2080, &[0x00]), // no motion detection
        (0x3024, &[0x08]), // no change of contexts
        (0x102F, &[0x00]), // no curve
        (0x1000, &[0x01]), // black level from covered pixels
        (0x1003, &[0x04, 0x04]),
        (0x1007, &[0x01, 0x04, 0x04]),
        (0x0205, &[0x00]),       // analog gain 1
        (0x020E, &[0x01, 0x00]), // digital gain 1
    ])
}

/// Registers without a public meaning, as OpenMV sets them: the first one, and the values from it upwards. Those from
/// 0x309E to 0x318C have the same values in Espressif's driver, where it has them.
const RUNS: &[Run<'_>] = &[
    (0x101D, &[0x00, 0x01, 0x00, 0x01, 0x00]),
    (0x3010, &[0x00]),
    (0x3013, &[0x01]),
    (0x3019, &[0x00, 0x00, 0x20, 0xFF]),
    (0x3026, &[0x03, 0x81, 0x01, 0x00, 0x30, 0x2A, 0x00, 0x03, 0x00, 0x00]),
    (0x3031, &[0x01]),
    (0x3051, &[0x00]),
    (0x305C, &[0x03]),
    (0x3060, &[0x00, 0xFA]),
    (0x3062, &[0xFF; 30]),
    (0x3080, &[0x01, 0x01, 0x03, 0x20, 0x00, 0x20, 0x00, 0x20, 0x00, 0x04]),
    (0x3094, &[0x02, 0x02, 0x00, 0x02, 0x00, 0x02]),
    (0x309E, &[0x05, 0x02, 0x02, 0x00, 0x08, 0x00, 0x20, 0x04, 0x02, 0x02, 0x01, 0x00, 0x02, 0x34]),
    (0x30B0, &[0x03]),
    (0x30C4, &[0x10, 0x01, 0xBF, 0x00, 0x00]),
    (0x30CB, &[0xFF, 0xFF, 0x7F, 0x7F]),
    (0x30D3, &[0x01, 0xFF]),
    (0x30D5, &[0x00, 0x40, 0x00, 0xA7, 0x05]),
    (0x30DA, &[0x01, 0x40, 0x00, 0x27, 0x05]),
    (0x30DF, &[0x07, 0x40, 0x00, 0x27, 0x05]),
    (0x30E4, &[0x47, 0x30, 0x00, 0x27, 0x05]),
    (0x30E9, &[0x87, 0x30, 0x00, 0x27, 0x05]),
    (0x30EE, &[0x00, 0x40, 0x00, 0xA7, 0x05]),
    (0x30F3, &[0x01, 0x40, 0x00, 0x27, 0x05]),
    (0x30F8, &[0x07, 0x40, 0x00, 0x27, 0x05]),
    (0x30FD, &[0x47, 0x30, 0x00, 0x27, 0x05]),
    (0x3102, &[0x87, 0x30, 0x00, 0x27, 0x05]),
    (0x310B, &[0x10]),
    (0x3113, &[0xA0, 0x67, 0x42, 0x10, 0x0A, 0x3F]),
    (0x311C, &[0x10, 0x06, 0x0F, 0x0E, 0x0D, 0x0F, 0x00, 0x1D]),
    (0x3126, &[0x03]),
    (0x3128, &[0x57]),
    (0x312A, &[0x11, 0x41]),
    (0x312E, &[0x00, 0x00, 0x0C]),
    (0x3141, &[0x2A, 0x9F]),
    (0x3147, &[0x18]),
    (0x3149, &[0x18]),
    (0x314B, &[0x01]),
    (0x3150, &[0x50]),
    (0x3152, &[0x00]),
    (0x3156, &[0x2C]),
    (0x315A, &[0x0A, 0x2F, 0xE0]),
    (0x315F, &[0x02, 0x1F]),
    (0x3163, &[0x1F, 0x7F, 0x7F]),
    (0x317B, &[0x94, 0x00, 0x02]),
    (0x318C, &[0x00]),
];

static TUNING: [Setting; count(RUNS)] = runs(RUNS);
