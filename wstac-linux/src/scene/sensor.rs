//! The camera: taxel brightness → noisy, quantised grey pixels. Only taxels are ever written.

use wstac_core::error::Error;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;

use super::rng::Rng;

/// Grey levels of a dark pixel: below the speed law's threshold, as the paper's camera must be.
const BLACK_LEVELS: f32 = 1.0;
/// Deviation of a pixel's read noise, in grey levels (a guess).
const READ_NOISE: f32 = 0.6;
/// Variance of shot noise per grey level of light, in grey levels: 100 electrons a level (a guess).
const SHOT_NOISE: f32 = 0.01;
/// Green full scale.
const FULL_SCALE: f32 = 255.0;
/// Radius of a whisker's spot as a share of its taxel's side, and of its edge's softness (guesses).
const SPOT_RADIUS: f32 = 0.44;
const SPOT_SOFTNESS: f32 = 0.12;
/// Noise is drawn from a table of this many numbers, at a random place for every row of a taxel. Longer than the
/// widest taxel, 2048 pixels.
const NOISE_NUMBERS: usize = 1 << 14;

/// A grey 8-bit camera that looks at 25 spots.
#[derive(Clone, Debug)]
pub struct Sensor {
    layout: Layout,
    /// The frame; outside of taxels it stays black.
    pixels: Vec<u8>,
    /// Light of a taxel's pixels, row by row, for a taxel brightness of 1: in grey levels.
    spot: Vec<f32>,
    /// Numbers of mean 0 and deviation 1.
    noise: Vec<f32>,
    rng: Rng,
}

impl Sensor {
    /// A camera with frames of this size, the paper's layout and this noise.
    ///
    /// # Errors
    /// [`Error::EmptyTaxel`] where the frame is too small for the layout.
    pub fn new(size: FrameSize, mut rng: Rng) -> Result<Self, Error> {
        let layout = Layout::paper(size)?;
        let pixels = usize::from(size.width()) * usize::from(size.height());
        Ok(Self {
            layout,
            pixels: vec![BLACK_LEVELS as u8; pixels],
            spot: spot(layout.taxel()),
            noise: (0..NOISE_NUMBERS).map(|_| rng.normal() as f32).collect(),
            rng,
        })
    }

    /// The frame as it was exposed last: rows without padding.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Takes a frame in which the taxels' mean light is `brightness`, as a share of full scale.
    pub fn expose(&mut self, brightness: &[f64; TAXELS]) {
        let [width, _] = self.layout.taxel().map(usize::from);
        let frame_width = usize::from(self.layout.frame().width());
        for (&[left, top], &brightness) in self.layout.corners().iter().zip(brightness) {
            let brightness = brightness as f32;
            let at = usize::from(top) * frame_width + usize::from(left);
            let rows = self.pixels.get_mut(at..).unwrap_or_default().chunks_mut(frame_width);
            for (row, spot) in rows.zip(self.spot.chunks_exact(width)) {
                let noise = self.rng.below(NOISE_NUMBERS - width);
                let noise = self.noise.get(noise..).unwrap_or_default();
                for ((pixel, &spot), &noise) in row.iter_mut().zip(spot).zip(noise) {
                    let light = brightness * spot;
                    // The one square root of std that is used here: IEEE 754 defines its every bit.
                    let deviation = (READ_NOISE * READ_NOISE + SHOT_NOISE * light).sqrt();
                    // Nearest integer, halves up; the cast saturates at 0 and 255.
                    *pixel = (BLACK_LEVELS + light + deviation * noise + 0.5) as u8;
                }
            }
        }
    }
}

/// A soft disc with a mean of full scale.
fn spot([width, height]: [u16; 2]) -> Vec<f32> {
    let side = f32::from(width.min(height));
    let (x0, y0) = (f32::from(width - 1) / 2.0, f32::from(height - 1) / 2.0);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (f32::from(x), f32::from(y))));
    let mut spot: Vec<f32> = pixels
        .map(|(x, y)| {
            let distance = ((x - x0) * (x - x0) + (y - y0) * (y - y0)).sqrt() / side;
            ((SPOT_RADIUS - distance) / SPOT_SOFTNESS + 0.5).clamp(0.0, 1.0)
        })
        .collect();
    // At least one pixel is lit: the middle of a taxel is nearer than the radius.
    let mean = spot.iter().sum::<f32>() / spot.len() as f32;
    for light in &mut spot {
        *light *= FULL_SCALE / mean;
    }
    spot
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(sensor: &Sensor, taxel: usize) -> f64 {
        let [left, top] = sensor.layout.corners()[taxel].map(usize::from);
        let [width, height] = sensor.layout.taxel().map(usize::from);
        let rows = sensor.pixels().chunks(usize::from(sensor.layout.frame().width()));
        let pixels = rows.skip(top).take(height).flat_map(|row| &row[left..left + width]);
        pixels.map(|&pixel| f64::from(pixel)).sum::<f64>() / (width * height) as f64
    }

    #[test]
    fn a_taxel_is_as_bright_as_it_is_told_to_be() {
        let mut sensor = Sensor::new(FrameSize::new(1280, 720).unwrap(), Rng::new(0, 0)).unwrap();
        let mut brightness = [0.0; TAXELS];
        brightness[7] = 0.25;
        sensor.expose(&brightness);
        assert!((mean(&sensor, 7) / 255.0 - 0.254).abs() < 0.001, "{}", mean(&sensor, 7));
        assert!((mean(&sensor, 8) - 1.0).abs() < 0.05, "{}", mean(&sensor, 8));
        brightness[7] = 1e9;
        sensor.expose(&brightness);
        assert!(mean(&sensor, 7) > 100.0);
    }

    #[test]
    fn every_frame_size_is_a_sensor_or_an_error() {
        for (width, height) in [(1, 1), (3, 3), (4, 4), (5, 16_384), (37, 29), (1000, 7)] {
            let sensor = Sensor::new(FrameSize::new(width, height).unwrap(), Rng::new(0, 0));
            assert_eq!(sensor.is_ok(), width.min(height) >= 4);
            if let Ok(mut sensor) = sensor {
                sensor.expose(&[1.0; TAXELS]);
                assert!(sensor.spot.iter().all(|light| light.is_finite()));
            }
        }
    }
}
