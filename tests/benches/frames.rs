//! Measures how long a 1280 × 720 frame takes from its bytes to its features, for each pixel format. Also measures a
//! logarithm with each kernel.
//!
//! "any" is what the `wstac` command runs: the format is chosen at run time. "read" is a plain sum of the same bytes.

#![expect(missing_docs, reason = "criterion_group! makes a function without any")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use wstac_core::features::{FeatureScale, Floor};
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::BayerOrder;
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;
use wstac_host::camera::mjpeg::Decoder;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::options::DecoderOptions;

const FORMATS: [(&str, PixelFormat, YcbcrMethod); 12] = [
    ("gray", PixelFormat::Gray, YcbcrMethod::Exact),
    ("y16", PixelFormat::Y16, YcbcrMethod::Exact),
    ("rgb24", PixelFormat::Rgb24, YcbcrMethod::Exact),
    ("rgb565", PixelFormat::Rgb565, YcbcrMethod::Exact),
    ("bayer8", PixelFormat::Bayer8(BayerOrder::Rggb), YcbcrMethod::Exact),
    ("bayer10", PixelFormat::Bayer10(BayerOrder::Rggb), YcbcrMethod::Exact),
    ("yuyv exact", PixelFormat::Yuyv, YcbcrMethod::Exact),
    ("yuyv linear", PixelFormat::Yuyv, YcbcrMethod::Linear),
    ("nv12 exact", PixelFormat::Nv12, YcbcrMethod::Exact),
    ("nv12 linear", PixelFormat::Nv12, YcbcrMethod::Linear),
    ("yu12 exact", PixelFormat::Yu12, YcbcrMethod::Exact),
    ("yu12 linear", PixelFormat::Yu12, YcbcrMethod::Linear),
];

fn frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("frame 1280x720");
    // One element is one frame, so criterion prints frames per second.
    group.throughput(Throughput::Elements(1));
    let layout = Layout::paper(FrameSize::new(1280, 720).unwrap()).unwrap();
    for (name, format, method) in FORMATS {
        let green = Any::new(format, YcbcrEncoding::default(), method);
        let camera = FrameGeometry::new(green, layout, FrameRate::NOMINAL).unwrap();
        let bytes: Vec<u8> =
            (0..camera.frame_bytes() as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let mut stream: FeatureStream<Any, Fixed> = FeatureStream::new(camera, 0.5).unwrap();
        group.bench_with_input(BenchmarkId::from_parameter(name), &bytes, |b, bytes| {
            b.iter(|| black_box(stream.push_frame(black_box(bytes))));
        });
    }
    group.finish();
}

fn read(c: &mut Criterion) {
    let mut group = c.benchmark_group("read of the bytes under 25 taxels");
    group.throughput(Throughput::Elements(1));
    for bytes_per_pixel in [1, 2, 3] {
        let bytes = vec![7_u8; 25 * 90 * 90 * bytes_per_pixel];
        group.bench_function(BenchmarkId::from_parameter(format!("{bytes_per_pixel} per pixel")), |b| {
            b.iter(|| {
                let words = black_box(&bytes).as_chunks::<8>().0;
                black_box(words.iter().fold(0, |sum: u64, word| sum.wrapping_add(u64::from_le_bytes(*word))))
            });
        });
    }
    group.finish();
}

fn logarithm<L: Ln>(c: &mut Criterion, name: &str) {
    let scale: FeatureScale<L> = FeatureScale::new(8100, 255, 1, Floor::new(0.5, 255).unwrap()).unwrap();
    let sums: Vec<[u32; 10]> = (1..100).map(|i| std::array::from_fn(|k| i * 7919 * (k as u32 + 1))).collect();
    c.benchmark_group("ten features").bench_function(name, |b| {
        b.iter(|| {
            for sums in black_box(&sums) {
                black_box(scale.features(sums));
            }
        });
    });
}

fn logarithms(c: &mut Criterion) {
    logarithm::<Fixed<256>>(c, "fixed, 256 segments (times 99)");
    logarithm::<Fixed<32>>(c, "fixed, 32 segments (times 99)");
    logarithm::<Libm>(c, "libm (times 99)");
    logarithm::<Micromath>(c, "micromath (times 99)");
}

/// Decodes a picture as a camera's, whose codes are checked first, and with the decoder alone.
fn mjpeg(c: &mut Criterion) {
    let (width, height) = (640_u16, 480_u16);
    let pixel = |at: u32| [30, (at / 2400) as u8, 20].map(|color| color + (at.wrapping_mul(2_654_435_761) >> 29) as u8);
    let pixels: Vec<u8> = (0..u32::from(width) * u32::from(height)).flat_map(pixel).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 90);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder.encode(&pixels, width, height, ColorType::Rgb).unwrap();
    let mut group = c.benchmark_group("mjpeg 640x480");
    group.throughput(Throughput::Elements(1));
    let mut decoder = Decoder::new(FrameSize::new(width.into(), height.into()).unwrap());
    group.bench_function("checked", |b| b.iter(|| decoder.decode(black_box(&bytes)).unwrap().len()));
    let mut rgb = vec![0; pixels.len()];
    let options = DecoderOptions::default().set_strict_mode(true);
    group.bench_function("decoder alone", |b| {
        b.iter(|| {
            let bytes = ZCursor::new(black_box(&bytes[..]));
            JpegDecoder::new_with_options(bytes, options).decode_into(&mut rgb).unwrap();
        });
    });
    group.finish();
}

criterion_group!(benches, frames, mjpeg, read, logarithms);
criterion_main!(benches);
