//! Tests a recording that begins while something touches the sensor: it is saved, and its answers are said to be none.

use std::fs::File;

use wstac_host::config::Config;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::record::FinishedRecording;
use wstac_host::session::{Observer, Phase};
use wstac_host::source::{Labels, Source};
use wstac_host::station::{Station, Turn};
use wstac_host::texture::Textures;
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;
use wstac_tests::folder::Folder;

struct Silent;

impl Observer for Silent {
    type Error = wstac_host::error::Error;

    fn output(&mut self, _: Output) -> Result<(), Self::Error> {
        Ok(())
    }
}

/// Records a touch from the first frame in this state on, to the end of the scene.
fn recorded(folder: &Folder, from: impl Fn(Phase) -> bool) -> FinishedRecording {
    let scene = "fidelity = \"taxel\"\nlead_in = 100\n[[touch]]\nkind = \"hold\"\nhold = 6\n";
    let source = SceneSource::new(&SceneConfig::from_toml("a hold", scene).unwrap()).unwrap();
    let info = source.info().clone();
    let (config, textures, outputs) = (Config::default(), Textures::default(), OutputOptions::default());
    let mut station = Station::new(Box::new(source), info, config, textures, outputs).unwrap();
    while !from(station.processor().phase()) {
        assert_ne!(station.advance(&mut Silent).unwrap(), Turn::Over);
    }
    let path = folder.0.join("a.mcap");
    let create = || Ok((File::create(&path).unwrap(), path.clone()));
    station.record(create, Labels::new(), false).unwrap();
    while station.advance(&mut Silent).unwrap() != Turn::Over {}
    station.take_recorded().unwrap().unwrap()
}

#[test]
fn a_recording_that_begins_in_a_touch_says_so() {
    let folder = Folder::new("recording-touched");
    let in_touch = "it begins in a touch, so its answers are not reliable: record it again";
    let before = recorded(&folder, |phase| phase == Phase::Watching);
    assert!(!before.begins_in_touch && before.events > 0 && !before.to_string().contains(in_touch), "{before}");
    let within = recorded(&folder, |phase| matches!(phase, Phase::Capturing { frames: 40.. }));
    assert!(within.begins_in_touch && within.to_string().ends_with(in_touch), "{within}");
}
