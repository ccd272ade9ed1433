//! A whisker's spot of light: the distribution of the light within its taxel.

use libm::{ceil, exp};

use super::encode::{Mosaic, Site};

/// Radius of a whisker's spot as a fraction of its taxel's shorter side (a guess).
const RADIUS: f64 = 0.44;
/// Width of the spot's soft edge as a fraction of the taxel's shorter side (a guess).
const SOFTNESS: f64 = 0.12;
/// Half width of the point spread's kernel in standard deviations: 6e-5 of the light is further away.
const KERNEL_DEVIATIONS: f64 = 4.0;
/// Side of the taxel over which a spot's mean is taken if there is no taxel with its own pixels.
const FINE: usize = 200;

/// Returns the light at a distance from a base as a fraction of that in the middle.
///
/// The distance is in shorter sides of a taxel.
pub(super) fn profile(distance: f64) -> f64 {
    ((RADIUS - distance) / SOFTNESS + 0.5).clamp(0.0, 1.0)
}

/// Returns the light of a spot's middle, as a multiple of its taxel's mean light.
pub(super) fn brightest() -> f64 {
    disc(FINE, FINE).into_iter().fold(0.0, f64::max)
}

/// The distribution of a taxel's light, as multiples of the taxel's mean light.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    /// Light of every pixel, row by row; for a mosaic's sites, of the color that they see.
    pub(super) light: Vec<f64>,
    /// Light of the pixels that are counted as green, in no order.
    pub(super) green: Vec<f64>,
}

impl Spot {
    /// Creates the spot of a taxel of this size, which starts at a mosaic's first site.
    pub(super) fn new(size: [usize; 2], blur: f64, mosaic: Option<Mosaic>) -> Self {
        let light = spot(size, blur);
        let Some(mosaic) = mosaic else { return Self { green: light.clone(), light } };
        let (mut seen, mut green) = (Vec::with_capacity(light.len()), Vec::with_capacity(light.len() / 2));
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        for ((x, y), light) in places.zip(light) {
            let site = mosaic.site(x, y);
            seen.push(site.share() * light);
            green.extend((site == Site::Green).then_some(light));
        }
        Self { light: seen, green }
    }
}

/// Returns the light of a taxel's pixels, row by row: a soft disc, blurred by a Gaussian of `blur` pixels.
///
/// The mean is 1 without blur. Blurred light that leaves the taxel is lost: neither the pixels between the taxels nor
/// the neighbors receive it.
fn spot([width, height]: [usize; 2], blur: f64) -> Vec<f64> {
    let disc = disc(width, height);
    if blur > 0.0 { blurred(&disc, width, blur) } else { disc }
}

fn disc(width: usize, height: usize) -> Vec<f64> {
    let side = width.min(height) as f64;
    let (x0, y0) = ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x as f64 - x0, y as f64 - y0)));
    let mut disc: Vec<f64> = pixels.map(|(x, y)| profile((x * x + y * y).sqrt() / side)).collect();
    // At least one pixel is lit: the middle of a taxel is nearer than the radius, or half a pixel away.
    let mean = disc.iter().sum::<f64>() / disc.len() as f64;
    for light in &mut disc {
        *light /= mean;
    }
    disc
}

/// Convolves rows, then columns, with the kernel; there is no light beyond the taxel.
pub(super) fn blurred(light: &[f64], width: usize, deviation: f64) -> Vec<f64> {
    let height = light.len() / width.max(1);
    let half = ceil(KERNEL_DEVIATIONS * deviation) as usize;
    let weight = |distance: usize| exp(-0.5 * (distance * distance) as f64 / (deviation * deviation));
    let total = weight(0) + 2.0 * (1..=half).map(weight).sum::<f64>();
    let kernel: Vec<f64> = (0..=half).map(|distance| weight(distance) / total).collect();
    let across = convolved(light, width, height, &kernel);
    convolved(&across, height, width, &kernel)
}

/// Convolves the rows of a picture with one half of a kernel, and returns them as the columns of a picture.
fn convolved(light: &[f64], width: usize, height: usize, kernel: &[f64]) -> Vec<f64> {
    let half = kernel.len().saturating_sub(1);
    let mut columns = vec![0.0; light.len()];
    for (y, row) in light.chunks_exact(width.max(1)).enumerate() {
        for x in 0..width {
            let from = x.saturating_sub(half);
            let near = row.iter().enumerate().take((x + half + 1).min(width)).skip(from);
            let sum = near.map(|(at, light)| light * kernel.get(at.abs_diff(x)).unwrap_or(&0.0)).sum();
            if let Some(pixel) = columns.get_mut(x * height + y) {
                *pixel = sum;
            }
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(light: &[f64]) -> f64 {
        light.iter().sum::<f64>() / light.len() as f64
    }

    #[test]
    fn the_mean_is_one_whatever_the_size() {
        for size in [[1, 1], [2, 2], [2, 5], [5, 2], [13, 40], [90, 90]] {
            let spot = spot(size, 0.0);
            assert_eq!(spot.len(), size[0] * size[1]);
            assert!((mean(&spot) - 1.0).abs() < 1e-12, "{size:?}");
        }
    }

    #[test]
    fn blur_widens_the_spot_and_loses_light_only_at_the_rim() {
        let sharp = spot([90, 90], 0.0);
        let mut last = 1.0 + 1e-12;
        for blur in [0.3, 2.0, 5.0, 20.0, 100.0] {
            let blurred = spot([90, 90], blur);
            let left = mean(&blurred);
            assert!(left < last && left > 0.0, "{blur}: {left}");
            assert!(blur > 2.0 || left > 0.99, "{blur}: {left}");
            assert!(blurred[44 * 90 + 44] <= sharp[44 * 90 + 44]);
            // The result is as symmetrical as the disc.
            for (a, b) in [(0, 89), (5 * 90 + 30, 30 * 90 + 5), (44 * 90 + 3, 45 * 90 + 86)] {
                assert!((blurred[a] - blurred[b]).abs() < 1e-12);
            }
            last = left;
        }
    }

    #[test]
    fn the_variance_of_a_spot_grows_by_that_of_the_point_spread() {
        // The rim is far enough away: a spot in the middle of a large dark area.
        let mut light = vec![0.0; 101 * 101];
        light[50 * 101 + 50] = 1.0;
        let wide = blurred(&light, 101, 3.0);
        let variance: f64 = wide.iter().enumerate().map(|(k, l)| l * ((k % 101) as f64 - 50.0).powi(2)).sum();
        assert!((wide.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((variance - 9.0).abs() < 0.02, "{variance}");
    }
}
