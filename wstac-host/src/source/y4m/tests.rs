use std::io::Write;

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::QuantizationRange;

use super::*;

/// A reader that hands out one byte per read.
struct Dripping(std::io::Cursor<Vec<u8>>);

impl Read for Dripping {
    fn read(&mut self, room: &mut [u8]) -> std::io::Result<usize> {
        let one = room.len().min(1);
        self.0.read(&mut room[..one])
    }
}

fn open(bytes: &[u8]) -> Result<Y4m, Error> {
    Y4m::from_reader("clip.y4m", std::io::Cursor::new(bytes.to_vec()), None)
}

fn with_fps(header: &str, fps: u32) -> Result<Y4m, Error> {
    let bytes = std::io::Cursor::new(header.as_bytes().to_vec());
    Y4m::from_reader("clip.y4m", bytes, Some(FrameRate::new(fps, 1).unwrap()))
}

fn frames(source: &mut Y4m) -> (Vec<Vec<u8>>, Option<String>) {
    let mut frames = vec![];
    loop {
        match source.next_event() {
            Ok(SourceEvent::Frame(Frame { bytes, .. })) => frames.push(bytes.to_vec()),
            Ok(SourceEvent::End) => return (frames, None),
            Ok(other) => panic!("{other:?}"),
            Err(error) => {
                assert!(matches!(source.next_event(), Ok(SourceEvent::End)), "ended after an error");
                return (frames, Some(error.to_string()));
            }
        }
    }
}

/// Makes three frames of `size` bytes, with and without frame parameters.
fn clip(header: &str, size: usize) -> (Vec<u8>, Vec<Vec<u8>>) {
    let frames: Vec<_> = (0..3).map(|frame| (0..size).map(|k| (frame * 7 + k) as u8).collect::<Vec<u8>>()).collect();
    let mut bytes = header.as_bytes().to_vec();
    for (frame, line) in frames.iter().zip(["FRAME\n", "FRAME Ip\n", "FRAME\n"]) {
        bytes.extend(line.as_bytes());
        bytes.extend(frame);
    }
    (bytes, frames)
}

#[test]
fn every_format_and_odd_sizes() {
    for (format, expected, size) in [
        ("", PixelFormat::Yu12, 7 * 5 + 2 * 4 * 3),
        (" C420", PixelFormat::Yu12, 7 * 5 + 2 * 4 * 3),
        (" C420jpeg", PixelFormat::Yu12, 7 * 5 + 2 * 4 * 3),
        (" C420mpeg2", PixelFormat::Yu12, 7 * 5 + 2 * 4 * 3),
        (" C420paldv", PixelFormat::Yu12, 7 * 5 + 2 * 4 * 3),
        (" C422", PixelFormat::Yuv422p, 7 * 5 + 2 * 4 * 5),
        (" C444", PixelFormat::Yuv444p, 3 * 7 * 5),
        (" Cmono", PixelFormat::Gray, 7 * 5),
        (" Cmono10", PixelFormat::Y10, 2 * 7 * 5),
        (" Cmono12", PixelFormat::Y12, 2 * 7 * 5),
        (" Cmono16", PixelFormat::Y16, 2 * 7 * 5),
    ] {
        let (bytes, expected_frames) = clip(&format!("YUV4MPEG2 Ip H5 F30000:1001 W7 A1:1{format}\n"), size);
        let mut source = open(&bytes).unwrap();
        assert_eq!(source.info().format, expected);
        assert_eq!((source.info().size.width(), source.info().size.height()), (7, 5));
        assert_eq!((source.info().rate.numerator(), source.info().rate.denominator()), (30_000, 1001));
        assert_eq!(frames(&mut source), (expected_frames.clone(), None), "{format}");
        let dripping = Dripping(std::io::Cursor::new(bytes));
        let mut source = Y4m::from_reader("drip", dripping, None).unwrap();
        assert_eq!(frames(&mut source), (expected_frames, None), "{format}, a byte at a time");
    }
}

#[test]
fn the_range_is_what_the_header_says() {
    for (tag, expected) in [
        ("", QuantizationRange::Limited),
        (" XCOLORRANGE=FULL", QuantizationRange::Full),
        (" XCOLORRANGE=LIMITED XYSCSS=420JPEG Xwhatever", QuantizationRange::Limited),
    ] {
        let source = open(format!("YUV4MPEG2 W2 H2 F1:1{tag}\n").as_bytes()).unwrap();
        assert_eq!(source.info().color.range, expected);
    }
}

#[test]
fn gray_of_limited_range_becomes_full() {
    let mono = [0, 16, 17, 126, 235, 255];
    for (format, bits) in [("mono", 8), ("mono10", 10), ("mono12", 12), ("mono16", 16)] {
        for (range, expected) in [("LIMITED", [0, 0, 1, 128, 255, 255]), ("FULL", mono)] {
            let mut bytes = format!("YUV4MPEG2 W6 H1 F1:1 C{format} XCOLORRANGE={range}\nFRAME\n").into_bytes();
            let words = mono.map(|level: u16| (level << (bits - 8)).to_le_bytes());
            bytes.extend(words.iter().flat_map(|word| &word[..if bits == 8 { 1 } else { 2 }]));
            let mut source = open(&bytes).unwrap();
            source.has_next();
            let found = frames(&mut source).0.concat();
            let levels = found.chunks(if bits == 8 { 1 } else { 2 });
            let levels: Vec<_> = levels
                .map(|word| word.iter().rev().fold(0, |all, byte| all << 8 | u32::from(*byte)) >> (bits - 8))
                .collect();
            assert_eq!(levels, expected.map(u32::from), "{format} {range}");
        }
    }
}

#[test]
fn what_is_wrong_with_a_header_is_named() {
    for (header, part) in [
        ("", "is empty"),
        ("RIFFxxxxAVI ", "starts with \"RIFFxxxxAV\", expected \"YUV4MPEG2 \""),
        ("YUV4MPEG W2", "starts with \"YUV4MPEG W\""),
        ("YUV4MPEG2 W2", "ends within its header, after 12 bytes"),
        ("YUV4MPEG2\n", "W is missing, expected a number from 1 to 16384"),
        ("YUV4MPEG2 Wabc H2 F1:1\n", "W is \"abc\", expected a number from 1 to 16384"),
        ("YUV4MPEG2 W+2 H2 F1:1\n", "W is \"+2\", expected"),
        ("YUV4MPEG2 W2 H16385 F1:1\n", "H is \"16385\", expected a number from 1 to 16384"),
        ("YUV4MPEG2 W2 F1:1\n", "H is missing"),
        ("YUV4MPEG2 W2 W2 H2 F1:1\n", "header has W twice"),
        ("YUV4MPEG2 W2 H2\n", "F is missing, expected a rate as in 30:1; state the rate with --fps"),
        ("YUV4MPEG2 W2 H2 F0:0\n", "F is \"0:0\", expected a rate as in 30:1; state the rate with --fps"),
        ("YUV4MPEG2 W2 H2 F30\n", "F is \"30\", expected a rate"),
        ("YUV4MPEG2 W2 H2 F1:1 Iq\n", "I is \"q\", expected ?, p, t, b or m"),
        ("YUV4MPEG2 W2 H2 F1:1 A1\n", "A is \"1\", expected"),
        ("YUV4MPEG2 W2 H2 F1:1 Z1\n", "tag \"Z1\", expected W, H"),
        ("YUV4MPEG2 W2 H2 F1:1 C420p10 XYSCSS=420P10\n", "C is \"420p10\", expected 420,"),
        ("YUV4MPEG2 W2 H2 F1:1 C444alpha\n", "C is \"444alpha\""),
        ("YUV4MPEG2 W2 H2 F1:1 C411\n", "C is \"411\""),
        ("YUV4MPEG2 W2 H2 F1:1 XYSCSS=411\n", "XYSCSS is \"411\""),
        ("YUV4MPEG2 W2 H2 F1:1 XCOLORRANGE=WIDE\n", "XCOLORRANGE is \"WIDE\", expected FULL or LIMITED"),
    ] {
        let message = open(header.as_bytes()).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(message.starts_with("clip.y4m: ") && message.contains(part), "{header:?} gave {message:?}");
    }
    let long = format!("YUV4MPEG2 X{}", "x".repeat(LONGEST_LINE));
    assert!(open(long.as_bytes()).err().unwrap().to_string().contains("no end in 4096 bytes"));
    let replaced = "30:1 frames per second as --fps says; without it, 25:1";
    for (rate, remark) in [("", ""), (" F0:0", ""), (" F30:1", ""), (" F60:2", ""), (" F25:1", replaced)] {
        let source = with_fps(&format!("YUV4MPEG2 W2 H2{rate}\n"), 30).unwrap();
        assert_eq!(source.info().rate, FrameRate::NOMINAL);
        let about = &source.info().about;
        let is_said = about.contains("as --fps says");
        assert!(is_said != remark.is_empty() && about.contains(remark), "{about}");
    }
}

#[test]
fn a_cut_stream_gives_its_whole_frames_then_says_so() {
    let header = "YUV4MPEG2 W4 H4 F30:1 Cmono\n";
    let (bytes, expected) = clip(header, 16);
    // A frame takes 22 bytes, the second one 3 more.
    for (kept, frames_left, part) in [
        (64, 2, "frame 2 (the first is 0) has 11 bytes, expected 16"),
        (53, 2, "frame 2 (the first is 0) has 0 bytes, expected 16"),
        (50, 2, "frame 2 (the first is 0) ends within its FRAME line"),
        (21, 0, "frame 0 (the first is 0) has 15 bytes, expected 16"),
    ] {
        let mut source = open(&bytes[..header.len() + kept]).unwrap();
        let (found, error) = frames(&mut source);
        assert_eq!(found, expected[..frames_left]);
        let error = error.unwrap();
        assert!(error.contains("clip.y4m: truncated") && error.contains(part), "{error}");
    }
}

#[test]
fn what_is_no_frame_is_named() {
    let header = "YUV4MPEG2 W2 H2 F1:1 Cmono\n";
    for (rest, part) in [
        ("FRAME\nabcdGARBAGE".to_owned(), "frame 1 starts with \"GARBAG\", expected \"FRAME\""),
        (format!("FRAME {}", "x".repeat(LONGEST_LINE)), "FRAME line of frame 0 has no end in 4096 bytes"),
    ] {
        let mut source = open(format!("{header}{rest}").as_bytes()).unwrap();
        let error = frames(&mut source).1.unwrap();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_header_that_claims_much_takes_no_memory_before_bytes_come() {
    let mut source = open(b"YUV4MPEG2 W16384 H16384 F30:1 C444\nFRAME\nabc").unwrap();
    let error = frames(&mut source).1.unwrap();
    assert!(error.contains("has 3 bytes, expected 805306368"), "{error}");
    assert!(source.reader.buffer.len() <= 2 * FIRST_READ);
}

#[test]
fn a_pipe_is_waited_for_and_then_goes_on() {
    let (reader, mut writer) = std::io::pipe().unwrap();
    writer.write_all(b"YUV4MPEG2 W2 H2 F1:1 Cmono\nFRA").unwrap();
    let mut source = Y4m::from_fd("standard input", &reader, None).unwrap();
    drop(reader);
    assert!(matches!(source.next_event(), Ok(SourceEvent::Waiting)));
    writer.write_all(b"ME\nab").unwrap();
    assert!(matches!(source.next_event(), Ok(SourceEvent::Waiting)));
    writer.write_all(b"cdFRAME\nefgh").unwrap();
    drop(writer);
    assert_eq!(frames(&mut source), (vec![b"abcd".to_vec(), b"efgh".to_vec()], None));
}

#[test]
fn what_cannot_be_opened_is_named() {
    let message = |path: &str| Y4m::open(Path::new(path), None).err().unwrap().to_string();
    assert!(message("/nowhere/clip.y4m").starts_with("/nowhere/clip.y4m: no such file"));
    assert!(message("/").contains("/: is a folder"));
    assert!(message("/dev/null").contains("is empty"));
}
