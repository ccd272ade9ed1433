//! Every entry point of `wstac-core`, with arguments that the compiler knows nothing about.
//!
//! The panic handler calls a function that does not exist. If any panic is left after optimisation, the library does
//! not link, and its symbols name the panic. What arguments hold is not even required to be what a constructor would
//! have made of them: every bit pattern of every field is covered, but of models, which kernels rely on. Only `Display` of errors is left out: it is
//! `core::fmt`, which has panics of its own, and nothing on the way from bytes to events formats text.
#![no_std]
#![allow(improper_ctypes_definitions, missing_docs, clippy::type_complexity)]

use wstac_core::baseline::Baseline;
use wstac_core::direction::{self, Direction};
use wstac_core::early::{Beginning, Early};
use wstac_core::error::Error;
use wstac_core::features::{FeatureScale, Features, Floor, line_sums, to_f32};
use wstac_core::fixed::Q16;
use wstac_core::frame::Stride;
use wstac_core::green::Green;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::{Bayer, BayerOrder};
use wstac_core::green::grey::Grey;
use wstac_core::green::packed_rgb::{Rgb24, Rgbx32, Xrgb32};
use wstac_core::green::packed_ycbcr::{Uyvy, Yuyv};
use wstac_core::green::planar_ycbcr::{Nv12, Yu12, Yuv422p, Yuv444p};
use wstac_core::green::rgb565::Rgb565;
use wstac_core::green::words::{Y10, Y12, Y16};
use wstac_core::green::ycbcr::{Colour, Exact, Linear};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, constant, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::model::Model;
use wstac_core::model::boosted::Boosted;
use wstac_core::model::file::ModelError;
use wstac_core::model::forest::Forest;
use wstac_core::model::labels::{Label, Labels};
use wstac_core::model::linear_svm::LinearSvm;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;
use wstac_core::speed::{self, Duration, Law, NoSpeed, Speed, SpeedConfig, ThresholdOn};
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::{Accumulators, Camera};
use wstac_core::texture;
use wstac_core::trigger::{Event, Incomplete, Rule, StreamEnd, Trigger, TriggerConfig};
use wstac_core::wire::{self, Answers, Decoder, Message, Received, Refused, Request, Text};

unsafe extern "C" {
    fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: there is no such function, so a library that calls it does not exist.
    unsafe { a_panic_is_reachable() }
}

/// Entry points: named symbols that stay in the library.
macro_rules! entries {
    ($($name:ident $(<$life:lifetime>)? ($($argument:ident: $type:ty),*) -> $result:ty $body:block)*) => {
        $(#[unsafe(no_mangle)] pub extern "C" fn $name$(<$life>)?($($argument: $type),*) -> $result $body)*
    };
}

/// The entry points of one pixel format: camera, sums, features and pipeline.
macro_rules! format {
    ($module:ident, $green:ty, $kernel:ty) => {
        mod $module {
            use super::*;
            type G = $green;
            type L = $kernel;

            #[unsafe(export_name = concat!("entry_", stringify!($module)))]
            pub extern "C" fn entries() -> Entries<G, L> {
                Entries {
                    camera: |green, layout, rate| Camera::new(green, layout, rate),
                    stride: |green, layout, rate, stride| Camera::with_stride(green, layout, rate, stride),
                    bytes_per_row: |camera, bytes| camera.with_bytes_per_row(bytes),
                    accumulators: |camera| Accumulators::new(camera),
                    sum_frame: |accumulators, bytes| accumulators.push_frame(bytes),
                    sum_stripe: |accumulators, bytes| accumulators.push_stripe(bytes),
                    abandon: |accumulators| accumulators.abandon_frame(),
                    sizes: |camera| {
                        (camera.frame_bytes(), camera.bytes_per_row(), camera.pixels(), camera.full_scale())
                    },
                    stream: |camera, floor| FeatureStream::new(camera, floor),
                    with_floor: |camera, floor| FeatureStream::with_floor(camera, floor),
                    stream_frame: |stream, bytes| stream.push_frame(bytes),
                    stream_stripe: |stream, bytes| stream.push_stripe(bytes),
                    stream_taxels: |stream, taxels| stream.push_taxels(taxels),
                    stream_lost: |stream, frames| stream.push_lost(frames),
                    stream_abandon: |stream| stream.abandon_frame(),
                    pipeline: |camera, floor, trigger| Pipeline::new(camera, floor, trigger),
                    pipeline_with_floor: |camera, floor, trigger| Pipeline::with_floor(camera, floor, trigger),
                    frame: |pipeline, bytes| pipeline.push_frame(bytes),
                    stripe: |pipeline, bytes| pipeline.push_stripe(bytes),
                    lost: |pipeline, frames| pipeline.push_lost(frames),
                    abandon_frame: |pipeline| pipeline.abandon_frame(),
                    finish: |pipeline| pipeline.finish(),
                    end: |pipeline| pipeline.end(),
                    interrupted: |pipeline| pipeline.take_interrupted(),
                }
            }
        }
    };
}

/// One function pointer each: what is pointed to is compiled for every possible argument.
#[repr(C)]
pub struct Entries<G: Green + 'static, L: 'static> {
    camera: fn(G, Layout, FrameRate) -> Result<Camera<G>, Error>,
    stride: fn(G, Layout, FrameRate, Stride) -> Result<Camera<G>, Error>,
    bytes_per_row: fn(Camera<G>, u32) -> Result<Camera<G>, Error>,
    accumulators: fn(Camera<G>) -> Accumulators<G>,
    sum_frame: fn(&mut Accumulators<G>, &[u8]) -> Result<[u32; 25], Error>,
    sum_stripe: fn(&mut Accumulators<G>, &[u8]) -> Result<Option<[u32; 25]>, Error>,
    abandon: fn(&mut Accumulators<G>),
    sizes: fn(&Camera<G>) -> (usize, usize, u32, u32),
    stream: fn(Camera<G>, f64) -> Result<FeatureStream<G, L>, Error>,
    with_floor: fn(Camera<G>, Floor) -> Result<FeatureStream<G, L>, Error>,
    stream_frame: fn(&mut FeatureStream<G, L>, &[u8]) -> Result<Option<FeatureFrame>, Error>,
    stream_stripe: fn(&mut FeatureStream<G, L>, &[u8]) -> Result<Option<FeatureFrame>, Error>,
    stream_taxels: fn(&mut FeatureStream<G, L>, &[u32; 25]) -> Option<FeatureFrame>,
    stream_lost: fn(&mut FeatureStream<G, L>, u64) -> Loss,
    stream_abandon: fn(&mut FeatureStream<G, L>) -> Loss,
    pipeline: fn(Camera<G>, f64, TriggerConfig) -> Result<Pipeline<G, L>, Error>,
    pipeline_with_floor: fn(Camera<G>, Floor, TriggerConfig) -> Result<Pipeline<G, L>, Error>,
    frame: for<'a> fn(&'a mut Pipeline<G, L>, &[u8]) -> Result<Option<Event<'a>>, Error>,
    stripe: for<'a> fn(&'a mut Pipeline<G, L>, &[u8]) -> Result<Option<Event<'a>>, Error>,
    lost: for<'a> fn(&'a mut Pipeline<G, L>, u64) -> Option<Event<'a>>,
    abandon_frame: for<'a> fn(&'a mut Pipeline<G, L>) -> Option<Event<'a>>,
    finish: for<'a> fn(&'a mut Pipeline<G, L>) -> Option<Event<'a>>,
    end: fn(&Pipeline<G, L>) -> StreamEnd,
    interrupted: fn(&mut Pipeline<G, L>) -> Option<Incomplete>,
}

format!(grey, Grey, Fixed);
format!(grey_fixed_32, Grey, Fixed<32>);
format!(grey_libm, Grey, Libm);
format!(grey_micromath, Grey, Micromath);
format!(y10, Y10, Fixed);
format!(y12, Y12, Fixed);
format!(y16, Y16, Fixed);
format!(rgb24, Rgb24, Fixed);
format!(rgbx32, Rgbx32, Fixed);
format!(xrgb32, Xrgb32, Fixed);
format!(rgb565, Rgb565, Fixed);
format!(bayer8, Bayer<8>, Fixed);
format!(bayer10, Bayer<10>, Fixed);
format!(bayer12, Bayer<12>, Fixed);
format!(yuyv, Yuyv<Exact>, Fixed);
format!(yuyv_linear, Yuyv<Linear>, Fixed);
format!(uyvy, Uyvy<Exact>, Fixed);
format!(uyvy_linear, Uyvy<Linear>, Fixed);
format!(nv12, Nv12<Exact>, Fixed);
format!(nv12_linear, Nv12<Linear>, Fixed);
format!(yu12, Yu12<Exact>, Fixed);
format!(yu12_linear, Yu12<Linear>, Fixed);
format!(yuv422p, Yuv422p<Exact>, Fixed);
format!(yuv422p_linear, Yuv422p<Linear>, Fixed);
format!(yuv444p, Yuv444p<Exact>, Fixed);
format!(yuv444p_linear, Yuv444p<Linear>, Fixed);
format!(any, Any, Fixed);

/// The features of one kernel.
macro_rules! kernel {
    ($new:ident, $feature:ident, $features:ident, $ln:ident, $kernel:ty) => {
        entries! {
            $new(pixels: u32, full_scale: u32, frames: u32, floor: Floor) -> Result<FeatureScale<$kernel>, Error> {
                FeatureScale::new(pixels, full_scale, frames, floor)
            }
            $feature(scale: &FeatureScale<$kernel>, sum: u32) -> i16 { scale.feature(sum).max(scale.floor()) }
            $features(scale: &FeatureScale<$kernel>, lines: &[u32; 10]) -> Features { scale.features(lines) }
            $ln(x: u32) -> i32 { <$kernel as Ln>::ln(x) }
        }
    };
}

kernel!(fixed_256_new, fixed_256_feature, fixed_256_features, fixed_256_ln, Fixed<256>);
kernel!(fixed_16_new, fixed_16_feature, fixed_16_features, fixed_16_ln, Fixed<16>);
kernel!(fixed_32_new, fixed_32_feature, fixed_32_features, fixed_32_ln, Fixed<32>);
kernel!(libm_new, libm_feature, libm_features, libm_ln, Libm);
kernel!(micromath_new, micromath_feature, micromath_features, micromath_ln, Micromath);

entries! {
    floor(levels: f64, full_scale: u32) -> Result<Floor, Error> { Floor::new(levels, full_scale) }
    frame_size(width: u32, height: u32) -> Result<FrameSize, Error> { FrameSize::new(width, height) }
    layout(frame: FrameSize, taxel: [u16; 2], corners: [[u16; 2]; 25]) -> Result<Layout, Error> {
        Layout::new(frame, taxel, corners)
    }
    paper_layout(frame: FrameSize) -> Result<Layout, Error> { Layout::paper(frame) }
    frame_rate(numerator: u32, denominator: u32) -> Result<FrameRate, Error> { FrameRate::new(numerator, denominator) }
    frames_added(rate: FrameRate) -> u32 { rate.frames_added() }
    nominal_frames(rate: FrameRate) -> f32 { rate.nominal_frames() }
    stride(stride: u32) -> Result<Stride, Error> { Stride::try_from(stride) }
    q16(x: f64) -> Option<Q16> { Q16::new(x) }
    any_format(format: PixelFormat, colour: Colour, method: YcbcrMethod) -> Any { Any::new(format, colour, method) }
    exact(colour: Colour) -> Exact { Exact::new(colour) }
    linear(colour: Colour) -> Linear { Linear::new(colour) }
    mosaic(order: BayerOrder) -> Bayer<10> { Bayer::new(order) }
    sums_of_lines(taxels: &[u32; 25]) -> [u32; 10] { line_sums(taxels) }
    real_feature(feature: i16) -> f32 { to_f32(feature) }
    constant_ln(x: f64) -> f64 { constant::ln(x) }
    constant_exp(x: f64) -> f64 { constant::exp(x) }

    trigger_config(window: u32, multiplier: f64, backtrack: u32, rule: Rule, margin: f64) -> Result<TriggerConfig, Error> {
        TriggerConfig::new(window, multiplier, backtrack, rule, margin)
    }
    trigger_default() -> TriggerConfig { TriggerConfig::default() }
    trigger_new(config: TriggerConfig, frame: u64) -> Trigger { Trigger::starting_at(config, frame) }
    trigger_push<'a>(trigger: &'a mut Trigger, features: Features, patched: bool) -> Option<Event<'a>> {
        trigger.push(features, patched)
    }
    trigger_push_then_lose<'a>(trigger: &'a mut Trigger, features: Features, patched: bool, lost: u64) -> Option<Event<'a>> {
        trigger.push_then_lose(features, patched, lost)
    }
    trigger_lost(trigger: &mut Trigger, frames: u64) -> () { trigger.push_lost(frames) }
    trigger_finish<'a>(trigger: &'a mut Trigger) -> Option<Event<'a>> { trigger.finish() }
    trigger_end(trigger: &Trigger) -> StreamEnd { trigger.end() }
    trigger_next(trigger: &Trigger) -> u64 { trigger.next_frame() }
    trigger_recent<'a>(trigger: &'a Trigger) -> (u64, Sample<'a>) { trigger.recent() }
    trigger_interrupted(trigger: &mut Trigger) -> Option<Incomplete> { trigger.take_interrupted() }
    trigger_baseline(trigger: &Trigger) -> Option<&Baseline> { trigger.baseline() }
    trigger_thresholds(trigger: &Trigger) -> Option<&[i32; 10]> { trigger.thresholds() }

    baseline(totals: [i32; 10], frames: u16) -> Baseline { Baseline::new(totals, frames) }
    sample<'a>(frames: &'a [Features; 70]) -> Sample<'a> { Sample::from_frames(frames) }
    sample_feature(sample: Sample<'_>, feature: usize) -> i64 { sample.feature(feature).map(i64::from).sum() }
    sample_flat(sample: Sample<'_>) -> [i16; 700] { sample.flat() }
    model<'a>(words: &'a [u32]) -> Result<Model<'a>, ModelError> { Model::from_words(words) }
    model_of_bytes<'a>(bytes: &'a [u8]) -> Result<Model<'a>, ModelError> { Model::from_bytes(bytes) }
    model_svm<'a>(words: &'a [u32]) -> Result<LinearSvm<'a>, ModelError> { LinearSvm::from_words(words) }
    model_forest<'a>(words: &'a [u32]) -> Result<Forest<'a>, ModelError> { Forest::from_words(words) }
    model_boosted<'a>(words: &'a [u32]) -> Result<Boosted<'a>, ModelError> { Boosted::from_words(words) }
    model_classify(model: &Model<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    svm_classify(model: &LinearSvm<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    forest_classify(model: &Forest<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    boosted_classify(model: &Boosted<'_>, sample: &[i16; 700]) -> u8 { model.classify(sample) }
    texture_of_svm(sample: &[i16; 700], model: &LinearSvm<'static>) -> u8 { texture::texture(sample, model).class }
    texture_of_forest(sample: &[i16; 700], model: &Forest<'static>) -> u8 { texture::texture(sample, model).class }
    texture_of_boosted(sample: &[i16; 700], model: &Boosted<'static>) -> u8 { texture::texture(sample, model).class }
    texture_of_model(sample: &[i16; 700], model: &Model<'static>) -> u8 { texture::texture(sample, model).class }
    early_new(frames: u8) -> Early { Early::new(frames) }
    early_take<'a>(early: &mut Early, trigger: &'a Trigger) -> Option<Beginning<'a>> { early.take(trigger) }
    beginning_flat(beginning: &Beginning<'_>) -> [i16; 700] { beginning.flat() }
    model_frames(model: &Model<'_>) -> u8 { model.frames() }
    model_label<'a>(labels: Labels<'a>, class: usize) -> Option<Label<'a>> { labels.get(class) }
    model_training<'a>(labels: Labels<'a>) -> Label<'a> { labels.training() }
    model_label_letters(label: Label<'_>) -> u32 { label.chars().map(u32::from).fold(0, u32::wrapping_add) }
    sample_frames(sample: Sample<'_>) -> usize { sample.frames().count() }
    event_direction(event: &Event<'_>) -> Direction { direction::direction(event) }
    event_duration(event: &Event<'_>, config: &SpeedConfig) -> Option<Duration> { speed::duration(event, config) }
    event_speed(event: &Event<'_>, config: &SpeedConfig) -> Result<Speed, NoSpeed> { speed::speed(event, config) }
    duration_frames(duration: Duration) -> u8 { duration.frames() }
    duration_cut_off(duration: Duration) -> bool { duration.is_cut_off() }
    law_speed(law: Law, frames: f32) -> Option<f32> { law.speed(frames) }
    speed_config(law: Law, threshold: f64, on: ThresholdOn, rate: FrameRate) -> Result<SpeedConfig, Error> {
        SpeedConfig::new(law, threshold, on, rate)
    }
    paper_speed(rate: FrameRate) -> SpeedConfig { SpeedConfig::paper(rate) }

    wire_encode<'b>(message: &Message<'_>, sequence: u16, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::encode(message, sequence, buffer)
    }
    wire_encode_request<'b>(request: &Request, sequence: u16, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::encode(request, sequence, buffer)
    }
    wire_decoder() -> Decoder { Decoder::new() }
    wire_decode<'a>(decoder: &'a mut Decoder, byte: u8) -> Option<Result<Received<Message<'a>>, Refused>> {
        decoder.push(byte)
    }
    wire_decode_request(decoder: &mut Decoder<16>, byte: u8) -> Option<Result<Received<Request>, Refused>> {
        decoder.push(byte)
    }
    wire_text<'a>(text: &'a str) -> Text<'a> { Text::new(text) }
    wire_answers(event: &Event<'_>, config: &SpeedConfig) -> Answers<'static> { Answers::new(event, config) }
    wire_texture<'a>(answers: Answers<'a>, sample: &[i16; 700], model: &Model<'a>) -> Answers<'a> {
        answers.with_texture(texture::texture(sample, model))
    }
    wire_sample<'b>(sample: Sample<'_>, part: usize, buffer: &'b mut [u8; wire::LONGEST]) -> &'b [u8] {
        wire::sample_parts(0, sample).nth(part).map_or(&[], |part| wire::encode(&part, 0, buffer))
    }
}

#[cfg(feature = "deliberate")]
#[unsafe(no_mangle)]
pub extern "C" fn deliberate(bytes: &[u8], index: usize) -> u8 {
    bytes[index]
}
