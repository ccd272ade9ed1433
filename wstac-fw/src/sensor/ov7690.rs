//! OV7690 and its sister OV7692: the cameras of the published power figure.
//!
//! Register addresses and bits are those of OmniVision's public register lists of the OV7690. There was no data sheet
//! and no sensor, so nothing of this is confirmed on hardware. Least certain are the OV7692's address and the
//! arithmetic of the clock.
//!
//! | register | bits that are used |
//! | --- | --- |
//! | 0x00–0x03 | gain; blue, red and green gains, 0x40 for 1 |
//! | 0x0A, 0x0B | product identity |
//! | 0x0C | 2: data pins on, 1: VSYNC, HREF, PCLK on |
//! | 0x0F, 0x10 | exposure in lines, high and low byte |
//! | 0x11, 0x29 | clock: 0x11 divides by 1 plus its low 6 bits; 0x29 holds the PLL's settings, left at their default |
//! | 0x12 | 7: reset; 5–0: 0 for YUV |
//! | 0x13 | 2: automatic gain, 1: automatic white balance, 0: automatic exposure |
//! | 0x15 | 6–4: lower the frame rate in the dark; 1–0: digital gain |
//! | 0x16–0x1A, 0x22 | window of the pixel array; 0x22 bit 4: every second line |
//! | 0x3E | 5–4: a pixel clock of twice the pixels, for YUV |
//! | 0x82 | 1–0: 3 for YUV 4:2:2 |
//! | 0xA3–0xB1, 0xB2 | gamma at 15 inputs, slope above the last |
//! | 0xC8–0xCF | width and height into the scaler, and out of it |

use super::{QVGA, Sensor, Setting, Signals, set};

/// The OV7690.
pub const OV7690: Sensor = Sensor {
    name: "OV7690",
    address: 0x21,
    identity: [set(0x0A, 0x76), set(0x0B, 0x91)],
    reset: set(0x12, 0x80),
    reset_ms: 5,
    settings: &[&FORMAT, &WINDOW, &GAMMA, &LOCKS],
    // The time of ten frames.
    settle_ms: 334,
    size: QVGA,
    signals: Signals {
        vsync_high_between_frames: true,
        href_high_in_lines: true,
        sample_at_rising_edge: true,
        luma_first: true,
    },
};

/// The OV7692, which has the same registers at another address.
pub const OV7692: Sensor =
    Sensor { name: "OV7692", address: 0x3C, identity: [set(0x0A, 0x76), set(0x0B, 0x92)], ..OV7690 };

/// YUV 4:2:2, Y first, at 30 frames per second from a clock of 24 MHz.
static FORMAT: [Setting; 5] = [
    set(0x12, 0x00), // YUV
    set(0x82, 0x03), // 4:2:2
    set(0x3E, 0x30), // two bytes per pixel
    set(0x11, 0x00), // clock undivided: 30 frames per second
    set(0x0C, 0x06), // all pins on, nothing swapped or mirrored
];

/// Every second line of the array, scaled to 320 × 240.
static WINDOW: [Setting; 14] = [
    set(0x16, 0x03),
    set(0x17, 0x69),
    set(0x18, 0xA4),
    set(0x19, 0x06),
    set(0x1A, 0xF6),
    set(0x22, 0x10), // every second line
    set(0xC8, 0x02), // 640 in
    set(0xC9, 0x80),
    set(0xCA, 0x00), // 240 in
    set(0xCB, 0xF0),
    set(0xCC, 0x01), // 320 out
    set(0xCD, 0x40),
    set(0xCE, 0x00), // 240 out
    set(0xCF, 0xF0),
];

/// Gamma as a straight line: the curve's values are its inputs. The slope above the last is 4/3 · (256 − 208).
static GAMMA: [Setting; 16] = [
    set(0xA3, 4),
    set(0xA4, 8),
    set(0xA5, 16),
    set(0xA6, 32),
    set(0xA7, 40),
    set(0xA8, 48),
    set(0xA9, 56),
    set(0xAA, 64),
    set(0xAB, 72),
    set(0xAC, 80),
    set(0xAD, 96),
    set(0xAE, 112),
    set(0xAF, 144),
    set(0xB0, 176),
    set(0xB1, 208),
    set(0xB2, 64),
];

/// Switches automatic controls off, then sets values.
static LOCKS: [Setting; 8] = [
    set(0x13, 0x00), // no automatic exposure, gain, white balance
    set(0x15, 0x00), // the rate stays, no digital gain
    set(0x00, 0x00), // gain 1
    set(0x01, 0x40), // blue 1
    set(0x02, 0x40), // red 1
    set(0x03, 0x40), // green 1
    set(0x0F, 0x01), // 480 lines: nearly all of a frame
    set(0x10, 0xE0),
];
