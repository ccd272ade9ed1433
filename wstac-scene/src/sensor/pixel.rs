//! One pixel: light becomes electrons, then a value, with shot noise and read noise.
//!
//! A pixel collects n = (light · spot + leak) · full well electrons. Its value is black + gain · G / full well · (n +
//! √(n + read noise²) · noise · z), with a normal number z, rounded to nearest and clamped to 0..=G.

use super::config::SensorConfig;

/// Largest light that every table and single-precision number can hold, in full scales: far beyond saturation.
pub(super) const MOST_LIGHT: f64 = 1e6;

/// A sensor's pixel, in electrons and in values of its format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pixel {
    /// Full scale G.
    pub(super) full_scale: f64,
    /// Value without an electron.
    pub(super) black: f64,
    /// Values for each electron.
    pub(super) scale: f64,
    /// Electrons at full scale at a gain of 1.
    pub(super) full_well: f64,
    /// Electrons without a whisker's light.
    pub(super) dark: f64,
    /// Variance of the read noise in electrons.
    pub(super) read: f64,
    /// Scale of all random deviations.
    pub(super) noise: f64,
}

impl Pixel {
    /// Creates the pixel of a sensor with this full scale.
    ///
    /// `leak` is ambient light as a fraction of full scale at a gain of 1.
    pub(super) fn new(config: &SensorConfig, full_scale: u32, leak: f64) -> Self {
        let full_scale = f64::from(full_scale);
        Self {
            full_scale,
            black: config.black_level / 255.0 * full_scale,
            scale: config.gain * full_scale / config.full_well,
            full_well: config.full_well,
            dark: checked_light(leak) * config.full_well,
            read: config.read_noise * config.read_noise,
            noise: config.noise,
        }
    }

    /// Returns the value of a pixel of `electrons`, without noise and before rounding.
    pub(super) fn value(&self, electrons: f64) -> f64 {
        self.black + self.scale * electrons
    }

    /// Returns the value of a pixel without a whisker's light and without noise.
    pub(super) fn outside(&self) -> u16 {
        self.rendering().quantized(self.value(self.dark) as f32)
    }

    /// Returns the same pixel for whole rows, in single precision.
    pub(super) fn rendering(&self) -> Rendering {
        let per_electron = self.scale * self.scale;
        Rendering {
            full_scale: self.full_scale as f32,
            base: self.value(self.dark) as f32,
            variance: (per_electron * (self.dark + self.read)) as f32,
            shot: self.scale as f32,
        }
    }
}

/// Returns light that can be rendered: not NaN, not negative, not infinite.
pub(super) fn checked_light(light: f64) -> f64 {
    // A clamp alone would keep NaN.
    light.max(0.0).clamp(0.0, MOST_LIGHT)
}

/// The factors with which rows are rendered, all in values of the format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rendering {
    full_scale: f32,
    /// Value without a whisker's light.
    base: f32,
    /// Variance of the noise without a whisker's light.
    variance: f32,
    /// Growth of the variance for each value of light.
    shot: f32,
}

/// Constant that rounds: added to 0..=65535, it leaves the nearest integer in the low bits of a single-precision
/// number.
const ROUNDER: f32 = 8_388_608.0;

impl Rendering {
    /// Renders a row of values without noise.
    ///
    /// `light` is a taxel's light; `spot` holds the values that each pixel gets for a light of 1.
    pub(super) fn quiet(&self, light: f32, spot: &[f32], values: &mut [u16]) {
        for (value, &spot) in values.iter_mut().zip(spot) {
            *value = self.quantized(self.base + light * spot);
        }
    }

    /// Renders a row of values with noise: normal numbers times the scale of all deviations.
    pub(super) fn noisy(&self, light: f32, spot: &[f32], noise: &[f32], values: &mut [u16]) {
        for ((value, &spot), &noise) in values.iter_mut().zip(spot).zip(noise) {
            let light = light * spot;
            // This is the only square root of std in use here: IEEE 754 defines its every bit.
            let deviation = (self.variance + self.shot * light).sqrt();
            *value = self.quantized(self.base + light + deviation * noise);
        }
    }

    /// Returns the nearest of 0..=G. This form compiles to a few instructions for several pixels at once.
    #[inline(always)]
    fn quantized(&self, value: f32) -> u16 {
        let value = if value > 0.0 { value } else { 0.0 };
        let value = if value < self.full_scale { value } else { self.full_scale };
        (value + ROUNDER).to_bits() as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_to_nearest_and_clamped() {
        for full_scale in [255_u16, 1023, 4095, 65_535] {
            let rendering = Pixel::new(&SensorConfig::default(), full_scale.into(), 0.0).rendering();
            for value in 0..=full_scale {
                for off in [-0.49, 0.0, 0.49] {
                    assert_eq!(rendering.quantized(f32::from(value) + off), value);
                }
            }
            for (value, expected) in [
                (f32::NAN, 0),
                (f32::NEG_INFINITY, 0),
                (-0.6, 0),
                (1e30, full_scale),
                (f32::INFINITY, full_scale),
                (f32::from(full_scale) + 0.6, full_scale),
            ] {
                assert_eq!(rendering.quantized(value), expected, "{value}");
            }
        }
    }

    #[test]
    fn noise_is_that_of_electrons() {
        // 100 electrons for each value, a read noise variance of 3600, and light of a quarter of full scale.
        let rendering = Pixel::new(&SensorConfig::default(), 255, 0.0).rendering();
        let mut values = [0; 2];
        rendering.noisy(0.25, &[255.0; 2], &[0.0, 10.0], &mut values);
        let deviation = (0.25 * 25_500.0_f64 + 3600.0).sqrt() / 100.0;
        assert_eq!(values, [65, (64.75 + 10.0 * deviation).round() as u16]);
    }

    #[test]
    fn black_level_gain_and_leak_shift_what_is_dark() {
        let config = SensorConfig { black_level: 2.0, gain: 4.0, ..SensorConfig::default() };
        assert_eq!(Pixel::new(&config, 255, 0.0).outside(), 2);
        assert_eq!(Pixel::new(&config, 255, 0.01).outside(), 12);
        assert_eq!(Pixel::new(&config, 4095, 0.01).outside(), (2.0_f64 / 255.0 * 4095.0 + 163.8).round() as u16);
        for leak in [f64::NAN, -1.0] {
            assert_eq!(Pixel::new(&config, 255, leak).outside(), 2);
        }
        assert_eq!(Pixel::new(&config, 255, f64::INFINITY).outside(), 255);
    }
}
