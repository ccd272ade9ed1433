//! Measures the cost of the way from frames to answers on a board that QEMU emulates (`ci/firmware`).
//!
//! The file `frames` has frames of 400 × 400 [`setup::PIXELS`]. They are taken in stripes, and whole if there is room.
//! Features go to the file `features`; instructions and stack go to the console, as JSON. The cost of the texture
//! model's answer is counted for the events, and for the samples in the file `samples`.
#![no_std]
#![no_main]

use core::fmt::Write;

use cortex_m_rt::entry;
use wstac_core::error::{ConfigError, Error, FrameError};
use wstac_core::law::EventLaw;
use wstac_core::layout::FrameSize;
use wstac_core::model::file::INPUTS;
use wstac_core::paper::direction;
use wstac_core::paper::speed;
use wstac_core::paper::trigger::{Event, Trigger};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture;
use wstac_core::touch::motion::{self, MotionConfig};
use wstac_core::touch::taxel_ring::TaxelStore;
use wstac_core::touch::wave::by_wave;
use wstac_core::wire::Answers;
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::{self, Console, File};
use wstac_fw::emulated::stack;
use wstac_fw::live::Live as _;
use wstac_fw::setup;
use wstac_fw::textures::{ModelSample, Textures};

const SIDE: usize = 400;
/// The rows that a DMA brings at a time.
const ROWS: usize = 8;
/// One if live motion is measured, else none: neither a model nor stripes of three bytes a pixel leave room for it.
const LIVE: usize = (setup::MODEL.is_none() && setup::PIXEL_BYTES < 3) as usize;
/// The bytes of a whole frame.
#[cfg(not(microbit))]
const FRAME: usize = SIDE * SIDE * setup::PIXEL_BYTES;

/// The total cost of a kind of work.
#[derive(Default)]
struct Cost {
    times: u32,
    ticks: u64,
}

impl Cost {
    fn add(&mut self, ticks: u32) {
        self.times += 1;
        self.ticks += u64::from(ticks);
    }

    /// Returns the instructions per execution.
    fn mean(&self, clock: &Clock) -> u64 {
        clock.instructions(self.ticks).checked_div(u64::from(self.times)).unwrap_or(0)
    }
}

#[entry]
fn main() -> ! {
    match run() {
        Ok(()) => host::done(),
        Err(_) => host::fail("the configuration does not fit frames of 400 x 400\n"),
    }
}

fn run() -> Result<(), Error> {
    let Some(clock) = Clock::start() else { return Ok(()) };
    let (frames, features) = (File::open(b"frames\0"), File::create(b"features\0"));
    let layout = setup::layout(FrameSize::new(SIDE as u32, SIDE as u32)?)?;
    let camera = FrameGeometry::with_stride(setup::GREEN, layout, FrameRate::NOMINAL, setup::STRIDE)?;
    // It stays in its result: taken out, it would be a second one on the stack.
    let mut pipeline = pipeline_of(camera);
    let pipeline = pipeline.as_mut().map_err(|error| *error)?;
    // The pipeline's own work cannot be timed separately.
    let mut trigger = Trigger::with(setup::TRIGGER, 0, setup::FOLLOWING);
    let speed = setup::durations(FrameRate::NOMINAL)?;
    let motion = setup::motion(FrameRate::NOMINAL)?;
    let [mut to_features, mut to_trigger, mut to_speed, mut to_direction, mut to_texture] =
        [const { Cost { times: 0, ticks: 0 } }; 5];
    let [mut to_edges, mut to_motion, mut to_wave] = [const { Cost { times: 0, ticks: 0 } }; 3];
    let mut live: [setup::Live; LIVE] = core::array::from_fn(|_| setup::Live::new(motion));
    let mut longest_live = [0; 2];
    let mut stripe = [0; ROWS * SIDE * setup::PIXEL_BYTES];
    let mut frame_ticks = 0;
    while frames.read(&mut stripe) {
        let (ticks, update) = clock.ticks(|| pipeline.push_stripe(&stripe));
        frame_ticks += ticks;
        let update = update?;
        let Some(frame) = update.frame() else { continue };
        features.write(&frame.features);
        let (ticks, _) = clock.ticks(|| trigger.push(frame.features, frame.has_missing_frames).is_some());
        to_trigger.add(ticks);
        to_features.add(core::mem::take(&mut frame_ticks).saturating_sub(ticks));
        if let Some(event) = update.event() {
            to_speed.add(clock.ticks(|| speed::speed(&event, &speed)).0);
            to_direction.add(clock.ticks(|| direction::direction(&event)).0);
            to_edges.add(clock.ticks(|| motion::by_edges(&event, motion)).0);
            to_motion.add(clock.ticks(|| motion::by_coherence(&event, motion)).0);
            if let Some(taxels) = event.taxels()
                && <setup::Taxels as TaxelStore>::NEEDS_START
                // Its 16 KiB are refused a wave.
                && cfg!(not(microbit))
            {
                to_wave.add(clock.ticks(|| by_wave(&event, taxels, motion)).0);
            }
            if let Some(model) = setup::MODEL {
                to_texture.add(of_texture(&clock, &event, motion, model)?);
            }
        }
        if let [live, ..] = &mut live[..] {
            let before = live.waves();
            let ticks = clock.ticks(|| live.newest(pipeline)).0;
            // A touch begins with none.
            let asks = usize::from(live.waves() > before);
            longest_live[asks] = longest_live[asks].max(ticks);
        }
    }
    let stack = stack::deepest() - size_of_val(&stripe);
    let logs = logs(&clock, camera, &pipeline.taxels().unwrap_or_default())?;
    let answer = answers(&clock);
    let whole = whole_frames(&clock, FeatureStream::with_floor(camera, setup::FLOOR)?)?;
    let _ = writeln!(
        Console,
        "{{\"frames\":{},\"events\":{},\"whole\":{whole},\"stripes\":{},\"logs\":{},\"trigger\":{},\"speed\":{},\"direction\":{},\"edges\":{},\"motion\":{},\"wave\":{},\"live\":{},\"live_wave\":{},\"texture\":{},\"answer\":{answer},\"stack\":{}}}",
        to_features.times,
        to_speed.times,
        to_features.mean(&clock),
        logs,
        to_trigger.mean(&clock),
        to_speed.mean(&clock),
        to_direction.mean(&clock),
        to_edges.mean(&clock),
        to_motion.mean(&clock),
        to_wave.mean(&clock),
        clock.instructions(u64::from(longest_live[0])),
        clock.instructions(u64::from(longest_live[1])),
        to_texture.mean(&clock),
        stack,
    );
    Ok(())
}

#[inline(never)]
fn pipeline_of(camera: FrameGeometry<setup::GreenChannel>) -> Result<setup::BoardPipeline, ConfigError> {
    setup::pipeline(camera)
}

/// Returns the ticks of the texture model's answer to an event, from the sample that it takes to its class.
// It is not inlined: the answers of the law do not count for the stack of all else.
#[inline(never)]
fn of_texture(
    clock: &Clock,
    event: &Event<'_>,
    motion: MotionConfig,
    model: &'static setup::Kind,
) -> Result<u32, ConfigError> {
    let law = setup::law(FrameRate::NOMINAL)?;
    let velocity = law.path_velocity(event, Answers::new(event, &law).velocity());
    let mut textures = Textures::default();
    let (ticks, _) = clock.ticks(|| {
        <setup::ModelSample as ModelSample>::texture(event, velocity, motion, model, &mut textures).is_some()
    });
    Ok(ticks)
}

/// Returns the instructions from a frame's taxel sums to its features.
// It is not inlined: a stream of its own would lie on the stack all the time.
#[inline(never)]
fn logs(clock: &Clock, camera: FrameGeometry<setup::GreenChannel>, sums: &[u32; TAXELS]) -> Result<u64, ConfigError> {
    let mut stream = FeatureStream::<_, setup::Ln>::with_floor(camera, setup::FLOOR)?;
    let ticks = clock.ticks(|| stream.push_taxels(sums)).0;
    Ok(clock.instructions(u64::from(ticks)))
}

/// Returns the instructions of the texture model's answer to one of the samples in the file. The cost of trees depends
/// on the sample.
#[inline(never)]
fn answers(clock: &Clock) -> u64 {
    let Some(model) = setup::MODEL else { return 0 };
    let samples = File::open(b"samples\0");
    let mut cost = Cost::default();
    let mut bytes = [0; 2 * INPUTS];
    while samples.read(&mut bytes) {
        let mut numbers = [0; INPUTS];
        for (number, bytes) in numbers.iter_mut().zip(bytes.as_chunks::<2>().0) {
            *number = i16::from_le_bytes(*bytes);
        }
        cost.add(clock.ticks(|| texture::texture(&numbers, model)).0);
    }
    cost.mean(clock)
}

/// Returns the instructions from a whole frame to its features; 0 on a board that has no room for one.
#[cfg(not(microbit))]
fn whole_frames(clock: &Clock, mut stream: FeatureStream<setup::GreenChannel, setup::Ln>) -> Result<u64, FrameError> {
    #[allow(clippy::large_stack_arrays, reason = "it is none: the start-up code writes it")]
    let Some(frame) = cortex_m::singleton!(: [u8; FRAME] = [0; FRAME]) else { return Ok(0) };
    let frames = File::open(b"frames\0");
    let mut cost = Cost::default();
    while frames.read(frame) {
        let (ticks, features) = clock.ticks(|| stream.push_frame(frame));
        features?;
        cost.add(ticks);
    }
    Ok(cost.mean(clock))
}

#[cfg(microbit)]
#[allow(clippy::unnecessary_wraps)]
fn whole_frames(_: &Clock, _: FeatureStream<setup::GreenChannel, setup::Ln>) -> Result<u64, FrameError> {
    Ok(0)
}
