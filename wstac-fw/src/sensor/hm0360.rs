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
    CameraSensor, Setting, Signals, Suspects, dump, frame_lines, readout, runs, set, six_frames, usual_exposure,
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
static TUNING: [Setting; 190] = dump(
    "101D: 00 01 00 01 00  3010: 00  3013: 01  3019: 00 00 20 FF  3026: 03 81 01 00 30 2A 00 03 00 00  3031: 01
     3051: 00  305C: 03  3060: 00 FA
     3062: FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF FF
     3080: 01 01 03 20 00 20 00 20 00 04  3094: 02 02 00 02 00 02
     309E: 05 02 02 00 08 00 20 04 02 02 01 00 02 34  30B0: 03  30C4: 10 01 BF 00 00  30CB: FF FF 7F 7F
     30D3: 01 FF  30D5: 00 40 00 A7 05  30DA: 01 40 00 27 05  30DF: 07 40 00 27 05  30E4: 47 30 00 27 05
     30E9: 87 30 00 27 05  30EE: 00 40 00 A7 05  30F3: 01 40 00 27 05  30F8: 07 40 00 27 05  30FD: 47 30 00 27 05
     3102: 87 30 00 27 05  310B: 10  3113: A0 67 42 10 0A 3F  311C: 10 06 0F 0E 0D 0F 00 1D  3126: 03  3128: 57
     312A: 11 41  312E: 00 00 0C  3141: 2A 9F  3147: 18  3149: 18  314B: 01  3150: 50  3152: 00  3156: 2C
     315A: 0A 2F E0  315F: 02 1F  3163: 1F 7F 7F  317B: 94 00 02  318C: 00",
);
