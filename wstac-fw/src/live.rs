//! What follows whatever slides, frame by frame: by ten sums, or by 25 taxels if the law takes them.

use wstac_core::touch::motion::{LiveContact, LiveMotion, LiveWave};

use crate::setup::BoardPipeline;

/// Follows whatever slides.
pub trait Live {
    /// Takes the newest frame of a pipeline, and returns what touches the sensor.
    fn newest(&mut self, pipeline: &BoardPipeline) -> Option<LiveContact>;

    /// Returns how often a wave was asked about this touch.
    fn waves(&self) -> u8 {
        0
    }
}

impl Live for LiveMotion {
    fn newest(&mut self, pipeline: &BoardPipeline) -> Option<LiveContact> {
        let (next_frame, recent) = pipeline.recent();
        self.push(next_frame, recent, pipeline.baseline()?)
    }
}

impl Live for LiveWave {
    fn newest(&mut self, pipeline: &BoardPipeline) -> Option<LiveContact> {
        let (next_frame, recent) = pipeline.recent();
        self.push(next_frame, recent, pipeline.baseline()?, pipeline.taxel_ring())
    }

    fn waves(&self) -> u8 {
        self.waves()
    }
}
