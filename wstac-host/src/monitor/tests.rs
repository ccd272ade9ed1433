//! Tests that the command's own tests do not cover: boards that start again, that are newer, or that send impossible
//! messages.

use wstac_core::baseline::Baseline;
use wstac_core::direction::{Direction, Heading};
use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;
use wstac_core::speed::{Speed, SpeedConfig};
use wstac_core::trigger::{Event, InterruptedSample, TriggerConfig};
use wstac_core::wire::{Answers, Hello, LONGEST, Text, TextureAnswer, encode};

use super::*;
use crate::output::StreamSummary;

fn hello(frame: u64) -> Message<'static> {
    Message::Hello(Hello {
        firmware: Text::new("board"),
        version: Text::new("1"),
        size: FrameSize::new(320, 240).unwrap(),
        format: PixelFormat::Gray,
        rate: FrameRate::new(30_000, 1001).unwrap(),
        trigger: TriggerConfig::default(),
        models: [None; 3],
        frame,
    })
}

fn event(frame: u64) -> Message<'static> {
    let dark = [[0; 10]; 70];
    let baseline = Baseline::new([0; 10], 25);
    let event = Event::new(frame, Sample::from_frames(&dark), &baseline);
    let mut answers = Answers::new(&event, &SpeedConfig::published(FrameRate::NOMINAL));
    answers.duration = Some(27);
    answers.speed = Ok(Speed::new(159.9));
    answers.direction = Direction::by_centroids(Ok(Heading::Up), 32_000);
    Message::Event(answers)
}

/// Returns the reports of these messages, and the end record if they have none.
fn reports(wanted: OutputOptions, messages: &[Message]) -> (Vec<Report>, Output) {
    numbered(wanted, (0..).zip(messages))
}

/// Returns the reports of messages with these sequence numbers.
fn numbered<'m>(
    wanted: OutputOptions,
    messages: impl IntoIterator<Item = (u16, &'m Message<'m>)>,
) -> (Vec<Report>, Output) {
    let (mut monitor, mut reports) = (Monitor::new(wanted), Vec::new());
    for (sequence, message) in messages {
        let give = |report| {
            reports.push(report);
            Ok::<_, Error>(())
        };
        monitor.take(encode(message, sequence, &mut [0; LONGEST]), give).unwrap();
    }
    (reports, monitor.finish())
}

fn note(text: &str) -> Report {
    Report::Note(text.to_owned())
}

fn end(frames: u64, baseline_complete: bool, incomplete: Option<InterruptedSample>) -> Output {
    Output::End(StreamSummary { frames, dropped: 0, baseline_complete, incomplete })
}

#[test]
fn a_board_that_starts_again_starts_from_nothing() {
    let said = note("board 1: 320x240 Gray at 30000/1001 frames per second, baseline of 25 frames");
    let (found, last) = numbered(OutputOptions::default(), [(0, &hello(0)), (1, &hello(90)), (0, &hello(0))]);
    assert_eq!(found, [Report::Started, said, note("the board has started again"), Report::Started]);
    assert_eq!(last, end(0, false, None));
}

#[test]
fn a_start_is_told_from_an_answer() {
    let said = note("board 1: 320x240 Gray at 30000/1001 frames per second, baseline of 25 frames");
    let again = note("the board has started again");
    // A board without frames is asked twice, then starts again.
    let (found, _) =
        numbered(OutputOptions::default(), [(0, &hello(0)), (1, &hello(0)), (2, &hello(0)), (0, &hello(0))]);
    assert_eq!(
        found,
        [Report::Started, said.clone(), Report::Started, Report::Started, again.clone(), Report::Started]
    );
    // Its first message was lost with the power, and so was the note of what was lost with it.
    let (found, last) = numbered(OutputOptions::default(), [(7, &hello(90)), (1, &hello(0))]);
    assert_eq!(found, [said, note("1 message lost"), again, Report::Started]);
    assert_eq!(last, end(0, false, None));
}

#[test]
fn an_end_that_the_board_does_not_tell_is_known_from_what_it_told() {
    let features = Message::Features { frame: 99, features: [0; 10] };
    let (found, last) = reports(OutputOptions::default(), &[features]);
    assert_eq!((found, last), (vec![], end(100, false, None)));
    let texture = TextureAnswer::new(wstac_core::model::file::Task::Pattern, Text::new("Saw"));
    let early = Message::Texture { frame: 200, frames: 40, texture };
    let under_way = Some(InterruptedSample::new(200, 40));
    assert_eq!(reports(OutputOptions::default(), &[early]).1, end(240, true, under_way));
    assert_eq!(reports(OutputOptions::default(), &[early, event(200)]).1, end(270, true, None));
}

#[test]
fn a_sample_is_whole_and_of_its_event_or_none() {
    let wanted = OutputOptions { samples: true, ..OutputOptions::default() };
    let part = |frame, first| Message::SamplePart { frame, first, features: [[i16::from(first) * 64; 10]; 10] };
    let parts = |frame| (0..7).map(move |number| part(frame, 10 * number)).collect::<Vec<_>>();
    let sample = |messages: &[Message]| {
        let (found, _) = reports(wanted, messages);
        match found.last() {
            Some(Report::Output(Output::Event(event))) => event.sample.clone(),
            _ => panic!("{found:?}"),
        }
    };
    let whole = sample(&[parts(7), vec![event(7)]].concat()).unwrap();
    assert_eq!((whole.len(), whole[9].len()), (70, 10));
    assert_eq!((whole[0][9], whole[9][9], whole[10][9], whole[69][0]), (0, 0, 640, 3840));
    // A part is missing, is of another event, or does not exist.
    assert_eq!(sample(&[&parts(7)[1..], &[event(7)]].concat()), None);
    assert_eq!(sample(&[&parts(7)[..6], &[part(8, 60), event(7)]].concat()), None);
    for first in [61, 70, 255] {
        assert_eq!(sample(&[&parts(7)[..6], &[part(7, first), event(7)]].concat()), None);
    }
    let (found, _) = reports(wanted, &[event(7)]);
    assert_eq!(found[0], note("the sample of the event at frame 7 did not arrive"));
}

#[test]
fn numbers_that_cannot_be_are_borne() {
    let texture = TextureAnswer::new(wstac_core::model::file::Task::Depth, Text::new("inf"));
    let last = u64::MAX;
    let early = Message::Texture { frame: last, frames: 255, texture };
    let lost = Message::Lost { frames: last };
    let incomplete = Message::InterruptedSample(InterruptedSample::new(last, 255));
    let features = Message::Features { frame: last, features: [i16::MIN; 10] };
    let (found, record) = reports(OutputOptions::default(), &[early, event(last), lost, lost, incomplete, features]);
    assert_eq!(found.len(), 5);
    let all = StreamSummary { frames: last, dropped: last, baseline_complete: true, incomplete: None };
    assert_eq!(record, Output::End(all));
}

#[test]
fn a_board_whose_model_has_no_answer_has_a_model() {
    use wstac_core::model::file::Task;
    use wstac_core::wire::ModelFacts;

    use crate::texture::NoTexture;

    let with_model = match hello(0) {
        Message::Hello(hello) => {
            Message::Hello(Hello { models: [Some(ModelFacts::new(Task::Specimen, 10, 28)), None, None], ..hello })
        }
        other => other,
    };
    for (hello, expected) in [(hello(0), NoTexture::NoModel), (with_model, NoTexture::Unanswered)] {
        let (found, _) = reports(OutputOptions::default(), &[hello, event(200)]);
        let Some(Report::Output(Output::Event(event))) = found.last() else { panic!("{found:?}") };
        assert_eq!(event.texture, Err(expected));
    }
}
