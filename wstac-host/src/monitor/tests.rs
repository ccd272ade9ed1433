//! Tests that the command's own tests do not cover: boards that start again, that are newer, or that send impossible
//! messages.

use wstac_core::crc::crc32;
use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::direction::{Direction, Heading};
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::{Speed, SpeedConfig};
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample, StreamEnd, TriggerConfig};
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::{Contact, Velocity};
use wstac_core::touch::slip::Slip;
use wstac_core::wire::{Answers, Hello, LONGEST, Outbox, Telemetry, Text, TextureAnswer, Wanted, encode};

use super::*;
use crate::output::StreamSummary;

pub(super) fn hello(frame: u64) -> Message<'static> {
    Message::Hello(Hello {
        firmware: Text::new("board"),
        version: Text::new("1"),
        size: FrameSize::new(320, 240).unwrap(),
        format: PixelFormat::Gray,
        rate: FrameRate::new(30_000, 1001).unwrap(),
        trigger: TriggerConfig::default(),
        models: [None; 3],
        frame,
        revision: Text::new(""),
        id: None,
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
        monitor.take(encode(message, sequence, &mut [0; LONGEST]), |report| reports.push(report)).unwrap();
    }
    (reports, monitor.finish())
}

/// Returns what is requested of a board that has started.
fn started() -> Vec<Report> {
    let outputs =
        [Request::Features(false), Request::Samples(false), Request::Motion(false), Request::KeepEvents(true)];
    outputs.map(Report::Request).into()
}

fn note(text: &str) -> Report {
    Report::Note(text.to_owned())
}

fn end(frames: u64, baseline_complete: bool, incomplete: Option<InterruptedSample>) -> Output {
    Output::End(StreamSummary { frames, baseline_complete, incomplete, ..StreamSummary::default() })
}

#[test]
fn a_board_that_starts_again_starts_from_nothing() {
    let said = note("board 1: 320x240 Gray at 30000/1001 frames per second, baseline of 25 frames");
    let (found, last) = numbered(OutputOptions::default(), [(0, &hello(0)), (1, &hello(90)), (0, &hello(0))]);
    assert_eq!(found, [&started(), &[said, note("the board has started again")][..], &started()].concat());
    assert_eq!(last, end(0, false, None));
}

#[test]
fn a_start_is_told_from_an_answer() {
    let said = note("board 1: 320x240 Gray at 30000/1001 frames per second, baseline of 25 frames");
    let again = note("the board has started again");
    // A board without frames is asked twice, then starts again.
    let (found, _) =
        numbered(OutputOptions::default(), [(0, &hello(0)), (1, &hello(0)), (2, &hello(0)), (0, &hello(0))]);
    let expected = [&started(), &[said.clone()][..], &started(), &started(), std::slice::from_ref(&again), &started()];
    assert_eq!(found, expected.concat());
    // Its first message was lost with the power, and so was the note of what was lost with it.
    let (found, last) = numbered(OutputOptions::default(), [(7, &hello(90)), (1, &hello(0))]);
    assert_eq!(found, [&[said, note("1 message lost"), again][..], &started()].concat());
    assert_eq!(last, end(0, false, None));
}

#[test]
fn an_end_that_the_board_does_not_tell_is_known_from_what_it_told() {
    for (frame, baseline_complete) in [(23, false), (24, true)] {
        let features = Message::Features { frame, features: [0; 10] };
        let (found, last) = reports(OutputOptions::default(), &[features]);
        assert_eq!((found, last), (vec![], end(frame + 1, baseline_complete, None)));
    }
    let texture = TextureAnswer::new(wstac_core::model::file::Task::Pattern, Text::new("Saw"));
    let early = Message::Texture { frame: 200, frames: 40, texture };
    let under_way = Some(InterruptedSample::new(200, 40));
    assert_eq!(reports(OutputOptions::default(), &[early]).1, end(240, true, under_way));
    assert_eq!(reports(OutputOptions::default(), &[early, event(200)]).1, end(270, true, None));
}

#[test]
fn a_slide_without_a_velocity_has_one_reason_for_speed_and_direction() {
    for reason in [Reason::Turning, Reason::SpeedChanges, Reason::NoSlide(Contact::Press)] {
        let Message::Event(mut answers) = event(0) else { unreachable!() };
        answers.contact = Some(if let Reason::NoSlide(contact) = reason { contact } else { Contact::Slide });
        (answers.speed, answers.direction) = (Err(reason), Direction::by_arrival(Err(reason)));
        answers.reliable = false;
        let (found, _) = reports(OutputOptions::default(), &[Message::Event(answers)]);
        let Some(Report::Output(Output::Event(event))) = found.last() else { panic!("{found:?}") };
        assert_eq!((event.speed.err(), event.direction.degrees.err()), (Some(reason), Some(reason)));
    }
    let Message::Event(mut answers) = event(0) else { unreachable!() };
    answers.direction = Direction::by_centroids(Err(Reason::NoOrder), 0);
    (answers.speed, answers.reliable) = (Err(Reason::NeverValid), false);
    let (found, _) = reports(OutputOptions::default(), &[Message::Event(answers)]);
    let Some(Report::Output(Output::Event(event))) = found.last() else { panic!("{found:?}") };
    assert_eq!(event.direction.degrees, Err(Reason::NoOrder));
}

#[test]
fn a_sample_is_whole_and_of_its_event_or_none() {
    let wanted = OutputOptions { samples: true, ..OutputOptions::default() };
    let part = |frame, first| Message::SamplePart { frame, first, features: [[i16::from(first) * 32; 10]; 10] };
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
    assert_eq!((whole[0][9], whole[9][9], whole[10][9], whole[69][0]), (0, 0, 320, 1920));
    // A part is missing, is of another event, or does not exist.
    assert_eq!(sample(&[&parts(7)[1..], &[event(7)]].concat()), None);
    assert_eq!(sample(&[&parts(7)[..6], &[part(8, 60), event(7)]].concat()), None);
    for first in [61, 70, 255] {
        assert_eq!(sample(&[&parts(7)[..6], &[part(7, first), event(7)]].concat()), None);
    }
    let (found, _) = reports(wanted, &[event(7)]);
    assert_eq!(found[1], note("the sample of the event at frame 7 did not arrive"));
}

#[test]
fn the_largest_numbers_are_borne_and_impossible_ones_are_refused_and_counted() {
    let texture = TextureAnswer::new(wstac_core::model::file::Task::Depth, Text::new("inf"));
    let last = 1 << 53;
    let early = Message::Texture { frame: last, frames: 70, texture };
    let lost = Message::Lost { frames: last };
    let incomplete = Message::InterruptedSample(InterruptedSample::new(last, 69));
    let features = Message::Features { frame: last, features: [i16::MIN; 10] };
    let (found, record) = reports(OutputOptions::default(), &[early, event(last), lost, lost, incomplete, features]);
    assert_eq!(found.len(), 6);
    let (frames, dropped) = (last + 70, 2 * last);
    let all = StreamSummary { frames, dropped, baseline_complete: true, ..StreamSummary::default() };
    assert_eq!(record, Output::End(all));
    // Eleven events of 255 filled frames, and one message with a frame number that cannot be.
    let Message::Event(mut answers) = event(35) else { panic!("an event") };
    answers.frames_filled = 255;
    let mut bad = vec![Message::Event(answers); 11];
    bad.push(Message::Lost { frames: u64::MAX });
    let (found, record) = reports(OutputOptions::default(), &bad);
    let refused = |count| note(&format!("{count} of the board refused: impossible number of frames"));
    assert_eq!(found, [refused("1 message"), refused("10 messages")]);
    assert_eq!(record, end(0, false, None));
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

/// A line that loses and changes bytes.
struct Line {
    random: fastrand::Rng,
    /// The bytes of 10,000 that are lost, and the same number are changed.
    errors: usize,
}

impl Line {
    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut arrived = Vec::new();
        for &byte in bytes {
            if self.random.usize(..10_000) < self.errors {
                continue;
            }
            let change = if self.random.usize(..10_000) < self.errors { 1 << self.random.u8(..8) } else { 0 };
            arrived.push(byte ^ change);
        }
        arrived
    }
}

/// A board and a host with a line between them.
struct Linked {
    line: Line,
    outbox: Outbox<'static>,
    decoder: Decoder<16>,
    sequence: u16,
    monitor: Monitor,
    requests: u16,
    /// The frames of events that arrived.
    arrived: Vec<u64>,
    lost: u64,
    /// The messages that were sent, and those of them that did not arrive whole.
    sent: u64,
    damaged: u64,
}

impl Linked {
    fn new(seed: u64, errors: usize) -> Self {
        let mut linked = Self {
            line: Line { random: fastrand::Rng::with_seed(seed), errors },
            outbox: Outbox::new(),
            decoder: Decoder::new(),
            sequence: 0,
            monitor: Monitor::new(OutputOptions::default()),
            requests: 0,
            arrived: Vec::new(),
            lost: 0,
            sent: 0,
            damaged: 0,
        };
        let requests: Vec<Request> = linked.monitor.requests().collect();
        linked.request(&requests);
        linked
    }

    /// Sends requests from the host.
    fn request(&mut self, requests: &[Request]) {
        for request in requests {
            let bytes = self.line.carry(encode(request, self.requests, &mut [0; LONGEST]));
            self.requests = self.requests.wrapping_add(1);
            for byte in bytes {
                if let Some(Ok(received)) = self.decoder.push::<Request>(byte) {
                    self.outbox.answer(received.message);
                }
            }
        }
    }

    /// Sends a message from the board.
    fn send(&mut self, message: &Message) {
        let mut buffer = [0; LONGEST];
        let whole = encode(message, self.sequence, &mut buffer);
        self.sequence = self.sequence.wrapping_add(1);
        let bytes = self.line.carry(whole);
        self.sent += 1;
        self.damaged += u64::from(bytes != whole);
        let mut requests = Vec::new();
        let taken = self.monitor.take(&bytes, |report| match report {
            Report::Request(request) => requests.push(request),
            Report::LostEvents(lost) => self.lost += lost,
            Report::Output(Output::Event(event)) => self.arrived.push(event.frame),
            _ => {}
        });
        assert!(taken.unwrap());
        self.request(&requests);
    }

    /// Lets this many events happen, one every 2.4 seconds, and the time for the last ones. `is_cut` says in which
    /// seconds the line is cut.
    fn run(&mut self, events: u64, is_cut: impl Fn(u32) -> bool) {
        let errors = self.line.errors;
        let end = 10_000 + 2400 * events as u32;
        for now in (0..end).step_by(10) {
            self.line.errors = if is_cut(now / 1000) { 10_000 } else { errors };
            if now >= 5000 && (now - 5000).is_multiple_of(2400) && (now - 5000) / 2400 < events as u32 {
                let Message::Event(answers) = event(u64::from(now)) else { panic!("an event") };
                let answers = self.outbox.push(answers, now);
                self.send(&Message::Event(answers));
            }
            if let Some(answers) = self.outbox.due(now) {
                self.send(&Message::Event(answers));
            }
            if now.is_multiple_of(1000) {
                let mut telemetry = Telemetry::default();
                telemetry.uptime_ms = now.into();
                (telemetry.events, telemetry.kept) = (self.outbox.next_event(), self.outbox.kept());
                telemetry.wanted.kept_events = self.outbox.is_heard();
                self.send(&Message::Telemetry(telemetry));
            }
        }
    }
}

#[test]
fn every_event_arrives_once_over_a_line_that_loses_and_changes_bytes() {
    for (seed, errors, least) in [(1, 0, 0.0), (2, 20, 0.1), (3, 50, 0.25), (4, 100, 0.4)] {
        let mut linked = Linked::new(seed, errors);
        linked.run(1000, |_| false);
        let expected: Vec<u64> = (0..1000).map(|event| 5000 + 2400 * event).collect();
        linked.arrived.sort_unstable();
        if errors <= 50 {
            assert_eq!(linked.arrived, expected, "seed {seed}");
            assert_eq!(linked.lost, 0, "seed {seed}");
        } else {
            // Where half of all messages are damaged, some events are given up. Each of them is counted.
            assert!(linked.arrived.is_sorted_by(|a, b| a < b), "seed {seed}: an event arrived twice");
            assert_eq!(linked.arrived.len() as u64 + linked.lost, 1000, "seed {seed}");
            assert!(linked.lost <= 10, "seed {seed}: {}", linked.lost);
        }
        // The line is as bad as is meant.
        let damaged = linked.damaged as f64 / linked.sent as f64;
        assert!(damaged >= least && (damaged > 0.0) == (errors > 0), "seed {seed}: {damaged}");
    }
}

#[test]
fn events_that_are_given_up_are_counted() {
    let mut linked = Linked::new(5, 20);
    // The line is cut for ten seconds of every minute.
    linked.run(500, |second| second % 60 >= 50);
    let (arrived, lost) = (linked.arrived.len() as u64, linked.lost);
    assert_eq!(arrived + lost, 500);
    let end = serde_json::to_value(crate::json::JsonLine::new(&linked.monitor.finish())).unwrap();
    assert_eq!(end["lost_events"], lost);
    assert!(lost >= 20, "{lost}");
    linked.arrived.sort_unstable();
    linked.arrived.dedup();
    assert_eq!(linked.arrived.len() as u64, arrived);
}

#[test]
fn requests_that_were_lost_are_repeated_but_not_for_ever() {
    let mut telemetry = Telemetry::default();
    let (found, _) = reports(OutputOptions::default(), &[Message::Telemetry(telemetry); 20]);
    assert_eq!(found.iter().filter(|&report| *report == Report::Request(Request::KeepEvents(true))).count(), 10);
    let mut wanted = Wanted::default();
    wanted.kept_events = true;
    telemetry.wanted = wanted;
    let (found, _) = reports(OutputOptions::default(), &[Message::Telemetry(telemetry)]);
    assert_eq!(found, [Report::Telemetry(telemetry, None)]);
}

#[test]
fn a_start_whose_first_message_was_lost_is_known_by_the_uptime() {
    let at = |uptime_ms| {
        let mut telemetry = Telemetry::default();
        (telemetry.uptime_ms, telemetry.wanted.kept_events) = (uptime_ms, true);
        Message::Telemetry(telemetry)
    };
    let (found, _) = reports(OutputOptions::default(), &[at(9000), event(70), at(900), event(70)]);
    let again = found.iter().filter(|&report| *report == note("the board has started again")).count();
    let events = found.iter().filter(|report| matches!(report, Report::Output(Output::Event(_)))).count();
    assert_eq!((again, events), (1, 2));
}

/// Checks the numbers of an output as its documentation says.
fn assert_possible(output: &Output) {
    let speed_is_possible = |mm_s: f32, sd: f32| mm_s > 0.0 && mm_s.is_finite() && sd >= 0.0 && sd.is_finite();
    match output {
        Output::Event(event) => {
            assert!(event.frame <= 1 << 53 && event.frames_filled <= 70, "{event:?}");
            assert!(event.lit_frames.is_none_or(|frames| frames < 70), "{event:?}");
            assert!(event.speed.is_err() || matches!(event.contact, None | Some(Contact::Slide)), "{event:?}");
            if let Ok(speed) = event.speed {
                assert!(speed_is_possible(speed.mm_s, speed.sd.unwrap_or(0.0)), "{event:?}");
            }
            if let Err(Reason::CutOff { at_most: Some(mm_s) }) = event.speed {
                assert!(speed_is_possible(mm_s, 0.0), "{event:?}");
            }
            assert!(event.direction.degrees.is_err() || (0.0..360.0).contains(&event.direction.degrees.unwrap()));
            assert!(event.direction.sd.is_none_or(|sd| sd >= 0.0 && sd.is_finite()), "{event:?}");
            assert!(event.direction.confidence().is_none_or(|confidence| confidence <= 1.0), "{event:?}");
            assert!(event.time.is_none_or(|time| time.touch_s >= 0.0 && time.completed_s.is_finite()), "{event:?}");
            if let Ok(texture) = &event.texture {
                assert_possible_texture(texture);
            }
        }
        Output::EarlyTexture(early) => {
            assert!((1..=70).contains(&early.frames), "{early:?}");
            assert_possible_texture(&early.texture);
        }
        Output::Motion(motion) => {
            let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = motion.velocity;
            assert!(speed_is_possible(mm_s, mm_s_sd) && degrees_sd >= 0.0 && degrees_sd.is_finite(), "{motion:?}");
            assert!((0.0..360.0).contains(&degrees), "{motion:?}");
        }
        Output::Interrupted(sample) => assert!(sample.frame <= 1 << 53 && sample.frames < 70, "{sample:?}"),
        Output::Features(features) => assert!(features.features.iter().all(|&feature| feature < 3300)),
        Output::Slip(slip) => {
            assert!(slip.held_since_frame <= slip.onset_frame && slip.onset_frame <= slip.frame, "{slip:?}");
            assert!(slip.frame <= 1 << 53 && slip.strength > 0.0 && slip.strength.is_finite(), "{slip:?}");
        }
        Output::ContactEnd(end) => assert!(end.frame.max(end.event_frame) <= 1 << 53, "{end:?}"),
        _ => {}
    }
}

fn assert_possible_texture(texture: &crate::texture::Texture) {
    assert!(texture.confidence.is_none_or(|confidence| (0.0..=1.0).contains(&confidence)), "{texture:?}");
    assert!(texture.depth_mm.is_none_or(f64::is_finite), "{texture:?}");
}

/// Returns the content of a message's frame, from its sequence number to the message's end.
fn content(message: &Message) -> Vec<u8> {
    let mut buffer = [0; LONGEST];
    let frame = encode(message, 0, &mut buffer);
    let mut content = Vec::new();
    let mut rest = &frame[1..frame.len() - 1];
    while let [code, bytes @ ..] = rest {
        let (block, next) = bytes.split_at(usize::from(*code) - 1);
        content.extend(block);
        if *code < u8::MAX && !next.is_empty() {
            content.push(0);
        }
        rest = next;
    }
    content.truncate(content.len() - 4);
    content
}

/// Returns the frame of any content, with its checksum.
fn frame_of(content: &[u8]) -> Vec<u8> {
    let sum = crc32(content.iter().copied());
    let mut frame = vec![0];
    for block in [content, &sum.to_le_bytes()].concat().split(|&byte| byte == 0) {
        // Blocks of more than 254 bytes have a code of their own.
        let mut rest = block;
        while rest.len() > 253 {
            frame.push(255);
            frame.extend(&rest[..254.min(rest.len())]);
            rest = &rest[254.min(rest.len())..];
        }
        frame.push(rest.len() as u8 + 1);
        frame.extend(rest);
    }
    frame.push(0);
    frame
}

#[test]
fn whatever_the_numbers_of_a_whole_frame_are_only_possible_ones_are_given() {
    let Message::Event(answers) = event(200) else { panic!("an event") };
    let mut by_arrival = answers;
    (by_arrival.contact, by_arrival.touch, by_arrival.end) = (Some(Contact::Slide), Some(9), Some(40));
    by_arrival.speed = Ok(Speed::by_arrival(150.5, 2.5));
    by_arrival.direction = Direction::by_arrival(Ok([90.25, 1.5]));
    let mut texture = TextureAnswer::new(wstac_core::model::file::Task::Specimen, Text::new("Saw3"));
    (texture.confidence, texture.known) = (Some(32_000), Some(true));
    let mut cut_off = answers;
    cut_off.speed = Err(Reason::CutOff { at_most: Some(45.5) });
    let mut stream = StreamEnd::new(207);
    stream.incomplete = Some(InterruptedSample::new(200, 7));
    let mut velocity = Velocity::default();
    (velocity.mm_s, velocity.mm_s_sd, velocity.degrees, velocity.degrees_sd) = (120.5, 3.5, 350.5, 1.25);
    let messages = [
        hello(0),
        Message::Event(answers),
        Message::Event(by_arrival.with_texture(texture)),
        Message::Event(cut_off),
        Message::Texture { frame: 200, frames: 40, texture },
        Message::Motion { frame: 9, velocity, basis: None },
        Message::InterruptedSample(InterruptedSample::new(200, 7)),
        Message::Status { stream, dropped: 3 },
        Message::ContactEnd(ContactEnd::new(240, 200)),
        Message::Slip(Slip::new(300, 298, 240, 0.4)),
        Message::Features { frame: 9, features: [-2048; 10] },
        Message::Lost { frames: 3 },
    ];
    let mut contents = messages.map(|message| content(&message)).to_vec();
    // Unchanged messages arrive.
    assert!(
        contents
            .iter()
            .zip(&messages)
            .all(|(content, message)| { frame_of(content) == encode(message, 0, &mut [0; LONGEST]) })
    );
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    let mut random = fastrand::Rng::with_seed(7);
    let (mut outputs, mut refused) = (0, 0);
    for round in 0..200_000 {
        let which = random.usize(..contents.len());
        let original = contents[which].clone();
        // A number of a message takes one to four bytes. The version and the sequence stay.
        for _ in 0..=random.u8(..3) {
            let at = 2 + random.usize(..original.len() - 2);
            let value = [0, 0x7F, 0x80, 0xC0, 0xFF, random.u8(..)][random.usize(..6)];
            contents[which][at] = value;
        }
        let mut monitor = Monitor::new(wanted);
        let stream = [frame_of(&contents[0]), frame_of(&contents[which])].concat();
        let taken = monitor.take(&stream, |report| {
            if let Report::Output(output) = &report {
                assert_possible(output);
                outputs += 1;
            }
        });
        assert!(taken.is_ok(), "round {round}");
        refused += monitor.refused();
        contents[which] = original;
    }
    // Both happen often, so that something was tested.
    assert!(outputs > 20_000 && refused > 5_000, "{outputs} {refused}");
}

#[test]
fn a_board_is_refused_what_only_frames_take() {
    use crate::source::open::{OpenOptions, open};
    let (sent, default) = (concat!(env!("CARGO_MANIFEST_DIR"), "/examples/board.bin"), OpenOptions::default());
    let open = |name, options| open(name, &options, &[&line::Boards]);
    let refused = |name, options| open(name, options).map(|_| ()).unwrap_err().to_string();
    let size = OpenOptions { size: Some((640, 480)), ..default.clone() };
    assert!(
        refused(sent, size)
            .ends_with("board.bin: is a board, whose firmware sets the camera up; leave options of a camera out")
    );
    let baud = OpenOptions { baud: Some(9600), ..default.clone() };
    assert_eq!(refused("a.y4m", baud), "a.y4m: is no board; leave --baud out");
    let board = || crate::session::Session::builder(open(sent, default.clone()).unwrap());
    let models = [crate::model_file::ModelFile::open("builtin".as_ref()).unwrap()];
    for builder in [board().config(crate::config::Config::default()), board().models(models)] {
        let error = builder.build().unwrap_err().to_string();
        assert!(error.contains("is a board, which finds its events itself"), "{error}");
    }
}
