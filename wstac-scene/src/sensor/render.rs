//! Frames of pixels: every taxel's light becomes values of its pixels, and those become bytes.

use std::sync::Arc;

use wstac_core::green::any::Any;
use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;
use wstac_core::taxels::FrameGeometry;

use super::config::SensorConfig;
use super::encode::{Block, Encoder, Frame, SHARES};
use super::noise::NoiseTable;
use super::pixel::{Pixel, Rendering, checked_light};
use super::spot::Spot;
use crate::rng::Rng;

/// Renders frames of one format.
#[derive(Clone, Debug)]
pub(super) struct Renderer {
    layout: Layout,
    frame: Frame,
    encoder: Arc<dyn Encoder>,
    rendering: Rendering,
    /// Values of light of a taxel's pixels, row by row, for a light of 1.
    spot: Vec<f32>,
    noise: Option<NoiseTable>,
    /// Value of a pixel outside of the taxels.
    outside: u16,
    /// The block in progress: its width and height are those of a taxel's cells in one row of cells.
    values: [Vec<u16>; 3],
}

impl Renderer {
    /// Creates a renderer of a camera's frames, which are black at first.
    pub(super) fn new(
        config: &SensorConfig,
        camera: &FrameGeometry<Any>,
        pixel: &Pixel,
        spot: &Spot,
        encoder: Arc<dyn Encoder>,
        rng: Rng,
    ) -> Self {
        let layout = *camera.layout();
        let [width, _] = layout.taxel().map(usize::from);
        let frame = Frame {
            bytes: vec![0; camera.frame_bytes()],
            bytes_per_row: camera.bytes_per_row(),
            height: usize::from(layout.frame().height()),
        };
        let values_of_light = pixel.scale * pixel.full_well;
        let mut renderer = Self {
            layout,
            frame,
            encoder,
            rendering: pixel.rendering(),
            spot: spot.light.iter().map(|light| (light * values_of_light) as f32).collect(),
            noise: (config.noise > 0.0).then(|| NoiseTable::new(width, config.noise, rng)),
            outside: pixel.outside(),
            values: [const { Vec::new() }; 3],
        };
        renderer.blacken();
        let [columns, rows] = renderer.encoder.cell();
        let colors = renderer.colors().map(|(color, _)| color);
        for color in colors {
            if let Some(values) = renderer.values.get_mut(color) {
                *values = vec![renderer.outside; (width + columns).next_multiple_of(columns) * rows];
            }
        }
        renderer
    }

    /// Returns the bytes of the next frame.
    pub(super) fn expose(&mut self, light: &[f64; TAXELS]) -> &[u8] {
        let corners = *self.layout.corners();
        for (corner, &light) in corners.iter().zip(light) {
            self.expose_taxel(corner.map(usize::from), checked_light(light));
        }
        &self.frame.bytes
    }

    /// Renders one taxel, block by block. The part of a block that is outside of the taxel stays dark.
    fn expose_taxel(&mut self, [left, top]: [usize; 2], light: f64) {
        let [columns, rows] = self.encoder.cell();
        let [width, height] = self.layout.taxel().map(usize::from);
        let before = left % columns;
        let block_width = (before + width).next_multiple_of(columns);
        for y in (top - top % rows..top + height).step_by(rows) {
            for (color, share) in self.colors() {
                let values = self.values.get_mut(color).map(Vec::as_mut_slice).unwrap_or_default();
                let values = values.get_mut(..block_width * rows).unwrap_or_default();
                if columns * rows > 1 {
                    values.fill(self.outside);
                }
                let light = (light * share) as f32;
                for (y, values) in (y..).zip(values.chunks_exact_mut(block_width)) {
                    let Some(row) = y.checked_sub(top).filter(|&row| row < height) else { continue };
                    let spot = self.spot.get(row * width..(row + 1) * width).unwrap_or_default();
                    let values = values.get_mut(before..before + width).unwrap_or_default();
                    match &mut self.noise {
                        Some(noise) => self.rendering.noisy(light, spot, noise.run(width), values),
                        None => self.rendering.quiet(light, spot, values),
                    }
                }
            }
            let colors = self.values.each_ref().map(|values| values.get(..block_width * rows).unwrap_or_default());
            let block = Block { left: left - before, top: y, width: block_width, colors };
            self.encoder.encode(&block, &mut self.frame);
        }
    }

    /// Iterates over the places and fractions of the rendered colors.
    fn colors(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let colored = self.encoder.is_colored();
        SHARES.into_iter().enumerate().filter(move |&(color, _)| colored || color == 1)
    }

    /// Writes the whole frame with the value outside of taxels.
    fn blacken(&mut self) {
        let [columns, rows] = self.encoder.cell();
        let width = usize::from(self.layout.frame().width()).next_multiple_of(columns);
        let values = vec![self.outside; width * rows];
        for top in (0..self.frame.height).step_by(rows) {
            let block = Block { left: 0, top, width, colors: [&values; 3] };
            self.encoder.encode(&block, &mut self.frame);
        }
    }
}
