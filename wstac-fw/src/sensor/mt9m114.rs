//! MT9M114: 640 × 480 in the middle of its 1296 × 976 pixels, of which two by two are one, 15 to 30 times per second.
//!
//! Register addresses and bits are those of onsemi's register list as public drivers quote it: those of Linux, OpenMV,
//! Zephyr, NXP and MediaTek. There was no sensor, so nothing of this is confirmed on hardware. OpenMV's makes the
//! window, the clocks of a line and what goes with them, by which a frame of all pixels takes 52 ms. The clock is that
//! of Linux without the PLL: a pixel takes two of 24 MHz, and has two bytes. The rate is arithmetic: a frame takes
//! 862 × 464 pixels.
//!
//! OpenMV's driver turns the picture by 180°, which the others and this table do not: an OpenMV Cam has this sensor
//! upside down, and its OV7725 not.
//!
//! Registers from 0x8000 on are variables of a processor in the sensor, and those from 0xC800 to 0xC9FF act when it is
//! told to change its configuration. A number of two bytes is written in one transfer.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x0000, 0x0001 | identity |
//! | 0x001B | 0: reset |
//! | 0x0080, 0x0081 | 7: done without an error; 3–0: commands under way, of which 1 changes the state |
//! | 0xA804, 0xA805 | 0: automatic exposure and gain |
//! | 0xB404, 0xB405 | 4: color matrix for the light |
//! | 0xBC02, 0xBC03 | 3: darker in the dark |
//! | 0xC800–0xC807 | window of the array: first row and column, last row and column |
//! | 0xC808–0xC80B | pixels per second |
//! | 0xC80E–0xC811 | shortest and longest part of an exposure in clocks |
//! | 0xC812–0xC815 | lines of a frame, clocks of a line |
//! | 0xC816–0xC819 | correction of an exposure; last row that is used |
//! | 0xC834, 0xC835 | sums of two: 1–0 of rows, 5–4 of columns; 1: upside down, 0: mirrored |
//! | 0xC836, 0xC837 | analog gain, 0x20 for 1 |
//! | 0xC83C, 0xC83D | exposure in lines |
//! | 0xC854–0xC85B | window into the scaler: first column and row, width and height |
//! | 0xC868–0xC86B | width and height |
//! | 0xC86C, 0xC86D | 1–0: 0 for YUV; 1: Y before U and V |
//! | 0xC86F | 4: 0x80 is no color; 3: luma of BT.601; 2: of fewer levels |
//! | 0xC874 | 2–0: 1 for no color |
//! | 0xC88C–0xC88F | highest and lowest rate of automatic exposure, in 1/256 |
//! | 0xC909 | 1: automatic white balance |
//! | 0xC914–0xC923 | windows of the automatic controls |
//! | 0xC92F, 0xC932 | sharper edges |
//! | 0xC940, 0xC941 | gamma, 100 for 1 |
//! | 0xC942, 0xC943 | contrast, 0x20 for 1 |
//! | 0xC95E, 0xC95F | lens correction |
//! | 0xC97E | PLL |
//! | 0xC984, 0xC985 | 2–0: 0 for the parallel port |
//! | 0xDC00 | next state |

use embedded_hal::i2c::I2c;

use super::ov7690::ov7690;
use super::{
    Addressing, CameraSensor, Commands, ExposurePart, Setting, Signals, Suspects, WHOLE_FPS, dump, frame_lines,
    readout_at, runs, set, usual_exposure,
};
use crate::setup;

/// The MT9M114, which has at most 30 frames per second.
pub const MT9M114: CameraSensor = mt9m114::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }>();

/// Creates the MT9M114 at a rate of 15 to 30 frames per second.
pub(super) const fn mt9m114<const FPS: u32>() -> CameraSensor {
    let ov7690 = ov7690::<FPS>();
    CameraSensor {
        name: "MT9M114",
        address: 0x48,
        addressing: Addressing::Wide,
        identity: [set(0x0000, 0x24), set(0x0001, 0x81)],
        reset: set(0x001B, 0x01),
        reset_ms: 45,
        commands: Some(&COMMANDS),
        once: &TUNING,
        settings: const { &[&table(frame_lines(LINES, FPS), FPS as u8)] },
        start: &START,
        switches: 0xA805,
        suspects: Suspects { size: 0xC868, format: 0xC86D, rate: 0xC97E },
        slower: None,
        exposure: &EXPOSURE,
        readout: readout_at(CLOCKS, 12_000),
        longest_exposure: frame_lines(LINES, FPS) - 2,
        // OpenMV takes data at the falling edge, NXP at the rising one.
        signals: Signals { vsync_high_between_frames: false, sample_at_rising_edge: false, ..ov7690.signals },
        ..ov7690
    }
}

/// The clocks of a line, and the lines of a frame in 1/30 s. OpenMV has 542 clocks more than columns.
const CLOCKS: u16 = 320 + 542;
const LINES: u32 = 464;
static EXPOSURE: [ExposurePart; 2] = [ExposurePart::byte(0xC83C, true), ExposurePart::byte(0xC83D, false)];

/// Returns the settings of a frame of so many lines.
const fn table(lines: u16, fps: u8) -> [Setting; 59] {
    let ([most, least], [left, right]) = (lines.to_be_bytes(), CLOCKS.to_be_bytes());
    // It is at most 30 ms.
    let [high, low] = usual_exposure(420, lines, 18).to_be_bytes();
    runs(&[
        (0xA804, &[0x00, 0x00]), // no automatic exposure or gain
        (0xB404, &[0x00, 0x00]),
        (0xBC02, &[0x00, 0x07]),
        // From row 240 and column 320 to 733 and 973; 12 MHz.
        (0xC800, &[0x00, 0xF0, 0x01, 0x40, 0x02, 0xDD, 0x03, 0xCD, 0x00, 0xB7, 0x1B, 0x00]),
        (0xC812, &[most, least, left, right]),
        (0xC834, &[0x03, 0x30, 0x00, 0x20]), // sums of 2 x 2; gain 1
        (0xC83C, &[high, low]),
        (0xC854, &[0x00, 0x00, 0x00, 0x00, 0x01, 0x40, 0x00, 0xF0]), // 320 x 240 of these
        (0xC868, &[0x01, 0x40, 0x00, 0xF0, 0x00, 0x02, 0x00, 0x18]), // 320 x 240, YUV 4:2:2, Y first
        (0xC874, &[0x01]),                                           // no color, which tells luma from chroma
        (0xC88C, &[fps, 0x00, fps, 0x00]),
        (0xC909, &[0x00]),                  // no automatic white balance
        (0xC940, &[0x00, 100, 0x20, 0x20]), // gamma and contrast 1
        (0xC95E, &[0x00, 0x00]),
        (0xC97E, &[0x00]), // no PLL
        (0xC984, &[0x80, 0x00]),
    ])
}

/// Registers without a public meaning, as Linux, OpenMV, Zephyr and NXP set them; then what goes with the window.
///
/// 0x001E is how fast the pins change. By bit 9 of 0x301A, bad frames are not sent, as in Linux and OpenMV. From 0xC92F
/// on, no edges are sharper.
static TUNING: [Setting; 52] = dump(
    "001E: 07 77  301A: 02 18  316A: 82 70 82 70 82 02  3180: 87 FF  30D4: 60 80  3ED0: 23 05 77 CF  3E14: FF 39
     A802: 00 08  C80C: 00 01 01 C3 02 73  C816: 00 E0 00 F3  C826: 00 20
     C914: 00 00 00 00 01 3F 00 EF 00 00 00 00 00 3F 00 2F  C92F: 00  C932: 00",
);
/// The longest part of an exposure is in 0xC810.
const _: () = assert!(CLOCKS - 235 == 0x0273);

/// The configuration is to change, then frames begin.
static START: [Setting; 1] = [set(0xDC00, 0x28)];

/// A success is bit 15 of 0x0080, and a change of the state bit 1.
static COMMANDS: Commands = Commands { change: [set(0x0080, 0x80), set(0x0081, 0x02)], under_way: 0x0F };

/// Returns the identity of an MT9M114 that a firmware finds whose rate it does not reach.
pub fn identity(bus: &mut impl I2c) -> Option<u16> {
    let mut id = [0; 2];
    bus.write_read(MT9M114.address, &[0, 0], &mut id).ok()?;
    Some(u16::from_be_bytes(id))
}
