use std::fs;

use jpeg_encoder::{ColorType, Encoder};

use super::*;
use crate::source::open::{OpenOptions, open};
use crate::source::{Fault, LossReason};

const SIDE: u16 = 48;

/// Returns a picture of one color.
fn jpeg(width: u16, color: [u8; 3], is_progressive: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 95);
    encoder.set_progressive(is_progressive);
    let pixels = color.repeat(usize::from(width) * usize::from(SIDE));
    encoder.encode(&pixels, width, SIDE, ColorType::Rgb).unwrap();
    bytes
}

fn gray(level: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels = vec![level; usize::from(SIDE) * usize::from(SIDE)];
    Encoder::new(&mut bytes, 95).encode(&pixels, SIDE, SIDE, ColorType::Luma).unwrap();
    bytes
}

/// Returns a folder with these files.
fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

/// Returns the green of the first pixel of every frame, `None` for a lost one, and the faults.
fn greens(source: &mut dyn Source) -> (Vec<Option<u8>>, Vec<String>) {
    let (mut found, mut faults) = (vec![], vec![]);
    loop {
        match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, encoded, .. }) => {
                assert_eq!(bytes.len(), 3 * usize::from(SIDE) * usize::from(SIDE));
                assert!(encoded.is_none_or(|jpeg| jpeg.starts_with(&[0xff, 0xd8])));
                found.push(Some(bytes[1]));
            }
            SourceEvent::Lost { frames: 1, reason } if reason.is_of_jpeg() => found.push(None),
            // Pictures of the numbers between.
            SourceEvent::Lost { frames, reason: LossReason::Missing } => found.extend((0..frames).map(|_| None)),
            SourceEvent::Fault(Fault { message, .. }) => faults.push(message),
            SourceEvent::End => return (found, faults),
            other => panic!("{other:?}"),
        }
    }
}

fn message(folder: &Path) -> String {
    open(folder, &OpenOptions::default(), &[]).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn pictures_come_in_natural_order_and_damaged_ones_are_lost() {
    let cut = jpeg(SIDE, [0, 99, 0], false);
    let folder = folder(&[
        ("a10.jpg", &jpeg(SIDE, [0, 200, 0], false)),
        ("a2.JPEG", &jpeg(SIDE, [0, 120, 0], true)),
        ("a1.jpg", &gray(40)),
        ("a0.jpg", b"none"),
        ("a3.jpg", &cut[..cut.len() - 5]),
        (".a4.jpg", b"hidden"),
        ("notes.txt", b"none"),
    ]);
    let mut source = open(folder.path(), &OpenOptions::default(), &[]).unwrap();
    assert!(source.info().about.contains("5 JPEG files, 48x48, 30:1 frames per second"), "{}", source.info().about);
    assert_eq!(source.info().format, PixelFormat::Rgb24);
    let (found, faults) = greens(source.as_mut());
    let expected = [None, Some(40), Some(120), None, None, None, None, None, None, None, Some(200)];
    let why = "a0.jpg: cannot be decoded: its headers are not those of a JPEG picture; others count as lost, too";
    assert!(faults[0].ends_with(why), "{faults:?}");
    assert!(
        faults[1].ends_with("6 frames are missing, by the numbers in their names: 1 to 7 apart, expected 1"),
        "{faults:?}"
    );
    assert_eq!(faults.len(), 2);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found.is_some(), expected.is_some());
        assert!(found.zip(expected).is_none_or(|(found, expected)| found.abs_diff(expected) < 4), "{found:?}");
    }
}

#[test]
fn a_picture_of_another_size_is_named() {
    let one = jpeg(SIDE, [0, 1, 0], false);
    let folder = folder(&[("1.jpg", &one), ("2.jpg", &jpeg(SIDE + 8, [0, 1, 0], false)), ("3.jpg", &one)]);
    let mut source = JpegFolder::open(folder.path(), None).unwrap();
    assert!(matches!(source.next_event(), Ok(SourceEvent::Frame(_))));
    let error = source.next_event().unwrap_err().to_string();
    assert!(error.contains("2.jpg: is 56x48, expected 48x48 as 1.jpg"), "{error}");
    assert!(matches!(source.next_event(), Ok(SourceEvent::End)));
}

#[test]
fn folders_that_are_no_source_are_named() {
    let one = jpeg(SIDE, [0, 1, 0], false);
    assert!(message(folder(&[("a.txt", b"")]).path()).contains("has no .png or .jpg file, expected at least one"));
    let error = message(folder(&[("1.TIFF", &one), ("2.tiff", b"")]).path());
    let help = "has .TIFF files, expected .png or .jpg; help: mogrify -format png *.TIFF makes PNG files of them";
    assert!(error.ends_with(help), "{error}");
    let mixed = folder(&[("1.jpg", &one), ("2.jpeg", &one), ("3.png", b"")]);
    let error = message(mixed.path());
    assert!(error.contains("has 1 PNG file and 2 JPEG files, expected pictures of one kind"), "{error}");
    let error = message(folder(&[("1.jpg", b"none"), ("2.jpg", b"")]).path());
    let why = "no JPEG file of 2 can be read; 1.jpg: its headers are not those of a JPEG picture";
    assert!(error.ends_with(why), "{error}");
    // The headers claim 65535 x 65535 pixels.
    let mut large = one.clone();
    let at = large.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    large[at + 5..at + 9].fill(0xff);
    let error = message(folder(&[("1.jpg", &large)]).path());
    assert!(error.contains("1.jpg: frame size is 65535x65535, expected 1 to 16384"), "{error}");
    large[at + 1] = 0xc9;
    let error = message(folder(&[("1.jpg", &large)]).path());
    assert!(error.contains("1.jpg: its coding is arithmetic; help: mogrify -path NEW "), "{error}");
    // A single picture is no source.
    let single = folder(&[("1.jpg", &one)]);
    let error = message(&single.path().join("1.jpg"));
    assert!(error.contains("a picture is read with all of its folder, so name that"), "{error}");
}

#[test]
fn pictures_are_turned_as_their_exif_data_say() {
    // The upper half is bright, as it is stored.
    let mut stored = Vec::new();
    let pixels: Vec<u8> =
        (0..SIDE).flat_map(|y| vec![if y < SIDE / 2 { 200 } else { 20 }; usize::from(SIDE)]).collect();
    Encoder::new(&mut stored, 95).encode(&pixels, SIDE, SIDE, ColorType::Luma).unwrap();
    let with = |orientation: u8| {
        let exif = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0";
        [&stored[..2], exif, &[orientation, 0, 0, 0, 0, 0, 0], &stored[2..]].concat()
    };
    for (orientation, is_bright, turn) in
        [(3, false, "180 degrees"), (8, true, "90 degrees counterclockwise"), (6, false, "90 degrees clockwise")]
    {
        let folder = folder(&[("1.jpg", &with(orientation)), ("2.jpg", &with(orientation))]);
        let mut source = JpegFolder::open(folder.path(), None).unwrap();
        let (found, faults) = greens(&mut source);
        let bright: Vec<_> = found.iter().map(|green| green.is_some_and(|green| green > 100)).collect();
        assert_eq!(bright, [is_bright; 2], "{found:?}");
        let why = format!("1.jpg: turned by {turn}, as its Exif data say; others are turned, too");
        assert!(faults.len() == 1 && faults[0].ends_with(&why), "{faults:?}");
    }
    // A readout would be wrong for one of them.
    let folder = folder(&[("1.jpg", &stored), ("2.jpg", &with(3))]);
    let mut source = JpegFolder::open(folder.path(), None).unwrap();
    assert!(matches!(source.next_event(), Ok(SourceEvent::Frame(_))));
    let error = source.next_event().unwrap_err().to_string();
    assert!(error.ends_with("2.jpg: has its rows in another direction than 1.jpg, by their Exif data"), "{error}");
}
