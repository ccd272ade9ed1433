//! When the rows of a picture are exposed: a rolling shutter reads them one after the other.

use super::sqrt::sqrt;
use crate::layout::Layout;
use crate::params::{COLUMNS, NOMINAL_FRAME_RATE, ROWS, TAXELS};
use crate::rate::FrameRate;

/// Where the rows that a sensor reads follow each other in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RowOrder {
    /// From top to bottom: the picture is as the sensor reads it.
    #[default]
    Down,
    /// From bottom to top.
    Up,
    /// From left to right.
    Right,
    /// From right to left.
    Left,
}

/// The time from the first to the last row of a picture as the sensor reads it, at most a second. It is below 0 if the
/// last row comes first.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ReadoutTime(f32);

impl ReadoutTime {
    /// A global shutter, or one strobe per frame: all rows are exposed at once.
    pub const GLOBAL: Self = Self(0.0);

    /// Creates it from milliseconds; `None` unless they are from −1000 to 1000.
    pub const fn from_ms(ms: f32) -> Option<Self> {
        if ms >= -1000.0 && ms <= 1000.0 { Some(Self(ms)) } else { None }
    }

    /// Returns the milliseconds.
    pub const fn ms(self) -> f32 {
        self.0
    }
}

/// How much later each row and column of taxels is exposed than the one before it.
///
/// A slide's light arrives in a row's own time. So a row's slowness is that of the light less the row's delay.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Readout {
    /// Feature frames from a row of taxels to the one below it, and from a column to the one at its right.
    delays: [f32; 2],
    /// Where the delays are assumed, how far they may be off, above and below.
    off: [f32; 2],
}

/// Standard deviation of whatever is equally likely from −1 to 1.
const EVEN_SD: f32 = 0.577_350_3;
/// How far an unknown readout may move a reliable velocity: as a fraction of the speed, and in radians. 9 % and 9°.
const MOST_OFF: [f32; 2] = [0.09, 0.157];

impl Readout {
    /// A global shutter, or one strobe per frame: all rows are exposed at once.
    pub const GLOBAL: Self = Self { delays: [0.0; 2], off: [0.0; 2] };

    /// Creates an unknown readout of the paper's layout, over the full height of the picture: between 0 and the time of
    /// a camera's frame, the top first.
    pub const fn unknown(rate: FrameRate) -> Self {
        let delays = [0.5 / (rate.frames_added() as f32 * ROWS as f32), 0.0];
        Self { delays, off: delays }
    }

    /// Creates the readout of a layout whose whole picture takes this time. `None` is unknown: between 0 and the time
    /// of a camera's frame.
    ///
    /// `order` says where these rows follow each other in the layout's picture.
    ///
    /// ```
    /// use wstac_core::{layout::{FrameSize, Layout}, rate::FrameRate};
    /// use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};
    ///
    /// let layout = Layout::paper(FrameSize::new(640, 480)?)?;
    /// let readout = Readout::of_layout(ReadoutTime::from_ms(30.0), RowOrder::Down, &layout, FrameRate::NOMINAL);
    /// let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(readout);
    /// # assert!(config != MotionConfig::published(FrameRate::NOMINAL));
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    pub fn of_layout(time: Option<ReadoutTime>, order: RowOrder, layout: &Layout, rate: FrameRate) -> Self {
        let (axis, side, sign) = match order {
            RowOrder::Down => (1, layout.frame().height(), 1.0),
            RowOrder::Up => (1, layout.frame().height(), -1.0),
            RowOrder::Right => (0, layout.frame().width(), 1.0),
            RowOrder::Left => (0, layout.frame().width(), -1.0),
        };
        // The slope of straight lines through the corners, of a row's number and of a column's.
        let mut moments = [0_i32; 2];
        for (taxel, corner) in layout.corners().iter().enumerate() {
            let at = i32::from(corner[axis]);
            moments[0] += at * ((taxel / COLUMNS) as i32 - (ROWS / 2) as i32);
            moments[1] += at * ((taxel % COLUMNS) as i32 - (COLUMNS / 2) as i32);
        }
        let frames = match time {
            Some(ReadoutTime(ms)) => ms * NOMINAL_FRAME_RATE as f32 / (1000.0 * rate.nominal_frames()),
            None => 0.5 / rate.frames_added() as f32,
        };
        let whole = side as f32 * SPREAD as f32;
        let delays = [moments[0] as f32 / whole * (sign * frames), moments[1] as f32 / whole * (sign * frames)];
        Self { delays, off: if time.is_some() { [0.0; 2] } else { delays } }
    }

    /// Returns whether it is known.
    pub const fn is_known(self) -> bool {
        self.off[0] == 0.0 && self.off[1] == 0.0
    }

    /// Returns feature frames from a row of taxels to the one below it, and from a column to the one at its right: half
    /// of what is possible if it is unknown.
    pub const fn delays(self) -> [f32; 2] {
        self.delays
    }

    /// Returns the least and the most that a slowness may be, if it and those of rows and columns are of the assumed
    /// delays.
    pub(super) fn bounds(self, [rows, columns]: [f32; 2], slowness: f32) -> [f32; 2] {
        // Without a floating-point unit, each of these operations takes a hundred instructions.
        if self.is_known() {
            return [slowness; 2];
        }
        let [a, b] = self.off;
        let along = rows * a + columns * b;
        let square = a * a + b * b;
        let nearest = (along / square).clamp(-1.0, 1.0);
        let far = if along < 0.0 { -1.0 } else { 1.0 };
        [-nearest, far].map(|part| super::length([rows + part * a, columns + part * b]))
    }

    /// Returns how far the speed may be off as a fraction, and the direction in radians, if the slowness is this one
    /// with this direction.
    pub(crate) fn reach(self, slowness: f32, right: f32, up: f32) -> [f32; 2] {
        if self.is_known() {
            return [0.0; 2];
        }
        let [rows, columns] = self.off;
        [(right * columns - up * rows).abs() / slowness, (right * rows + up * columns).abs() / slowness]
    }
}

/// The sum of the squares of the lines' numbers from the middle, over all taxels.
const SPREAD: usize = TAXELS * 2;

/// Returns whether a velocity may be off by more than a reliable one.
pub(crate) fn is_too_far(reach: [f32; 2]) -> bool {
    reach[0] > MOST_OFF[0] || reach[1] > MOST_OFF[1]
}

/// Returns a standard deviation together with that of what may be off by `reach`.
pub(crate) fn widened(sd: f32, reach: f32) -> f32 {
    if reach == 0.0 {
        return sd;
    }
    let more = EVEN_SD * reach;
    sqrt(sd * sd + more * more)
}
