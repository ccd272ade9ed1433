//! The library that `features.py` calls: frames to features as in the `wstac` command, and a plain read of the same
//! bytes.
//!
//! Each call repeats its work, so that the cost of a call from Python is small beside it. All names start with
//! `wstac_`, because `open` and `read` are functions of the C library.

mod read;

use std::ffi::c_char;

use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::BayerOrder;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::fixed::Fixed;
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;

/// A stream of one format and layout.
pub struct Stream(FeatureStream<Any, Fixed>);

/// The formats by number. `features.py` has their names in the same order.
const FORMATS: [(PixelFormat, YcbcrMethod); 12] = [
    (PixelFormat::Gray, YcbcrMethod::Exact),
    (PixelFormat::Yuyv, YcbcrMethod::Linear),
    (PixelFormat::Yuyv, YcbcrMethod::Exact),
    (PixelFormat::Nv12, YcbcrMethod::Linear),
    (PixelFormat::Nv12, YcbcrMethod::Exact),
    (PixelFormat::Yu12, YcbcrMethod::Linear),
    (PixelFormat::Yu12, YcbcrMethod::Exact),
    (PixelFormat::Rgb24, YcbcrMethod::Exact),
    (PixelFormat::Y16, YcbcrMethod::Exact),
    (PixelFormat::Y10, YcbcrMethod::Exact),
    (PixelFormat::Rgb565, YcbcrMethod::Exact),
    (PixelFormat::Bayer8(BayerOrder::Rggb), YcbcrMethod::Exact),
];

/// Returns the instruction set that sums frames, as a C string.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_instruction_set() -> *const c_char {
    let name = match wstac_core::green::instruction_set() {
        "AVX-512" => c"AVX-512",
        "AVX2" => c"AVX2",
        "NEON" => c"NEON",
        _ => c"plain",
    };
    name.as_ptr()
}

/// Creates a stream of frames of this format and size. `layout` is the width and height of a taxel, and 25 corners.
/// Returns null if the format or layout is invalid.
///
/// # Safety
///
/// `layout` points to 52 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_open(format: u32, width: u32, height: u32, layout: *const u16) -> *mut Stream {
    // SAFETY: as the caller promises.
    let &[taxel, ref corners @ ..] = unsafe { &*layout.cast::<[[u16; 2]; 26]>() };
    let stream = || {
        let &(format, method) = FORMATS.get(format as usize)?;
        let layout = Layout::new(FrameSize::new(width, height).ok()?, taxel, *corners).ok()?;
        let camera =
            FrameGeometry::new(Any::new(format, YcbcrEncoding::default(), method), layout, FrameRate::NOMINAL).ok()?;
        FeatureStream::new(camera, 0.5).ok()
    };
    stream().map_or(std::ptr::null_mut(), |stream| Box::into_raw(Box::new(Stream(stream))))
}

/// Returns the bytes of a frame.
///
/// # Safety
///
/// `stream` is of [`wstac_open`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_frame_bytes(stream: *const Stream) -> usize {
    // SAFETY: as the caller promises.
    unsafe { &*stream }.0.camera().frame_bytes()
}

/// Turns `count` frames into features, and writes the ten features of the last one. The frames are taken in turn from
/// `frames` frames, which are stored one after another.
///
/// # Safety
///
/// `stream` is of [`wstac_open`], there are `frames` frames, and room for ten features.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_features(
    stream: *mut Stream,
    bytes: *const u8,
    frames: usize,
    count: usize,
    features: *mut i16,
) {
    // SAFETY: as the caller promises.
    let (stream, features) = unsafe { (&mut (*stream).0, &mut *features.cast::<[i16; 10]>()) };
    let length = stream.camera().frame_bytes();
    for index in 0..count {
        // SAFETY: as the caller promises.
        let frame = unsafe { std::slice::from_raw_parts(bytes.add(index % frames * length), length) };
        if let Ok(Some(frame)) = stream.push_frame(frame) {
            *features = frame.features;
        }
    }
}

/// Reads the bytes under the taxels of `count` frames, and returns a number that depends on all of them. With `ahead`,
/// cache lines are prefetched eight rows early.
///
/// # Safety
///
/// `stream` is of [`wstac_open`], of a packed format of `pixel` bytes per pixel, and there are `frames` frames.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_read(
    stream: *const Stream,
    bytes: *const u8,
    frames: usize,
    count: usize,
    pixel: usize,
    ahead: bool,
) -> u64 {
    // SAFETY: as the caller promises.
    let camera = unsafe { &*stream }.0.camera();
    let length = camera.frame_bytes();
    (0..count).fold(0, |all, index| {
        // SAFETY: as the caller promises.
        let frame = unsafe { std::slice::from_raw_parts(bytes.add(index % frames * length), length) };
        all ^ read::taxels(frame, camera.bytes_per_row(), camera.layout(), pixel, ahead)
    })
}
