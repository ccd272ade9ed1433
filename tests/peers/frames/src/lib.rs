//! What `signal.py` calls: frames to features as the `wstac` command does it, a plain read of the same bytes, and a forest. Each call does a number of
//! things in turn, so that what a call from Python costs is small beside them. All names start with `wstac_`: `open` and `read` are the C library's.

mod forest;
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

/// The formats by number; `signal.py` has their names in the same order.
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

/// The instruction set that frames are summed with, as a C string.
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

/// A stream of frames of this format and size; `layout` is a taxel's width and height and 25 corners. Null where there is no such stream.
///
/// # Safety
/// `layout` points to 52 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_open(format: u32, width: u32, height: u32, layout: *const u16) -> *mut Stream {
    // SAFETY: as the caller promises.
    let &[taxel, ref corners @ ..] = unsafe { &*layout.cast::<[[u16; 2]; 26]>() };
    let stream = || {
        let &(format, method) = FORMATS.get(format as usize)?;
        let layout = Layout::new(FrameSize::new(width, height).ok()?, taxel, *corners).ok()?;
        let camera = FrameGeometry::new(Any::new(format, YcbcrEncoding::default(), method), layout, FrameRate::NOMINAL).ok()?;
        FeatureStream::new(camera, 0.5).ok()
    };
    stream().map_or(std::ptr::null_mut(), |stream| Box::into_raw(Box::new(Stream(stream))))
}

/// Bytes of a frame.
///
/// # Safety
/// `stream` is of [`wstac_open`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_frame_bytes(stream: *const Stream) -> usize {
    // SAFETY: as the caller promises.
    unsafe { &*stream }.0.camera().frame_bytes()
}

/// Frames to features: `count` frames one after the other, of `frames` that lie one behind the other; ten features of the last.
///
/// # Safety
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

/// Reads the bytes under taxels, of as many frames: a number that all of them make. `ahead`: cache lines are asked for eight rows before.
///
/// # Safety
/// `stream` is of [`wstac_open`], of a packed format of `pixel` bytes a pixel, and there are `frames` frames.
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
