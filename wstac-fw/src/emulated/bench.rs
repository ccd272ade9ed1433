//! The parts that programs on emulated boards share, for frames of 400 × 400 pixels.
//!
//! The sizes of the examples are measured, so their pixels come from a static buffer and their answers go to a sink.

use core::hint::black_box;

use wstac_core::error::{ConfigError, Error};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::speed::SpeedConfig;
use wstac_core::paper::trigger::Event;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, Readout};

use super::host;
use crate::setup;

/// The bytes of a stripe: eight rows of 400 pixels.
pub const STRIPE: usize = 8 * 400 * setup::PIXEL_BYTES;

/// The positions of the taxels in the frames.
pub const LAYOUT: Layout = match FrameSize::new(400, 400) {
    Ok(size) => match setup::layout(size) {
        Ok(layout) => layout,
        Err(_) => panic!("the configuration does not fit frames of 400 x 400"),
    },
    Err(_) => panic!("400 x 400 is a size of frames"),
};

/// The law of the configuration.
pub const LAW: setup::Law = match setup::law(FrameRate::NOMINAL) {
    Ok(law) => law,
    Err(_) => panic!("checked by the build script"),
};

/// The law of durations of the configuration, or else the published one.
pub const DURATIONS: SpeedConfig = match setup::durations(FrameRate::NOMINAL) {
    Ok(durations) => durations,
    Err(_) => panic!("checked by the build script"),
};

/// The parameters of arrival times of the configuration.
pub const MOTION: MotionConfig = match setup::motion(FrameRate::NOMINAL) {
    Ok(motion) => motion.with_readout(Readout::GLOBAL),
    Err(_) => panic!("checked by the build script"),
};

/// The message if the configuration does not fit the frames.
pub const DOES_NOT_FIT: &str = "the configuration does not fit the camera\n";

/// Returns the geometry of the frames: 400 × 400 pixels.
///
/// # Errors
/// Returns an error if the configuration does not fit them.
pub fn camera() -> Result<FrameGeometry<setup::GreenChannel>, ConfigError> {
    FrameGeometry::with_stride(setup::GREEN, LAYOUT, FrameRate::NOMINAL, setup::STRIDE)
}

/// Passes every event of endless stripes to `show`.
#[inline(always)]
pub fn events(show: impl FnMut(&Event<'_>)) -> ! {
    match run(show) {
        Ok(()) => host::done(),
        Err(_) => host::fail(DOES_NOT_FIT),
    }
}

fn run(mut show: impl FnMut(&Event<'_>)) -> Result<(), Error> {
    let mut pipeline = setup::checked(camera()?)?.build();
    loop {
        if let Some(event) = pipeline.push_stripe(stripe())?.event() {
            show(&event);
        }
    }
}

/// Returns the next stripe, in RAM as a DMA would leave it.
pub fn stripe() -> &'static [u8] {
    static mut PIXELS: [u8; STRIPE] = [0; STRIPE];
    // SAFETY: it has this many bytes, and no code writes them.
    black_box(unsafe { core::slice::from_raw_parts((&raw const PIXELS).cast(), STRIPE) })
}

/// Takes an answer.
pub fn show<T>(answer: T) {
    black_box(answer);
}
