//! Entry points for frames, rates, formats, and arithmetic on sums.

use wstac_core::error::ConfigError;
use wstac_core::features::{Floor, line_sums};
use wstac_core::fixed::Q16;
use wstac_core::frame::Stride;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::{Bayer, BayerOrder};
use wstac_core::green::ycbcr::{Exact, Linear, YcbcrEncoding};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::constant;
use wstac_core::rate::FrameRate;

entries! {
    camera:
    frame_size(width: u32, height: u32) -> Result<FrameSize, ConfigError> { FrameSize::new(width, height) }
    layout(frame: FrameSize, taxel: [u16; 2], corners: [[u16; 2]; 25]) -> Result<Layout, ConfigError> {
        Layout::new(frame, taxel, corners)
    }
    paper_layout(frame: FrameSize) -> Result<Layout, ConfigError> { Layout::paper(frame) }
    frame_rate(numerator: u32, denominator: u32) -> Result<FrameRate, ConfigError> { FrameRate::new(numerator, denominator) }
    frames_added(rate: FrameRate) -> u32 { rate.frames_added() }
    nominal_frames(rate: FrameRate) -> f32 { rate.nominal_frames() }
    floor(levels: f64, full_scale: u32) -> Result<Floor, ConfigError> { Floor::new(levels, full_scale) }
    stride(stride: u32) -> Result<Stride, ConfigError> { Stride::try_from(stride) }
    q16(x: f64) -> Option<Q16> { Q16::new(x) }
    any_format(format: PixelFormat, color: YcbcrEncoding, method: YcbcrMethod) -> Any { Any::new(format, color, method) }
    exact(color: YcbcrEncoding) -> Exact { Exact::new(color) }
    linear(color: YcbcrEncoding) -> Linear { Linear::new(color) }
    mosaic(order: BayerOrder) -> Bayer<10> { Bayer::new(order) }
    sums_of_lines(taxels: &[u32; 25]) -> [u32; 10] { line_sums(taxels) }
    constant_ln(x: f64) -> f64 { constant::ln(x) }
    constant_exp(x: f64) -> f64 { constant::exp(x) }
}
