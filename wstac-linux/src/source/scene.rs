//! A simulated sensor as a source: as fast as its frames are asked for.

use super::{Item, Source, StreamInfo};
use crate::error::Error;
use crate::scene::sensor::Fidelity;
use crate::scene::{Scene, Script, Shot, Truth};

/// The frames of a scene.
#[derive(Clone, Debug)]
pub struct SceneSource {
    info: StreamInfo,
    scene: Scene,
}

impl SceneSource {
    /// A scene from its start.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn new(script: &Script) -> Result<Self, Error> {
        let scene = Scene::new(script)?;
        let slides = match &script.slides[..] {
            [one] => format!("{} at {} mm/s, {} degrees", one.specimen, one.speed_mm_s, one.heading.degrees()),
            slides => format!("{} slides", slides.len()),
        };
        let (width, height) = script.sensor.size.into();
        let sensor = scene.sensor();
        let (seed, frames, format) = (script.seed, scene.frames(), script.sensor.format);
        let what = match script.fidelity {
            Fidelity::Rendered => format!("frames of {width}x{height} {format}"),
            Fidelity::Taxel => format!("taxel sums of {width}x{height} {format}"),
        };
        let info = StreamInfo {
            size: script.sensor.size,
            format: sensor.format(),
            colour: sensor.colour(),
            bytes_per_row: sensor.bytes_per_row() as u32,
            rate: script.sensor.rate,
            taxels_only: script.fidelity == Fidelity::Taxel,
            about: format!("scene: {slides}, seed {seed}, {frames} {what}"),
            camera: None,
        };
        Ok(Self { info, scene })
    }

    /// What really happens in it.
    pub fn truth(&self) -> &[Truth] {
        self.scene.truth()
    }
}

impl Source for SceneSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next(&mut self) -> Result<Item<'_>, Error> {
        let frame = |bytes, encoded| Item::Frame { bytes, timestamp: None, sequence: None, encoded };
        Ok(match self.scene.next_shot() {
            Some(Shot::Frame(bytes)) => frame(bytes, None),
            Some(Shot::Jpeg(bytes, jpeg)) => frame(bytes, Some(jpeg)),
            Some(Shot::Taxels(sums)) => Item::Taxels(sums),
            Some(Shot::Lost(frames, why)) => Item::Lost { frames: frames.into(), why },
            None => Item::End,
        })
    }
}
