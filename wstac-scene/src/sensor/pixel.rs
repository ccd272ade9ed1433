//! One pixel: light → electrons → a value, with shot noise and read noise.
//!
//! A pixel collects n = (light · spot + leak) · full well electrons. Its value is black + gain · G / full well ·
//! (n + √(n + read noise²) · noise · z), z a normal number, rounded to nearest and clamped to 0..=G.

use super::config::SensorConfig;

/// Light that no table and no single precision number has trouble with, in full scales: far beyond saturation.
pub(super) const MOST_LIGHT: f64 = 1e6;

/// A sensor's pixel, in electrons and in values of its format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pixel {
    /// Full scale G.
    pub(super) full_scale: f64,
    /// Value without an electron.
    pub(super) black: f64,
    /// Values an electron.
    pub(super) scale: f64,
    /// Electrons at full scale at a gain of 1.
    pub(super) full_well: f64,
    /// Electrons without a whisker's light.
    pub(super) dark: f64,
    /// Variance of the read noise in electrons.
    pub(super) read: f64,
    /// Scale of all deviations.
    pub(super) noise: f64,
}

impl Pixel {
    /// The pixel of a sensor with this full scale, ambient light `leak` as a share of full scale at a gain of 1.
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

    /// Value of a pixel of `electrons`, before it is rounded and without noise.
    pub(super) fn value(&self, electrons: f64) -> f64 {
        self.black + self.scale * electrons
    }

    /// Value of a pixel without a whisker's light, without noise.
    pub(super) fn outside(&self) -> u16 {
        self.rendering().quantised(self.value(self.dark) as f32)
    }

    /// The same for whole rows, in single precision.
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

/// Light that can be rendered: no NaN, nothing negative, nothing endless.
pub(super) fn checked_light(light: f64) -> f64 {
    // Not the same as a clamp alone, which keeps what is no number.
    light.max(0.0).clamp(0.0, MOST_LIGHT)
}

/// What rows are rendered with: everything in values of the format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rendering {
    full_scale: f32,
    /// Value without a whisker's light.
    base: f32,
    /// Variance of the noise there.
    variance: f32,
    /// More variance for each value of light.
    shot: f32,
}

/// Added to 0..=65535, leaves that number, rounded to nearest, in the low bits of a single precision number.
const ROUNDER: f32 = 8_388_608.0;

impl Rendering {
    /// A row of values without noise. `light` is a taxel's, `spot` says how many values of light a pixel gets for a
    /// light of 1.
    pub(super) fn quiet(&self, light: f32, spot: &[f32], values: &mut [u16]) {
        for (value, &spot) in values.iter_mut().zip(spot) {
            *value = self.quantised(self.base + light * spot);
        }
    }

    /// A row of values with noise: normal numbers times the scale of all deviations.
    pub(super) fn noisy(&self, light: f32, spot: &[f32], noise: &[f32], values: &mut [u16]) {
        for ((value, &spot), &noise) in values.iter_mut().zip(spot).zip(noise) {
            let light = light * spot;
            // The one square root of std that is used here: IEEE 754 defines its every bit.
            let deviation = (self.variance + self.shot * light).sqrt();
            *value = self.quantised(self.base + light + deviation * noise);
        }
    }

    /// The nearest of 0..=G. Written so that it compiles to a few instructions for several pixels at once.
    #[inline(always)]
    fn quantised(&self, value: f32) -> u16 {
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
                    assert_eq!(rendering.quantised(f32::from(value) + off), value);
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
                assert_eq!(rendering.quantised(value), expected, "{value}");
            }
        }
    }

    #[test]
    fn noise_is_that_of_electrons() {
        // 100 electrons a value, 3600 of read noise's variance, a quarter of full scale of light.
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
