//! Reads any bytes as a recording. The result is its items, or an error that names the file, but never a panic.
//! A file that `recover` writes without a problem can be read to its end, and a second recovery changes nothing.
#![no_main]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use mcap::records::op;
use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::record::recover;
use wstac_host::session::Processor;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Source, SourceEvent};

/// Recordings are files, so each process of the fuzzer has its own.
static PATHS: LazyLock<[PathBuf; 3]> = LazyLock::new(|| {
    let name = |what: &str| std::env::temp_dir().join(format!("wstac-fuzz-{}-{what}.mcap", std::process::id()));
    [name("old"), name("new"), name("again")]
});
/// The position of the checksum in a chunk: after the operation code, the length, two times and a size.
const CHECKSUM: usize = 9 + 24;

fuzz_target!(|data: &[u8]| {
    let Some((&first, data)) = data.split_first() else { return };
    let mut bytes = data.to_vec();
    if first & 1 == 1 {
        forget_checksums(&mut bytes);
    }
    let [old, new, _] = &*PATHS;
    std::fs::write(old, &bytes).expect("a temporary file");
    read(old, bytes.len());
    let out = File::create(new).expect("a temporary file");
    match recover(old, out, new) {
        Err(error) => assert!(error.to_string().contains("wstac-fuzz-")),
        Ok(found) => {
            read(new, found.bytes as usize);
            if found.problem.is_none() {
                again(new);
            }
        }
    }
});

/// Checks that a recovery can be read to its end, and that it is what a second recovery writes.
fn again(recovered: &Path) {
    let mut source = McapSource::open(recovered, None).expect("it can be read");
    while !matches!(source.next_event().expect("it can be read to its end"), SourceEvent::End) {}
    let again = &PATHS[2];
    let out = File::create(again).expect("a temporary file");
    let found = recover(recovered, out, again).expect("it can be recovered again");
    assert!(found.problem.is_none());
    assert!(std::fs::read(recovered).ok() == std::fs::read(again).ok(), "a second recovery is another file");
}

/// Reads a recording as `wstac run` does.
fn read(path: &Path, bytes: usize) {
    let mut source = match McapSource::open(path, None) {
        Ok(source) => source,
        Err(error) => return assert!(error.to_string().contains("wstac-fuzz-")),
    };
    let mut reading = Processor::new(source.info(), &Config::default(), OutputOptions::default()).ok();
    for _ in 0..=bytes {
        match source.next_event() {
            Err(_) => return,
            Ok(item) => {
                if let Some(reading) = &mut reading {
                    let Ok(goes_on) = reading.process(&item, |_| Ok::<(), ()>(())) else { return };
                    if !goes_on {
                        return;
                    }
                } else if matches!(item, SourceEvent::End) {
                    return;
                }
            }
        }
    }
    panic!("more items than bytes");
}

/// Sets checksums to 0, which means that there is none. Otherwise changed bytes would be refused early.
fn forget_checksums(bytes: &mut [u8]) {
    let mut at = mcap::MAGIC.len();
    while let Some(&code) = bytes.get(at) {
        let length = bytes.get(at + 1..at + 9).and_then(<[u8]>::first_chunk).map(|length| u64::from_le_bytes(*length));
        if code == op::CHUNK
            && let Some(checksum) = bytes.get_mut(at + CHECKSUM..at + CHECKSUM + 4)
        {
            checksum.fill(0);
        }
        let next =
            length.and_then(|length| usize::try_from(length).ok()).and_then(|length| (at + 9).checked_add(length));
        let Some(next) = next else { return };
        at = next;
    }
}
