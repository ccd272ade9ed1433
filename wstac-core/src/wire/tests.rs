//! Tests every message there and back, at its extremes, and the effects of damage.

use std::string::{String, ToString};
use std::vec::Vec;

use super::*;
use crate::crc::crc32;
use crate::direction::{Direction, Heading, Unclear};
use crate::green::any::PixelFormat;
use crate::green::bayer::BayerOrder;
use crate::layout::FrameSize;
use crate::model::file::Task;
use crate::model::forest::Forest;
use crate::motion::Contact;
use crate::rate::FrameRate;
use crate::speed::{NoSpeed, Speed};
use crate::texture::texture;
use crate::trigger::{ContactEnd, InterruptedSample, Rule, StreamEnd, TriggerConfig};

static MODEL: Forest<'static> = crate::include_model!(Forest, "../../tests/models/small.wsm");
const LONGEST_NAME: &str = "the name of a class is at most this long: 63 bytes, in UTF-8 é";
const LONGEST_REASON: &str = concat!(
    "panicked at the very end of a long path, in a function of a long name, with a message that goes on and on, ",
    "so long that what is said in it can only be said in part, because the rest is behind the end"
);

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
    }
}

fn answers() -> Answers<'static> {
    Answers {
        frame: u64::MAX,
        touch: Some(i16::MIN),
        end: Some(u8::MAX),
        contact: Some(Contact::Unclear),
        duration: Some(69),
        speed: Ok(Speed::by_arrival(600.5, 3.25)),
        direction: Direction::by_arrival(Ok([359.75, 0.5])),
        textures: [Some(TextureAnswer {
            task: Task::Specimen,
            label: Text::new(LONGEST_NAME),
            confidence: Some(u16::MAX),
            known: Some(true),
        }); 3],
        frames_filled: 70,
        reliable: true,
    }
}

/// Returns every message at its longest, then some others.
fn messages() -> Vec<Message<'static>> {
    let incomplete = InterruptedSample { frame: u64::MAX, frames: 69 };
    let stream =
        StreamEnd { frames: u64::MAX, baseline_complete: true, baseline_quiet: true, incomplete: Some(incomplete) };
    let short = Answers {
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
    };
    Vec::from([
        Message::Hello(hello(u64::MAX)),
        Message::Features { frame: u64::MAX, features: [i16::MIN; 10] },
        Message::SamplePart { frame: u64::MAX, first: 60, features: [[i16::MIN; 10]; 10] },
        Message::Event(answers()),
        Message::Texture { frame: u64::MAX, frames: 69, texture: answers().textures[0].unwrap() },
        Message::InterruptedSample(incomplete),
        Message::Lost { frames: u64::MAX },
        Message::Fault(Fault::LastRun(Text::new(LONGEST_REASON))),
        Message::Status { stream, dropped: u64::MAX },
        Message::End { stream, dropped: u64::MAX },
        Message::Hello(Hello { models: [None; 3], firmware: Text::new(""), ..hello(7) }),
        Message::Event(short),
        Message::Event(Answers {
            contact: Some(Contact::Press),
            speed: Err(NoSpeed::NoSlide(Contact::Press)),
            direction: Direction::by_arrival(Err(Unclear::NoSlide(Contact::Press))),
            ..short
        }),
        Message::Event(Answers {
            speed: Err(NoSpeed::CutOff { at_most: Some(45.5) }),
            direction: Direction::by_centroids(Err(Unclear::NoOrder), 32_768),
            ..short
        }),
        Message::ContactEnd(ContactEnd::new(u64::MAX, u64::MAX)),
        Message::Features { frame: 0, features: [0; 10] },
        Message::Fault(Fault::SensorUnknown { id: 0xFFFF }),
        Message::Fault(Fault::Overrun),
        Message::Fault(Fault::SensorRefuses { register: u8::MAX }),
        Message::PicturePart(PicturePart::new(u8::MAX, u64::MAX, u32::MAX, &[u8::MAX; PICTURE_PART])),
        Message::PicturePart(PicturePart::new(0, 0, 0, &[0; 3])),
        Message::PictureEnd(PictureEnd::new(u8::MAX, u16::MAX, u32::MAX)),
    ])
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

#[test]
fn every_message_is_read_as_it_was_written() {
    let mut longest = 0;
    for message in messages() {
        let bytes = frame(&message, u16::MAX);
        longest = longest.max(bytes.len());
        assert_eq!((bytes[0], bytes[bytes.len() - 1]), (0, 0), "{message:?}");
        assert!(!bytes[1..bytes.len() - 1].contains(&0), "{message:?}");
        let mut decoder = Decoder::<LONGEST>::new();
        let found = bytes.iter().filter_map(|&byte| match decoder.push::<Message>(byte) {
            Some(Ok(Received { message: found, lost: 0, .. })) => Some(found == message),
            Some(other) => panic!("{message:?}: {other:?}"),
            None => None,
        });
        assert_eq!(found.collect::<Vec<_>>(), [true], "{message:?}");
    }
    // The longest message fits, and little room is left.
    assert!(longest > 256 && longest <= LONGEST, "{longest}");
}

#[test]
fn the_bytes_of_a_frame_are_these() {
    // Version 1, sequence 300, message 1 (features), frame 130, 20 bytes; CRC-32; no zero among them.
    let message = Message::Features { frame: 130, features: [257, -1, -2, -2048, 3296, 258, 259, 260, 261, -13_000] };
    let content = [
        &[3, 0xAC, 2, 1, 0x82, 1, 20][..],
        &[1, 1, 0xFF, 0xFF, 0xFE, 0xFF, 0, 0xF8, 0xE0, 0xC, 2, 1, 3, 1, 4, 1, 5, 1, 0x38, 0xCD],
    ]
    .concat();
    let sum = crc32(content.iter().copied());
    let mut expected = [&[0, 14][..], &content[..13], &[18], &content[14..], &sum.to_le_bytes()].concat();
    expected.push(0);
    assert_eq!(frame(&message, 300), expected);
    // An event: a slide from frame 45 to 73, 159.9 ± 1.5 mm/s in 27 frames, 90.5 ± 0.75°, one known texture of
    // a confidence of 32000/32768, no frame filled, reliable.
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
        frames_filled: 0,
        reliable: true,
    };
    let content = [
        &[3, 0, 3, 35, 1, 20, 1, 38, 1, 0, 1, 27, 0][..],
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
        &[0, 0, 0, 1],
    ]
    .concat();
    assert_eq!(frame(&Message::Event(event), 0), frame_of(&content));
    assert_eq!((event.touch_frame(), event.end_frame()), (Some(45), Some(73)));
    // The check value of CRC-32 (IEEE).
    assert_eq!(crc32(*b"123456789"), 0xCBF4_3926);
}

#[test]
fn every_truncation_and_every_changed_byte_is_refused() {
    for message in messages() {
        let bytes = frame(&message, 2);
        for length in 2..bytes.len() - 1 {
            let mut cut = bytes[..length].to_vec();
            cut.push(0);
            assert_eq!(
                received(&mut Decoder::new(), &cut),
                [Err(DecodeError::Damaged)],
                "{message:?} of {length} bytes"
            );
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
    let checked = with_crc(&[3, 5, 1, 1]);
    let push = |bytes: &[u8]| {
        let mut decoder = Decoder::<8>::new();
        bytes.iter().filter_map(|&byte| decoder.push::<Request>(byte)).collect::<Vec<_>>()
    };
    assert_eq!(push(&cobs(&checked)), [Ok(Received { message: Request::Features(true), lost: 0, first: false })]);
    assert_eq!(push(&cobs(&[&checked[..], &[9]].concat())), [Err(DecodeError::Damaged)]);
}

/// Returns a frame of any content, with its CRC.
fn frame_of(content: &[u8]) -> Vec<u8> {
    cobs(&with_crc(content))
}

fn with_crc(content: &[u8]) -> Vec<u8> {
    let sum = crc32(content.iter().copied());
    [content, &sum.to_le_bytes()].concat()
}

fn cobs(content: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::from([0]);
    for block in content.split(|&byte| byte == 0) {
        bytes.push(block.len() as u8 + 1);
        bytes.extend(block);
    }
    bytes.push(0);
    bytes
}

#[test]
fn other_versions_and_unknown_messages_are_told_apart_from_damage() {
    let lost = Message::Lost { frames: 9 };
    assert_eq!(frame_of(&[3, 5, 6, 9]), frame(&lost, 5));
    for (content, expected) in [
        (&[1, 5, 6, 9][..], Err(DecodeError::Version(1))),
        (&[0, 5, 6, 9], Err(DecodeError::Version(0))),
        (&[3, 5, 99, 1, 2, 3], Err(DecodeError::Unknown)),
        (&[3, 5, 6], Err(DecodeError::Unknown)),
        (&[3], Err(DecodeError::Unknown)),
        (&[2, 5, 6, 9], Err(DecodeError::Version(2))),
        (&[], Err(DecodeError::Damaged)),
        // A fault of another number, a direction of another kind, a name that is no UTF-8.
        (&[3, 5, 7, 99], Err(DecodeError::Unknown)),
        (&[3, 5, 7, 6, 1, 0xFF], Err(DecodeError::Unknown)),
        // A field more.
        (&[3, 5, 6, 9, 1, 2, 3], arrived(&lost, 0)),
    ] {
        assert_eq!(received(&mut Decoder::new(), &frame_of(content)), [expected], "{content:?}");
    }
    // Messages that were lost before an unknown message are not forgotten.
    let mut decoder = Decoder::new();
    received(&mut decoder, &frame(&lost, 0));
    received(&mut decoder, &frame_of(&[3, 3, 99]));
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
    let requests =
        [Request::Hello, Request::Features(true), Request::Features(false), Request::Samples(true), Request::Picture];
    for (sequence, request) in (u16::MAX - 1..=u16::MAX).chain(0..3).zip(requests) {
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
    let reasons: [(&dyn core::error::Error, &str); 11] = [
        (&NoSpeed::BaselineAbove, "the baseline is above the speed threshold"),
        (&NoSpeed::NeverValid, "no frame is above the speed threshold"),
        (&NoSpeed::CutOff { at_most: Some(45.5) }, "cut off: the sample starts or ends above the speed threshold"),
        (&NoSpeed::OutsideLaw, "the speed law has no finite speed for this duration"),
        (&NoSpeed::NoSlide(Contact::Press), "the touch is a press, which does not slide"),
        (&Unclear::NoSlide(Contact::Unclear), "unclear: the touch is not certain to be a slide"),
        (&Unclear::NeverLit, "unclear: a row and a column never light up"),
        (&Unclear::NoOrder, "unclear: neither rows nor columns light up in order"),
        (&DecodeError::Damaged, "the frame is damaged: its bytes are not the bytes that were sent"),
        (&DecodeError::Version(7), "version of the link is 7, expected 3"),
        (&DecodeError::Unknown, "the message is unknown to this version of the software"),
    ];
    for (reason, sentence) in reasons {
        assert_eq!(reason.to_string(), sentence);
    }
}
