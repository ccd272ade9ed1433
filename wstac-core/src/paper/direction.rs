//! Sliding direction from the order in which rows and columns light up (SPEC §5; paper, "Directional
//! Identification").

use crate::exp::{EXP_FRACTION_BITS, exp_of_negative, widened};
use crate::paper::trigger::Event;
use crate::params::{COLUMNS, LEAST_CONFIDENCE, ROWS};
use crate::reason::Reason;

/// One of the four directions that the centroids tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
// It is exhaustive: rows and columns have four directions.
pub enum Heading {
    /// The specimen slides along +x: columns light up in order.
    Right,
    /// The specimen slides along +y: rows light up in reverse order.
    Up,
    /// The specimen slides along −x: columns light up in reverse order.
    Left,
    /// The specimen slides along −y: rows light up in order.
    Down,
}

impl Heading {
    /// Returns the angle in degrees, counterclockwise from +x: 0, 90, 180 or 270.
    pub fn degrees(self) -> u16 {
        90 * self as u16
    }
}

/// The former name of [`Reason`].
#[deprecated(since = "0.4.0", note = "use `reason::Reason`")]
pub type Unclear = Reason;

/// A direction, and how far it can be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Direction {
    /// The angle in degrees, counterclockwise from +x (0 ≤ degrees < 360), or the reason why there is none.
    ///
    /// By centroids it is 0, 90, 180 or 270. By arrival times it is any angle.
    #[cfg_attr(feature = "serde", serde(with = "crate::reason::of_direction"))]
    pub degrees: Result<f32, Reason>,
    /// The standard deviation in degrees; `None` by centroids, or without an angle.
    pub sd: Option<f32>,
    /// The confidence (|s₁| − |s₂|) / (|s₁| + |s₂|) of the two slopes of the centroids, in units of 2^-15: 0..=32768;
    /// `None` by arrival times.
    pub confidence: Option<u16>,
}

impl Direction {
    /// Creates a direction by centroids, with its confidence in units of 2^-15.
    pub fn by_centroids(heading: Result<Heading, Reason>, confidence: u16) -> Self {
        Self { degrees: heading.map(|heading| f32::from(heading.degrees())), sd: None, confidence: Some(confidence) }
    }

    /// Creates a direction by arrival times: an angle and its standard deviation in degrees, or the reason why there is
    /// none.
    pub fn by_arrival(angle: Result<[f32; 2], Reason>) -> Self {
        Self { degrees: angle.map(|[degrees, _]| degrees), sd: angle.ok().map(|[_, sd]| sd), confidence: None }
    }

    /// Returns the heading whose angle is exactly this one; `None` for any other angle.
    pub fn heading(&self) -> Option<Heading> {
        let degrees = self.degrees.ok()?;
        let is_at = |heading: &Heading| degrees.to_bits() == f32::from(heading.degrees()).to_bits();
        [Heading::Right, Heading::Up, Heading::Left, Heading::Down].into_iter().find(is_at)
    }

    /// Returns the confidence as a real number, 0..=1.
    pub fn confidence(&self) -> Option<f32> {
        self.confidence.map(|confidence| f32::from(confidence) / 32_768.0)
    }
}

const CENTROID_FRACTION_BITS: u32 = 20;

/// Slope of centroid against index, as a fraction. It is 0 if fewer than two lines light up.
#[derive(Clone, Copy)]
struct Slope {
    numerator: i64,
    denominator: i64,
    /// Every line of the axis lights up.
    all_lit: bool,
}

/// Returns the sliding direction of an event, one of four, from least-squares slopes of the rows' and the columns'
/// light centroids.
///
/// The error comes from these sources:
///
/// - A feature's own error (0.507 units of 2^-11) is a fraction r = 2.5e-4 of a frame's light L and of the baseline's
///   B.
/// - Both lights are e^x of a table. Each is off by 4 units of 2^-31 of the line's brightest light, and by 2^-27 of
///   itself. Together this is below 2e-8 of the brightest light.
/// - The rounding of the mean adds 2^-20 B.
///
/// Let d be the sum of these errors at frame t, about r (L + B), and a the light above the baseline. A centroid c is
/// off by at most Σ |t − c| d / (Σ a − Σ d), and by 2^-20 frames of its own rounding. A slope is off by a tenth of its
/// lines' errors, each times |index − 2|. A confidence is off by 2^-15 of its own rounding, and by at most
/// 2 (|s₁| Δs₂ + |s₂| Δs₁) / ((|s₁| + |s₂|) (|s₁| + |s₂| − Δs₁ − Δs₂)).
/// A line whose Σ a is below Σ d may count as lit or not.
pub fn direction(event: &Event<'_>) -> Direction {
    let means = event.baseline.means(EXP_FRACTION_BITS);
    let slope = |first: usize, count: usize| {
        let (_, lines) = means.split_at_checked(first).unwrap_or((&[], &[]));
        slope_of(
            (0..)
                .zip(lines.iter().take(count))
                .map(|(index, &mean)| (index, centroid(event, first + index as usize, mean))),
        )
    };
    let (rows, columns) = (slope(0, ROWS), slope(ROWS, COLUMNS));
    // Both slopes over a common denominator.
    let row = rows.numerator.unsigned_abs() * columns.denominator.unsigned_abs();
    let column = columns.numerator.unsigned_abs() * rows.denominator.unsigned_abs();
    let (difference, sum) = (row.abs_diff(column), row + column);
    let confidence = (difference << 15).checked_div(sum).unwrap_or(0) as u16;
    let heading = if !rows.all_lit && !columns.all_lit {
        Err(Reason::NeverLit)
    } else if sum == 0 || difference * LEAST_CONFIDENCE.1 < sum * LEAST_CONFIDENCE.0 {
        Err(Reason::NoOrder)
    } else if column > row {
        Ok(if columns.numerator > 0 { Heading::Right } else { Heading::Left })
    } else {
        Ok(if rows.numerator > 0 { Heading::Down } else { Heading::Up })
    };
    Direction::by_centroids(heading, confidence)
}

/// Returns when a row or column is lit, in frames from the sample's start: the centroid of its light above its baseline
/// `mean`. Returns `None` if it never lights up.
fn centroid(event: &Event<'_>, feature: usize, mean: i32) -> Option<i64> {
    // Light is a fraction of the line's brightest light. A centroid does not depend on that unit, and all bits are
    // used.
    let brightest = widened(event.sample.feature(feature).max()?);
    let base = exp_of_negative(u32::try_from(brightest - mean).ok()?);
    let (mut light, mut moment) = (0_u64, 0_u64);
    for (frame, value) in (0_u64..).zip(event.sample.feature(feature)) {
        let above = u64::from(exp_of_negative((brightest - widened(value)).max(0) as u32).saturating_sub(base));
        light += above;
        moment += frame * above;
    }
    // moment < 70²/2 · 2^31 < 2^43.
    (moment << CENTROID_FRACTION_BITS).checked_div(light).map(|centroid| centroid as i64)
}

/// Returns the least-squares slope over the lines that light up.
fn slope_of(lines: impl Iterator<Item = (i64, Option<i64>)>) -> Slope {
    let (mut n, mut x, mut xx, mut y, mut xy) = (0, 0, 0, 0, 0);
    let mut all_lit = true;
    for (index, centroid) in lines {
        let Some(centroid) = centroid else {
            all_lit = false;
            continue;
        };
        n += 1;
        x += index;
        xx += index * index;
        y += centroid;
        xy += index * centroid;
    }
    match n * xx - x * x {
        0 => Slope { numerator: 0, denominator: 1, all_lit },
        denominator => Slope { numerator: n * xy - x * y, denominator, all_lit },
    }
}
