//! Tests every message there and back, at its extremes, and the effects of damage.

use core::num::NonZeroU8;
use std::string::{String, ToString};
use std::vec::Vec;

use super::*;
use crate::crc::crc32;
use crate::green::any::PixelFormat;
use crate::green::bayer::BayerOrder;
use crate::layout::FrameSize;
use crate::model::file::Task;
use crate::model::forest::Forest;
use crate::paper::direction::{Direction, Heading};
use crate::paper::speed::Speed;
use crate::paper::trigger::{ContactEnd, InterruptedSample, Rule, StreamEnd, TriggerConfig};
use crate::rate::FrameRate;
use crate::reason::Reason;
use crate::texture::texture;
use crate::touch::motion::{Contact, Velocity};
use crate::touch::slip::Slip;
use crate::touch::wave::{Basis, Extent, Measured};

static MODEL: Forest<'static> = crate::include_model!(Forest, "../../tests/models/small.wsm");
const LONGEST_NAME: &str = "the name of a class is at most this long: 63 bytes, in UTF-8 é";
const LONGEST_REASON: &str = concat!(
    "panicked at the very end of a long path, in a function of a long name, with a message that goes on and on, ",
    "so long that what is said in it can only be said in part, because the rest is behind the end"
);

/// The largest number of a frame.
const LAST: u64 = 1 << 53;

fn hello(frame: u64) -> Hello<'static> {
    Hello {
        firmware: Text::new("a firmware whose name fills 31 b"),
        version: Text::new("1234567.1234567.1234567-beta.123"),
        size: FrameSize::new(16_384, 16_384).unwrap(),
        format: PixelFormat::Bayer12(BayerOrder::Gbrg),
        rate: FrameRate::new(u32::MAX, u32::MAX).unwrap(),
        trigger: TriggerConfig::new(70, 65_535.999, 0, Rule::Signed, 65_535.999).unwrap(),
        models: [Some(ModelFacts { task: Task::Depth, classes: 64, frames: 70 }); 3],
        frame,
        revision: Text::new("0123456789abcde"),
        id: Some([u32::MAX; 3]),
    }
}

fn answers() -> Answers<'static> {
    Answers {
        frame: LAST,
        touch: Some(i16::MIN),
        end: Some(70),
        contact: Some(Contact::Slide),
        duration: Some(69),
        speed: Ok(Speed::by_arrival(600.5, 3.25)),
        direction: Direction::by_arrival(Ok([359.75, 0.5])),
        textures: [Some(TextureAnswer {
            task: Task::Specimen,
            label: Text::new(LONGEST_NAME),
            confidence: Some(32_768),
            known: Some(true),
        }); 3],
        frames_filled: 70,
        reliable: false,
        number: u16::MAX,
        kept: u8::MAX,
        doubt: Some(Reason::Uncertain),
        basis: Some(Basis::Outline),
        extent: Some(Extent {
            place_mm: Some(Measured { value: -13.5, sd: 0.25 }),
            width_mm: Some(Measured { value: 18.5, sd: 0.5 }),
            contacts: 1,
        }),
        frames: NonZeroU8::new(69),
    }
}

fn telemetry() -> Telemetry {
    Telemetry {
        uptime_ms: LAST,
        millihertz: Some(u32::MAX),
        overruns: Some(u32::MAX),
        restarts: Some(u32::MAX),
        stack: Some(u32::MAX),
        temperature: Some(2000),
        events: u16::MAX,
        kept: u8::MAX,
        wanted: Wanted { features: true, samples: true, motion: true, kept_events: true },
        last_frame: Some(FrameTime { frame: LAST, board_us: LAST }),
    }
}

/// Returns answers of which as much as possible is absent or zero.
fn short_answers() -> Answers<'static> {
    Answers {
        frame: 0,
        touch: None,
        end: None,
        contact: None,
        duration: None,
        speed: Ok(Speed::new(159.9)),
        direction: Direction::by_centroids(Ok(Heading::Left), 0),
        textures: [None; 3],
        frames_filled: 0,
        reliable: false,
        number: 0,
        kept: 0,
        doubt: None,
        basis: None,
        extent: None,
        frames: None,
    }
}

/// Returns every message at its longest, then some others.
fn messages() -> Vec<Message<'static>> {
    let incomplete = InterruptedSample { frame: LAST, frames: 69 };
    let stream =
        StreamEnd { frames: LAST, baseline_complete: true, baseline_quiet: true, incomplete: Some(incomplete) };
    let short = short_answers();
    let mut all = Vec::from([
        Message::Hello(hello(LAST)),
        Message::Features { frame: LAST, features: [i16::MIN; 10] },
        Message::SamplePart { frame: LAST, first: 60, features: [[i16::MIN; 10]; 10] },
        Message::Event(answers()),
        Message::Texture { frame: LAST, frames: 69, texture: answers().textures[0].unwrap() },
        Message::InterruptedSample(incomplete),
        Message::Lost { frames: LAST },
        Message::Fault(Fault::LastRun(Text::new(LONGEST_REASON))),
        Message::Status { stream, dropped: LAST },
        Message::End { stream, dropped: LAST },
        Message::Hello(Hello { models: [None; 3], firmware: Text::new(""), ..hello(7) }),
        Message::Event(short),
        Message::Event(Answers {
            contact: Some(Contact::Press),
            speed: Err(Reason::NoSlide(Contact::Press)),
            direction: Direction::by_arrival(Err(Reason::NoSlide(Contact::Press))),
            ..short
        }),
        Message::Event(Answers {
            speed: Err(Reason::CutOff { at_most: Some(45.5) }),
            direction: Direction::by_centroids(Err(Reason::NoOrder), 32_768),
            ..short
        }),
        Message::ContactEnd(ContactEnd::new(LAST, LAST)),
        Message::Features { frame: 0, features: [3297; 10] },
        Message::Motion {
            frame: LAST,
            velocity: Velocity { mm_s: 0.5, mm_s_sd: 0.0, degrees: 0.0, degrees_sd: 9.5 },
            basis: Some(Basis::Edge),
        },
        Message::Telemetry(telemetry()),
        Message::Telemetry(Telemetry::default()),
        Message::Time { host_us: u64::MAX, board_us: LAST },
        Message::Fault(Fault::SensorUnknown { id: 0xFFFF }),
        Message::Fault(Fault::Overrun),
        Message::Fault(Fault::SensorRefuses { register: u16::MAX, values: None }),
        Message::PicturePart(PicturePart::new(u8::MAX, LAST, u32::MAX, &[u8::MAX; PICTURE_PART])),
        Message::PicturePart(PicturePart::new(0, 0, 0, &[0; 3])),
        Message::PictureEnd(PictureEnd::new(u8::MAX, u16::MAX, u32::MAX)),
    ]);
    // Those of a board with everything.
    #[cfg(feature = "learn")]
    all.extend(learned::tests::messages());
    #[cfg(feature = "models")]
    all.extend(models::tests::messages());
    all.extend([Message::Slip(Slip::new(LAST, LAST, 0, 0.4)), Message::Fault(sends_another_rate())]);
    all.extend([None, Some(Bootloader::Uf2), Some(Bootloader::Dfu)].map(Message::Bootloader));
    all.push(Message::Fault(Fault::SensorRefuses { register: u16::MAX, values: Some(not_kept()) }));
    all.extend([None, Some(BusLines::BothLow)].map(|lines| Message::Fault(Fault::SensorGone { lines })));
    all
}

fn not_kept() -> RegisterValues {
    RegisterValues { address: 0x21, found: 0x1F, expected: 0xFB }
}

fn sends_another_rate() -> Fault<'static> {
    let expected = FrameNumbers { lines: 240, words: 38_400, millihertz: 30_000 };
    let found = FrameNumbers { millihertz: 45_018, ..expected };
    Fault::SensorDiffers { part: FramePart::Rate, address: 0x21, register: 0x11, found, expected }
}

fn frame(message: &Message, sequence: u16) -> Vec<u8> {
    encode(message, sequence, &mut [0; LONGEST]).to_vec()
}

/// The result of a decoder, in words, so that nothing borrows it.
type Found = Result<(String, u16), DecodeError>;

fn received(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Found> {
    let mut all = Vec::new();
    for &byte in bytes {
        if let Some(found) = decoder.push::<Message>(byte) {
            all.push(found.map(|received| (std::format!("{:?}", received.message), received.lost)));
        }
    }
    all
}

#[expect(clippy::unnecessary_wraps, reason = "it is compared with what is found")]
fn arrived(message: &Message, lost: u16) -> Found {
    Ok((std::format!("{message:?}"), lost))
}

/// Checks that a message is read as it was written, and returns its frame.
pub(super) fn check_read(message: &Message) -> Vec<u8> {
    let bytes = frame(message, u16::MAX);
    let mut decoder = Decoder::<LONGEST>::new();
    let found = bytes.iter().filter_map(|&byte| match decoder.push::<Message>(byte) {
        Some(Ok(Received { message: found, lost: 0, .. })) => Some(found == *message),
        Some(other) => panic!("{message:?}: {other:?}"),
        None => None,
    });
    assert_eq!(found.collect::<Vec<_>>(), [true], "{message:?}");
    bytes
}

/// Checks that a board reads requests as they were written, and returns their numbers: behind the frame's zero and its
/// first code are version, sequence number and number.
#[cfg(feature = "settings")]
pub(super) fn check_requests(requests: &[Request]) -> Vec<u8> {
    let mut decoder = Decoder::<LONGEST_REQUEST>::new();
    let number = |request: &Request| {
        let bytes = encode(request, 7, &mut [0; LONGEST]).to_vec();
        let mut found = bytes.iter().filter_map(|&byte| decoder.push::<Request>(byte).map(Result::unwrap));
        assert_eq!(found.next().unwrap().message, *request);
        bytes[4]
    };
    requests.iter().map(number).collect()
}

#[test]
fn requests_have_their_numbers_whatever_the_features() {
    let number = |bytes: &[u8]| bytes[4];
    let mut buffer = [0; LONGEST];
    assert_eq!(number(encode(&Message::Bootloader(None), 1, &mut buffer)), 22);
    #[cfg(feature = "settings")]
    assert_eq!(number(encode(&Request::Settings, 1, &mut buffer)), 8);
    #[cfg(feature = "learn")]
    assert_eq!(number(encode(&Request::Textures, 1, &mut buffer)), 11);
    #[cfg(feature = "models")]
    assert_eq!(number(encode(&Request::Model, 1, &mut buffer)), 15);
    assert_eq!(number(encode(&Request::Bootloader, 1, &mut buffer)), 19);
}

#[test]
fn every_message_is_read_as_it_was_written() {
    let mut longest = 0;
    for message in messages() {
        let bytes = check_read(&message);
        longest = longest.max(bytes.len());
        assert_eq!((bytes[0], bytes[bytes.len() - 1]), (0, 0), "{message:?}");
        assert!(!bytes[1..bytes.len() - 1].contains(&0), "{message:?}");
    }
    // The longest message fits, and little room is left.
    assert!(longest > 256 && longest <= LONGEST, "{longest}");
}

#[test]
fn the_bytes_of_a_frame_are_these() {
    // Version 4, sequence 300, message 1 (features), frame 130, 20 bytes; CRC-32; no zero among them.
    let message = Message::Features { frame: 130, features: [257, -1, -2, -2048, 3296, 258, 259, 260, 261, -13_000] };
    let content = [
        &[4, 0xAC, 2, 1, 0x82, 1, 20][..],
        &[1, 1, 0xFF, 0xFF, 0xFE, 0xFF, 0, 0xF8, 0xE0, 0xC, 2, 1, 3, 1, 4, 1, 5, 1, 0x38, 0xCD],
    ]
    .concat();
    let sum = crc32(content.iter().copied());
    let mut expected = [&[0, 14][..], &content[..13], &[18], &content[14..], &sum.to_le_bytes()].concat();
    expected.push(0);
    assert_eq!(frame(&message, 300), expected);
    // An event: a slide from frame 45 to 73, 159.9 ± 1.5 mm/s in 27 frames, 90.5 ± 0.75°, one known texture of
    // a confidence of 32000/32768, no frame filled, reliable, event 300, the one before it is kept, no doubt, by
    // an edge, no extent.
    let texture = Some(TextureAnswer {
        confidence: Some(32_000),
        known: Some(true),
        ..TextureAnswer::new(Task::Specimen, Text::new("Saw3"))
    });
    let event = Answers {
        frame: 35,
        touch: Some(10),
        end: Some(38),
        contact: Some(Contact::Slide),
        duration: Some(27),
        speed: Ok(Speed::by_arrival(159.9, 1.5)),
        direction: Direction::by_arrival(Ok([90.5, 0.75])),
        textures: [texture, None, None],
        reliable: true,
        number: 300,
        kept: 1,
        basis: Some(Basis::Edge),
        ..short_answers()
    };
    let content = [
        &[4, 0, 3, 35, 1, 20, 1, 38, 1, 0, 1, 27, 0][..],
        &159.9_f32.to_le_bytes(),
        &[1],
        &1.5_f32.to_le_bytes(),
        &[0, 0],
        &90.5_f32.to_le_bytes(),
        &[1],
        &0.75_f32.to_le_bytes(),
        &[0, 1, 1, 4],
        b"Saw3",
        // 32000 in seven bits a byte.
        &[1, 0x80, 0xFA, 1, 1, 1],
        &[0, 0, 0, 1, 0xAC, 2, 1, 0, 1, 0, 0, 0],
    ]
    .concat();
    assert_eq!(frame(&Message::Event(event), 0), frame_of(&content));
    // A board before version 0.4 sends neither reason nor basis, a newer one may send some that are not known here.
    let before = &content[..content.len() - 5];
    let plain = Answers { basis: None, ..event };
    let doubted = Answers { reliable: false, doubt: Some(Reason::LostFrames), ..event };
    for (last, answers) in [(&[][..], plain), (&[1, 7, 1, 0], doubted), (&[1, 99, 1, 0], event), (&[0, 1, 99], plain)] {
        let mut content = before.to_vec();
        // The byte in front of the number and of what is kept.
        content[before.len() - 4] = answers.reliable.into();
        let bytes = frame_of(&[&content, last].concat());
        assert_eq!(received(&mut Decoder::new(), &bytes), [arrived(&Message::Event(answers), 0)]);
    }
    assert_eq!((event.touch_frame(), event.end_frame()), (Some(45), Some(73)));
    // The check value of CRC-32 (IEEE).
    assert_eq!(crc32(*b"123456789"), 0xCBF4_3926);
}

#[test]
fn the_bytes_of_a_register_that_is_not_kept_are_these() {
    // Fault 7, the register, and since version 0.4 address and values.
    let content = [4, 0, 7, 7, 0x64, 1, 0x21, 0x1F, 0xFB];
    let message = Message::Fault(Fault::SensorRefuses { register: 0x64, values: Some(not_kept()) });
    assert_eq!(frame(&message, 0), frame_of(&content));
    let before = Message::Fault(Fault::SensorRefuses { register: 0x64, values: None });
    assert_eq!(received(&mut Decoder::new(), &frame_of(&content[..5])), [arrived(&before, 0)]);
}

#[test]
fn the_bytes_of_a_camera_that_does_not_answer_are_these() {
    // Fault 3, and since version 0.4 the lines of the bus.
    let gone = |lines| Message::Fault(Fault::SensorGone { lines });
    let all = [BusLines::PulledUp, BusLines::NotPulledUp, BusLines::DataLow, BusLines::ClockLow, BusLines::BothLow];
    for (number, lines) in (0..).zip(all) {
        assert_eq!(frame(&gone(Some(lines)), 0), frame_of(&[4, 0, 7, 3, 1, number]));
    }
    // An older board, and lines that are newer than this code.
    for content in [&[4, 0, 7, 3][..], &[4, 0, 7, 3, 1, 5]] {
        assert_eq!(received(&mut Decoder::new(), &frame_of(content)), [arrived(&gone(None), 0)]);
    }
}

#[test]
fn the_bytes_of_what_a_camera_sends_are_these() {
    let numbers = |rate: [u8; 3]| [&[0xF0, 1, 0x80, 0xAC, 2][..], &rate].concat();
    // Version 4, sequence 0, message 7 (a fault), fault 8, part 3 (the rate), address, register, found and expected.
    let content = [&[4, 0, 7, 8, 3, 0x21, 0x11][..], &numbers([0xDA, 0xDF, 2]), &numbers([0xB0, 0xEA, 1])].concat();
    let message = Message::Fault(sends_another_rate());
    assert_eq!(frame(&message, 0), frame_of(&content));
    // A host skips a fault or a part that it does not know, as one before version 0.4 skips this fault.
    for (place, number) in [(3, 9), (4, 4)] {
        let mut newer = content.clone();
        newer[place] = number;
        let bytes = [frame_of(&newer), frame(&message, 1)].concat();
        assert_eq!(received(&mut Decoder::new(), &bytes), [Err(DecodeError::Unknown), arrived(&message, 0)]);
    }
}

/// The numbers of reasons never change: boards and hosts may have different versions.
#[test]
fn every_reason_crosses_the_link_by_its_number() {
    let at_most = Some(45.5);
    let reasons = [
        (0, Reason::BaselineAbove),
        (1, Reason::NeverValid),
        (2, Reason::CutOff { at_most }),
        (3, Reason::OutsideLaw),
        (4, Reason::NoSlide(Contact::Poke)),
        (5, Reason::NeverLit),
        (6, Reason::NoOrder),
        (7, Reason::LostFrames),
        (8, Reason::Uneven),
        (9, Reason::Baseline),
        (10, Reason::FewWhiskers),
        (11, Reason::NotOver),
        (12, Reason::TooSlow),
        (13, Reason::TooFast),
        (14, Reason::NotAlike),
        (15, Reason::SpeedChanges),
        (16, Reason::NotCrossed),
        (17, Reason::OutOfLine),
        (18, Reason::Uncertain),
        (19, Reason::ReadoutUnknown),
        (20, Reason::Turning),
        (21, Reason::TwoObjects),
        (22, Reason::FasterCamera),
        (23, Reason::Slips),
    ];
    for (number, reason) in reasons {
        let mut bytes = [0; 16];
        assert_eq!(postcard::to_slice(&reason, &mut bytes).unwrap()[0], number, "{reason}");
        let contact = Contact::Unclear;
        let direction = Direction::by_arrival(Err(Reason::NoSlide(contact)));
        let of_touch = Answers { contact: Some(contact), direction, basis: None, extent: None, ..answers() };
        let event = Message::Event(Answers { speed: Err(reason), doubt: Some(reason), ..of_touch });
        assert_eq!(received(&mut Decoder::new(), &frame(&event, 0)), [arrived(&event, 0)], "{reason}");
    }
}

#[test]
fn every_truncation_and_every_changed_byte_is_refused() {
    for message in messages() {
        let bytes = frame(&message, 2);
        for length in 2..bytes.len() - 1 {
            let mut cut = bytes[..length].to_vec();
            cut.push(0);
            let found = received(&mut Decoder::new(), &cut);
            assert_eq!(found, [Err(DecodeError::Damaged)], "{message:?} of {length} bytes");
        }
        for at in 1..bytes.len() - 1 {
            for change in 1..=u8::MAX {
                let mut damaged = bytes.clone();
                damaged[at] ^= change;
                let found = received(&mut Decoder::new(), &damaged);
                // If a zero came in, there are two frames, or one and an empty one.
                assert!(found.iter().all(|one| *one == Err(DecodeError::Damaged)), "{message:?} byte {at} ^ {change}");
                assert!((1..=2).contains(&found.len()), "{message:?} byte {at} ^ {change}");
            }
        }
    }
}

#[test]
fn garbage_costs_no_message_and_gaps_are_counted() {
    let lost = |frames| Message::Lost { frames };
    let long = [7; 1000];
    let mut bytes = b"boot: 115200 8N1\r\n".to_vec();
    bytes.extend(frame(&lost(1), 65_534));
    bytes.extend(frame(&lost(2), 65_535));
    bytes.extend(long);
    bytes.extend(frame(&lost(3), 0));
    bytes.extend(&frame(&lost(4), 1)[..6]);
    bytes.extend(frame(&lost(5), 4));
    let damaged = Err(DecodeError::Damaged);
    let found = received(&mut Decoder::new(), &bytes);
    let expected = [
        damaged.clone(),
        arrived(&lost(1), 0),
        arrived(&lost(2), 0),
        damaged.clone(),
        arrived(&lost(3), 0),
        damaged,
        arrived(&lost(5), 3),
    ];
    assert_eq!(found, expected);
}

#[test]
fn a_board_that_starts_again_has_lost_nothing() {
    let mut decoder = Decoder::new();
    let lost = Message::Lost { frames: 1 };
    assert_eq!(received(&mut decoder, &frame(&lost, 40_000)), [arrived(&lost, 0)]);
    let first = Message::Hello(hello(0));
    assert_eq!(received(&mut decoder, &frame(&first, 0)), [arrived(&first, 0)]);
    assert_eq!(received(&mut decoder, &frame(&lost, 1)), [arrived(&lost, 0)]);
    // A hello that answers a request is not a start.
    let later = Message::Hello(hello(9));
    assert_eq!(received(&mut decoder, &frame(&later, 4)), [arrived(&later, 2)]);
    // A hello of a board without frames is not a start either.
    assert_eq!(received(&mut decoder, &frame(&first, 7)), [arrived(&first, 2)]);
    // A start whose hello was lost.
    assert_eq!(received(&mut decoder, &frame(&lost, 20_000)), [arrived(&lost, 20_000 - 8)]);
    assert_eq!(received(&mut decoder, &frame(&lost, 3)), [arrived(&lost, 3)]);
}

#[test]
fn a_frame_that_is_too_long_for_a_decoder_is_refused_whatever_its_beginning() {
    let checked = with_crc(&[4, 5, 1, 1]);
    let push = |bytes: &[u8]| {
        let mut decoder = Decoder::<8>::new();
        bytes.iter().filter_map(|&byte| decoder.push::<Request>(byte)).collect::<Vec<_>>()
    };
    assert_eq!(push(&cobs(&checked)), [Ok(Received { message: Request::Features(true), lost: 0, first: false })]);
    assert_eq!(push(&cobs(&[&checked[..], &[9]].concat())), [Err(DecodeError::Damaged)]);
}

/// Returns a frame of any content, with its CRC.
pub(super) fn frame_of(content: &[u8]) -> Vec<u8> {
    cobs(&with_crc(content))
}

fn with_crc(content: &[u8]) -> Vec<u8> {
    let sum = crc32(content.iter().copied());
    [content, &sum.to_le_bytes()].concat()
}

fn cobs(content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::from([0]);
    for mut block in content.split(|&byte| byte == 0) {
        while let Some((full, rest)) = block.split_at_checked(254) {
            bytes.push(255);
            bytes.extend(full);
            block = rest;
        }
        bytes.push(block.len() as u8 + 1);
        bytes.extend(block);
    }
    bytes.push(0);
    bytes
}

#[test]
fn other_versions_and_unknown_messages_are_told_apart_from_damage() {
    let lost = Message::Lost { frames: 9 };
    assert_eq!(frame_of(&[4, 5, 6, 9]), frame(&lost, 5));
    // A slip has the same number with and without the features of the messages before it.
    let slip = Message::Slip(Slip::new(131, 129, 96, 0.5));
    assert_eq!(frame_of(&[4, 5, 21, 0x83, 1, 0x81, 1, 96, 0, 0, 0, 0x3F]), frame(&slip, 5));
    for (content, expected) in [
        (&[1, 5, 6, 9][..], Err(DecodeError::Version(1))),
        (&[0, 5, 6, 9], Err(DecodeError::Version(0))),
        (&[4, 5, 99, 1, 2, 3], Err(DecodeError::Unknown)),
        (&[4, 5, 6], Err(DecodeError::Unknown)),
        (&[4], Err(DecodeError::Unknown)),
        (&[3, 5, 6, 9], Err(DecodeError::Version(3))),
        (&[], Err(DecodeError::Damaged)),
        // A fault of another number, a direction of another kind, a name that is no UTF-8.
        (&[4, 5, 7, 99], Err(DecodeError::Unknown)),
        (&[4, 5, 7, 6, 1, 0xFF], Err(DecodeError::Unknown)),
        // A field more.
        (&[4, 5, 6, 9, 1, 2, 3], arrived(&lost, 0)),
    ] {
        assert_eq!(received(&mut Decoder::new(), &frame_of(content)), [expected], "{content:?}");
    }
    // Messages that were lost before an unknown message are not forgotten.
    let mut decoder = Decoder::new();
    received(&mut decoder, &frame(&lost, 0));
    received(&mut decoder, &frame_of(&[4, 3, 99]));
    assert_eq!(received(&mut decoder, &frame(&lost, 5)), [arrived(&lost, 3)]);
}

#[test]
fn any_bytes_are_borne() {
    let mut random = 1_u32;
    let mut decoder = Decoder::<LONGEST>::new();
    let mut small = Decoder::<4>::new();
    let mut refused = 0;
    for _ in 0..1_000_000 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Zeros are more frequent than by chance, so that frames are short.
        let byte = if random >> 28 == 0 { 0 } else { (random >> 16) as u8 };
        if let Some(found) = decoder.push::<Message>(byte) {
            assert!(found.is_err());
            refused += 1;
        }
        assert!(small.push::<Request>(byte).is_none_or(|found| found.is_err()));
    }
    assert!(refused > 50_000, "{refused}");
    let lost = Message::Lost { frames: 1 };
    assert_eq!(received(&mut decoder, &frame(&lost, 9)).last(), Some(&arrived(&lost, 0)));
}

#[test]
fn requests_fit_a_small_decoder() {
    let mut decoder = Decoder::<16>::new();
    let requests = [
        Request::Hello,
        Request::Features(true),
        Request::Features(false),
        Request::Samples(true),
        Request::KeepEvents(true),
        Request::Acknowledge { event: u16::MAX },
        Request::Picture,
        // 17 years.
        Request::Time { host_us: (1 << 49) - 1 },
    ];
    for (sequence, request) in (u16::MAX - 1..=u16::MAX).chain(0..5).zip(requests) {
        let bytes = encode(&request, sequence, &mut [0; LONGEST]).to_vec();
        let found: Vec<_> = bytes.iter().filter_map(|&byte| decoder.push::<Request>(byte)).collect();
        assert_eq!(found, [Ok(Received { message: request, lost: 0, first: false })]);
    }
}

#[test]
fn parts_of_a_picture_are_cut_and_summed_in_any_order() {
    let bytes: Vec<u8> = (0..=255).collect();
    let part = PicturePart::new(1, 2, 3, &bytes);
    assert_eq!((part.bytes, part.first), (&bytes[..PICTURE_PART], 3));
    assert_eq!(part.checksum(), crc32([3, 0, 0, 0].into_iter().chain(0..PICTURE_PART as u8)));
    // The place counts, the frame does not.
    assert_ne!(PicturePart::new(1, 2, 4, &bytes).checksum(), part.checksum());
    assert_eq!(PicturePart::new(1, 9, 3, &bytes).checksum(), part.checksum());
}

#[test]
fn texts_are_cut_between_characters_and_labels_are_read_where_they_lie() {
    assert_eq!(LONGEST_NAME.len(), 63);
    assert_eq!(Text::<63>::new("ééé").to_string(), "ééé");
    assert_eq!(Text::<5>::new("ééé").to_string(), "éé");
    assert_eq!(Text::<63>::new(LONGEST_NAME).to_string(), LONGEST_NAME);
    let answer = texture(&[0; 700], &MODEL);
    let label = answer.label.to_string();
    let of_model = Answers { textures: [None; 3], ..answers() }.with_texture(answer);
    let of_text = TextureAnswer::new(answer.task, Text::new(&label));
    assert!(!label.is_empty());
    assert_eq!(of_model.textures, [Some(of_text), None, None]);
    let by_text = Answers { textures: [Some(of_text), None, None], ..answers() };
    assert_eq!(frame(&Message::Event(of_model), 1), frame(&Message::Event(by_text), 1));
    // A fourth model has no place.
    assert_eq!(answers().with_texture(answer), answers());
}

#[test]
fn reasons_are_errors_with_sentences() {
    let reasons: [(&dyn core::error::Error, &str); 12] = [
        (&Reason::BaselineAbove, "the baseline is above the speed threshold"),
        (&Reason::NeverValid, "no frame is above the speed threshold"),
        (&Reason::CutOff { at_most: Some(45.5) }, "cut off: the sample starts or ends above the speed threshold"),
        (&Reason::OutsideLaw, "the speed law has no finite speed for this duration"),
        (&Reason::NoSlide(Contact::Press), "the touch is a press, which does not slide"),
        (&Reason::NoSlide(Contact::Unclear), "unclear: the touch is not certain to be a slide"),
        (&Reason::NeverLit, "unclear: a row and a column never light up"),
        (&Reason::NoOrder, "unclear: neither rows nor columns light up in order"),
        (&DecodeError::Damaged, "the frame is damaged: its bytes are not the bytes that were sent"),
        (&DecodeError::Version(7), "version of the link is 7, expected 4"),
        (&DecodeError::Unknown, "the message is unknown to this version of the software"),
        (&DecodeError::Impossible(Quantity::Deviation), "the message has an impossible standard deviation"),
    ];
    for (reason, sentence) in reasons {
        assert_eq!(reason.to_string(), sentence);
    }
}

/// Returns the quantity for which a message is refused.
pub(super) fn refused(message: &Message) -> Option<Quantity> {
    let bytes = frame(message, 7);
    match &received(&mut Decoder::new(), &bytes)[..] {
        [Ok(_)] => None,
        [Err(DecodeError::Impossible(quantity))] => Some(*quantity),
        other => panic!("{message:?}: {other:?}"),
    }
}

/// Returns the quantity for which an event with this change is refused.
fn refused_event(change: impl Fn(&mut Answers)) -> Option<Quantity> {
    let mut answers = answers();
    change(&mut answers);
    refused(&Message::Event(answers))
}

#[test]
fn impossible_numbers_are_refused_and_the_last_possible_ones_are_not() {
    let event = |change: &dyn Fn(&mut Answers)| refused_event(change);
    let velocity = |change: &dyn Fn(&mut Velocity)| {
        let mut velocity = Velocity { mm_s: 0.5, mm_s_sd: 0.0, degrees: 0.0, degrees_sd: 9.5 };
        change(&mut velocity);
        refused(&Message::Motion { frame: 1, velocity, basis: None })
    };
    let below = |number: f32| number.next_down();
    for (mm_s, is_refused) in [
        (f32::NAN, true),
        (-f32::NAN, true),
        (f32::INFINITY, true),
        (f32::NEG_INFINITY, true),
        (-1.0, true),
        (-0.0, true),
        (0.0, true),
        (f32::MIN_POSITIVE, false),
        (f32::MAX, false),
    ] {
        let expected = is_refused.then_some(Quantity::Speed);
        assert_eq!(event(&|answers| answers.speed = Ok(Speed::new(mm_s))), expected, "{mm_s}");
        let cut_off = Err(Reason::CutOff { at_most: Some(mm_s) });
        let cut = |answers: &mut Answers| {
            (answers.contact, answers.speed, answers.basis, answers.extent) = (None, cut_off, None, None);
        };
        assert_eq!(event(&cut), expected, "{mm_s}");
        assert_eq!(velocity(&|velocity| velocity.mm_s = mm_s), expected, "{mm_s}");
    }
    for (sd, is_refused) in [(f32::NAN, true), (f32::INFINITY, true), (-0.5, true), (0.0, false), (f32::MAX, false)] {
        let expected = is_refused.then_some(Quantity::Deviation);
        assert_eq!(event(&|answers| answers.speed = Ok(Speed::by_arrival(1.0, sd))), expected, "{sd}");
        assert_eq!(event(&|answers| answers.direction = Direction::by_arrival(Ok([1.0, sd]))), expected, "{sd}");
        assert_eq!(velocity(&|velocity| velocity.mm_s_sd = sd), expected, "{sd}");
        assert_eq!(velocity(&|velocity| velocity.degrees_sd = sd), expected, "{sd}");
    }
    for (degrees, is_refused) in
        [(f32::NAN, true), (f32::INFINITY, true), (-0.5, true), (360.0, true), (0.0, false), (below(360.0), false)]
    {
        let expected = is_refused.then_some(Quantity::Direction);
        assert_eq!(event(&|answers| answers.direction = Direction::by_arrival(Ok([degrees, 0.5]))), expected);
        assert_eq!(velocity(&|velocity| velocity.degrees = degrees), expected);
    }
    for (confidence, is_refused) in [(0, false), (32_768, false), (32_769, true), (u16::MAX, true)] {
        let expected = is_refused.then_some(Quantity::Confidence);
        let by_centroids = Direction::by_centroids(Ok(Heading::Up), confidence);
        assert_eq!(event(&|answers| answers.direction = by_centroids), expected);
        let texture = TextureAnswer { confidence: Some(confidence), ..answers().textures[0].unwrap() };
        assert_eq!(event(&|answers| answers.textures = [None, None, Some(texture)]), expected);
        assert_eq!(refused(&Message::Texture { frame: 0, frames: 70, texture }), expected);
    }
}

#[test]
fn impossible_counts_are_refused_and_the_last_possible_ones_are_not() {
    let event = |change: &dyn Fn(&mut Answers)| refused_event(change);
    let too_many = Some(Quantity::SampleFrames);
    assert_eq!(event(&|answers| answers.frames_filled = 71), too_many);
    assert_eq!(event(&|answers| answers.frames_filled = 255), too_many);
    assert_eq!(event(&|answers| answers.duration = Some(70)), too_many);
    assert_eq!(event(&|answers| answers.end = Some(71)), too_many);
    assert_eq!(event(&|answers| answers.touch = Some(71)), too_many);
    // A touch before the first frame.
    assert_eq!(event(&|answers| (answers.frame, answers.touch) = (4, Some(-5))), Some(Quantity::FrameNumber));
    assert_eq!(event(&|answers| (answers.frame, answers.touch) = (5, Some(-5))), None);
    // A press has neither speed nor direction.
    let press = |answers: &mut Answers| answers.contact = Some(Contact::Press);
    assert_eq!(event(&press), Some(Quantity::Contact));
    let texture = answers().textures[0].unwrap();
    // A slide has both, and a touch ends behind its start.
    let never = Err(Reason::NoSlide(Contact::Slide));
    assert_eq!(event(&|answers| answers.speed = Err(Reason::OutsideLaw)), Some(Quantity::Contact));
    assert_eq!(event(&|answers| answers.direction = Direction::by_arrival(never)), Some(Quantity::Contact));
    assert_eq!(event(&|answers| (answers.touch, answers.end) = (Some(5), Some(5))), too_many);
    assert_eq!(refused(&Message::ContactEnd(ContactEnd::new(4, 5))), Some(Quantity::FrameNumber));
    for (slip, expected) in [
        (Slip::new(4, 5, 3, 0.4), Quantity::FrameNumber),
        (Slip::new(5, 3, 4, 0.4), Quantity::FrameNumber),
        (Slip::new(5, 4, 3, 0.0), Quantity::Strength),
        (Slip::new(5, 4, 3, f32::NAN), Quantity::Strength),
    ] {
        assert_eq!(refused(&Message::Slip(slip)), Some(expected), "{slip:?}");
    }
    for frames in [0, 71, 255] {
        assert_eq!(refused(&Message::Texture { frame: 0, frames, texture }), too_many);
    }
    for first in [1, 61, 70, 255] {
        assert_eq!(refused(&Message::SamplePart { frame: 0, first, features: [[0; 10]; 10] }), too_many);
    }
    for (brightest, expected) in [(3297, None), (3298, Some(Quantity::Feature)), (i16::MAX, Some(Quantity::Feature))] {
        let mut features = [0; 10];
        features[9] = brightest;
        assert_eq!(refused(&Message::Features { frame: 0, features }), expected);
        let mut part = [[0; 10]; 10];
        part[9] = features;
        assert_eq!(refused(&Message::SamplePart { frame: 0, first: 60, features: part }), expected);
    }
    for frames in [70, 255] {
        let incomplete = InterruptedSample::new(0, frames);
        assert_eq!(refused(&Message::InterruptedSample(incomplete)), too_many);
        let stream = StreamEnd { incomplete: Some(incomplete), ..StreamEnd::new(0) };
        assert_eq!(refused(&Message::Status { stream, dropped: 0 }), too_many);
        assert_eq!(refused(&Message::End { stream, dropped: 0 }), too_many);
    }
    for frame in [LAST + 1, u64::MAX] {
        let stream = StreamEnd::new(frame);
        let velocity = Velocity { mm_s: 0.5, mm_s_sd: 0.0, degrees: 0.0, degrees_sd: 9.5 };
        for message in [
            Message::Hello(hello(frame)),
            Message::Features { frame, features: [0; 10] },
            Message::SamplePart { frame, first: 0, features: [[0; 10]; 10] },
            Message::Event(Answers { frame, ..answers() }),
            Message::Texture { frame, frames: 1, texture },
            Message::InterruptedSample(InterruptedSample::new(frame, 1)),
            Message::Lost { frames: frame },
            Message::Status { stream, dropped: 0 },
            Message::Status { stream: StreamEnd::new(0), dropped: frame },
            Message::End { stream, dropped: 0 },
            Message::End { stream: StreamEnd::new(0), dropped: frame },
            Message::ContactEnd(ContactEnd::new(frame, 0)),
            Message::ContactEnd(ContactEnd::new(0, frame)),
            Message::Slip(Slip::new(frame, 3, 2, 0.4)),
            Message::Motion { frame, velocity, basis: None },
            Message::Telemetry(Telemetry { uptime_ms: frame, ..telemetry() }),
        ] {
            assert_eq!(refused(&message), Some(Quantity::FrameNumber), "{message:?}");
        }
    }
    let models = |classes, frames| Hello {
        models: [None, None, Some(ModelFacts::new(Task::Depth, classes, frames))],
        ..hello(0)
    };
    assert_eq!(refused(&Message::Hello(models(0, 70))), Some(Quantity::Classes));
    assert_eq!(refused(&Message::Hello(models(1, 0))), too_many);
    assert_eq!(refused(&Message::Hello(models(1, 71))), too_many);
    let rate = FrameRate::new(100_001, 1).unwrap();
    assert_eq!(refused(&Message::Hello(Hello { rate, ..hello(0) })), Some(Quantity::FrameRate));
    for temperature in [i16::MIN, -1001, 2001] {
        let telemetry = Telemetry { temperature: Some(temperature), ..telemetry() };
        assert_eq!(refused(&Message::Telemetry(telemetry)), Some(Quantity::Temperature));
    }
}

#[test]
fn reliable_answers_that_contradict_themselves_are_refused() {
    let reliable = |change: &dyn Fn(&mut Answers)| {
        refused_event(|answers| {
            (answers.frames_filled, answers.reliable, answers.doubt) = (7, true, None);
            change(answers);
        })
    };
    let refused = Some(Quantity::Reliability);
    assert_eq!(reliable(&|_| {}), None);
    assert_eq!(reliable(&|answers| answers.frames_filled = 8), refused);
    assert_eq!(reliable(&|answers| answers.doubt = Some(Reason::Uneven)), refused);
    assert_eq!(reliable(&|answers| answers.speed = Ok(Speed::by_arrival(100.0, 10.1))), refused);
    assert_eq!(reliable(&|answers| answers.speed = Ok(Speed::new(100.0))), refused);
    let touch = |answers: &mut Answers, contact| {
        let never = Reason::NoSlide(contact);
        (answers.contact, answers.speed) = (Some(contact), Err(never));
        answers.direction = Direction::by_arrival(Err(never));
        (answers.basis, answers.extent) = (None, None);
    };
    assert_eq!(reliable(&|answers| touch(answers, Contact::Press)), None);
    assert_eq!(reliable(&|answers| touch(answers, Contact::Unclear)), refused);
    let press_by_edge = |answers: &mut Answers| {
        touch(answers, Contact::Press);
        answers.basis = Some(Basis::Edge);
    };
    assert_eq!(reliable(&press_by_edge), Some(Quantity::Contact));
}

#[test]
fn a_refused_message_has_arrived_and_the_next_one_is_read() {
    let lost = Message::Lost { frames: 9 };
    let mut decoder = Decoder::new();
    received(&mut decoder, &frame(&lost, 0));
    let bad = Message::Event(Answers { frames_filled: 255, ..answers() });
    let refused = Err(DecodeError::Impossible(Quantity::SampleFrames));
    assert_eq!(received(&mut decoder, &frame(&bad, 2)), [refused]);
    assert_eq!(received(&mut decoder, &frame(&lost, 3)), [arrived(&lost, 1)]);
}

fn event(frame: u64) -> Answers<'static> {
    Answers { frame, ..answers() }
}

/// Returns frame, number and what is kept of an event.
fn facts(answers: Option<Answers<'static>>) -> Option<(u64, u16, u8)> {
    answers.map(|answers| (answers.frame, answers.number, answers.kept))
}

#[test]
fn an_event_is_sent_once_if_nobody_acknowledges_events() {
    let mut outbox = Outbox::<2>::new();
    for number in 0..5 {
        assert_eq!(facts(Some(outbox.push(event(number), 0))), Some((number, number as u16, 0)));
    }
    assert_eq!((outbox.due(1_000_000), outbox.next_event(), outbox.kept()), (None, 5, 0));
}

#[test]
fn an_event_is_sent_again_until_it_is_acknowledged() {
    let mut outbox = Outbox::<2>::new();
    outbox.answer(Request::KeepEvents(true));
    // The clock wraps.
    let start = u32::MAX - 300;
    let at = |ms: u32| start.wrapping_add(ms);
    assert_eq!(facts(Some(outbox.push(event(70), at(0)))), Some((70, 0, 0)));
    assert_eq!(outbox.due(at(RESEND_MS - 1)), None);
    assert_eq!(facts(outbox.due(at(RESEND_MS))), Some((70, 0, 0)));
    assert_eq!(outbox.due(at(2 * RESEND_MS - 1)), None);
    assert_eq!(facts(Some(outbox.push(event(170), at(400)))), Some((170, 1, 1)));
    assert_eq!(facts(outbox.due(at(2 * RESEND_MS))), Some((70, 0, 0)));
    assert_eq!(facts(outbox.due(at(700))), Some((170, 1, 1)));
    // An acknowledgment of an event that is not kept, or is not yet there, changes nothing.
    for other in [2, 3, u16::MAX] {
        outbox.answer(Request::Acknowledge { event: other });
    }
    assert_eq!([0, 1, 2].map(|event| outbox.keeps(event)), [true, true, false]);
    outbox.answer(Request::Acknowledge { event: 0 });
    assert_eq!([0, 1, 2].map(|event| outbox.keeps(event)), [false, true, false]);
    assert_eq!((outbox.kept(), facts(outbox.due(at(5000)))), (1, Some((170, 1, 0))));
    outbox.answer(Request::Acknowledge { event: 1 });
    assert_eq!((outbox.kept(), outbox.due(at(9000))), (0, None));
    assert!(outbox.is_heard());
}

#[test]
fn an_event_is_given_up_after_its_tries_or_for_two_newer_ones() {
    let mut outbox = Outbox::<2>::new();
    outbox.answer(Request::KeepEvents(true));
    outbox.push(event(1), 0);
    let mut sent = 1;
    for now in 1..=60_000 {
        sent += u8::from(outbox.due(now).is_some());
        assert_eq!(outbox.kept(), u8::from(now < u32::from(TRIES) * RESEND_MS), "{now}");
    }
    // Nobody is there, so the next events are sent once.
    assert_eq!((sent, outbox.is_heard()), (TRIES, false));
    outbox.push(event(2), 60_000);
    assert_eq!((outbox.due(70_000), outbox.kept()), (None, 0));
    // Somebody is there again.
    outbox.answer(Request::KeepEvents(true));
    for number in 2..5 {
        outbox.push(event(number), 70_000);
    }
    assert_eq!(outbox.kept(), 2);
    assert_eq!([0; 3].map(|_| facts(outbox.due(80_000))), [Some((3, 3, 0)), Some((4, 4, 1)), None]);
    outbox.answer(Request::KeepEvents(false));
    assert_eq!((outbox.due(90_000), outbox.kept()), (None, 0));
}

/// Tests that the fuzzer starts with messages of this version of the link: all of [`messages`].
///
/// `WSTAC_WRITE_SEEDS=1 cargo test -p wstac-core --all-features seeds` makes the files anew.
#[cfg(all(feature = "learn", feature = "models"))]
#[test]
fn seeds_of_the_fuzzer_are_messages_of_this_version() {
    let seeds = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz/seeds");
    let write = std::env::var_os("WSTAC_WRITE_SEEDS").is_some();
    let mut files = std::collections::BTreeMap::new();
    for (number, message) in messages().into_iter().enumerate() {
        let bytes = frame(&message, 300);
        let words = std::format!("{message:?}");
        let kind: String = words.chars().take_while(|character| character.is_alphanumeric()).collect();
        let name = std::format!("{number:02}-{}", kind.to_lowercase());
        let content = content_of(&bytes);
        let mut decoder = Decoder::<LONGEST>::new();
        assert_eq!(received(&mut decoder, &frame_of(&content)), [arrived(&message, 0)], "{name}");
        // The monitor's seeds start with the kind of input, 1 for contents of frames, and the length of a piece.
        files.insert(std::format!("wire/{name}"), content.clone());
        files.insert(std::format!("monitor/content-{name}"), [&[1, 16][..], &content].concat());
        files.insert(std::format!("monitor/frame-{name}"), [&[0, 16][..], &bytes].concat());
    }
    for folder in ["wire", "monitor"] {
        for entry in std::fs::read_dir(seeds.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = std::format!("{folder}/{}", path.file_name().unwrap().to_str().unwrap());
            if write && !files.contains_key(&name) {
                std::fs::remove_file(&path).unwrap();
            } else {
                assert!(write || files.contains_key(&name), "{name} is no message, make the seeds anew");
            }
        }
    }
    for (name, bytes) in files {
        if write {
            std::fs::write(seeds.join(&name), &bytes).unwrap();
        }
        assert!(std::fs::read(seeds.join(&name)).unwrap() == bytes, "{name} is an old message, make the seeds anew");
    }
}

/// Returns the content of a frame, without its checksum.
fn content_of(frame: &[u8]) -> Vec<u8> {
    let (mut content, mut rest) = (Vec::new(), &frame[1..frame.len() - 1]);
    while let Some((&length, behind)) = rest.split_first() {
        let (block, after) = behind.split_at(usize::from(length) - 1);
        content.extend(block);
        if length < 255 && !after.is_empty() {
            content.push(0);
        }
        rest = after;
    }
    content.truncate(content.len() - 4);
    content
}
