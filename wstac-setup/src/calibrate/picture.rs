//! A picture of a calibration for a person: the light, with the taxels or the candidates for whiskers over it.

use wstac_core::params::{COLUMNS, TAXELS};

use super::watch::Seen;
use super::{Calibration, Outcome, Refusal, Watch};
use crate::canvas::{Canvas, Color};
use wstac_host::picture::Picture;

/// Smallest length of a picture's shorter side, so that numbers can be read: smaller frames are enlarged.
const READABLE: usize = 720;
/// Fraction of the cells that are dimmer than the light shown as brightest.
const BRIGHTEST: f32 = 0.985;

const TAXEL: Color = [255, 255, 255];
const DEAD: Color = [255, 150, 40];
const BASE: Color = [255, 70, 90];
const LINK: Color = [90, 110, 140];
const ON_LATTICE: Color = [255, 255, 255];
const STRAY: Color = [255, 150, 40];

/// Most columns of a picture of the light so far.
const MOST_COLUMNS: usize = 320;

impl Seen {
    /// Returns the light of each cell above its noise: 0 for none, 1 for the brightest.
    fn glow(&self) -> Vec<f32> {
        let light = &self.light.values;
        let mut sorted = light.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        let brightest = sorted.get((sorted.len() as f32 * BRIGHTEST) as usize).copied().unwrap_or(0.0).max(1e-6);
        let most = brightest.max(4.0 * self.noise as f32);
        let hidden = 2.5 * self.noise as f32;
        light.iter().map(|light| ((light - hidden) / (most - hidden)).clamp(0.0, 1.0)).collect()
    }
}

impl Watch {
    /// Returns the light so far, above the untouched picture: 0 for none, 1 for the brightest.
    ///
    /// The picture shows the whole frame, and has at most about 320 columns.
    pub fn glow(&self) -> Picture {
        let seen = self.seen();
        let (glow, [columns, rows]) = (seen.glow(), seen.light.size);
        let step = columns.div_ceil(MOST_COLUMNS).max(1);
        let size = [columns / step, rows / step];
        let at = |k: usize| {
            let (x, y) = (k % size[0] * step, k / size[0] * step);
            let cells = (y..y + step).flat_map(|y| (x..x + step).map(move |x| y * columns + x));
            let sum: f32 = cells.filter_map(|cell| glow.get(cell)).sum();
            sum / (step * step) as f32
        };
        Picture { size, light: (0..size[0] * size[1]).map(at).collect() }
    }
}

impl Outcome {
    /// Returns the picture as the bytes of a PNG file.
    ///
    /// With a calibration it shows each taxel's outline with its row and column, a cross on each base, and lines
    /// between neighbors. A whisker without light is dashed in orange. Without a calibration it shows a ring and a
    /// number on every spot of light. They are white if the spot seemed to be a whisker, and orange otherwise.
    pub fn to_png(&self) -> Vec<u8> {
        let mut canvas = self.light();
        match &self.result {
            Ok(calibration) => self.draw_taxels(&mut canvas, calibration),
            Err(refusal) => self.draw_spots(&mut canvas, refusal),
        }
        canvas.to_png()
    }

    /// Returns the number of pixels of the picture along a cell's side.
    fn scale(&self) -> usize {
        let shorter = self.seen.light.size.into_iter().min().unwrap_or(0).max(1);
        READABLE.div_ceil(shorter)
    }

    /// Draws the light in green over the untouched picture in gray-blue, as an eye sees it: not in proportion.
    fn light(&self) -> Canvas {
        let scale = self.scale();
        let glows = self.seen.glow();
        let [columns, rows] = self.seen.light.size;
        let mut canvas = Canvas::new(columns * scale, rows * scale);
        for (k, (glow, dark)) in glows.iter().zip(&self.seen.dark.values).enumerate() {
            // A root amplifies weak light.
            let glow = glow.sqrt();
            let dark = 22.0 + 70.0 * dark.clamp(0.0, 1.0).sqrt();
            let color = [dark + 30.0 * glow, dark + (235.0 - dark) * glow, dark * 1.25 + 40.0 * glow];
            canvas.fill([k % columns * scale, k / columns * scale], [scale; 2], color.map(|part| part as u8));
        }
        canvas
    }

    fn draw_taxels(&self, canvas: &mut Canvas, calibration: &Calibration) {
        let scale = self.scale() as f64;
        // Converts pixels of the frame, with whole numbers in their middle, to pixels of the picture.
        let per_pixel = scale / f64::from(self.cells.side);
        let seen = |at: f64| (at + 0.5) * per_pixel - 0.5;
        let bases = calibration.centers.map(|center| center.map(seen));
        let links = (0..TAXELS).flat_map(|k| {
            let right = ((k + 1) % COLUMNS != 0).then_some([k, k + 1]);
            right.into_iter().chain((k + COLUMNS < TAXELS).then_some([k, k + COLUMNS]))
        });
        for [from, to] in links {
            canvas.line(bases[from], bases[to], LINK);
        }
        let size = calibration.layout.taxel().map(|side| f64::from(side) * per_pixel);
        for (taxel, corner) in calibration.layout.corners().iter().enumerate() {
            let dead = calibration.dead == Some(taxel);
            let corner = corner.map(|at| f64::from(at) * per_pixel);
            canvas.outline(corner, size, if dead { DEAD } else { TAXEL }, dead);
            let label = format!("{},{}", taxel / COLUMNS + 1, taxel % COLUMNS + 1);
            canvas.text([corner[0] + 5.0, corner[1] + 5.0], &label, if dead { DEAD } else { TAXEL });
            canvas.cross(bases[taxel], 6.0, if dead { DEAD } else { BASE });
        }
    }

    fn draw_spots(&self, canvas: &mut Canvas, refusal: &Refusal) {
        let scale = self.scale() as f64;
        for (k, spot) in self.spots.iter().enumerate() {
            let color = if refusal.lattice.contains(&k) { ON_LATTICE } else { STRAY };
            let center = spot.center.map(|at| (at + 0.5) * scale - 0.5);
            let radius = (spot.area as f64 / core::f64::consts::PI).sqrt() * 1.3 * scale + 3.0;
            canvas.ring(center, radius, color);
            canvas.text([center[0] + radius * 0.75, center[1] - radius * 0.75 - 14.0], &(k + 1).to_string(), color);
        }
    }
}
