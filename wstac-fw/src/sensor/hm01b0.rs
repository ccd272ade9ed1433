//! HM01B0: 324 × 244 gray pixels, of which the inner 320 × 240 are used, from a clock of 24 MHz. Its data bus has 8, 4
//! or 1 wires.
//!
//! Register addresses and bits are those of Himax's register list as public drivers quote it (OpenMV, Zephyr, and two
//! drivers for the RP2040). There was no sensor, so nothing of this is confirmed on hardware. The rate is arithmetic:
//! 24 MHz / 8 / (376 pixels × 266 lines per frame) = 29.995. Other rates have other numbers of lines, as the driver of
//! P. Marques makes them; above 30, the clock is divided by 4. With 1 wire, that would take a clock of 48 MHz.
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
//! | 0x0340, 0x0341 | lines of a frame |
//! | 0x0342, 0x0343 | pixel clocks of a line |
//! | 0x0383, 0x0387, 0x0390 | 1, 1 and 0: every pixel |
//! | 0x0601 | 0: test pattern, 4: walking ones |
//! | 0x1000–0x1012 | black level; correction of defect pixels; shift of syncs |
//! | 0x2000, 0x2100, 0x210E, 0x2150 | 0: statistics, automatic exposure and gain, flicker control, motion detection |
//! | 0x3010 | 0: the window of 324 × 244 |
//! | 0x3011 | 0: pixels of 6 bits |
//! | 0x3022, 0x3023 | lines and pixels by which the syncs come early |
//! | 0x3044–0x3058 | analog tuning, as all drivers have it |
//! | 0x3059 | 6: 4 data wires, 5: 1 data wire; 4–0: 2 |
//! | 0x3060 | 5: PCLK only with pixels, 4: high bits first, 3–2: register clock, 1–0: pixel clock, 0 for / 8, 1 for / 4 |
//! | 0x3068 | 0: PCLK inverted |

use super::{
    Addressing, CameraSensor, ExposurePart, QVGA, RESTS, Setting, Signals, Suspects, WHOLE_FPS, frame_lines, readout,
    runs, set, six_frames, usual_exposure,
};
use crate::setup;

/// The width of the data bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataWires {
    /// A bit at a time, the lowest of a pixel first.
    One,
    /// Four bits at a time, the low half of a pixel first.
    Four,
    /// A pixel at a time.
    Eight,
}

impl DataWires {
    /// Returns their number.
    pub const fn count(self) -> u8 {
        match self {
            Self::One => 1,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

/// Creates the HM01B0 with this data bus. With one wire, its table stays at 30 frames per second, and `rp::run` refuses
/// more.
pub const fn hm01b0(wires: DataWires) -> CameraSensor {
    part::<1>(wires)
}

const fn part<const PART: u16>(wires: DataWires) -> CameraSensor {
    match wires {
        DataWires::One => with::<{ if setup::FPS > WHOLE_FPS { WHOLE_FPS } else { setup::FPS } }, false, PART>(wires),
        _ => with::<{ setup::FPS }, { setup::FPS > WHOLE_FPS }, PART>(wires),
    }
}

/// The HM01B0 with eight wires and as many lines as sensors of other boards have.
pub const HM01B0: CameraSensor = with::<{ setup::FPS }, true, 1>(DataWires::Eight);

/// Returns the settings of an HM01B0 that rests: frames with the same exposure and readout, but [`RESTS`] times as many
/// lines. `None` is for another sensor.
pub(super) fn resting(sensor: &CameraSensor) -> Option<&'static [&'static [Setting]]> {
    static RESTING: [CameraSensor; 4] = [
        part::<RESTS>(DataWires::One),
        part::<RESTS>(DataWires::Four),
        part::<RESTS>(DataWires::Eight),
        with::<{ setup::FPS }, true, RESTS>(DataWires::Eight),
    ];
    // Its wires and its clock.
    let kind = |sensor: &CameraSensor| {
        let value = |register| sensor.table().find(|setting| setting.register == register);
        (sensor.name, value(0x3059), value(0x3060))
    };
    RESTING.iter().find(|one| kind(one) == kind(sensor)).map(|one| one.settings)
}

/// Creates the HM01B0 at a rate of 15 to 60 frames per second, or at a whole part of it; with one wire or a slow clock,
/// to 30.
pub(super) const fn with<const FPS: u32, const IS_FAST: bool, const PART: u16>(wires: DataWires) -> CameraSensor {
    let settings = match wires {
        DataWires::One => At::<FPS, IS_FAST, PART>::WITH_1,
        DataWires::Four => At::<FPS, IS_FAST, PART>::WITH_4,
        DataWires::Eight => At::<FPS, IS_FAST, PART>::WITH_8,
    };
    CameraSensor {
        name: "HM01B0",
        address: 0x24,
        addressing: Addressing::Word,
        bank: None,
        identity: [set(0x0000, 0x01), set(0x0001, 0xB0)],
        reset: set(0x0103, 0x01),
        reset_ms: 100,
        commands: None,
        once: &[],
        settings,
        start: &START,
        switches: 0x2100,
        settle_ms: six_frames(FPS),
        size: QVGA,
        readout: readout(At::<FPS, IS_FAST, PART>::DIVIDER * CLOCKS),
        signals: Signals {
            vsync_high_between_frames: false,
            href_high_in_lines: true,
            sample_at_rising_edge: true,
            has_chroma: false,
            luma_first: true,
            border: 2,
            early: 0,
        },
        suspects: Suspects { size: 0x3010, format: 0x3059, rate: 0x3060 },
        slower: None,
        clock: None,
        exposure: &EXPOSURE,
        lines: None,
        longest_exposure: At::<FPS, IS_FAST, PART>::LINES - 2,
        pattern: &WALKING_ONES,
    }
}

static EXPOSURE: [ExposurePart; 2] = [ExposurePart::byte(0x0202, true), ExposurePart::byte(0x0203, false)];

/// The pixel clocks of a line.
const CLOCKS: u16 = 376;

/// Makes a rate of the tables: frames per second, or a whole part of them.
struct At<const FPS: u32, const IS_FAST: bool, const PART: u16>;

impl<const FPS: u32, const IS_FAST: bool, const PART: u16> At<FPS, IS_FAST, PART> {
    /// The clocks of 24 MHz for a pixel.
    const DIVIDER: u16 = if IS_FAST { 4 } else { 8 };
    /// The lines of a frame. An exposure of more than two less would take longer than a frame.
    const LINES: u16 = frame_lines(if IS_FAST { 532 } else { 266 }, FPS);
    /// It is at most 27 ms.
    const EXPOSURE: u16 = usual_exposure(if IS_FAST { 480 } else { 240 }, Self::LINES, 26);

    const RATE: [Setting; 6] = runs(&[
        (0x0340, &(PART * Self::LINES).to_be_bytes()),
        (0x2100, &[0x00]), // no automatic exposure or gain
        (0x0202, &Self::EXPOSURE.to_be_bytes()),
        // PCLK only with pixels; low bits first; clock / 4 or 8
        (0x3060, &[if IS_FAST { 0x29 } else { 0x28 }]),
    ]);
    const WITH_1: &[&[Setting]] = &[&FORMAT, &Self::RATE, &BUS_1, &TUNING, &LOCKS];
    const WITH_4: &[&[Setting]] = &[&FORMAT, &Self::RATE, &BUS_4, &TUNING, &LOCKS];
    const WITH_8: &[&[Setting]] = &[&FORMAT, &Self::RATE, &BUS_8, &TUNING, &LOCKS];
}

/// Every pixel of the window.
static FORMAT: [Setting; 12] = runs(&[
    (0x3010, &[0x01]), // 324 x 244
    (0x0383, &[0x01]), // every column
    (0x0387, &[0x01]), // every row
    (0x0390, &[0x00]), // no binning
    (0x0342, &CLOCKS.to_be_bytes()),
    // VSYNC two lines before the first, so that the interrupt at it comes before the pixels; HREF two pixels before the
    // first, for machine 1 of the PIO: PCLK may run then.
    (0x3022, &[0x02, 0x02]),
    (0x1012, &[0x00]),
    (0x0101, &[0x00]), // neither mirrored nor upside down
    (0x0601, &[0x00]), // no test pattern
    (0x3011, &[0x70]), // pixels of 8 bits
]);

static BUS_8: [Setting; 2] = [set(0x3059, 0x02), NOT_INVERTED];
static BUS_4: [Setting; 2] = [set(0x3059, 0x42), NOT_INVERTED];
static BUS_1: [Setting; 2] = [set(0x3059, 0x22), NOT_INVERTED];
/// Data is to be taken at the rising edge of PCLK.
const NOT_INVERTED: Setting = set(0x3068, 0x20);

/// The analog part, as Himax tunes it.
static TUNING: [Setting; 15] = runs(&[
    (0x3044, &[0x0A, 0x00]),
    (0x3047, &[0x0A]),
    (0x3050, &[0xC0, 0x42, 0x50, 0x00, 0x03, 0xF7, 0xF8, 0x29, 0x1F]),
    (0x3064, &[0x00, 0x04]), // no trigger
    (0x3067, &[0x00]),       // the clock comes from outside
]);

/// Switches other automatic controls off, then sets values.
static LOCKS: [Setting; 12] = runs(&[
    (0x2000, &[0x00]),
    (0x210E, &[0x00]), // no flicker control
    (0x2150, &[0x00]), // no motion detection
    (0x1000, &[0x43]), // black level from covered pixels
    (0x1003, &[0x08]),
    (0x1006, &[0x01, 0x08, 0x00]), // no pixel is corrected by its neighbors
    (0x0205, &[0x00]),             // analog gain 1
    (0x020E, &[0x01, 0x00]),       // digital gain 1
    (0x0350, &[0x7F]),
]);

/// Pixels of known values: 1, 2, 4 … 128, 0, 1 …. A black level would be added to them.
static WALKING_ONES: [Setting; 2] = [set(0x1000, 0x00), set(0x0601, 0x11)];

/// Settings take effect, and frames begin.
static START: [Setting; 2] = [set(0x0104, 0x01), set(0x0100, 0x01)];
