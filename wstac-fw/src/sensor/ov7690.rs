//! OV7690: the camera of the published power figure.
//!
//! Register addresses and bits are those of OmniVision's register lists as public drivers quote them: the Linux drivers
//! of i.MX and OMAP boards, and OpenMV's. There was no data sheet and no sensor, so nothing of this is confirmed on
//! hardware. The rate is arithmetic: the PLL makes 48 MHz of 24 MHz, half of it is the pixel clock, and a frame takes
//! 776 × 516 × 2 pixel clocks, which is 29.97 frames per second. Other rates have other numbers of lines; above 30,
//! every second line of the array is skipped.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x00–0x03 | gain; blue, red and green gains, 0x40 for 1 |
//! | 0x0A, 0x0B | product identity |
//! | 0x0C | 7, 6: turned over, mirrored; 4: Y before U and V; 2: data pins on; 1: VSYNC, HREF, PCLK on; 0: color bars |
//! | 0x0F, 0x10 | exposure in lines, high and low byte |
//! | 0x11 | 5–0: the clock is the PLL's / (1 + these) |
//! | 0x12 | 7: reset; 6: every second line, at twice the rate; 5–0: 0 for YUV |
//! | 0x13 | 2: automatic gain, 1: automatic white balance, 0: automatic exposure |
//! | 0x15 | 7–4: lower the frame rate in the dark; 1–0: digital gain |
//! | 0x16–0x1A, 0x22 | window of the pixel array |
//! | 0x29 | 7–6: PLL divider less 1; 5–4: PLL, 1 for 4 times |
//! | 0x2A–0x2E | pixels of a line; lines that are added to a frame |
//! | 0x3E | 5–4: a pixel clock of twice the pixels, for YUV |
//! | 0x81 | 5: special effects; 3, 2: scaler, vertical and horizontal; both are off at reset |
//! | 0x82 | 3: color bars; 1–0: 3 for YUV 4:2:2 |
//! | 0xA3–0xB1, 0xB2 | gamma at 15 inputs, slope above the last |
//! | 0xC8–0xCF | width and height into the scaler, and out of it |
//! | 0xD2, 0xDA, 0xDB | effects: 4–3 fix U and V at these two values; 2: contrast |

use super::{
    Addressing, CameraSensor, ExposurePart, FIXED_CHROMA, QVGA, Setting, Signals, Suspects, WHOLE_FPS, frame_lines,
    readout, runs, set, six_frames, usual_exposure,
};
use crate::setup;

/// The OV7690.
pub const OV7690: CameraSensor = ov7690::<{ setup::FPS }>();

/// Creates the OV7690 at a rate of 15 to 60 frames per second.
pub(super) const fn ov7690<const FPS: u32>() -> CameraSensor {
    CameraSensor {
        name: "OV7690",
        address: 0x21,
        addressing: Addressing::Byte,
        bank: None,
        identity: [set(0x0A, 0x76), set(0x0B, 0x91)],
        reset: set(0x12, 0x80),
        reset_ms: 5,
        commands: None,
        once: &[],
        settings: At::<FPS>::OV7690,
        start: &[],
        switches: 0x13,
        settle_ms: six_frames(FPS),
        size: QVGA,
        // Rows of the array, with two clocks per pixel.
        readout: readout(At::<FPS>::ROWS * 776 * 2),
        signals: Signals {
            vsync_high_between_frames: true,
            href_high_in_lines: true,
            sample_at_rising_edge: true,
            has_chroma: true,
            luma_first: true,
            border: 0,
            early: 0,
        },
        suspects: Suspects { size: 0xCD, format: 0x0C, rate: 0x11 },
        slower: Some([0x01, 0x03]),
        clock: None,
        exposure: &EXPOSURE,
        lines: None,
        longest_exposure: At::<FPS>::LINES - 16,
        pattern: &[],
    }
}

static EXPOSURE: [ExposurePart; 2] = [ExposurePart::byte(0x0F, true), ExposurePart::byte(0x10, false)];

/// Makes a rate of the tables of the OV7690 and the OV7692.
pub(super) struct At<const FPS: u32>;

impl<const FPS: u32> At<FPS> {
    /// The rows of the array for each row of the picture.
    const ROWS: u16 = if FPS > WHOLE_FPS { 1 } else { 2 };
    /// The lines of a frame.
    const LINES: u16 = frame_lines(516, FPS);
    /// The lines that are added to those of the array.
    const MORE: [u8; 2] = (Self::LINES - 258 * Self::ROWS).to_be_bytes();
    const EXPOSURE: [u8; 2] = usual_exposure(480, Self::LINES, 18).to_be_bytes();
    /// The rows of the array that go into the scaler.
    const INPUT: [u8; 2] = (240 * Self::ROWS).to_be_bytes();

    pub(super) const RATE: [Setting; 13] = runs(&[
        (0x12, &[if FPS > WHOLE_FPS { 0x40 } else { 0x00 }]), // the whole array, or every second line of it; YUV
        (0x11, &[0x00]),                                      // undivided
        // 4 times, by 2; 776 pixels per line; lines that are added
        (0x29, &[0x50, 0x30 | Self::MORE[0], 0x08, Self::MORE[1], 0x00, 0x00]),
        (0xCA, &Self::INPUT),
        (0x13, &[0x00]),         // no automatic exposure, gain, white balance
        (0x0F, &Self::EXPOSURE), // nearly all of a frame, at most 31 ms
    ]);
    const OV7690: &[&[Setting]] = &[&FORMAT, &Self::RATE, &WINDOW, &GAMMA, &LOCKS];
}

/// YUV 4:2:2, Y first, with chroma fixed at its middle, which tells luma from chroma without a picture.
static FORMAT: [Setting; 7] = runs(&[
    (0x82, &[0x03]), // 4:2:2
    (0x3E, &[0x30]), // two bytes per pixel
    (0x81, &[0x3F]), // scaler both ways, special effects
    (0xD2, &[0x18]), // of these, only fixed U and V
    (0xDA, &[FIXED_CHROMA, FIXED_CHROMA]),
    (0x0C, &[0x16]), // all pins on, Y first, nothing mirrored
]);

/// 640 × 480 of the array, scaled to 320 × 240.
pub(super) static WINDOW: [Setting; 12] = runs(&[
    (0x16, &[0x03, 0x69, 0xA4, 0x0C, 0xF6]),
    (0x22, &[0x00]),
    (0xC8, &[0x02, 0x80]),             // 640 in
    (0xCC, &[0x01, 0x40, 0x00, 0xF0]), // 320 and 240 out
]);

/// Gamma as a straight line: the curve's values are its inputs. The slope above the last is 4/3 · (256 − 208).
pub(super) static GAMMA: [Setting; 16] =
    runs(&[(0xA3, &[4, 8, 16, 32, 40, 48, 56, 64, 72, 80, 96, 112, 144, 176, 208, 64])]);

/// Sets the values of automatic controls, which are off.
pub(super) static LOCKS: [Setting; 5] = runs(&[
    (0x15, &[0x00]),                   // the rate stays, no digital gain
    (0x00, &[0x00, 0x40, 0x40, 0x40]), // gain, blue, red and green 1
]);
