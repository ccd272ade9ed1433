//! Tests `wstac calibrate` with a board: it finds what it finds in the same frames of a camera.

use std::path::Path;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::wire::{Fault, Hello, Message, PICTURE_PART, PictureEnd, PicturePart, Request};
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::source::{Frame, SourceEvent};
use wstac_scene::source::Scenes;
use wstac_tests::command::{good, printed, refused, run, said, says};
use wstac_tests::folder::Folder;

use super::board::{Sent, hello};
use super::settings::Board;
use super::{bytes_of, path};

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
    let stderr = says(&done, 0, &["pictures of test-board 1.2.3, 320x240 Gray"]);
    let lost = "board: a part of a picture was lost on the line; it is asked for again";
    assert_eq!(stderr.matches(lost).count(), frames.len() / 2, "{stderr}");
}

#[test]
fn a_board_on_a_line_is_asked_for_one_picture_after_another() {
    let folder = Folder::new("pictures-line");
    let frames = frames(&folder);
    let (expected, _) = of_camera(&folder, &frames);
    let config = folder.0.join("board.toml");
    let (count, mut next) = (frames.len().to_string(), (0..).zip(frames));
    let board = Board::that(move |request, sent| match request {
        Request::Hello => sent.push(&Message::Hello(hello())),
        Request::Picture => {
            sent.push(&Message::Fault(Fault::SensorBack));
            next.next().into_iter().for_each(|(number, frame)| picture(sent, number, &frame));
        }
        other => panic!("{other:?}"),
    });
    let line = [path(&board.line), "--baud", "921600", "--frames", &count];
    let done = run(&[&["calibrate", "-o", path(&config)], &line[..]].concat());
    assert!(printed(&done).starts_with("25 whiskers found"), "{}", said(&done));
    says(&done, 0, &["board: the camera sends frames\n"]);
    assert_eq!(written(&config), expected);
}

#[test]
fn what_is_no_board_and_what_a_board_does_not_take_is_refused() {
    let folder = Folder::new("pictures-refused");
    let config = folder.0.join("new.toml");
    let file = |name: &str, bytes: &[u8]| format!("board:{}", folder.written(name, bytes));
    let described = file("hello.bin", &bytes_of(&[Message::Hello(hello())]));
    // Frames of which no picture has a number of parts.
    let size = FrameSize::new(16_384, 16_384).unwrap();
    let large = bytes_of(&[Message::Hello(Hello { size, ..hello() })]);
    for (arguments, part) in [
        (&[&*file("noise.bin", &[7; 999])][..], "has no description of a board, expected a board"),
        (&[&described], "found 0 frames, expected 25 untouched ones"),
        (&[&described, "--size", "320x240"], "leave options of a camera out"),
        (&["scene:Fla0@100", "--baud", "9600"], "is no board; leave --baud out"),
        (&[&file("large.bin", &large)], "has pictures of 268435456 bytes, expected at most 10485600"),
    ] {
        refused(&[&["calibrate", "-o", path(&config)], arguments].concat(), &[part]);
    }
    assert!(!config.exists());
}
