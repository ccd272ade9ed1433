//! Uses a logarithm and a model of your own: `cargo run -p wstac-core --example own_kernel`.
//!
//! After the pixels, the logarithm is the arithmetic that costs most of a frame. It is a type parameter of
//! [`Pipeline`], and only the kernel that you name is linked. This one has no table and one multiplication. The model
//! is a file that the compiler checks: `wstac model import forest.onnx -o my.wsm`.

use wstac_core::error::Error;
use wstac_core::features::Features;
use wstac_core::green::gray::Gray;
use wstac_core::include_model;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{LN_FRACTION_BITS, Ln, fixed::Fixed};
use wstac_core::model::forest::Forest;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture::texture;

/// A forest in 1,660 bytes of flash. A damaged file, or one of another kind, does not compile.
static MODEL: Forest<'static> = include_model!(Forest, "../tests/models/small.wsm");

/// Computes log2(1 + m) as the parabola m + 0.344 m (1 − m), within 0.0083. As a natural logarithm that is within
/// 0.0058, 12 units of a feature.
#[derive(Clone, Copy, Debug, Default)]
struct Parabola;

/// ln 2 in units of 2^-16.
const LN_2: u64 = 45_426;

impl Ln for Parabola {
    // A kernel is called with x ≥ 1 and returns ln x in units of 2^-26. It must not panic, whatever x is.
    fn ln(&self, x: u32) -> i32 {
        let exponent = x.max(1).ilog2();
        // The mantissa without its leading one, 0 to 1 in units of 2^-16.
        let m = ((u64::from(x) << 16) >> exponent) as u32 & 0xFFFF;
        let bow = (((m * (0x1_0000 - m)) >> 16) * 11) >> 5;
        let log2 = u64::from((exponent << 16) + m + bow);
        // Units of 2^-32, then of 2^-26.
        ((log2 * LN_2) >> (32 - LN_FRACTION_BITS)) as i32
    }
}

/// Returns the results of one slide's frames with a logarithm: the highest features, and the texture.
fn slide<L: Ln>() -> Result<(Features, String), Error> {
    let camera = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400)?)?, FrameRate::NOMINAL)?;
    let mut pipeline = Pipeline::builder(camera).ln(L::default()).build()?;
    let mut frame = vec![0; 400 * 400];
    for t in 0..120_usize {
        frame.fill(2);
        if let Some(left) = t.checked_sub(40).map(|frames| 12 * frames).filter(|left| *left < 388) {
            frame.chunks_mut(400).for_each(|row| row[left..][..12].fill(200));
        }
        if let Some(event) = pipeline.push_frame(&frame)?.event() {
            let highest = core::array::from_fn(|feature| event.sample.feature(feature).max().unwrap_or(i16::MIN));
            // A model that is not a file takes `event.sample.flat()`: 700 numbers, frame by frame.
            return Ok((highest, texture(&event.sample.flat(), &MODEL).label.to_string()));
        }
    }
    Ok(([i16::MIN; 10], "no event".to_owned()))
}

fn main() -> Result<(), Error> {
    let (fixed, parabola) = (slide::<Fixed>()?, slide::<Parabola>()?);
    println!("highest features, in units of 1/2048, rows then columns, and the texture:");
    println!("  Fixed     {:?} {}", fixed.0, fixed.1);
    println!("  Parabola  {:?} {}", parabola.0, parabola.1);
    let most = fixed.0.iter().zip(parabola.0).map(|(fixed, own)| fixed.abs_diff(own)).max().unwrap_or(0);
    println!("the parabola is off by {most} units at most here");
    Ok(())
}
