//! Tests `wstac calibrate` with a board: it finds what it finds in the same frames of a camera.

use std::io::{Read, Write};
use std::path::Path;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::wire::{Decoder, Fault, Hello, Message, PICTURE_PART, PictureEnd, PicturePart, Request};
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::source::{Frame, SourceEvent};
use wstac_scene::source::Scenes;
use wstac_tests::command::{good, printed, refusal, run, said, start};
use wstac_tests::folder::Folder;

use super::board::{Sent, hello};
use super::{path, pty};

const SCENE: &str = "specimen = \"Fla0\"\nspeed = 150\nlead_in = 45\n[sensor]\nsize = [320, 240]\n";
const SIZE: [u32; 2] = [320, 240];

/// Returns untouched frames, and then as many of a touch of all whiskers: each pixel as bright as it gets in a slide.
fn frames(folder: &Folder) -> Vec<Vec<u8>> {
    let name = format!("scene:{}", path(&folder.file("slide.toml", SCENE)));
    let mut source = open(&name, &OpenOptions::default(), &[&Scenes]).unwrap();
    assert_eq!(source.info().format, PixelFormat::Gray);
    let (mut frames, mut lit) = (Vec::new(), vec![0; (SIZE[0] * SIZE[1]) as usize]);
    loop {
        match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, .. }) => {
                lit.iter_mut().zip(bytes).for_each(|(most, byte)| *most = (*most).max(*byte));
                if frames.len() < 25 {
                    frames.push(bytes.to_vec());
                }
            }
            SourceEvent::End => break,
            _ => {}
        }
    }
    frames.resize(32, lit);
    frames
}

/// Returns what calibrating the same frames of a camera writes and prints.
fn of_camera(folder: &Folder, frames: &[Vec<u8>]) -> (String, String) {
    let mut clip = format!("YUV4MPEG2 W{} H{} F30:1 Cmono\n", SIZE[0], SIZE[1]).into_bytes();
    for frame in frames {
        clip.extend(b"FRAME\n");
        clip.extend(frame);
    }
    let (clip, config) = (folder.file("clip.y4m", clip), folder.0.join("camera.toml"));
    let printed = good(&["calibrate", path(&clip), "-o", path(&config), "--json"]);
    (written(&config), printed)
}

/// Returns a configuration without its first line, which names the source.
fn written(config: &Path) -> String {
    std::fs::read_to_string(config).unwrap().split_once('\n').unwrap().1.to_owned()
}

/// Sends a picture: every stripe's first parts, then their second ones, as a board with a slow line does.
fn picture(sent: &mut Sent, number: u8, frame: &[u8]) {
    let mut parts: Vec<_> = frame.chunks(PICTURE_PART).enumerate().collect();
    parts.sort_by_key(|(at, _)| (at % 24, *at));
    let mut checksum = 0_u32;
    for (at, bytes) in &parts {
        let part = PicturePart::new(number, 9, (at * PICTURE_PART) as u32, bytes);
        checksum = checksum.wrapping_add(part.checksum());
        sent.push(&Message::PicturePart(part));
    }
    sent.push(&Message::PictureEnd(PictureEnd::new(number, parts.len() as u16, checksum)));
}

#[test]
fn a_recorded_board_is_calibrated_like_a_camera() {
    let folder = Folder::new("pictures-file");
    let frames = frames(&folder);
    let (expected, printed_of_camera) = of_camera(&folder, &frames);
    let mut sent = Sent { frames: Vec::new() };
    sent.push(&Message::Hello(hello()));
    for (number, frame) in frames.iter().enumerate() {
        picture(&mut sent, number as u8, frame);
        if number % 2 == 0 {
            // The next one follows at once, in the bytes of the same read.
            continue;
        }
        // Other messages come in between.
        sent.push(&Message::Lost { frames: 1 });
        // A picture of which a part is damaged, and one that is given up, are left out.
        let parts = sent.frames.len();
        picture(&mut sent, number as u8 + 100, &vec![255; frame.len()]);
        sent.frames[parts + 20][30] ^= 1;
        picture(&mut sent, number as u8 + 200, &vec![255; frame.len()]);
        sent.frames.truncate(sent.frames.len() - 10);
    }
    let (file, config) = (folder.file("board.bin", sent.frames.concat()), folder.0.join("board.toml"));
    let name = format!("board:{}", path(&file));
    let done = run(&["calibrate", &name, "-o", path(&config), "--json"]);
    assert_eq!(printed(&done), printed_of_camera);
    assert_eq!(written(&config), expected);
    let stderr = said(&done);
    assert!(stderr.contains("pictures of test-board 1.2.3, 320x240 Gray"), "{stderr}");
    let lost = "board: a part of a picture was lost on the line; it is asked for again";
    assert_eq!(stderr.matches(lost).count(), frames.len() / 2, "{stderr}");
}

#[test]
fn a_board_on_a_line_is_asked_for_one_picture_after_another() {
    let folder = Folder::new("pictures-line");
    let frames = frames(&folder);
    let (expected, _) = of_camera(&folder, &frames);
    let config = folder.0.join("board.toml");
    let (mut board, name) = pty();
    let count = frames.len().to_string();
    let calibrate =
        start(&["calibrate", path(&name), "--baud", "921600", "-o", path(&config), "--frames", count.as_str()]);
    let (mut decoder, mut sent, mut said_so) = (Decoder::<16>::new(), Sent { frames: Vec::new() }, 0);
    let mut next = 0;
    while next < frames.len() {
        let mut byte = [0];
        let Ok(1) = board.read(&mut byte) else {
            std::thread::yield_now();
            continue;
        };
        match decoder.push::<Request>(byte[0]).map(|received| received.unwrap().message) {
            Some(Request::Hello) => sent.push(&Message::Hello(hello())),
            Some(Request::Picture) => {
                sent.push(&Message::Fault(Fault::SensorBack));
                picture(&mut sent, next as u8, &frames[next]);
                next += 1;
            }
            Some(other) => panic!("{other:?}"),
            None => continue,
        }
        board.write_all(&sent.frames[said_so..].concat()).unwrap();
        said_so = sent.frames.len();
    }
    let done = calibrate.wait_with_output().unwrap();
    assert!(printed(&done).starts_with("25 whiskers found"), "{}", said(&done));
    assert!(said(&done).contains("board: the camera sends frames\n"), "{}", said(&done));
    assert_eq!(written(&config), expected);
}

#[test]
fn what_is_no_board_and_what_a_board_does_not_take_is_refused() {
    let folder = Folder::new("pictures-refused");
    let config = folder.0.join("new.toml");
    let of = |arguments: &[&str]| refusal(&[&["calibrate", "-o", path(&config)], arguments].concat());
    let file = format!("board:{}", path(&folder.file("noise.bin", [7; 999])));
    assert!(of(&[&file]).contains("has no description of a board, expected a board"));
    let mut sent = Sent { frames: Vec::new() };
    sent.push(&Message::Hello(hello()));
    let file = format!("board:{}", path(&folder.file("hello.bin", sent.frames.concat())));
    assert!(of(&[&file]).contains("found 0 frames, expected 25 untouched ones"));
    assert!(of(&[&file, "--size", "320x240"]).contains("leave options of a camera out"));
    assert!(of(&["scene:Fla0@100", "--baud", "9600"]).contains("is no board; leave --baud out"));
    // Frames of which no picture has a number of parts.
    let mut sent = Sent { frames: Vec::new() };
    let size = FrameSize::new(16_384, 16_384).unwrap();
    sent.push(&Message::Hello(Hello { size, ..hello() }));
    let file = format!("board:{}", path(&folder.file("large.bin", sent.frames.concat())));
    assert!(of(&[&file]).contains("has pictures of 268435456 bytes, expected at most 10485600"));
    assert!(!config.exists());
}
