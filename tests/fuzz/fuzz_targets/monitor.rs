//! Reads any bytes as what a board sends, in pieces of any length. The results are outputs and notes, and the end comes
//! last. Half of the inputs are the contents of frames whose COBS and CRC are correct.
#![no_main]

mod frame;

use libfuzzer_sys::fuzz_target;
use wstac_core::wire::LONGEST;
use wstac_host::monitor::{Monitor, Report};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::visible;

fuzz_target!(|data: &[u8]| {
    let Some((&[first, piece], data)) = data.split_first_chunk() else { return };
    let mut stream = Vec::new();
    if first & 1 == 1 {
        for content in data.split(|&byte| byte == 0xFF) {
            stream.extend(frame::with_content(&content[..content.len().min(LONGEST - 7)]));
        }
    } else {
        stream.extend(data);
    }
    let mut monitor = Monitor::new(OutputOptions { features: true, samples: true, ..OutputOptions::default() });
    for piece in stream.chunks(usize::from(piece) + 1) {
        let goes_on = monitor.take(piece, |report| {
            if let Report::Note(text) = report {
                assert!(text.len() < 2000);
                assert!(!visible::line(&text).contains(char::is_control));
            }
        });
        if !matches!(goes_on, Ok(true)) {
            return;
        }
    }
    assert!(matches!(monitor.finish(), Output::End(_)));
});
