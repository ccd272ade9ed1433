//! Frames of pixels for a camera that does not look straight on: every pixel of the frame is computed, with its noise.

use std::sync::Arc;

use wstac_core::green::any::Any;
use wstac_core::params::{PAPER_IMAGE_SIDE, PAPER_TAXEL_SIDE, TAXELS};
use wstac_core::taxels::FrameGeometry;

use super::config::SensorConfig;
use super::encode::{Block, Encoder, Frame, Mosaic, SHARES};
use super::noise::NoiseTable;
use super::pixel::{Pixel, Rendering, checked_light};
use super::pose::{Pose, View, nearest};
use super::spot::{blurred, brightest, profile};
use crate::rng::Rng;

/// Shorter side of a taxel on the sensor, in half sides of a tactile picture.
const TAXEL: f64 = 2.0 * PAPER_TAXEL_SIDE as f64 / PAPER_IMAGE_SIDE as f64;

/// Renders whole frames of one format for a camera in some pose.
#[derive(Clone, Debug)]
pub(super) struct WholeRenderer {
    frame: Frame,
    encoder: Arc<dyn Encoder>,
    rendering: Rendering,
    width: usize,
    /// For every pixel, row by row: the taxel that it sees, and its values of light for a light of 1.
    seen: Vec<(u8, f32)>,
    noise: Option<NoiseTable>,
    /// Values of light of a row, and the block in progress: a row of cells.
    lights: Vec<f32>,
    values: [Vec<u16>; 3],
}

impl WholeRenderer {
    pub(super) fn new(
        config: &SensorConfig,
        pose: &Pose,
        camera: &FrameGeometry<Any>,
        pixel: &Pixel,
        encoder: Arc<dyn Encoder>,
        rng: Rng,
    ) -> Self {
        let size = camera.layout().frame();
        let (width, height) = (usize::from(size.width()), usize::from(size.height()));
        let [columns, rows] = encoder.cell();
        let block_width = width.next_multiple_of(columns);
        let view = View::new(pose, size);
        let values_of_light = pixel.scale * pixel.full_well * brightest();
        let (taxels, shares) = looked_up(&view, width, height);
        let shares = if config.blur > 0.0 { blurred(&shares, width, config.blur) } else { shares };
        let mosaic = Mosaic::of(config.format.pixels());
        let seen = taxels.into_iter().zip(shares).enumerate().map(|(k, (taxel, share))| {
            let color = mosaic.map_or(1.0, |mosaic| mosaic.site(k % width, k / width).share());
            (taxel, (share * color * values_of_light) as f32)
        });
        let seen = seen.collect();
        Self {
            frame: Frame { bytes: vec![0; camera.frame_bytes()], bytes_per_row: camera.bytes_per_row(), height },
            rendering: pixel.rendering(),
            width,
            seen,
            noise: (config.noise > 0.0).then(|| NoiseTable::new(width, config.noise, rng)),
            lights: vec![0.0; width],
            values: [const { Vec::new() }; 3].map(|_: Vec<u16>| vec![pixel.outside(); block_width * rows]),
            encoder,
        }
    }

    /// Returns the bytes of the next frame.
    pub(super) fn expose(&mut self, light: &[f64; TAXELS]) -> &[u8] {
        let light = light.map(checked_light);
        let [columns, rows] = self.encoder.cell();
        let (width, block_width) = (self.width, self.width.next_multiple_of(columns));
        let colored = self.encoder.is_colored();
        for top in (0..self.frame.height).step_by(rows) {
            for (color, (values, share)) in self.values.iter_mut().zip(SHARES).enumerate() {
                if !colored && color != 1 {
                    continue;
                }
                let light = light.map(|light| (light * share) as f32);
                for (y, values) in (top..).zip(values.chunks_exact_mut(block_width)) {
                    let seen = self.seen.get(y * width..(y + 1) * width).unwrap_or_default();
                    for (to, (taxel, share)) in self.lights.iter_mut().zip(seen) {
                        *to = light.get(usize::from(*taxel)).unwrap_or(&0.0) * share;
                    }
                    let values = values.get_mut(..width).unwrap_or_default();
                    match &mut self.noise {
                        Some(noise) => self.rendering.noisy(1.0, &self.lights, noise.run(width), values),
                        None => self.rendering.quiet(1.0, &self.lights, values),
                    }
                }
            }
            let colors = self.values.each_ref().map(Vec::as_slice);
            self.encoder.encode(&Block { left: 0, top, width: block_width, colors }, &mut self.frame);
        }
        &self.frame.bytes
    }
}

/// Returns for every pixel the taxel that it sees, and its light as a fraction of that in a spot's middle.
fn looked_up(view: &View, width: usize, height: usize) -> (Vec<u8>, Vec<f64>) {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x as f64, y as f64]));
    let looked_up = pixels.map(|pixel| {
        let Some(source) = view.source(pixel) else { return (0, 0.0) };
        let (taxel, distance) = nearest(source);
        (taxel as u8, profile(distance / TAXEL) * view.brightness(pixel))
    });
    looked_up.unzip()
}
