//! Taxel sums without pixels: the distribution of a rendered taxel's sum, and numbers drawn from it.
//!
//! Each of A pixels is noisy, rounded and clamped on its own. So the sum is normal with A times the mean and A times
//! the variance of one pixel, both averaged over the spot. Tables hold these over the light.
//!
//! Compared with rendered frames (tested), the mean is within 0.02 of a level of 255 for each pixel, and the variance
//! within 15 %. Most of the latter is the rendered noise's own.

use std::sync::{Arc, Mutex, PoisonError};

use wstac_core::green::any::PixelFormat;
use wstac_core::params::TAXELS;

use super::pixel::{Pixel, checked_light};
use super::quantized::Values;
use crate::rng::Rng;

/// Points of a pixel's table for a change of its value by one standard deviation of the noise.
///
/// Linear interpolation of the mean is off by less than 5e-4 of a value, or of a step if a format has larger ones.
const PIXEL_POINTS: f64 = 8.0;
/// Points of a spot's table for a change of its value by one standard deviation of the noise.
///
/// The interpolation is off by less than 2e-3 of a value, and by less if the pixels of the spot differ.
const SPOT_POINTS: f64 = 4.0;
/// Largest number of intervals in a table; very little noise has wider intervals.
const MOST_INTERVALS: f64 = 32_768.0;
/// Bits of the mantissa by which pixels are classed, together with their light's power of two: 3 % of the light.
const CLASS_BITS: u32 = 5;
/// Bits of the mantissa if there is too little noise to hide that values are integers: 0.8 % of the light.
const QUIET_CLASS_BITS: u32 = 7;
/// Standard deviation of a dark pixel's noise, in values, that hides the integers.
const HIDING: f64 = 0.3;

/// Draws the sums of taxels.
#[derive(Clone, Debug)]
pub(super) struct TaxelSampler {
    /// Number of counted pixels in a taxel, A.
    pixels: f64,
    /// Highest sum, A · G.
    most: f64,
    pixel: Pixel,
    values: Values,
    /// The spot: the light of each class of pixels, and the fraction of pixels in the class.
    classes: Vec<(f64, f64)>,
    /// Tables of a pixel and of a spot, or `None` if there is no noise, and so no variance.
    curves: Option<Arc<Curves>>,
    rng: Rng,
}

/// Tables of mean and variance by the electrons that the brightest class of pixels collects.
#[derive(Clone, Debug)]
struct Curves {
    /// Values of one pixel.
    pixel: Curve,
    /// Values averaged over the spot.
    spot: Curve,
    /// Light of the brightest class.
    brightest: f64,
}

impl TaxelSampler {
    /// Creates a sampler of the sums of taxels whose counted pixels get these multiples of the taxel's light.
    pub(super) fn new(pixel: Pixel, format: PixelFormat, green: &[f64], rng: Rng) -> Self {
        let values = match format {
            PixelFormat::Rgb565 => Values::six_bits(),
            _ => Values::Every(pixel.full_scale as u32),
        };
        let hidden = pixel.scale * pixel.root(0.0) * pixel.noise >= HIDING;
        let classes = classes(green, if hidden { CLASS_BITS } else { QUIET_CLASS_BITS });
        let curves = (pixel.noise > 0.0).then(|| Curves::shared(&pixel, &values, &classes));
        let pixels = green.len() as f64;
        Self { pixels, most: pixels * pixel.full_scale, pixel, values, classes, curves, rng }
    }

    /// Returns the next frame's sums.
    pub(super) fn next(&mut self, light: &[f64; TAXELS]) -> [u32; TAXELS] {
        light.map(|light| {
            let [mean, variance] = self.moments(checked_light(light));
            let deviation =
                if self.curves.is_some() { (self.pixels * variance).sqrt() * self.rng.normal() } else { 0.0 };
            libm::round(self.pixels * mean + deviation).max(0.0).min(self.most) as u32
        })
    }

    /// Returns the mean and variance of a pixel, averaged over the spot.
    fn moments(&self, light: f64) -> [f64; 2] {
        let Some(curves) = &self.curves else {
            let values = |collected| self.values.moments(self.pixel.value(collected), 0.0);
            return over_spot(&self.pixel, &self.classes, light, values);
        };
        let brightest = self.pixel.root(light * curves.brightest);
        // Beyond the table only the spot's edge is not yet saturated.
        curves.spot.at(brightest).unwrap_or_else(|| {
            over_spot(&self.pixel, &self.classes, light, |collected| curves.of_pixel(&self.pixel, collected))
        })
    }
}

impl Pixel {
    /// Returns the electrons of a pixel that gets this light.
    fn collected(&self, light: f64) -> f64 {
        self.dark + light * self.full_well
    }

    /// Returns the standard deviation of such a pixel in electrons, for noise of scale 1.
    ///
    /// A pixel's value grows with the square of this deviation. So equal steps of it are equal fractions of the noise's
    /// deviation everywhere.
    fn root(&self, light: f64) -> f64 {
        (self.collected(light) + self.read).sqrt()
    }
}

/// Curves and the values from which they follow.
struct KnownCurves {
    pixel: Pixel,
    values: Values,
    classes: Vec<(f64, f64)>,
    curves: Arc<Curves>,
}

impl Curves {
    /// Returns the curves that were requested last, if they are these, or computes them.
    ///
    /// They take a third of the time of a slide, and many slides have the same camera.
    fn shared(pixel: &Pixel, values: &Values, classes: &[(f64, f64)]) -> Arc<Self> {
        static LAST: Mutex<Option<KnownCurves>> = Mutex::new(None);
        let last = || LAST.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |known: &&KnownCurves| known.pixel == *pixel && known.values == *values && known.classes == classes;
        if let Some(known) = last().as_ref().filter(same) {
            return Arc::clone(&known.curves);
        }
        let curves = Arc::new(Self::new(pixel, values, classes));
        let (values, classes) = (values.clone(), classes.to_vec());
        *last() = Some(KnownCurves { pixel: *pixel, values, classes, curves: Arc::clone(&curves) });
        curves
    }

    fn new(pixel: &Pixel, values: &Values, classes: &[(f64, f64)]) -> Self {
        let brightest = classes.iter().map(|&(light, _)| light).fold(0.0, f64::max);
        let dark = pixel.root(0.0);
        // The root at which even an unlucky pixel is saturated: root² − 7 noise · root = read noise² + the electrons of
        // full scale.
        let saturating = pixel.read + (pixel.full_scale - pixel.black).max(0.0) / pixel.scale;
        let unlucky = 7.0 * pixel.noise;
        let saturated = f64::midpoint(unlucky, (unlucky * unlucky + 4.0 * saturating).sqrt());
        // A value grows with half the square of the root.
        let step = |points| pixel.noise / points / 2.0;
        let of_pixel = Curve::new(dark, saturated.max(dark), step(PIXEL_POINTS), |root| {
            values.moments(pixel.value(root * root - pixel.read), pixel.scale * root * pixel.noise)
        });
        let mut curves = Self { pixel: of_pixel, spot: Curve::default(), brightest };
        // The end is at twice the light that saturates the spot's middle; rarer values need not be fast.
        let end = (1.5 * saturated).max(dark);
        curves.spot = Curve::new(dark, end, step(SPOT_POINTS), |root| {
            let light = (root * root - pixel.read - pixel.dark) / (pixel.full_well * brightest);
            over_spot(pixel, classes, light, |collected| curves.of_pixel(pixel, collected))
        });
        curves
    }

    /// Returns the mean and variance of a pixel that collects this many electrons.
    fn of_pixel(&self, pixel: &Pixel, collected: f64) -> [f64; 2] {
        self.pixel.at((collected + pixel.read).max(0.0).sqrt()).unwrap_or([pixel.full_scale, 0.0])
    }
}

/// Averages a property of pixels over the spot.
fn over_spot(pixel: &Pixel, classes: &[(f64, f64)], light: f64, of: impl Fn(f64) -> [f64; 2]) -> [f64; 2] {
    classes.iter().fold([0.0; 2], |[mean, variance], &(spot, share)| {
        let [m, v] = of(pixel.collected(light * spot));
        [mean + share * m, variance + share * v]
    })
}

/// Groups pixels by their light: each class has the mean light of its pixels and their fraction.
fn classes(green: &[f64], bits: u32) -> Vec<(f64, f64)> {
    let mut sorted: Vec<u64> = green.iter().map(|light| light.to_bits()).collect();
    // Floating-point numbers that are not negative sort in the order of their bits.
    sorted.sort_unstable();
    let shift = f64::MANTISSA_DIGITS - 1 - bits;
    let classes = sorted.chunk_by(|a, b| a >> shift == b >> shift).map(|class| {
        let sum: f64 = class.iter().map(|&bits| f64::from_bits(bits)).sum();
        (sum / class.len() as f64, class.len() as f64 / green.len() as f64)
    });
    classes.collect()
}

/// A table of two numbers at equal distances.
#[derive(Clone, Debug, Default)]
struct Curve {
    start: f64,
    per_step: f64,
    points: Vec<[f64; 2]>,
}

impl Curve {
    /// Creates the table of `of` from `start` to `end`, at distances of about `step`.
    fn new(start: f64, end: f64, step: f64, of: impl Fn(f64) -> [f64; 2]) -> Self {
        let intervals = libm::ceil((end - start) / step).clamp(1.0, MOST_INTERVALS);
        let width = (end - start) / intervals;
        let points = (0..=intervals as usize).map(|index| of(start + width * index as f64)).collect();
        Self { start, per_step: if width > 0.0 { 1.0 / width } else { 0.0 }, points }
    }

    /// Returns the linearly interpolated value, or `None` beyond the end.
    fn at(&self, x: f64) -> Option<[f64; 2]> {
        let position = (x - self.start) * self.per_step;
        let index = position as usize;
        let &[low, high] = self.points.get(index..index + 2)?.as_array()?;
        let share = position - index as f64;
        Some([0, 1].map(|k| low[k] + (high[k] - low[k]) * share))
    }
}
