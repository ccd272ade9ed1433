//! Tests answers at once of the reference's streams: in which frame each comes, of how many frames, and what it says.

use serde::Deserialize;
use wstac_core::green::gray::Gray;
use wstac_core::law::{Answer, ByWave};
use wstac_core::paper::trigger::{ContactEnd, InterruptedSample, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::motion::Contact;
use wstac_core::touch::taxel_ring::TaxelRing;

use super::case::{Cases, Frames, directory, each, read};
use super::wave::{DARK, WaveOf, check_velocity, config, layout, word};

/// The frame of an answer, the first frame of its sample, the number of its frames, and what it says.
type AnswerOf = (u64, u64, u8, WaveOf);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AtOnceCase {
    name: String,
    readout_ms: Option<f32>,
    frames: Vec<Frames<u32>>,
    answers: Vec<AnswerOf>,
    ends: Vec<ContactEnd>,
    incomplete: Vec<InterruptedSample>,
}

/// The answers and ends of a stream.
#[derive(Default)]
struct Said {
    answers: Vec<(u64, u64, u8, Answer)>,
    ends: Vec<ContactEnd>,
    incomplete: Vec<InterruptedSample>,
}

impl AtOnceCase {
    fn said(&self) -> Said {
        let layout = layout();
        let config = config(self.readout_ms, 30.0, &layout);
        let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
        let trigger = TriggerConfig::default().one_event_per_touch();
        let mut pipeline = Pipeline::builder(geometry).trigger(trigger).taxels::<TaxelRing>().build().unwrap();
        let (law, mut at_once, mut said) = (ByWave(config), AtOnce::new(config), Said::default());
        for sums in each(&self.frames, DARK) {
            let update = match &sums {
                Some(sums) => pipeline.push_taxels(sums),
                None => pipeline.push_lost(1),
            };
            said.incomplete.extend(update.interrupted());
            let touch = update.event().or(update.touch());
            let answer =
                touch.and_then(|touch| answer(&touch, &law, Some(&mut at_once), None, |answer| (touch, *answer)));
            said.ends.extend(at_once.end(&update));
            if let Some((touch, answer)) = answer {
                said.answers.push((touch.last_frame(), touch.frame, touch.frames, answer));
                pipeline.answer_touch();
            }
        }
        said.ends.extend(at_once.last_end());
        said
    }
}

#[test]
fn every_answer_at_once_is_that_of_the_reference() {
    let Cases::<AtOnceCase> { cases } = read(&directory().join("at_once.json"));
    let (mut early, mut late) = (0, 0);
    for case in &cases {
        let (name, said) = (&case.name, case.said());
        assert_eq!((&said.ends, &said.incomplete), (&case.ends, &case.incomplete), "{name}: ends, incomplete samples");
        assert_eq!(said.answers.len(), case.answers.len(), "{name}: {:?}", said.answers);
        for (found, (frame, event_frame, frames, expected)) in said.answers.iter().zip(&case.answers) {
            let (answer, at) = (&found.3, format!("{name}, frame {frame}"));
            assert_eq!((found.0, found.1, found.2), (*frame, *event_frame, *frames), "{at}: {answer:?}");
            let velocity = answer.velocity().filter(|_| answer.reliable);
            if let Some(velocity) = velocity.filter(|_| expected.mm_s.is_some()) {
                check_velocity(&at, velocity, answer.basis, expected);
            } else {
                let pressed = Reason::NoSlide(Contact::Press);
                let reason = answer.doubt.or((answer.contact == Some(Contact::Press)).then_some(pressed));
                assert_eq!(reason.map(word), expected.why.as_deref(), "{at}: {answer:?}");
            }
            *(if *frames < 70 { &mut early } else { &mut late }) += 1;
        }
    }
    assert!(early >= 9 && late >= 3, "{early} answers at once, {late} of whole samples");
}
