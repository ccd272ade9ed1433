//! Reads any bytes as a Y4M stream. The result is an error or frames, but never a panic, and the core accepts every
//! frame.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_host::source::y4m::Y4m;
use wstac_host::source::{Frame, Source, SourceEvent};

fuzz_target!(|data: &[u8]| {
    let Some((&first, data)) = data.split_first() else { return };
    let fps = (first & 1 == 1).then_some(FrameRate::NOMINAL);
    let Ok(mut source) = Y4m::from_reader("fuzz", Cursor::new(data.to_vec()), fps) else { return };
    let info = source.info().clone();
    let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
    let mut pipeline = Layout::paper(info.size)
        .and_then(|layout| FrameGeometry::new(green, layout, info.rate))
        .and_then(|camera| camera.with_bytes_per_row(info.bytes_per_row))
        .and_then(|camera| Pipeline::builder(camera).build())
        .ok();
    // Every frame takes at least the six bytes of its line.
    for _ in 0..=data.len() {
        match source.next_event() {
            Ok(SourceEvent::Frame(Frame { bytes, .. })) => {
                if let Some(pipeline) = &mut pipeline {
                    let _ = pipeline.push_frame(bytes).expect("a frame of the size that the header says");
                }
            }
            Ok(SourceEvent::End) | Err(_) => return,
            Ok(_) => {}
        }
    }
    panic!("more frames than bytes");
});
