use std::fs;

use png::{BitDepth, ColorType};
use wstac_core::green::any::PixelFormat;

use super::*;
use crate::source::FaultKind;
use crate::source::open::{OpenOptions, open};

struct Folder(tempfile::TempDir);

impl Folder {
    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.0.path().join(name), bytes).unwrap();
    }

    fn picture(&self, name: &str, width: u32, color: ColorType, depth: BitDepth, data: &[u8]) {
        self.write(name, &encoded(width, color, depth, data));
    }

    fn open(&self) -> Result<PngFolder, Error> {
        PngFolder::open(self.0.path(), None)
    }
}

/// Encodes a picture of one row.
fn encoded(width: u32, color: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ColorType::Indexed {
        encoder.set_palette(vec![9, 8, 7, 6, 5, 4]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

fn frames(source: &mut dyn Source) -> Vec<Option<Vec<u8>>> {
    let mut frames = vec![];
    loop {
        match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, .. }) => frames.push(Some(bytes.to_vec())),
            SourceEvent::Lost { frames: 1, .. } => frames.push(None),
            SourceEvent::Fault(fault)
                if matches!(fault.kind, FaultKind::Decoder | FaultKind::Turned | FaultKind::Spacing) => {}
            SourceEvent::End => return frames,
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn every_type_of_picture() {
    use BitDepth::{Eight, One, Sixteen};
    for (color, depth, data, format, expected) in [
        (ColorType::Grayscale, Eight, &[1, 2][..], PixelFormat::Gray, &[1, 2][..]),
        (ColorType::Grayscale, One, &[0b0100_0000], PixelFormat::Gray, &[0, 255]),
        (ColorType::GrayscaleAlpha, Eight, &[1, 2, 3, 4], PixelFormat::Gray, &[1, 3]),
        (ColorType::Rgb, Eight, &[1, 2, 3, 4, 5, 6], PixelFormat::Rgb24, &[1, 2, 3, 4, 5, 6]),
        (ColorType::Indexed, Eight, &[1, 0], PixelFormat::Rgb24, &[6, 5, 4, 9, 8, 7]),
        (ColorType::Rgba, Eight, &[1, 2, 3, 4, 5, 6, 7, 8], PixelFormat::Rgbx32, &[1, 2, 3, 4, 5, 6, 7, 8]),
        (ColorType::Grayscale, Sixteen, &[1, 2, 3, 4], PixelFormat::Y16, &[2, 1, 4, 3]),
        (ColorType::GrayscaleAlpha, Sixteen, &[1, 2, 3, 4, 5, 6, 7, 8], PixelFormat::Y16, &[2, 1, 6, 5]),
        (ColorType::Rgb, Sixteen, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], PixelFormat::Y16, &[4, 3, 10, 9]),
        (ColorType::Rgba, Sixteen, &[0; 16], PixelFormat::Y16, &[0; 4]),
    ] {
        let folder = Folder(tempfile::tempdir().unwrap());
        folder.picture("a.png", 2, color, depth, data);
        let mut source = folder.open().unwrap();
        let info = source.info().clone();
        assert_eq!((info.format, info.rate), (format, FrameRate::NOMINAL));
        assert_eq!(info.bytes_per_row as usize, expected.len());
        assert_eq!(frames(&mut source), [Some(expected.to_vec())], "{color:?} {depth:?}");
    }
}

#[test]
fn natural_order_and_lost_frames() {
    let folder = Folder(tempfile::tempdir().unwrap());
    folder.write("frame0.png", b"not a picture");
    for (name, value) in [("frame10.png", 10), ("frame2.PNG", 2), ("frame1.png", 1)] {
        folder.picture(name, 1, ColorType::Grayscale, BitDepth::Eight, &[value]);
    }
    let whole = encoded(1, ColorType::Grayscale, BitDepth::Eight, &[5]);
    folder.write("frame5.png", &whole[..whole.len() - 20]);
    folder.write("frame6.png", b"");
    folder.write("notes.txt", b"not a picture either");
    folder.write(".frame3.png", b"nor this");
    let expected = [None, Some(1), Some(2), None, None, Some(10)];
    let found = frames(&mut folder.open().unwrap());
    assert_eq!(found, expected.map(|value| value.map(|value| vec![value])));
}

#[test]
fn names_in_several_notations_are_in_order_and_tell_a_gap() {
    for (kind, name) in [
        ("hex", &(|n| format!("{:x}.png", 0x9F0_u32 + n)) as &dyn Fn(u32) -> String),
        ("z", &|n| {
            let fraction = if n % 25 == 0 { String::new() } else { format!(".{:03}", n % 25 * 40) };
            format!("2026-11-27T10:00:{:02}{fraction}Z.png", n / 25)
        }),
        ("clock", &|n| format!("10{:02}{:02}.{:03}.png", 58 + n / 50, (58 + n / 25) % 60, n % 25 * 40)),
    ] {
        let folder = Folder(tempfile::tempdir().unwrap());
        for n in (0..60).filter(|n| *n != 37) {
            folder.picture(&name(n), 1, ColorType::Grayscale, BitDepth::Eight, &[n as u8]);
        }
        let mut source = open(folder.0.path(), &OpenOptions::default(), &[]).unwrap();
        assert_eq!(source.info().rate.numerator(), if kind == "hex" { 30 } else { 25 }, "{kind}");
        let found = frames(&mut *source);
        assert!(found == (0..60).map(|n| (n != 37).then(|| vec![n])).collect::<Vec<_>>(), "{kind}: {found:?}");
    }
}

#[test]
fn a_picture_of_another_size_or_type_is_named() {
    for (width, color, data, part) in [
        (2, ColorType::Grayscale, &[1, 2][..], "2x1 8-bit gray, expected 1x1 8-bit gray as a1.png"),
        (1, ColorType::Rgb, &[1, 2, 3], "1x1 8-bit RGB, expected 1x1 8-bit gray as a1.png"),
    ] {
        let folder = Folder(tempfile::tempdir().unwrap());
        folder.picture("a1.png", 1, ColorType::Grayscale, BitDepth::Eight, &[1]);
        folder.picture("a2.png", width, color, BitDepth::Eight, data);
        folder.picture("a3.png", 1, ColorType::Grayscale, BitDepth::Eight, &[1]);
        let mut source = folder.open().unwrap();
        assert!(source.info().about.contains(": 3 PNG files, 1x1 "), "{}", source.info().about);
        assert!(matches!(source.next_event(), Ok(SourceEvent::Frame(_))));
        let error = source.next_event().unwrap_err().to_string();
        assert!(error.contains("a2.png: is ") && error.contains(part), "{error}");
        assert!(matches!(source.next_event(), Ok(SourceEvent::End)));
    }
}

#[test]
fn what_cannot_be_a_source_is_named() {
    let folder = Folder(tempfile::tempdir().unwrap());
    let message = |folder: &Folder| folder.open().err().unwrap().to_string();
    folder.write("a.png", b"x");
    assert!(message(&folder).contains("no PNG file of 1 can be read; a.png: "));
    // This header claims 2^31 − 1 pixels each way.
    let mut bytes = encoded(1, ColorType::Rgb, BitDepth::Eight, &[1, 2, 3]);
    bytes[16..24].copy_from_slice(&[0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF]);
    let crc = crc32fast::hash(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    folder.write("a.png", &bytes);
    let error = message(&folder);
    assert!(error.contains("a.png: frame size is 2147483647x2147483647, expected 1 to 16384"), "{error}");
    assert!(PngFolder::open(Path::new("/nowhere"), None).err().unwrap().to_string().contains("no such file"));
}

#[test]
fn pictures_are_turned_as_their_exif_data_say() {
    let folder = Folder(tempfile::tempdir().unwrap());
    for (name, orientation, size, pixels) in [
        ("1.png", 6, (3, 2), [1, 2, 3, 4, 5, 6]),
        ("2.png", 6, (3, 2), [1, 2, 3, 4, 5, 6]),
        ("3.png", 7, (3, 2), [3, 2, 1, 6, 5, 4]),
    ] {
        let mut info = png::Info::with_size(size.0, size.1);
        let exif = [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", &[orientation, 0, 0, 0][..]].concat();
        info.exif_metadata = Some(exif.into());
        let mut bytes = vec![];
        let encoder = png::Encoder::with_info(&mut bytes, info).unwrap();
        encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
        folder.write(name, &bytes);
    }
    let mut source = folder.open().unwrap();
    assert_eq!(<(u32, u32)>::from(source.info().size), (2, 3));
    let Ok(SourceEvent::Fault(fault)) = source.next_event() else { panic!("no fault") };
    assert_eq!(fault.kind, FaultKind::Turned);
    let why = "1.png: turned by 90 degrees clockwise, as its Exif data say; others are turned, too";
    assert!(fault.message.ends_with(why), "{fault}");
    assert_eq!(frames(&mut source), vec![Some(vec![4, 1, 5, 2, 6, 3]); 3]);
}
