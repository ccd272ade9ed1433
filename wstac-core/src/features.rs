//! Turns 25 taxel sums into ten features (SPEC §2, equation 1 of the paper).

use crate::error::ConfigError;
use crate::green::GreenChannel;
use crate::ln::constant;
use crate::ln::{LN_FRACTION_BITS, Ln, fixed::Fixed};
use crate::params::{COLUMNS, FEATURE_FRACTION_BITS, FEATURE_ONE, FEATURES, ROWS, TAXELS};
use crate::taxels::FrameGeometry;

/// The ten features of a frame, in units of 2^-11.
///
/// They are ln of the five row sums, then of the five column sums, relative to full scale. The range is −16 · 2048
/// (saturated) ..= ln 5 · 2048.
pub type Features = [i16; FEATURES];

/// Fraction bits of a logarithm beyond those of a feature.
const SHIFT: u32 = LN_FRACTION_BITS - FEATURE_FRACTION_BITS;

/// ln 5, in units of 2^-11.
const LN_5: i16 = constant::nearest(constant::ln(5.0) * FEATURE_ONE as f64) as i16;

/// Returns the row sums, then the column sums, of the taxel sums. They saturate, which five sums of at most G · A never
/// do.
#[inline(always)]
pub fn line_sums(taxels: &[u32; TAXELS]) -> [u32; FEATURES] {
    let mut lines = [0; FEATURES];
    let (rows, columns) = lines.split_at_mut(ROWS);
    let (grid, _) = taxels.as_chunks::<COLUMNS>();
    for (row, taxels) in rows.iter_mut().zip(grid) {
        *row = taxels.iter().fold(0, |sum: u32, taxel| sum.saturating_add(*taxel));
        for (column, taxel) in columns.iter_mut().zip(taxels) {
            *column = column.saturating_add(*taxel);
        }
    }
    lines
}

/// The darkness floor (SPEC §2), computed once. In a `const`, a board needs no 64-bit floating point for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Floor {
    full_scale: u32,
    /// In units of 2^-11; `None` for one raw count.
    feature: Option<i16>,
}

impl Floor {
    /// Creates a floor at ln(5 · `levels` / `full_scale`) for pixels whose green full scale is `full_scale`. With
    /// `levels` = 0 the floor is one raw count.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorLevels`] if `levels` is not 0..=`full_scale`.
    pub const fn new(levels: f64, full_scale: u32) -> Result<Self, ConfigError> {
        if !(levels >= 0.0 && levels <= full_scale as f64) {
            return Err(ConfigError::FloorLevels(levels));
        }
        let feature = if levels == 0.0 {
            None
        } else {
            let floor = constant::nearest(constant::ln(5.0 * levels / full_scale as f64) * FEATURE_ONE as f64);
            Some(if floor < i16::MIN as i64 { i16::MIN } else { floor as i16 })
        };
        Ok(Self { full_scale, feature })
    }
}

/// Turns line sums into features with a log kernel `L`, the full scale and the darkness floor.
#[derive(Clone, Copy, Debug)]
pub struct FeatureScale<L = Fixed> {
    /// ln(G · A · frames) by the same kernel, so that full scale is exactly 0.
    reference: i32,
    floor: i16,
    kernel: L,
}

impl<L: Ln> FeatureScale<L> {
    /// Creates the scale with the default value of the log kernel.
    ///
    /// A taxel has `pixels` pixels of green full scale `full_scale`; `frames` camera frames are added up.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorFullScale`] if the floor is for another full scale. Returns
    /// [`ConfigError::SumTooLarge`] if 5 · `pixels` · `full_scale` · `frames` exceeds 32 bits.
    pub fn new(pixels: u32, full_scale: u32, frames: u32, floor: Floor) -> Result<Self, ConfigError> {
        Self::with_ln(pixels, full_scale, frames, floor, L::default())
    }

    /// Creates the scale of a camera's taxels, with a floor of `floor_levels` gray levels of a taxel.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorLevels`] if the floor is not 0 to the green full scale.
    pub fn of<G: GreenChannel>(camera: &FrameGeometry<G>, floor_levels: f64) -> Result<Self, ConfigError> {
        let (pixels, full_scale) = (camera.pixels(), camera.full_scale());
        Self::new(pixels, full_scale, camera.rate().frames_added(), Floor::new(floor_levels, full_scale)?)
    }

    /// Creates the scale with a log kernel that was chosen at run time.
    ///
    /// A taxel has `pixels` pixels of green full scale `full_scale`; `frames` camera frames are added up.
    ///
    /// # Errors
    /// Returns the errors of [`FeatureScale::new`].
    pub fn with_ln(pixels: u32, full_scale: u32, frames: u32, floor: Floor, kernel: L) -> Result<Self, ConfigError> {
        let fits = pixels.checked_mul(full_scale).and_then(|most| most.checked_mul(frames));
        let Some(most) = fits.filter(|most| most.checked_mul(5).is_some()) else {
            return Err(ConfigError::SumTooLarge { pixels, full_scale, frames });
        };
        let mut scale = Self { reference: kernel.ln(most), floor: i16::MIN, kernel };
        scale.set_floor(floor, full_scale)?;
        Ok(scale)
    }

    pub(crate) fn set_floor(&mut self, floor: Floor, full_scale: u32) -> Result<(), ConfigError> {
        if floor.full_scale != full_scale {
            return Err(ConfigError::FloorFullScale { found: floor.full_scale, expected: full_scale });
        }
        self.floor = i16::MIN;
        self.floor = floor.feature.unwrap_or_else(|| self.feature(1));
        Ok(())
    }

    /// Returns the least possible feature.
    pub fn floor(&self) -> i16 {
        self.floor
    }

    /// Returns ln `sum` − ln(full scale), rounded to the nearest 2^-11, and at least the floor.
    ///
    /// The error has two parts: half a unit of rounding, and the kernel's own error e in each of two logarithms.
    /// Together they are 1/2 + 2 · 2048 · e units of 2^-11 above −16, below which a feature saturates. That is 0.507
    /// units with [`Fixed<256>`](Fixed), 1.033 with `Fixed<32>`, 0.50004 with `libm`, and 0.7622 with `micromath`. The
    /// floor adds nothing to it, because clamping two values never moves them further apart.
    #[inline(always)]
    pub fn feature(&self, sum: u32) -> i16 {
        self.above(self.floor, sum)
    }

    /// Returns ln `sum` − ln(full scale) of one taxel's sum, rounded as a feature is. The floor is that of a line of
    /// five such taxels, less ln 5.
    pub fn taxel(&self, sum: u32) -> i16 {
        self.above(self.floor.saturating_sub(LN_5), sum)
    }

    #[inline(always)]
    fn above(&self, floor: i16, sum: u32) -> i16 {
        if sum == 0 {
            return floor;
        }
        // At most ln 5 · 2048 = 3296 for a sum of five taxels. Larger sums saturate.
        let feature = (self.kernel.ln(sum) - self.reference + (1 << (SHIFT - 1))) >> SHIFT;
        feature.clamp(i32::from(floor), i32::from(i16::MAX)) as i16
    }

    /// Returns the features of ten line sums.
    #[inline(always)]
    pub fn features(&self, lines: &[u32; FEATURES]) -> Features {
        lines.map(|sum| self.feature(sum))
    }
}
