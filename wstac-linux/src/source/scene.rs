//! A simulated sensor as a source: as fast as its frames are asked for.

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::Colour;

use super::{Item, Source, StreamInfo};
use crate::error::Error;
use crate::scene::{Scene, Script, Truth};

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
        let (width, height) = script.size.into();
        let info = StreamInfo {
            size: script.size,
            format: PixelFormat::Grey,
            colour: Colour::default(),
            bytes_per_row: width,
            rate: script.rate,
            about: format!("scene: {slides}, seed {}, {} frames of {width}x{height} GREY", script.seed, scene.frames()),
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
        Ok(self.scene.next_frame().map_or(Item::End, |bytes| Item::Frame { bytes, timestamp: None }))
    }
}
