//! A loop that answers each frame before a deadline, and counts those that it could not.
//!
//!     cargo run --release -p wstac-host --example bounded_loop FRAMES [PASSES]
//!
//! FRAMES has raw frames: `wstac run scene:Saw3@150,90deg --size 640x480 --save-raw FRAMES`.
use std::time::{Duration, Instant};
use std::{env, fs, process, thread};

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::{Poll, Session};
use wstac_host::source::{Frame, LossReason, SourceEvent, StreamInfo};

const SIZE: (u32, u32) = (640, 480);
const DEADLINE: Duration = Duration::from_millis(10);

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        process::exit(if error.kind() == ErrorKind::Usage { 2 } else { 1 });
    }
}

fn run() -> Result<(), Error> {
    let wrong = |message: &str| Error::new(ErrorKind::Usage, "bounded_loop", message);
    let arguments: Vec<String> = env::args().skip(1).collect();
    let (file, passes) = match &arguments[..] {
        [file] => (file, 1_usize),
        [file, passes] => match passes.parse() {
            Ok(passes @ 1..) => (file, passes),
            _ => return Err(wrong(&format!("PASSES is {passes:?}, expected 1 or more"))),
        },
        _ => return Err(wrong("wrong arguments, expected FRAMES [PASSES]")),
    };
    let bytes = fs::read(file).map_err(|error| Error::io(format_args!("bounded_loop: {file}"), error))?;
    let frames: Vec<&[u8]> = bytes.chunks_exact((SIZE.0 * SIZE.1) as usize).collect();
    let end = frames.len() * passes;
    let size = FrameSize::new(SIZE.0, SIZE.1).map_err(|error| wrong(&error.to_string()))?;
    let info = StreamInfo::new("my camera", size, PixelFormat::Gray, FrameRate::NOMINAL);
    let mut session = Session::of_frames(info).outputs(OutputOptions::LIVE).build()?;
    // What is reserved now is not waited for in the loop.
    let mut took = Vec::with_capacity(end);
    let (mut events, mut lost, mut number) = (0, 0, 0);
    let start = Instant::now();
    while number < end {
        // Put the wait for your camera here, and its time stamp: this one has a frame every 1/30 s.
        let stamp_of = |at: usize| start + Duration::from_secs(at as u64) / 30;
        thread::sleep(stamp_of(number).saturating_duration_since(Instant::now()));
        // Who comes late takes the newest frame: those before it keep their place in time.
        let missed = (number + 1..end).take_while(|&at| stamp_of(at) <= Instant::now()).count();
        if missed > 0 {
            session.push(&SourceEvent::Lost { frames: missed as u64, reason: LossReason::Reported });
            (lost, number) = (lost + missed, number + missed);
        }
        session.push(&SourceEvent::Frame(Frame::new(frames[number % frames.len()])));
        while let Poll::Output(output) = session.poll()? {
            // Put what your machine does about a slip, a motion or an event here.
            events += usize::from(matches!(output, Output::Event(_)));
        }
        took.push(stamp_of(number).elapsed());
        number += 1;
    }
    took.sort_unstable();
    let late = took.iter().filter(|&&took| took > DEADLINE).count();
    let ms = |place: usize| took.get(place).map(|took| took.as_secs_f64() * 1e3);
    let (Some(median), Some(most), Some(worst)) =
        (ms(took.len() / 2), ms(took.len() * 99 / 100), ms(took.len().wrapping_sub(1)))
    else {
        return Err(wrong("FRAMES has no frame of 640 x 480 GREY"));
    };
    print!("frames: {}, lost: {lost}, late: {late}, events: {events}; ", took.len());
    println!("stamp to answer in ms: median {median:.3}, 99 % {most:.3}, worst {worst:.3}");
    Ok(())
}
