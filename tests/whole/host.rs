//! The answers of a host to taxel sums of a simulated sensor, some of which may be lost.

use wstac_core::params::TAXELS;
use wstac_host::config::Config;
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, OutputOptions, TactileEvent};
use wstac_host::session::Processor;
use wstac_host::source::{LossReason, Source, SourceEvent, StreamInfo, SummedFrame};
use wstac_host::texture::Textures;
use wstac_scene::SceneConfig;
use wstac_scene::sensor::Fidelity;
use wstac_scene::source::SceneSource;

/// The taxel sums of a frame.
pub(crate) type Sums = [u32; TAXELS];

/// Returns the frames of a scene, and what they have in common.
pub(crate) fn sums(mut scene: SceneConfig) -> (StreamInfo, Vec<Sums>) {
    scene.fidelity = Fidelity::Taxel;
    let mut source = SceneSource::new(&scene).unwrap();
    let mut frames = Vec::new();
    while let SourceEvent::Taxels(frame) = source.next_event().unwrap() {
        frames.push(frame.sums);
    }
    (source.info().clone(), frames)
}

/// Returns the first event of these frames, of which `None` is lost.
pub(crate) fn first_event(
    info: &StreamInfo,
    frames: impl IntoIterator<Item = Option<Sums>>,
    config: &Config,
    models: &[&str],
) -> TactileEvent {
    let files: Vec<_> = models.iter().map(|name| ModelFile::open(name.as_ref()).unwrap()).collect();
    let processor = Processor::new(info, config, OutputOptions::default()).unwrap();
    let mut processor = processor.with_textures(Textures::new(&files).unwrap());
    let mut first = None;
    for frame in frames {
        let event = match frame {
            Some(sums) => SourceEvent::Taxels(SummedFrame::new(sums)),
            None => SourceEvent::Lost { frames: 1, reason: LossReason::Dropped },
        };
        let emit = |output| {
            if let Output::Event(event) = output {
                first.get_or_insert(*event);
            }
            Ok::<(), ()>(())
        };
        processor.process(&event, emit).unwrap();
    }
    first.expect("the touch has an event")
}
