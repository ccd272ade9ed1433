//! Compares what a reader sends for simulated frames with the core's results for whole frames.

use std::vec::Vec;

use wstac_core::features::Features;
use wstac_core::green::gray::Gray;
use wstac_core::wire::{Decoder, LONGEST, encode};

use super::*;

const SIZE: u16 = 40;
const FRAME: usize = SIZE as usize * SIZE as usize;
/// The first lit frame of a touch, and the first dark one behind it.
const TOUCH: [u64; 2] = [40, 73];

/// The part of a message that is kept.
#[derive(Clone, Debug, PartialEq)]
enum Sent {
    Hello(u64),
    Features(u64, Features),
    Part(u64, u8, Vec<Features>),
    Event(u64, u8),
    /// The end of a touch, and the first frame of its event.
    End(u64, u64),
    Lost(u64),
    Status(u64, u64),
}

/// Sends messages through bytes, and keeps what arrives.
#[derive(Default)]
struct Log(Vec<Sent>);

impl Publisher for Log {
    fn send(&mut self, message: &Message<'_>) {
        let (mut buffer, mut decoder) = ([0; LONGEST], Decoder::<LONGEST>::new());
        for &byte in encode(message, 0, &mut buffer) {
            let Some(received) = decoder.push::<Message<'_>>(byte) else { continue };
            self.0.push(match received.unwrap().message {
                Message::Hello(hello) => Sent::Hello(hello.frame),
                Message::Features { frame, features } => Sent::Features(frame, features),
                Message::SamplePart { frame, first, features } => Sent::Part(frame, first, features.into()),
                Message::Event(answers) => Sent::Event(answers.frame, answers.frames_filled),
                Message::ContactEnd(end) => Sent::End(end.frame, end.event_frame),
                Message::Lost { frames } => Sent::Lost(frames),
                Message::Status { stream, dropped } => Sent::Status(stream.frames, dropped),
                // It comes with every status.
                Message::Telemetry(_) => continue,
                other => panic!("{other:?}"),
            });
        }
    }
}

fn layout() -> Layout {
    setup::layout(FrameSize::new(SIZE.into(), SIZE.into()).unwrap()).unwrap()
}

/// Returns a frame with a bright bar that moves down from frame 40 on, over a dark ground.
fn frame(t: usize) -> Vec<u8> {
    let mut frame = std::vec![2; FRAME];
    if (40..73).contains(&t) {
        frame.chunks_mut(SIZE.into()).skip(t - 40).take(3).for_each(|row| row.fill(200));
    }
    frame
}

/// Returns a frame of a touch of all taxels that is longer than two samples.
fn long(t: usize) -> Vec<u8> {
    std::vec![if (40..200).contains(&t) { 200 } else { 2 }; FRAME]
}

fn reader() -> Reader {
    let law = setup::law(FrameRate::NOMINAL).unwrap();
    let mut reader = Reader::new(layout(), layout().frame(), FrameRate::NOMINAL, law).unwrap();
    reader.state_readout(ReadoutTime::GLOBAL);
    reader
}

/// Takes frames in stripes of four rows, with room for this many parts of a sample after each frame.
fn run(reader: &mut Reader, frames: core::ops::Range<usize>, parts_a_frame: usize, log: &mut Log) {
    run_of(frame, reader, frames, parts_a_frame, log);
}

/// Takes frames of another stream in the same way.
fn run_of(
    frame: impl Fn(usize) -> Vec<u8>,
    reader: &mut Reader,
    frames: core::ops::Range<usize>,
    parts_a_frame: usize,
    log: &mut Log,
) {
    for t in frames {
        for rows in frame(t).chunks(4 * usize::from(SIZE)) {
            reader.rows(rows, log).unwrap();
        }
        for _ in 0..parts_a_frame {
            reader.send_held(log);
        }
    }
}

/// Returns the event of the same frames, taken whole: its first frame and its sample.
fn expected(lost: core::ops::Range<usize>) -> (u64, Vec<Features>) {
    let camera = FrameGeometry::new(Gray, layout(), FrameRate::NOMINAL).unwrap();
    let mut pipeline = setup::pipeline(camera).unwrap();
    for t in 0..130 {
        let update = if lost.contains(&t) { pipeline.push_lost(1) } else { pipeline.push_frame(&frame(t)).unwrap() };
        if let Some(event) = update.event() {
            return (event.frame, event.sample.frames().copied().collect());
        }
    }
    panic!("no event: the frames show less than they should")
}

fn events(log: &Log) -> Vec<&Sent> {
    log.0.iter().filter(|sent| matches!(sent, Sent::Event(..))).collect()
}

#[test]
fn events_are_those_of_whole_frames_and_nothing_else_is_sent_unasked() {
    let mut log = Log::default();
    run(&mut reader(), 0..130, 0, &mut log);
    let first = expected(0..0).0;
    log.0.retain(|sent| !matches!(sent, Sent::Status(frames, 0) if frames % 30 == 0));
    // The light has left before the sample is complete.
    assert_eq!(log.0, [Sent::Event(first, 0), Sent::End(TOUCH[1], first)]);
}

/// Does the work of an interrupt whenever a message is sent.
struct Interrupted(Log);

impl Publisher for Interrupted {
    fn send(&mut self, message: &Message<'_>) {
        // SAFETY: the one thread that runs this test calls it.
        #[allow(unsafe_code)]
        unsafe {
            crate::meanwhile::interrupt();
        }
        self.0.send(message);
    }
}

#[test]
fn rows_that_an_interrupt_takes_while_a_frame_is_used_are_those_of_the_next_one() {
    let (mut whole, mut of_whole) = (reader(), Log::default());
    let (mut reader, mut log) = (reader(), Interrupted(Log::default()));
    for reader in [&mut whole, &mut reader] {
        reader.answer(Request::Features(true), &mut Log::default());
    }
    run(&mut whole, 0..130, 0, &mut of_whole);
    let (stripe, last) = (4 * usize::from(SIZE), FRAME - usize::from(SIZE));
    let (mut at, mut early) = (0, 0);
    for t in 0..130 {
        let (here, next) = (frame(t), frame(t + 1));
        while at < last {
            let end = (at + stripe).min(last);
            reader.rows(&here[at..end], &mut log).unwrap();
            at = end;
        }
        at = 0;
        // Two stripes are there before a message is sent, and two more before each.
        let more = |sums: &mut NextFrame<'_, _>| {
            for _ in 0..2 {
                at += if sums.push_stripe(&next[at..FRAME.min(at + stripe)]).unwrap() { stripe } else { 0 };
            }
        };
        reader.last_rows(&here[last..], &mut log, more).unwrap();
        early = early.max(at);
    }
    assert_eq!(log.0.0, of_whole.0);
    assert!(events(&log.0).len() == 1 && early >= 6 * stripe, "{early}");
}

#[test]
fn a_host_gets_what_it_asks_for() {
    let (mut reader, mut log) = (reader(), Log::default());
    reader.answer(Request::Features(true), &mut log);
    run(&mut reader, 0..2, 0, &mut log);
    reader.answer(Request::Hello, &mut log);
    reader.answer(Request::Features(false), &mut log);
    run(&mut reader, 2..4, 0, &mut log);
    let features = &expected(0..0).1[0];
    assert_eq!(log.0, [Sent::Features(0, *features), Sent::Features(1, *features), Sent::Hello(2)]);
}

#[test]
fn a_sample_arrives_whole_when_its_parts_are_spread_over_frames() {
    let (first, sample) = expected(0..0);
    for parts_a_frame in [1, 2, 11] {
        let (mut reader, mut log) = (reader(), Log::default());
        reader.answer(Request::Samples(true), &mut log);
        run(&mut reader, 0..130, parts_a_frame, &mut log);
        log.0.retain(|sent| !matches!(sent, Sent::Status(..)));
        let parts = (0_u8..).step_by(SAMPLE_PART).zip(sample.chunks(SAMPLE_PART));
        let mut wanted: Vec<_> = parts.map(|(at, part)| Sent::Part(first, at, part.into())).collect();
        wanted.extend([Sent::Event(first, 0), Sent::End(TOUCH[1], first)]);
        assert_eq!(log.0, wanted, "{parts_a_frame} parts a frame");
    }
}

#[test]
fn parts_that_come_too_late_are_left_out_and_the_event_still_comes() {
    let first = expected(0..0).0;
    let (mut reader, mut log) = (reader(), Log::default());
    reader.answer(Request::Samples(true), &mut log);
    // One frame more than the sample has, and its first frame has left the ring.
    run(&mut reader, 0..(first as usize + SAMPLE_FRAMES + 1), 0, &mut log);
    reader.send_held(&mut log);
    reader.send_held(&mut log);
    log.0.retain(|sent| !matches!(sent, Sent::Status(..)));
    assert_eq!(log.0, [Sent::Event(first, 0), Sent::End(TOUCH[1], first)]);
}

#[test]
fn a_touch_that_is_longer_than_samples_is_one_event_and_its_end_comes_later() {
    for parts_a_frame in [0, 1] {
        let (mut reader, mut log) = (reader(), Log::default());
        reader.answer(Request::Samples(parts_a_frame > 0), &mut log);
        run_of(long, &mut reader, 0..204, parts_a_frame, &mut log);
        log.0.retain(|sent| !matches!(sent, Sent::Status(..) | Sent::Part(..)));
        let first = log.0.iter().find_map(|sent| if let Sent::Event(frame, 0) = sent { Some(*frame) } else { None });
        let first = first.unwrap();
        assert!((26..=TOUCH[0]).contains(&first), "{first}");
        assert_eq!(log.0, [Sent::Event(first, 0)], "{parts_a_frame}");
        // The fifth dark frame shows that the light has left.
        run_of(long, &mut reader, 204..300, parts_a_frame, &mut log);
        log.0.retain(|sent| !matches!(sent, Sent::Status(..)));
        assert_eq!(log.0, [Sent::Event(first, 0), Sent::End(200, first)], "{parts_a_frame}");
    }
}

#[test]
fn an_event_that_waits_for_its_sample_goes_out_before_the_next_one() {
    for wanted_still in [true, false] {
        let (mut reader, mut log) = (reader(), Log::default());
        reader.answer(Request::Samples(true), &mut log);
        run(&mut reader, 0..130, 0, &mut log);
        reader.answer(Request::Samples(wanted_still), &mut log);
        run(&mut reader, 0..130, 0, &mut log);
        while reader.send_held(&mut log) {}
        let first = expected(0..0).0;
        log.0.retain(|sent| matches!(sent, Sent::Event(..) | Sent::End(..)));
        let touches = [0, 130].map(|t| [Sent::Event(first + t, 0), Sent::End(TOUCH[1] + t, first + t)]);
        assert_eq!(log.0, touches.concat(), "{wanted_still}");
    }
}

#[test]
fn lost_frames_are_told_of_and_keep_their_place() {
    let (mut reader, mut log) = (reader(), Log::default());
    run(&mut reader, 0..50, 0, &mut log);
    // The first half of a frame is followed by two frames that did not come.
    reader.rows(&frame(50)[..FRAME / 2], &mut log).unwrap();
    reader.abandon_frame(&mut log);
    reader.lost(2, &mut log);
    run(&mut reader, 53..130, 0, &mut log);
    assert_eq!(reader.dropped(), 3);
    assert_eq!(events(&log), [&Sent::Event(expected(50..53).0, 3)]);
    let lost: Vec<_> = log.0.iter().filter(|sent| matches!(sent, Sent::Lost(_))).collect();
    assert_eq!(lost, [&Sent::Lost(1), &Sent::Lost(2)]);
    assert!(log.0.contains(&Sent::Status(60, 3)));
}

#[test]
fn rows_of_another_width_are_refused() {
    let (mut reader, mut log) = (reader(), Log::default());
    let error = reader.rows(&[0; SIZE as usize + 1], &mut log).unwrap_err();
    assert_eq!(error, FrameError::StripeNotWholeRows { found: 41, bytes_per_row: 40 });
}

/// Returns the number and what is kept of each event that was sent.
#[derive(Default)]
struct Numbers(Vec<(u16, u8)>, Option<Telemetry>);

impl Publisher for Numbers {
    fn send(&mut self, message: &Message<'_>) {
        match message {
            Message::Event(answers) => self.0.push((answers.number, answers.kept)),
            Message::Telemetry(telemetry) => self.1 = Some(*telemetry),
            _ => {}
        }
    }
}

#[test]
fn an_event_is_sent_again_until_the_host_has_it() {
    let (mut reader, mut log) = (reader(), Numbers::default());
    reader.answer(Request::KeepEvents(true), &mut log);
    let play = |reader: &mut Reader, log: &mut Numbers| {
        for t in 0..130 {
            reader.rows(&frame(t), log).unwrap();
        }
    };
    reader.set_time(1000_000);
    play(&mut reader, &mut log);
    assert_eq!(log.0, [(0, 0)]);
    assert!(!reader.send_again(&mut log));
    reader.set_time(1250_000);
    assert!(reader.send_again(&mut log) && !reader.send_again(&mut log));
    play(&mut reader, &mut log);
    reader.set_time(1600_000);
    while reader.send_again(&mut log) {}
    assert_eq!(log.0, [(0, 0), (0, 0), (1, 1), (0, 0), (1, 1)]);
    reader.status(&mut log);
    let telemetry = log.1.unwrap();
    assert_eq!((telemetry.uptime_ms, telemetry.events, telemetry.kept), (1600, 2, 2));
    assert!(telemetry.wanted.kept_events && !telemetry.wanted.features);
    for event in [0, 1] {
        reader.answer(Request::Acknowledge { event }, &mut log);
    }
    reader.set_time(9000_000);
    assert!(!reader.send_again(&mut log));
}
