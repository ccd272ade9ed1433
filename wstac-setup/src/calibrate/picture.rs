//! A picture of a calibration for a person: the light, with the taxels or the candidates for whiskers over it.

use wstac_core::params::{COLUMNS, TAXELS};

use super::{Calibration, Outcome, Refusal};
use crate::canvas::{Canvas, Color};

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
        let brightest = |values: &[f32]| {
            let mut values = values.to_vec();
            values.sort_unstable_by(f32::total_cmp);
            values.get((values.len() as f32 * BRIGHTEST) as usize).copied().unwrap_or(0.0).max(1e-6)
        };
        let most = brightest(&self.seen.light.values).max(4.0 * self.seen.noise as f32);
        // A root amplifies weak light, so noise is left out.
        let hidden = 2.5 * self.seen.noise as f32;
        let [columns, rows] = self.seen.light.size;
        let mut canvas = Canvas::new(columns * scale, rows * scale);
        for (k, (light, dark)) in self.seen.light.values.iter().zip(&self.seen.dark.values).enumerate() {
            let glow = ((light - hidden) / (most - hidden)).clamp(0.0, 1.0).sqrt();
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
