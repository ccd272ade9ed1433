//! Runs the golden vectors on a board that QEMU emulates (tests/firmware/golden.py).
//!
//! The file `cases` has cases of any pixel format, whose answers are by the published algorithm; results go to the file
//! `results`. The file `touches` has samples whose answers are by arrival times; they go to the file `motions`. The
//! file `waves` has sums of touches that live motion by 25 taxels follows; its velocities go to the file `velocities`.
//! Random sums of GREY come first, because their kernels are this board's own.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_core::frame::Stride;
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::gray::Gray;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::direction;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::{self, Law, LitSpan, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{ContactEnd, Event, Rule, TriggerConfig};
use wstac_core::params::{COLUMNS, FEATURES, SAMPLE_FRAMES, TAXELS};
use wstac_core::pipeline::{Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_core::touch::motion::{self, Contact, LiveContact, LiveWave, Motion};
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_core::touch::wave::{Basis, by_wave};
use wstac_fw::emulated::host::{self, File};

/// The size of the largest whole frame. Larger frames come in stripes.
const ROOM: usize = if cfg!(microbit) { 6 * 1024 } else { 32 * 1024 };
/// The number of random layouts.
const TURNS: usize = 400;
/// The words in front of a case's frames.
const HEADER: usize = 80;
/// The first word of a result: for a feature frame, an event, the end, the end of a contact.
const FEATURE_FRAME: i16 = 1;
const EVENT: i16 = 2;
const END: i16 = 3;
const CONTACT_END: i16 = 4;
/// The bytes of a sample: ten totals of its baseline, the frames that they are of, and ten features of 70 frames.
const SAMPLE: usize = 4 * (FEATURES + 1) + 2 * FEATURES * SAMPLE_FRAMES;

struct WordReader<'a>(&'a [u8]);

impl WordReader<'_> {
    fn u32(&mut self) -> u32 {
        let Some((word, rest)) = self.0.split_first_chunk::<4>() else { return 0 };
        self.0 = rest;
        u32::from_le_bytes(*word)
    }

    fn f64(&mut self) -> f64 {
        let low = self.u32();
        f64::from_bits(u64::from(low) | u64::from(self.u32()) << 32)
    }
}

#[entry]
fn main() -> ! {
    let (cases, results) = (File::open(b"cases\0"), File::create(b"results\0"));
    #[allow(clippy::large_stack_arrays, reason = "it is none: the start-up code writes it")]
    let Some(frame) = cortex_m::singleton!(: [u8; ROOM] = [0; ROOM]) else { host::done() };
    if sums_by_chance(frame).is_err() {
        host::fail("sums of GREY by chance cannot be set up\n");
    }
    motions();
    // A microbit has no memory for taxels.
    if cfg!(not(microbit)) && velocities().is_err() {
        host::fail("live motion cannot be set up\n");
    }
    let mut header = [0; 4 * HEADER];
    while cases.read(&mut header) {
        if run(&cases, &results, &header, frame).is_err() {
            host::fail("a golden case cannot be set up\n");
        }
    }
    host::done()
}

/// Sums taxels of every width, height, place, alignment and distance of rows, and compares them with sums of single
/// bytes.
fn sums_by_chance(room: &mut [u8; ROOM]) -> Result<(), Error> {
    let mut seed = 1_u32;
    let mut below = |end: usize| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(seed) * end as u64) >> 32) as usize
    };
    for turn in 0..TURNS {
        // Some are so wide that they are summed in strips.
        let width = 1 + below(if turn % 4 == 0 { 600 } else { 90 });
        // In three of four, taxels side by side share their rows; in half, all rows have the same alignment.
        let (grid, alike) = (turn % 4 != 1, turn % 2 == 0);
        let (padded, offset) = (width + below(6), below(4));
        let bytes_per_row = if alike { padded.next_multiple_of(4) } else { padded };
        let height = 1 + below(((ROOM - offset) / bytes_per_row).min(60));
        let most = if turn % 3 == 0 { 1 } else { 256 };
        for byte in room.iter_mut() {
            *byte = 255 - below(most) as u8;
        }
        let taxel = [1 + below(width), 1 + below(height)];
        let mut corners: [[u16; 2]; TAXELS] =
            core::array::from_fn(|_| [below(width + 1 - taxel[0]) as u16, below(height + 1 - taxel[1]) as u16]);
        for row in corners.as_chunks_mut::<COLUMNS>().0.iter_mut().filter(|_| grid) {
            let [[_, top], rest @ ..] = row;
            for corner in rest {
                corner[1] = *top;
            }
        }
        let layout = Layout::new(FrameSize::new(width as u32, height as u32)?, taxel.map(|side| side as u16), corners)?;
        let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?.with_bytes_per_row(bytes_per_row as u32)?;
        let bytes = room.get(offset..offset + height * bytes_per_row).unwrap_or_default();
        let mut summed = TaxelSums::new(camera);
        let whole = summed.push_frame(bytes)?;
        let stripes = bytes.chunks((1 + below(height)) * bytes_per_row);
        let sums = stripes.map(|rows| summed.push_stripe(rows)).try_fold(None, |_, sums| sums)?.unwrap_or_default();
        if sums != whole {
            host::fail("sums of GREY by chance differ in stripes\n");
        }
        for (sum, [x, y]) in sums.iter().zip(corners) {
            let rows = bytes.chunks(bytes_per_row).skip(y.into()).take(taxel[1]);
            let one_by_one = rows.flat_map(|row| row.iter().skip(x.into()).take(taxel[0])).map(|&byte| u32::from(byte));
            if *sum != one_by_one.sum::<u32>() {
                host::fail("a sum of GREY by chance is wrong\n");
            }
        }
    }
    Ok(())
}

/// Writes the motions of samples, by coherence and by edges.
// It is not inlined, so that its samples do not lie on the stack for ever.
#[inline(never)]
fn motions() {
    let (samples, motions) = (File::open(b"touches\0"), File::create(b"motions\0"));
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let mut bytes = [0; SAMPLE];
    while samples.read(&mut bytes) {
        let mut words = WordReader(&bytes);
        let totals = core::array::from_fn(|_| words.u32().cast_signed());
        let baseline = Baseline::new(totals, words.u32() as u16);
        let mut frames = [[0; FEATURES]; SAMPLE_FRAMES];
        for (feature, bytes) in frames.as_flattened_mut().iter_mut().zip(words.0.as_chunks().0) {
            *feature = i16::from_le_bytes(*bytes);
        }
        let event = Event::new(0, Sample::from_frames(&frames), &baseline);
        for motion in [motion::by_coherence(&event, config), motion::by_edges(&event, config)] {
            write(&motions, &motion);
        }
    }
}

/// Writes every bit of a motion: its kind, whether it is reliable, and five numbers, the lower half of each first.
fn write(motions: &File, motion: &Motion) {
    let kind = match motion.contact {
        Contact::Slide => 0,
        Contact::Press => 1,
        Contact::Poke => 2,
        _ => 3,
    };
    let velocity = motion.velocity.map(|found| [found.mm_s, found.mm_s_sd, found.degrees, found.degrees_sd]);
    let [mm_s, mm_s_sd, degrees, degrees_sd] = velocity.unwrap_or_default();
    motions.write(&[kind, i16::from(motion.reliable)]);
    motions.write(halves([mm_s, mm_s_sd, degrees, degrees_sd, motion.coherence]).as_flattened());
}

fn halves<const N: usize>(numbers: [f32; N]) -> [[i16; 2]; N] {
    numbers.map(f32::to_bits).map(|bits| [bits as i16, (bits >> 16) as i16])
}

/// Writes the velocities of live motion by 25 taxels: the frame, whether an edge tells it, and its bits; −1 behind each
/// touch.
#[inline(never)]
fn velocities() -> Result<(), Error> {
    let (touches, velocities) = (File::open(b"waves\0"), File::create(b"velocities\0"));
    let corners = core::array::from_fn(|taxel| [16 * (taxel % COLUMNS) as u16, 16 * (taxel / COLUMNS) as u16]);
    let layout = Layout::new(FrameSize::new(80, 80)?, [16, 16], corners)?;
    let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL)?;
    let (mut header, mut bytes) = ([0; 12], [0; 4 * TAXELS]);
    while touches.read(&mut header) {
        let mut words = WordReader(&header);
        let (rate, time) = (FrameRate::new(words.u32(), 1)?, ReadoutTime::from_ms(f32::from_bits(words.u32())));
        let readout = Readout::of_layout(time, RowOrder::Down, &layout, rate);
        let config = MotionConfig::published(rate).with_readout(readout);
        let mut live = LiveWave::new(config);
        let mut pipeline = Pipeline::builder(camera).taxels::<TaxelRing>().build()?;
        for frame in 0..words.u32() {
            touches.read(&mut bytes);
            let mut words = WordReader(&bytes);
            let sums = core::array::from_fn(|_| words.u32());
            if sums == [u32::MAX; TAXELS] {
                pipeline.push_lost(1);
                continue;
            }
            pipeline.push_taxels(&sums);
            let touch = live_frame(&mut live, pipeline.recent(), pipeline.baseline(), pipeline.taxel_ring());
            if let Some(LiveContact { velocity: Some(found), basis, .. }) = touch {
                velocities.write(&[frame as i16, i16::from(basis == Some(Basis::Edge))]);
                velocities.write(halves([found.mm_s, found.mm_s_sd, found.degrees, found.degrees_sd]).as_flattened());
            }
        }
        velocities.write(&[-1]);
        if let (Some(baseline), Some(ring)) = (pipeline.baseline(), pipeline.taxel_ring()) {
            black_box(by_wave(&Event::new(0, pipeline.recent().1, baseline), ring, config));
        }
    }
    Ok(())
}

// It is not inlined: tests/firmware/parts.py counts its instructions.
#[inline(never)]
fn live_frame(
    live: &mut LiveWave,
    (next_frame, recent): (u64, Sample<'_>),
    baseline: Option<&Baseline>,
    ring: Option<&TaxelRing>,
) -> Option<LiveContact> {
    live.push(next_frame, recent, baseline?, ring)
}

fn run(cases: &File, results: &File, header: &[u8], room: &mut [u8; ROOM]) -> Result<(), Error> {
    let mut words = WordReader(header);
    let (format, size) = (words.u32(), FrameSize::new(words.u32(), words.u32())?);
    let (bytes_per_row, frame_bytes) = (words.u32(), words.u32() as usize);
    let rate = FrameRate::new(words.u32(), words.u32())?;
    let matrix = if words.u32() == 0 { YcbcrMatrix::Bt601 } else { YcbcrMatrix::Bt709 };
    let range = if words.u32() == 0 { QuantizationRange::Limited } else { QuantizationRange::Full };
    let method = if words.u32() == 0 { YcbcrMethod::Exact } else { YcbcrMethod::Linear };
    let stride = Stride::try_from(words.u32())?;
    let taxel = [words.u32() as u16, words.u32() as u16];
    let corners = core::array::from_fn(|_| [words.u32() as u16, words.u32() as u16]);
    let layout = if taxel == [0, 0] { Layout::paper(size)? } else { Layout::new(size, taxel, corners)? };
    let floor = words.f64();
    let (window, multiplier, backtrack) = (words.u32(), words.f64(), words.u32());
    let rule = if words.u32() == 0 { Rule::Literal } else { Rule::Signed };
    let trigger = TriggerConfig::new(window, multiplier, backtrack, rule, words.f64())?;
    let threshold = words.f64();
    let on = if words.u32() == 0 { ThresholdOn::Absolute } else { ThresholdOn::AboveBaseline };
    let speed = SpeedConfig::new(Law::PUBLISHED, threshold, on, rate)?;
    let trigger = if words.u32() == 0 { trigger } else { trigger.one_event_per_touch() };
    let frames = words.u32();

    let format = PixelFormat::all().nth(format as usize).unwrap_or(PixelFormat::Gray);
    let green = Any::new(format, YcbcrEncoding { matrix, range }, method);
    let camera = FrameGeometry::with_stride(green, layout, rate, stride)?.with_bytes_per_row(bytes_per_row)?;
    let planar = green.chroma_bytes(camera.bytes_per_row(), size.height()).is_some();
    let mut pipeline = Pipeline::builder(camera).floor_levels(floor).trigger(trigger).build()?;
    for _ in 0..frames {
        lose(cases, results, &mut pipeline, &speed);
        // Frames are taken whole if there is room, and otherwise in as many rows as there is room for.
        let at_once = if frame_bytes <= ROOM || planar {
            frame_bytes
        } else {
            ROOM / camera.bytes_per_row() * camera.bytes_per_row()
        };
        let mut left = frame_bytes;
        while left > 0 {
            let Some(bytes) = room.get_mut(..at_once.min(left)) else {
                host::fail("a golden frame is too large for the board\n")
            };
            if !cases.read(bytes) {
                host::fail("the file of golden cases ends too early\n");
            }
            left -= bytes.len();
            let whole = planar || at_once == frame_bytes;
            give(results, &if whole { pipeline.push_frame(bytes)? } else { pipeline.push_stripe(bytes)? }, &speed);
        }
    }
    lose(cases, results, &mut pipeline, &speed);
    let finished = pipeline.finish();
    give_event(results, finished.event().as_ref(), &speed);
    give_contact_end(results, finished.contact_end());
    results.write(&[END, finished.end().frames as i16, i16::from(finished.end().baseline_complete)]);
    Ok(())
}

/// Takes note of the frames that were lost before the next one. A number of the file says how many.
fn lose(cases: &File, results: &File, pipeline: &mut Pipeline<Any>, speed: &SpeedConfig) {
    let mut lost = [0; 4];
    cases.read(&mut lost);
    let lost = u64::from(u32::from_le_bytes(lost));
    if lost > 0 {
        give(results, &pipeline.push_lost(lost), speed);
    }
}

/// Writes the results of a push: a frame's features, an event.
fn give(results: &File, update: &Update<'_>, config: &SpeedConfig) {
    if let Some(frame) = update.frame() {
        results.write(&[FEATURE_FRAME, i16::from(frame.has_missing_frames)]);
        results.write(&frame.features);
    }
    give_event(results, update.event().as_ref(), config);
    give_contact_end(results, update.contact_end());
}

/// Writes the end of a contact: its frame and that of its event.
fn give_contact_end(results: &File, end: Option<ContactEnd>) {
    if let Some(end) = end {
        results.write(&[CONTACT_END, end.frame as i16, end.event_frame as i16]);
    }
}

/// Writes an event: its frame, how many frames were filled, and whether it is reliable. Then come its duration and
/// direction (−1 if there is none), its speed in 1/16 mm/s, and the first lit and the first dark frame of its touch.
fn give_event(results: &File, event: Option<&Event<'_>>, config: &SpeedConfig) {
    let Some(event) = event else { return };
    let duration = speed::duration(event, config).map_or(-1, |duration: LitSpan| i16::from(duration.frames()));
    let degrees = direction::direction(event).heading().map_or(-1, |heading| heading.degrees() as i16);
    let speed = speed::speed(event, config).map_or(-1.0, |speed| speed.mm_s * 16.0);
    let reliable = i16::from(event.reliable);
    let frame = |frame: Option<u64>| frame.map_or(-1, |frame| (frame & 0x7FFF) as i16);
    results.write(&[
        EVENT,
        event.frame as i16,
        i16::from(event.frames_filled),
        reliable,
        duration,
        degrees,
        speed as i16,
        frame(event.touch_frame),
        frame(event.end_frame),
    ]);
}
