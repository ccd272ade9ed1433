//! Tests a session's textures by 25 taxels: they are those that the core computes directly.
//! They are absent if too many frames are lost.

use wstac_core::law::EventLaw;
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::touch::path_sample::PathSample;
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_host::config::Config;
use wstac_host::model_file::ModelFile;
use wstac_host::output::TactileEvent;
use wstac_host::source::StreamInfo;
use wstac_host::texture::{NoTexture, Texture};
use wstac_scene::SceneConfig;

use crate::host::{Sums, first_event, sums};

fn slide(text: &str, per_second: u32) -> (StreamInfo, Vec<Sums>) {
    let mut script = SceneConfig::parse_short(text).unwrap();
    script.sensor.rate = FrameRate::new(per_second, 1).unwrap();
    sums(script)
}

/// Returns the first event of a host with these models, if every frame of `lost` is lost.
fn on_host(info: &StreamInfo, frames: &[Sums], models: &[&str], lost: &[usize]) -> TactileEvent {
    let frames = frames.iter().enumerate().map(|(number, sums)| (!lost.contains(&number)).then_some(*sums));
    first_event(info, frames, &Config::default(), models)
}

/// Returns the class of the first event, as the core computes it from a ring of its own.
fn directly(info: &StreamInfo, frames: &[Sums], model: &str) -> String {
    let config = Config::default();
    let mut pipeline = config.pipeline(info).unwrap();
    let (law, motion) = (config.law_of(info).unwrap(), config.motion_of(info).unwrap());
    let mut ring = TaxelRing::of(pipeline.geometry());
    let file = ModelFile::open(model.as_ref()).unwrap();
    let model = file.owned().unwrap();
    let added = info.rate.frames_added() as usize;
    for together in frames.chunks_exact(added) {
        let mut sums = [0; TAXELS];
        for frame in together {
            for (sum, one) in sums.iter_mut().zip(frame) {
                *sum += one;
            }
        }
        ring.push(&sums);
        for (number, frame) in (1..).zip(together) {
            let update = pipeline.push_taxels(frame);
            assert_eq!(update.is_frame(), number == added);
            let Some(event) = update.event() else { continue };
            assert!(update.taxels().is_none(), "no model has asked for taxels");
            let velocity = law.answer(&event).velocity().unwrap();
            let sample = PathSample::of_taxels(&ring, &velocity, motion, model.get().frames()).unwrap();
            let class = model.get().classify(sample.numbers());
            return model.get().labels().get(class.into()).unwrap().to_string();
        }
    }
    panic!("the slide has no event");
}

#[test]
fn a_session_with_a_model_of_25_taxels_answers_as_the_core_does() {
    let mut right = 0;
    let slides = ["Saw3@60,200deg,80mm", "Sin4@290,10deg", "Tri2@90,330deg,120mm", "Fla0@150,45deg,seed=4"];
    for text in slides {
        for per_second in [30, 60] {
            let (info, frames) = slide(text, per_second);
            for model in ["builtin:taxel-path-svm", "builtin:taxel-path-forest", "builtin:taxel-path-boosted"] {
                let event = on_host(&info, &frames, &[model], &[]);
                let specimen = event.texture.unwrap().specimen.unwrap();
                assert_eq!(specimen, directly(&info, &frames, model), "{text} {per_second} {model}");
                right += usize::from(text.starts_with(&specimen));
            }
        }
    }
    assert!(right >= 22, "{right} of 24");
}

#[test]
fn lost_frames_leave_a_model_of_25_taxels_with_its_answer_if_few_are_lost() {
    let (info, frames) = slide("Saw3@100", 30);
    let whole = on_host(&info, &frames, &["builtin:taxel-path-svm"], &[]);
    let at = whole.frame as usize;
    let with = |lost: &[usize]| on_host(&info, &frames, &["builtin:taxel-path-svm"], lost).texture;
    let texture = whole.texture.unwrap();
    // Before the sample, and behind the answer.
    for lost in [at - 5, at + 60] {
        assert_eq!(with(&[lost]), Ok(texture.clone()));
    }
    // At its first frames, and in its middle.
    for lost in [&[at + 1][..], &[at + 20], &[at + 18, at + 23]] {
        let found = with(lost).unwrap();
        assert_eq!((found.specimen, found.known), (texture.specimen.clone(), Some(true)), "{lost:?}");
    }
    let run: Vec<usize> = (at + 17..at + 24).collect();
    assert_eq!(with(&run), Err(NoTexture::LostFrames));
}

#[test]
fn reasons_are_those_of_the_touch() {
    let (info, frames) = slide("Saw3@10", 30);
    let with = |models: &[&str], lost: &[usize]| on_host(&info, &frames, models, lost).texture;
    assert_eq!(with(&["builtin:taxel-path-svm"], &[]), Err(NoTexture::TooShort));
    assert_eq!(with(&[], &[]), Err(NoTexture::NoModel));
    let script = SceneConfig::from_toml("a press", "[[touch]]\nkind = \"press\"\n").unwrap();
    let (info, frames) = sums(script);
    let press = on_host(&info, &frames, &["builtin:taxel-path-svm"], &[]).texture;
    assert_eq!(press, Err::<Texture, _>(NoTexture::NoSlide));
}
