//! Entry points of every pixel format: geometry, sums, features and pipeline.

use wstac_core::error::{ConfigError, FrameError};
use wstac_core::features::Floor;
use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::green::bayer::Bayer;
use wstac_core::green::gray::Gray;
use wstac_core::green::packed_rgb::{Rgb24, Rgbx32, Xrgb32};
use wstac_core::green::packed_ycbcr::{Uyvy, Yuyv};
use wstac_core::green::planar_ycbcr::{Nv12, Yu12, Yuv422p, Yuv444p};
use wstac_core::green::rgb565::Rgb565;
use wstac_core::green::words::{Y10, Y12, Y16};
use wstac_core::green::ycbcr::{Exact, Linear};
use wstac_core::layout::Layout;
use wstac_core::ln::{any::AnyLn, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::paper::baseline_policy::FixedBaseline;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::trigger::{InterruptedSample, StreamEnd, TriggerConfig};
use wstac_core::pipeline::{Finished, NextFrame, Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::{FrameGeometry, TaxelSums};

/// Declares the entry points of one pixel format.
macro_rules! format {
    ($group:ident, $green:ty, $kernel:ty) => {
        mod $group {
            use super::*;
            type G = $green;
            type L = $kernel;

            entries! {
                $group:
                new_camera(green: G, layout: Layout, rate: FrameRate) -> Result<FrameGeometry<G>, ConfigError> { FrameGeometry::new(green, layout, rate) }
                new_camera_with_stride(green: G, layout: Layout, rate: FrameRate, stride: Stride) -> Result<FrameGeometry<G>, ConfigError> {
                    FrameGeometry::with_stride(green, layout, rate, stride)
                }
                new_camera_with_bytes_per_row(camera: FrameGeometry<G>, bytes: u32) -> Result<FrameGeometry<G>, ConfigError> { camera.with_bytes_per_row(bytes) }
                camera_sizes(camera: &FrameGeometry<G>) -> (usize, usize, u32, u32) {
                    (camera.frame_bytes(), camera.bytes_per_row(), camera.pixels(), camera.full_scale())
                }
                new_sums(camera: FrameGeometry<G>) -> TaxelSums<G> { TaxelSums::new(camera) }
                sums_push_frame(sums: &mut TaxelSums<G>, bytes: &[u8]) -> Result<[u32; 25], FrameError> { sums.push_frame(bytes) }
                sums_push_stripe(sums: &mut TaxelSums<G>, bytes: &[u8]) -> Result<Option<[u32; 25]>, FrameError> { sums.push_stripe(bytes) }
                sums_abandon(sums: &mut TaxelSums<G>) -> () { sums.abandon_frame(); }
                new_stream(camera: FrameGeometry<G>, floor: f64) -> Result<FeatureStream<G, L>, ConfigError> { FeatureStream::new(camera, floor) }
                new_stream_with_floor(camera: FrameGeometry<G>, floor: Floor) -> Result<FeatureStream<G, L>, ConfigError> {
                    FeatureStream::with_floor(camera, floor)
                }
                stream_push_frame(stream: &mut FeatureStream<G, L>, bytes: &[u8]) -> Result<Option<FeatureFrame>, FrameError> {
                    stream.push_frame(bytes)
                }
                stream_push_stripe(stream: &mut FeatureStream<G, L>, bytes: &[u8]) -> Result<Option<FeatureFrame>, FrameError> {
                    stream.push_stripe(bytes)
                }
                stream_push_taxels(stream: &mut FeatureStream<G, L>, taxels: &[u32; 25]) -> Option<FeatureFrame> {
                    stream.push_taxels(taxels)
                }
                stream_push_lost(stream: &mut FeatureStream<G, L>, frames: u64) -> Loss { stream.push_lost(frames) }
                stream_abandon(stream: &mut FeatureStream<G, L>) -> Loss { stream.abandon_frame() }
                stream_taxels(stream: &FeatureStream<G, L>) -> Option<[u32; 25]> { stream.taxels() }
                new_pipeline(camera: FrameGeometry<G>, floor: f64, trigger: TriggerConfig) -> Result<Pipeline<G, L>, ConfigError> {
                    Pipeline::builder(camera).ln(L::default()).floor_levels(floor).trigger(trigger).build()
                }
                new_pipeline_with_floor(camera: FrameGeometry<G>, floor: Floor, frame: u64) -> Result<Pipeline<G, L>, ConfigError> {
                    Pipeline::builder(camera).ln(L::default()).floor(floor).starting_at(frame).build()
                }
                push_frame<'a>(pipeline: &'a mut Pipeline<G, L>, bytes: &[u8]) -> Result<Update<'a>, FrameError> {
                    pipeline.push_frame(bytes)
                }
                push_stripe<'a>(pipeline: &'a mut Pipeline<G, L>, bytes: &[u8]) -> Result<Update<'a>, FrameError> {
                    pipeline.push_stripe(bytes)
                }
                push_last_stripe<'a>(pipeline: &'a mut Pipeline<G, L>, bytes: &[u8]) -> Result<(Update<'a>, NextFrame<'a, G>), FrameError> {
                    pipeline.push_last_stripe(bytes)
                }
                push_next(next: &mut NextFrame<'_, G>, bytes: &[u8]) -> Result<bool, FrameError> { next.push_stripe(bytes) }
                push_taxels<'a>(pipeline: &'a mut Pipeline<G, L>, taxels: &[u32; 25]) -> Update<'a> { pipeline.push_taxels(taxels) }
                push_lost<'a>(pipeline: &'a mut Pipeline<G, L>, frames: u64) -> Update<'a> { pipeline.push_lost(frames) }
                abandon<'a>(pipeline: &'a mut Pipeline<G, L>) -> Update<'a> { pipeline.abandon_frame() }
                finish<'a>(pipeline: &'a mut Pipeline<G, L>) -> Finished<'a> { pipeline.finish() }
                rezero(pipeline: &mut Pipeline<G, L>) -> Option<InterruptedSample> { pipeline.rezero() }
                restart(pipeline: &mut Pipeline<G, L>) -> Option<InterruptedSample> { pipeline.restart() }
                set_trigger(pipeline: &mut Pipeline<G, L>, trigger: TriggerConfig) -> Option<InterruptedSample> {
                    pipeline.set_trigger(trigger, FixedBaseline)
                }
                set_floor(pipeline: &mut Pipeline<G, L>, floor: Floor) -> Result<(), ConfigError> { pipeline.set_floor(floor) }
                taxels(pipeline: &Pipeline<G, L>) -> Option<[u32; 25]> { pipeline.taxels() }
                next_frame(pipeline: &Pipeline<G, L>) -> u64 { pipeline.next_frame() }
                settled_frame(pipeline: &Pipeline<G, L>) -> u64 { pipeline.settled_frame() }
                recent<'a>(pipeline: &'a Pipeline<G, L>) -> (u64, Sample<'a>) { pipeline.recent() }
                end(pipeline: &Pipeline<G, L>) -> StreamEnd { pipeline.end() }
            }
        }
    };
}

format!(gray, Gray, Fixed);
format!(gray_fixed_32, Gray, Fixed<32>);
format!(gray_libm, Gray, Libm);
format!(gray_micromath, Gray, Micromath);
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
format!(any, Any, AnyLn);
