//! Tests orders while something touches the sensor. A recording is saved, and its answers are said to be none; an end
//! of contact that waits for more light is reported before the new baseline.

use std::fs::File;

use wstac_host::config::Config;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::record::FinishedRecording;
use wstac_host::session::{Observer, Phase, Session};
use wstac_host::source::{Labels, Source};
use wstac_host::station::{Station, Turn};
use wstac_host::texture::Textures;
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;
use wstac_tests::folder::Folder;

/// Keeps the outputs.
#[derive(Default)]
struct Kept(Vec<Output>);

impl Observer for Kept {
    type Error = wstac_host::error::Error;

    fn output(&mut self, output: Output) -> Result<(), Self::Error> {
        self.0.push(output);
        Ok(())
    }
}

fn station(scene: &str) -> Station {
    let source = SceneSource::new(&SceneConfig::from_toml("a touch", scene).unwrap()).unwrap();
    let info = source.info().clone();
    let (config, textures, outputs) = (Config::default(), Textures::default(), OutputOptions::default());
    Station::new(Box::new(source), info, config, textures, outputs).unwrap()
}

/// Records a touch from the first frame in this state on, to the end of the scene.
fn recorded(folder: &Folder, from: impl Fn(Phase) -> bool) -> FinishedRecording {
    let scene = "fidelity = \"taxel\"\nlead_in = 100\n[[touch]]\nkind = \"hold\"\nhold = 6\n";
    let mut station = station(scene);
    while !from(station.processor().phase()) {
        assert_ne!(station.advance(&mut Kept::default()).unwrap(), Turn::Over);
    }
    let path = folder.0.join("a.mcap");
    let create = || Ok((File::create(&path).unwrap(), path.clone()));
    station.record(create, Labels::new(), false).unwrap();
    while station.advance(&mut Kept::default()).unwrap() != Turn::Over {}
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

#[test]
fn an_order_behind_an_event_does_not_lose_its_end() {
    type Order = fn(&mut Station, &Folder);
    let folder = Folder::new("recording-ends");
    let orders: [Order; 4] = [
        |_, _| (),
        |station, _| station.rezero(),
        |station, _| station.reconfigure(Config::default()).unwrap(),
        |station, folder| {
            let path = folder.0.join("a.mcap");
            station.record(|| Ok((File::create(&path).unwrap(), path.clone())), Labels::new(), false).unwrap();
        },
    ];
    // One end of a block gives light, and so may the other one for a time.
    let slide = "fidelity = \"taxel\"\ngap = 200\n[[slide]]\nspecimen = \"Fla0\"\nspeed = 40\ndirection = 30\n";
    let ends = orders.map(|order| {
        let (mut station, mut kept) = (station(slide), Kept::default());
        let is_event = |output: &Output| matches!(output, Output::Event(_));
        while !kept.0.iter().any(is_event) || station.processor().phase() != Phase::Watching {
            assert_ne!(station.advance(&mut kept).unwrap(), Turn::Over);
        }
        let is_end = |output: &&Output| matches!(output, Output::ContactEnd(_));
        assert_eq!(kept.0.iter().find(is_end), None);
        order(&mut station, &folder);
        while station.advance(&mut kept).unwrap() != Turn::Over {}
        let Some(Output::Event(event)) = kept.0.iter().find(|output| is_event(output)) else { panic!("{:?}", kept.0) };
        let of_event = |output: &&Output| matches!(output, Output::ContactEnd(end) if end.event_frame == event.frame);
        let [Output::ContactEnd(end)] = kept.0.iter().filter(of_event).collect::<Vec<_>>()[..] else {
            panic!("{:?}", kept.0)
        };
        (end.frame, end.time_ns)
    });
    // Without a station, the processor returns it.
    let source = SceneSource::new(&SceneConfig::from_toml("a touch", slide).unwrap()).unwrap();
    let mut session = Session::builder(Box::new(source)).build().unwrap();
    let is_event = |output: &Output| matches!(output, Output::Event(_));
    while !is_event(&session.next().unwrap().unwrap()) {}
    while session.processor().phase() != Phase::Watching {
        session.step(&mut Kept::default()).unwrap();
    }
    let [Output::ContactEnd(end)] = &session.processor_mut().rezero()[..] else { panic!("no end") };
    assert_eq!((end.frame, end.time_ns), ends[1]);
    assert!(ends[1..].iter().all(|end| end.0 < ends[0].0), "{ends:?}");
    assert!(ends.iter().all(|end| end.1 == Some(end.0 * 100_000_000 / 3)), "{ends:?}");
}
