//! Opens, reads and closes a camera many times. Then breaks its connection many times and waits for it to come back.
//! The number of open files and the memory may not grow.
//!
//! `camera_cycles DEVICE CYCLES BUTTON…`: a button is NAME=0xNUMBER of one of vivid's controls that breaks the stream.
//! `ci/vm cycles` runs this program.

use std::process::ExitCode;
use std::time::Instant;

use v4l::Device;
use v4l::control::{Control, Value};
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{FaultKind, Source, SourceEvent};
use wstac_linux::source::CameraSource;

/// The resources that one process holds.
#[derive(Clone, Copy)]
struct Held {
    files: usize,
    mappings: usize,
    /// The resident memory, in KiB.
    kib: u64,
}

fn held() -> Held {
    let read = |path| std::fs::read_to_string(path).expect("a process knows itself");
    let status = read("/proc/self/status");
    let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("memory is told");
    Held {
        files: std::fs::read_dir("/proc/self/fd").expect("a process knows its files").count(),
        mappings: read("/proc/self/maps").lines().count(),
        kib: resident.trim().trim_end_matches(" kB").parse().expect("a number"),
    }
}

impl std::fmt::Display for Held {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} files, {} mappings, {} KiB", self.files, self.mappings, self.kib)
    }
}

/// Reads until the next frame, and returns the faults before it.
fn frame(source: &mut CameraSource) -> Vec<FaultKind> {
    let mut faults = Vec::new();
    loop {
        match source.next_event().expect("a camera that goes on") {
            SourceEvent::Frame(_) => return faults,
            SourceEvent::Fault(fault) => faults.push(fault.kind),
            _ => {}
        }
    }
}

/// Presses a button.
fn press(path: &str, id: u32) {
    let device = Device::with_path(path).expect("the node is there");
    device.set_control(Control { id, value: Value::Integer(1) }).expect("the button can be pressed");
}

/// Repeats an action, and returns whether the resources stayed the same after the first tenth.
fn cycles(what: &str, count: usize, mut once: impl FnMut()) -> bool {
    let start = Instant::now();
    (0..count / 10).for_each(|_| once());
    let before = held();
    (count / 10..count).for_each(|_| once());
    let after = held();
    // An allocator may keep some memory. A leak of a tenth of a frame per cycle would be far more than this.
    let sound = after.files == before.files && after.mappings <= before.mappings + 2 && after.kib <= before.kib + 512;
    let seconds = start.elapsed().as_secs();
    let verdict = if sound { "no growth" } else { "GREW" };
    println!("{what}, {count} times in {seconds} s: {before}, and at the end {after}: {verdict}");
    sound
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, count, buttons @ ..] = &arguments[..] else {
        eprintln!("camera_cycles: expected DEVICE CYCLES BUTTON…, found {arguments:?}");
        return ExitCode::from(2);
    };
    let count = count.parse().expect("CYCLES is a whole number");
    let options = OpenOptions { format: Some(*b"GREY"), size: Some((320, 180)), ..OpenOptions::default() };
    let mut sound = cycles("open, one frame, close", count, || {
        frame(&mut CameraSource::open(path, &options).expect("the camera opens"));
    });
    let mut source = CameraSource::open(path, &options).expect("the camera opens");
    frame(&mut source);
    for button in buttons {
        let (name, id) = button.split_once("=0x").expect("a button is NAME=0xNUMBER");
        let id = u32::from_str_radix(id, 16).expect("a control's number");
        sound &= cycles(&format!("{name}, reconnect, one frame"), count, || {
            press(path, id);
            let mut faults = Vec::new();
            while faults.last() != Some(&FaultKind::Reconnected) {
                faults.extend(frame(&mut source));
            }
            assert_eq!(faults, [FaultKind::Disconnected, FaultKind::Reconnected], "after {name}");
        });
    }
    if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
