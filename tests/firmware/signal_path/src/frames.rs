//! Measures how the cost from bytes to the trigger grows with the frame size, the taxel size and the number of frames.

use wstac_core::error::{ConfigError, Error};
use wstac_core::features::Floor;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::{COLUMNS, TAXELS};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_fw::emulated::clock::Clock;

use crate::{ROWS, STRIPE};

const FLOOR: Floor = match Floor::new(0.5, 255) {
    Ok(floor) => floor,
    Err(_) => panic!("half a level of 255"),
};

/// Returns the instructions of `count` frames, from bytes to the trigger.
fn frames(clock: &Clock, stripe: &[u8; STRIPE], layout: Layout, count: u32) -> Result<f64, Error> {
    let mut pipeline = Pipeline::builder(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?).floor(FLOOR).build()?;
    let (width, height) = (usize::from(layout.frame().width()), usize::from(layout.frame().height()));
    let mut all = 0;
    for _ in 0..count {
        for first in (0..height).step_by(ROWS) {
            let rows = &stripe[..width * ROWS.min(height - first)];
            let (ticks, done) = clock.ticks(|| pipeline.push_stripe(rows).map(drop));
            done?;
            all += u64::from(ticks);
        }
    }
    Ok(clock.instructions(all) as f64)
}

/// Returns a layout of square taxels with this side. Their distance is a fifth of the frame.
fn layout(frame: u16, side: u16) -> Result<Layout, ConfigError> {
    let place = |k: usize| (k as u16) * (frame / COLUMNS as u16);
    let corners: [[u16; 2]; TAXELS] = core::array::from_fn(|k| [place(k % COLUMNS), place(k / COLUMNS)]);
    Layout::new(FrameSize::new(frame.into(), frame.into())?, [side, side], corners)
}

/// Measures and prints all series. `of` is the factor by which the size or number has grown.
pub fn measure(clock: &Clock, stripe: &[u8; STRIPE]) -> Result<(), Error> {
    for grown in [1_u16, 2, 4, 8] {
        let of = ["1", "4", "16", "64"][grown.ilog2() as usize];
        let paper = Layout::paper(FrameSize::new(100 * u32::from(grown), 100 * u32::from(grown))?)?;
        crate::say("frame pixels with the paper's taxels", of, frames(clock, stripe, paper, 4)? / 4.0);
        crate::say("frame pixels, taxels of 16 × 16", of, frames(clock, stripe, layout(100 * grown, 16)?, 4)? / 4.0);
        crate::say("taxel area, frames of 400 × 400", of, frames(clock, stripe, layout(400, 10 * grown)?, 4)? / 4.0);
        let paper = Layout::paper(FrameSize::new(400, 400)?)?;
        crate::say("frames", of, frames(clock, stripe, paper, u32::from(grown) * u32::from(grown))?);
    }
    Ok(())
}
