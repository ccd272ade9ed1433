//! Tests recordings parts of which stand elsewhere: sectors and messages after damage, and channels and topics after
//! another tool wrote the recording anew. A frame comes back right, or it does not come back.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;

use mcap::records::{Metadata, Record};
use mcap::{Channel, Message, Schema, WriteOptions};
use wstac_tests::command::{assert_has, ends, good, prints, run, said};
use wstac_tests::folder::{Folder, text};
use wstac_tests::random::Random;

use super::cuts::chunks;
use super::flips::{ended, outcome, recovered_twice, small};
use super::several_damage::{SENSORS, Stream, check_frames, message_moved, recorded as several, sector_moved, stream};

/// Frames of the clip.
const FRAMES: u32 = 300;

/// Records frames of 25 pixels that have their numbers in them. A moment is about as large as a sector.
fn numbered(folder: &Folder, options: &[&str]) -> (Vec<u8>, Stream) {
    let corners: Vec<String> = (0..25).map(|place| format!("[{}, {}]", place % 5, place / 5)).collect();
    let layout = folder.file("l.toml", format!("[layout]\ntaxel = [1, 1]\ncorners = [{}]\n", corners.join(", ")));
    let mut clip = b"YUV4MPEG2 W5 H5 F30:1 Ip A1:1 Cmono XCOLORRANGE=FULL\n".to_vec();
    for frame in 0..FRAMES {
        clip.extend(b"FRAME\n");
        clip.extend(frame.to_be_bytes());
        clip.extend((0..21).map(|place| (frame * 7 + place * 13) as u8));
    }
    let (clip, file) = (folder.file("a.y4m", clip), folder.path("whole.mcap"));
    good(&[&["record", text(&clip), "-o", &file, "--force", "--config", text(&layout)], options].concat());
    (fs::read(&file).unwrap(), stream(file.as_ref(), None).unwrap())
}

/// Recovers these bytes and checks every frame by its number. Returns the exit code, the frames and what was said.
fn recovered(folder: &Folder, bytes: &[u8], truth: &Stream) -> (Option<i32>, u64, String) {
    let [old, new] = ["old.mcap", "new.mcap"].map(|name| folder.0.join(name));
    fs::write(&old, bytes).unwrap();
    let _ = fs::remove_file(&new);
    let done = run(&["recover", old.to_str().unwrap(), "-o", new.to_str().unwrap()]);
    let code = done.status.code();
    assert!(matches!(code, Some(0 | 1)), "{}", said(&done));
    // What can be run at once is right, too.
    if let Some(direct) = stream(&old, None) {
        assert!(direct.frames == truth.frames, "run: {}", said(&done));
    }
    let Some(found) = stream(&new, None) else {
        assert_eq!(code, Some(1), "{}", said(&done));
        return (code, 0, said(&done));
    };
    check_frames(&found, truth).unwrap_or_else(|why| panic!("{why}: {}", said(&done)));
    (code, found.frames.iter().flatten().count() as u64, said(&done))
}

/// `ci/long damage COUNT` tries more of them.
#[test]
fn a_sector_or_a_message_elsewhere_never_becomes_a_wrong_frame() {
    let count = std::env::var("WSTAC_LONG_DAMAGE").map_or(25, |count| count.parse().unwrap());
    let folder = Folder::new("recording-moved-sectors");
    let mut random = Random::new(41);
    let (mut codes, mut frames) = ([0_u64; 2], 0);
    for options in [&[][..], &["--compress", "lz4"]] {
        let (bytes, truth) = numbered(&folder, options);
        for number in 0..count {
            let mut damaged = bytes.clone();
            for _ in 0..=number % 3 {
                let is_sector = !options.is_empty() || random.below(2) == 0;
                if is_sector {
                    sector_moved(&mut damaged, &mut random);
                } else {
                    message_moved(&mut damaged, &mut random);
                }
            }
            let (code, found, _) = recovered(&folder, &damaged, &truth);
            codes[code.unwrap() as usize] += 1;
            frames += found;
        }
    }
    println!("{codes:?} of {} ended with 0 and 1; {frames} frames, none wrong", 2 * count);
    assert!(codes[0] * 10 > 9 * count, "{codes:?}");
    assert!(frames > u64::from(FRAMES) * count, "{frames}");
}

/// How another tool writes a recording anew.
struct Rewrite<'a> {
    options: WriteOptions,
    /// Replaces the configuration in the description; `None` leaves it.
    configuration: Option<&'a dyn Fn(&str) -> String>,
    /// Gives a topic another name; `None` leaves it out.
    topic: &'a dyn Fn(&str) -> Option<String>,
    /// Puts the messages in another order.
    order: &'a dyn Fn(&mut Vec<Message<'_>>),
    /// Whether another program's message follows every message.
    with_others: bool,
    /// Whether checksums of the description and the record at the end are left out.
    is_bare: bool,
}

/// Writes a recording anew with the `mcap` library. It numbers the channels in their order.
fn rewritten(bytes: &[u8], how: Rewrite<'_>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = how.options.create(&mut out).unwrap();
    let records = mcap::read::LinearReader::new(bytes).unwrap().map(Result::unwrap);
    let of_metadata = |record| if let Record::Metadata(found) = record { Some(found) } else { None };
    let mut metadata: Vec<Metadata> = records.filter_map(of_metadata).collect();
    if let Some(replace) = how.configuration {
        let is_configuration = |of: &&mut Metadata| of.name == "wstac.configuration";
        for of in metadata.iter_mut().filter(is_configuration) {
            let text = of.metadata.get_mut("toml").unwrap();
            *text = replace(text);
        }
        let sum = sum_of(metadata.iter().find(|of| of.name == "wstac.configuration").unwrap());
        for sums in metadata.iter_mut().filter(|of| of.name == "wstac.sums") {
            sums.metadata.insert("wstac.configuration".to_owned(), sum.clone());
        }
    }
    metadata.retain(|of| !how.is_bare || !["wstac.sums", "wstac.end"].contains(&&*of.name));
    for metadata in &metadata {
        writer.write_metadata(metadata).unwrap();
    }
    let mut messages: Vec<Message<'_>> =
        mcap::MessageStream::new(bytes).unwrap().map(|message| message.unwrap()).collect();
    (how.order)(&mut messages);
    let (mut channels, mut schemas) = (BTreeMap::new(), 40);
    let (message_encoding, metadata) = ("cdr".into(), BTreeMap::default());
    let other = std::sync::Arc::new(Channel { id: 300, topic: "/tf".into(), schema: None, message_encoding, metadata });
    for message in messages {
        let Some(topic) = (how.topic)(&message.channel.topic) else { continue };
        let channel = channels.entry(message.channel.id).or_insert_with(|| {
            schemas += 1;
            let schema = message.channel.schema.as_ref().map(|schema| {
                let (name, encoding) = (schema.name.clone(), schema.encoding.clone());
                std::sync::Arc::new(Schema { id: schemas, name, encoding, data: Cow::Owned(schema.data.to_vec()) })
            });
            std::sync::Arc::new(Channel { id: schemas + 60, topic, schema, ..(*message.channel).clone() })
        });
        writer.write(&Message { channel: channel.clone(), ..message.clone() }).unwrap();
        if how.with_others {
            let data = Cow::Borrowed(&b"transform"[..]);
            writer.write(&Message { channel: other.clone(), data, ..message.clone() }).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

/// Returns the checksum that a description has of one of its records.
fn sum_of(metadata: &Metadata) -> String {
    let texts = metadata.metadata.iter().flat_map(|(name, value)| [name, value]);
    let bytes = std::iter::once(&metadata.name)
        .chain(texts)
        .flat_map(|text| [&(text.len() as u64).to_le_bytes()[..], text.as_bytes()].concat());
    format!("{:08x}", wstac_core::crc::crc32(bytes))
}

fn chunked() -> WriteOptions {
    // A chunk ends in the middle of a moment.
    WriteOptions::new().compression(None).chunk_size(Some(5000))
}

fn unchunked() -> WriteOptions {
    WriteOptions::new().use_chunks(false)
}

#[expect(clippy::unnecessary_wraps, reason = "others leave topics out")]
fn same(topic: &str) -> Option<String> {
    Some(topic.to_owned())
}

#[expect(clippy::unnecessary_wraps, reason = "others leave topics out")]
fn prefixed(topic: &str) -> Option<String> {
    Some(format!("/robot{topic}"))
}

fn no_sums(topic: &str) -> Option<String> {
    (topic != "/sums/json").then(|| topic.to_owned())
}

/// The orders in which other tools write messages.
type Order = (&'static str, fn(&mut Vec<Message<'_>>));
const ORDERS: [Order; 8] = [
    ("two frames exchanged", |all| {
        let frames = frames_of(all);
        all.swap(frames[40], frames[41]);
    }),
    ("frames backward, all else in its place", |all| {
        let frames = &frames_of(all)[20..60];
        (0..20).for_each(|place| all.swap(frames[place], frames[39 - place]));
    }),
    ("by topic", |all| all.sort_by_key(|message| message.channel.id)),
    ("by topic, frames last", |all| all.sort_by_key(|message| std::cmp::Reverse(message.channel.id))),
    ("by time", |all| all.sort_by_key(|message| message.log_time)),
    ("backward", |all| all.reverse()),
    ("by chance", |all| all.sort_by_key(|message| message.log_time.wrapping_mul(0x9E37_79B9_7F4A_7C15))),
    ("twice", |all| *all = all.iter().flat_map(|message| [message.clone(), message.clone()]).collect()),
];

/// Returns the places of the messages that are frames.
fn frames_of(all: &[Message<'_>]) -> Vec<usize> {
    let is_frame = |topic: &str| ["/camera", "/taxels/sums"].iter().any(|end| topic.ends_with(end));
    (0..all.len()).filter(|&place| is_frame(&all[place].channel.topic)).collect()
}

fn plain(options: WriteOptions) -> Rewrite<'static> {
    Rewrite { options, configuration: None, topic: &same, order: &|_| (), with_others: false, is_bare: false }
}

/// Writes a recording anew with another configuration in its description.
pub(super) fn with_configuration(bytes: &[u8], replace: &dyn Fn(&str) -> String) -> Vec<u8> {
    rewritten(bytes, Rewrite { configuration: Some(replace), ..plain(chunked()) })
}

/// Channels are found by their topics and schemas, and the checksums of frames are right with the numbers of before.
#[test]
fn a_recording_that_another_tool_wrote_anew_is_read_and_recovered() {
    let folder = Folder::new("recording-moved-anew");
    let file = folder.0.join("anew.mcap");
    for options in [&[][..], &["--features-only"]] {
        let (bytes, _) = small(&folder, options);
        let lines = good(&["run", &folder.path("a.mcap"), "--json", "--features"]);
        let zstd = || chunked().compression(Some(mcap::Compression::Zstd));
        let without_index = || chunked().emit_summary_records(false).repeat_channels(false).repeat_schemas(false);
        for (what, how) in [
            ("in chunks", plain(chunked())),
            ("compressed", plain(zstd())),
            ("without chunks", plain(unchunked())),
            ("without an index", plain(without_index())),
            ("with a prefix", Rewrite { topic: &prefixed, ..plain(chunked()) }),
            ("with a prefix, without chunks", Rewrite { topic: &prefixed, ..plain(unchunked()) }),
            ("among others", Rewrite { with_others: true, ..plain(chunked()) }),
            ("among others, compressed", Rewrite { with_others: true, ..plain(zstd()) }),
        ] {
            fs::write(&file, rewritten(&bytes, how)).unwrap();
            let done = run(&["run", file.to_str().unwrap(), "--json", "--features"]);
            assert_eq!(done.status.code(), Some(0), "{options:?} {what}: {}", said(&done));
            assert!(String::from_utf8_lossy(&done.stdout) == lines, "{options:?} {what}: {}", said(&done));
            assert!(recovered_twice(&folder, text(&file)).1 == lines, "{options:?} {what}");
        }
        // Nothing vouches for another program's message that stands in no chunk.
        let others = rewritten(&bytes, Rewrite { with_others: true, ..plain(unchunked()) });
        let outcome = outcome(&folder, &others);
        assert_eq!((outcome.run, outcome.recover), (Some(0), Some(1)), "{}", outcome.said);
        assert!(outcome.said.contains("has messages of /tf, which no checksum vouches for"), "{}", outcome.said);
        assert_eq!(outcome.found, Some(ended(lines.as_bytes())), "{}", outcome.said);
    }
}

/// Messages in any order are put in that in which they were recorded, also those of several sensors.
#[test]
fn a_recording_in_another_order_is_read_and_recovered() {
    let folder = Folder::new("recording-moved-sorted");
    let file = folder.0.join("anew.mcap");
    let lines = |name: &str| good(&["run", name, "--json", "--features"]);
    for options in [&[][..], &["--features-only"]] {
        let (bytes, _) = small(&folder, options);
        let whole = lines(&folder.path("a.mcap"));
        for (what, order) in ORDERS {
            for how in [chunked(), chunked().compression(Some(mcap::Compression::Lz4)), unchunked()] {
                fs::write(&file, rewritten(&bytes, Rewrite { order: &order, ..plain(how) })).unwrap();
                assert!(lines(file.to_str().unwrap()) == whole, "{options:?} {what}");
                assert!(recovered_twice(&folder, text(&file)).1 == whole, "{options:?} {what}");
            }
        }
    }
    let bytes = several(&folder, &[]);
    let of_sensors = |file: &Path| SENSORS.map(|(name, ..)| stream(file, Some(name)).map(|stream| stream.frames));
    let truth = of_sensors(&folder.0.join("whole.mcap"));
    assert!(truth.iter().all(Option::is_some));
    for (what, order) in ORDERS {
        fs::write(&file, rewritten(&bytes, Rewrite { order: &order, ..plain(chunked()) })).unwrap();
        assert!(of_sensors(&file) == truth, "{what}");
    }
}

/// The checksums of chunks vouch for frames of which the own ones are gone.
#[test]
fn frames_without_anything_else_are_recovered() {
    let folder = Folder::new("recording-moved-frames");
    let (bytes, _) = small(&folder, &[]);
    let whole = stream(&folder.0.join("a.mcap"), None).unwrap().frames;
    for topics in [&["/camera", "/faults", "/faults/json"][..], &["/camera", "/faults/json", "/taxels", "/features"]] {
        let topic = |topic: &str| topics.contains(&topic).then(|| topic.to_owned());
        let file = folder.file("frames.mcap", rewritten(&bytes, Rewrite { topic: &topic, ..plain(chunked()) }));
        assert!(stream(&file, None).unwrap().frames == whole, "{topics:?}");
        let new = folder.0.join("new.mcap");
        good(&["recover", file.to_str().unwrap(), "-o", new.to_str().unwrap(), "--force"]);
        assert!(stream(&new, None).unwrap().frames == whole, "{topics:?}");
    }
}

/// Frames behind one whose message is gone keep their places, although all moments have as many bytes.
#[test]
fn a_frame_whose_message_is_gone_moves_no_later_one() {
    let folder = Folder::new("recording-moved-gone");
    let (bytes, truth) = numbered(&folder, &[]);
    for how in [chunked(), unchunked()] {
        let order = |all: &mut Vec<Message<'_>>| {
            let number = all.iter().filter(|message| message.channel.topic == "/camera").nth(70).unwrap().sequence;
            all.retain(|message| message.channel.topic != "/camera" || message.sequence != number);
            all.sort_by_key(|message| message.channel.id);
        };
        let gone = rewritten(&bytes, Rewrite { order: &order, ..plain(how) });
        let (code, frames, said) = recovered(&folder, &gone, &truth);
        assert_eq!((code, frames), (Some(0), 299), "{said}");
        let found = stream(&folder.0.join("new.mcap"), None).unwrap();
        let lost: Vec<_> = found.frames.iter().enumerate().filter(|(_, frame)| frame.is_none()).collect();
        assert!(matches!(lost[..], [(70, _)]), "{lost:?}: {said}");
    }
}

/// Frames that were left out with all checksums are lost in their places, by the times of the others.
#[test]
fn frames_left_out_with_all_checksums_are_lost_in_their_places() {
    let folder = Folder::new("recording-moved-holes");
    let (bytes, truth) = numbered(&folder, &[]);
    let [file, new] = ["holes.mcap", "new.mcap"].map(|name| folder.0.join(name));
    let recover = |bytes: &[u8], is_bare, options, order: &dyn Fn(&mut Vec<Message<'_>>)| {
        let how = Rewrite { topic: &no_sums, order, is_bare, ..plain(options) };
        fs::write(&file, rewritten(bytes, how)).unwrap();
        said(&run(&["recover", file.to_str().unwrap(), "-o", new.to_str().unwrap(), "--force"]))
    };
    let lz4 = || chunked().compression(Some(mcap::Compression::Lz4));
    for holes in [0..FRAMES - 1, 100..140] {
        let is_gone = |number: u32| holes.contains(&number) && number % 2 == 1;
        let order = |all: &mut Vec<Message<'_>>| {
            all.retain(|message| !is_gone((message.log_time as f64 * 30e-9).round() as u32));
            // Numbers say nothing any longer.
            all.iter_mut().zip(0..).for_each(|(message, number)| message.sequence = number);
        };
        let expected: Vec<_> =
            truth.frames.iter().zip(0..).map(|(frame, number)| frame.clone().filter(|_| !is_gone(number))).collect();
        for (is_bare, options) in [(true, chunked()), (true, lz4()), (true, unchunked()), (false, chunked())] {
            let text = recover(&bytes, is_bare, options, &order);
            assert!(text.contains("damaged, recorded as lost"), "{text}");
            assert!(stream(&new, None).unwrap().frames == expected, "{is_bare} {holes:?}");
            // The record at the end has the number of all frames.
            assert_eq!(stream(&file, None).map(|found| found.frames == expected), is_bare.then_some(true), "{holes:?}");
        }
    }
    let order = |all: &mut Vec<Message<'_>>| all.iter_mut().for_each(|of| (of.log_time, of.publish_time) = (9, 9));
    recover(&bytes, true, chunked(), &order);
    for name in [&file, &new] {
        let uneven = ": frame 1 comes 0.0 ms after the one before, expected 33.3 ms";
        prints(&["run", text(name), "--json"], &[uneven]);
    }
    // A frame that is no picture is left out, as the new file would end there.
    let text = recover(&bytes, true, unchunked(), &|all| {
        frames_of(all)[120..121].iter().for_each(|place| all[*place].data.to_mut()[0] = 0);
    });
    let expected = truth.frames.iter().zip(0..).map(|(frame, number)| frame.clone().filter(|_| number != 120));
    assert!(stream(&new, None).unwrap().frames == expected.collect::<Vec<_>>() && text.contains("1 frame"), "{text}");
    // If only a picture is gone, what followed from it is no part of the moment before, of whatever sensor and time
    // that is.
    let sensors = several(&folder, &[]);
    for (bytes, damaged) in [(&bytes, 0..0), (&bytes, 20..21), (&sensors, 0..0)] {
        recover(bytes, true, chunked(), &|all| {
            frames_of(all)[damaged.clone()].iter().for_each(|place| all[*place].log_time = u64::MAX);
            all.remove(frames_of(all)[120]);
        });
        let (new, mut of_moment) = (fs::read(&new).unwrap(), None);
        for message in mcap::MessageStream::new(&new).unwrap().map(Result::unwrap) {
            let topic = &message.channel.topic;
            let of = (SENSORS.iter().position(|(name, ..)| topic.starts_with(&format!("/{name}/"))), message.log_time);
            let first = *of_moment.get_or_insert(of);
            let is_line = topic.contains("events") || topic.contains("faults");
            let is_sum = topic == "/sums/json";
            let follows = of == first || (is_line && of.0 == first.0 && of.1 < first.1);
            assert!(is_sum || follows, "{topic}: {of:?} in the moment of {first:?}");
            of_moment = of_moment.filter(|_| !is_sum);
        }
    }
}

/// Each of several sensors has times of its own.
#[test]
fn a_sensors_frame_left_out_with_all_checksums_is_lost_in_its_place() {
    let folder = Folder::new("recording-moved-sensors");
    let order = |all: &mut Vec<Message<'_>>| {
        let is_of_left = |message: &Message<'_>| message.channel.topic.starts_with("/left/");
        let of_left = frames_of(all).into_iter().filter(|&place| is_of_left(&all[place]));
        let time = of_left.map(|place| all[place].log_time).nth(60);
        all.retain(|message| !is_of_left(message) || Some(message.log_time) != time);
    };
    let how = Rewrite { topic: &no_sums, order: &order, is_bare: true, ..plain(chunked()) };
    let file = folder.file("hole.mcap", rewritten(&several(&folder, &[]), how));
    run(&["recover", file.to_str().unwrap(), "-o", &folder.path("new.mcap")]);
    for (name, ..) in SENSORS {
        let [mut whole, found] =
            ["whole.mcap", "new.mcap"].map(|of| stream(&folder.0.join(of), Some(name)).unwrap().frames);
        if name == "left" {
            *whole.iter_mut().filter(|frame| frame.is_some()).nth(60).unwrap() = None;
        }
        assert!(found == whole, "{name}");
    }
}

/// Frames of a recording behind another one in the same file are not copied, and counted. Copies of the first are none.
#[test]
fn a_second_recording_is_counted() {
    let folder = Folder::new("recording-moved-second");
    let (first, truth) = numbered(&folder, &[]);
    let (second, (frames, _)) = small(&folder, &[]);
    for is_damaged in [false, true] {
        let (places, mut first) = (chunks(&first), first.clone());
        first[places[1] + 500] ^= u8::from(is_damaged);
        let (start, rest) = second.split_at(chunks(&second)[1]);
        let parts = [&first[..places[3]], &start[8..], &first[places[0]..places[1]], rest];
        let (code, found, said) = recovered(&folder, &parts.concat(), &truth);
        assert_eq!((code, found > 0 && found < FRAMES.into()), (Some(1), true), "{said}");
        assert!(said.contains(&format!("has {frames} frames of another recording, which were not copied")), "{said}");
    }
}

/// MCAP gives these operation codes no meaning yet. Readers skip them.
#[test]
fn records_that_nothing_describes_are_no_damage() {
    let folder = Folder::new("recording-moved-unknown");
    let (bytes, recorded) = small(&folder, &[]);
    let bytes = rewritten(&bytes, plain(chunked().emit_summary_records(false).calculate_data_section_crc(false)));
    let start = 17 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    for op in [0x10, 0x7F, 0x80] {
        let record = [&[op, 5, 0, 0, 0, 0, 0, 0, 0][..], b"later"].concat();
        let outcome = outcome(&folder, &[&bytes[..start], &record, &bytes[start..]].concat());
        assert_eq!((outcome.run, outcome.recover), (Some(0), Some(0)), "{op}: {}", outcome.said);
        assert_eq!(outcome.found, Some(recorded), "{op}: {}", outcome.said);
    }
}

/// A recording without its frames, or with those of two, is refused with the reason.
#[test]
fn a_recording_with_other_topics_is_refused() {
    let folder = Folder::new("recording-moved-order");
    let other = |topic: &str| Some(format!("/robot{}", topic.replace("/camera", "/picture")));
    let two = |topic: &str| Some(format!("{}{topic}", if topic == "/faults/json" { "/left" } else { "/right" }));
    let no_camera = |topic: &str| (topic != "/camera").then(|| topic.to_owned());
    let (bytes, recorded) = small(&folder, &[]);
    let named = |topic| Rewrite { topic, ..plain(chunked()) };
    for (what, how, direct, parts) in [
        (
            "without frames",
            named(&no_camera),
            "expected /camera or /taxels/sums",
            "has no frame that can be recovered (found 1",
        ),
        ("with another name", named(&other), "has no frame (found the topics ", "/robot/picture of schema foxglove."),
        ("with two prefixes", named(&two), "has the topics of two recordings", "\"/right/\""),
    ] {
        let outcome = outcome(&folder, &rewritten(&bytes, how));
        assert_eq!((outcome.run, outcome.recover), (Some(1), Some(1)), "{what}: {}", outcome.said);
        assert_has(&outcome.said, &[direct, parts]);
    }
    // Without the checksums, those of chunks vouch for the frames, and nothing says where some were lost.
    let outcome = outcome(&folder, &rewritten(&bytes, named(&no_sums)));
    assert_eq!((outcome.run, outcome.recover), (Some(0), Some(0)), "{}", outcome.said);
    assert_eq!(outcome.found, Some(recorded), "{}", outcome.said);
}

/// Checksums of frames are checked if there are none of chunks.
#[test]
fn a_wrong_frame_in_no_chunk_is_noticed() {
    let folder = Folder::new("recording-moved-bytes");
    let (bytes, truth) = numbered(&folder, &[]);
    let mut anew = rewritten(&bytes, plain(unchunked()));
    let frame = 70_u32.to_be_bytes().into_iter().chain((0..21).map(|place| (70 * 7 + place * 13) as u8));
    let frame: Vec<u8> = frame.collect();
    let at = anew.windows(25).position(|window| window == frame).unwrap();
    assert_eq!(recovered(&folder, &anew, &truth).1, 300);
    anew[at + 9] ^= 4;
    ends(&["run", &folder.written("a.mcap", &anew)], 1, &[]);
    let (code, frames, said) = recovered(&folder, &anew, &truth);
    assert_eq!((code, frames), (Some(0), 299), "{said}");
}

/// A damaged index that names no checksums does not hide those that there are.
#[test]
fn a_damaged_index_hides_no_checksums() {
    let folder = Folder::new("recording-moved-index");
    let (bytes, truth) = numbered(&folder, &[]);
    // Neither the data nor the index has a checksum.
    let plainly = || unchunked().calculate_data_section_crc(false).calculate_summary_section_crc(false);
    let anew = rewritten(&bytes, plain(plainly()));
    let place = |part: &[u8]| anew.windows(part.len()).rposition(|window| window == part).unwrap();
    let (index, frame) = (place(b"/sums/json"), place(&70_u32.to_be_bytes()));
    for flips in [&[index + 1][..], &[frame + 9], &[index + 1, frame + 9]] {
        let mut damaged = anew.clone();
        for &at in flips {
            damaged[at] ^= 4;
        }
        let (code, frames, said) = recovered(&folder, &damaged, &truth);
        let expected = if flips.contains(&(frame + 9)) { 299 } else { 300 };
        assert_eq!((code, frames), (Some(0), expected), "{flips:?}: {said}");
    }
}

/// Nothing but lost frames, and no frame at all.
#[test]
fn a_recording_without_a_frame_is_an_error() {
    let folder = Folder::new("recording-moved-none");
    let clip = folder.file("none.y4m", "YUV4MPEG2 W40 H40 F30:1 Cmono\n");
    let [name, new] = ["none.mcap", "new.mcap"].map(|name| folder.path(name));
    let _ = run(["record", text(&clip), "-o", &name]);
    for arguments in [&["run", &name][..], &["recover", &name, "-o", &new]] {
        ends(arguments, 1, &["none.mcap: has no frame"]);
    }
}

/// A file of another program without any checksum is copied, and that is said.
#[test]
fn nothing_vouches_for_a_file_without_checksums() {
    let folder = Folder::new("recording-moved-foreign");
    let before = fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/command/recording/before.mcap")).unwrap();
    let without = || chunked().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    for options in [without(), unchunked()] {
        let outcome = outcome(&folder, &rewritten(&before, plain(options)));
        assert_eq!((outcome.run, outcome.recover), (Some(0), Some(0)), "{}", outcome.said);
        assert_eq!(outcome.found, Some((137, 3)), "{}", outcome.said);
        assert_has(&outcome.said, &["nothing vouches for its frames", "137 frames without a checksum"]);
    }
}
