//! Turns your own frames into events: `cargo run -p wstac-core --example frames`.
//!
//! `Grabber` stands for whatever produces your frames: a camera's library, a video decoder, a DMA. The rest is what a
//! program does with them. The core allocates nothing and needs no `std`; only this example prints.

use wstac_core::error::Error;
use wstac_core::green::packed_rgb::Rgb24;
use wstac_core::law::{ByCoherence, EventLaw};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::{Event, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};

/// Frames of 640 × 480 RGB, whose rows take 2048 bytes each, as if the driver preferred powers of two.
const SIZE: (u32, u32) = (640, 480);
const BYTES_PER_ROW: u32 = 2048;
/// The width and height of a taxel, and the distance from one to the next, in pixels.
const TAXEL: [u16; 2] = [48, 48];
const PITCH: u16 = 80;

fn main() -> Result<(), Error> {
    // These are the places of the whiskers' bases in your picture, row by row. `wstac calibrate` finds them;
    // `Layout::paper` has the published ones.
    let corners = core::array::from_fn(|taxel| [130 + taxel as u16 % 5 * PITCH, 50 + taxel as u16 / 5 * PITCH]);
    let layout = Layout::new(FrameSize::new(SIZE.0, SIZE.1)?, TAXEL, corners)?;
    let rate = FrameRate::NOMINAL;
    // This camera exposes all rows at once. Most read one after the other: state the time from the first to the last
    // one, or every speed covers all that it may be.
    let readout = Readout::of_layout(ReadoutTime::from_ms(0.0), RowOrder::Down, &layout, rate);
    let camera = FrameGeometry::new(Rgb24::default(), layout, rate)?.with_bytes_per_row(BYTES_PER_ROW)?;
    let trigger = TriggerConfig::default().one_event_per_touch();
    let mut pipeline = Pipeline::builder(camera).trigger(trigger).build()?;
    let law = ByCoherence(MotionConfig::published(rate).with_readout(readout));

    let mut grabber = Grabber::new();
    loop {
        let update = match grabber.grab() {
            // This fails on bytes that are not a frame. Such a frame is lost, too.
            Grabbed::Frame(bytes) => match pipeline.push_frame(bytes) {
                Ok(update) => update,
                Err(error) => {
                    println!("a frame is lost: {error}");
                    pipeline.push_lost(1)
                }
            },
            // Frames measure time: a lost frame keeps its place, or every later speed would be wrong.
            Grabbed::Lost(frames) => pipeline.push_lost(frames),
            Grabbed::End => break,
        };
        if let Some(event) = update.event() {
            print(&event, law);
        }
    }
    // The last frames may complete an event, too.
    let finished = pipeline.finish();
    if let Some(event) = finished.event() {
        print(&event, law);
    }
    println!("{} frames", finished.end().frames);
    Ok(())
}

fn print(event: &Event<'_>, law: ByCoherence) {
    print!("event from frame {}", event.frame);
    let answer = law.answer(event);
    if let (Some(contact), Some(frame)) = (answer.contact, event.touch_frame) {
        print!(", {contact} from frame {frame}");
    }
    match answer.speed {
        Ok(speed) => print!(", {:.1} ± {:.1} mm/s", speed.mm_s, speed.sd.map_or(f32::NAN, |sd| sd.max(0.1))),
        Err(why) => print!(", no speed: {why}"),
    }
    match answer.direction.degrees {
        Ok(degrees) => print!(", towards {degrees:.1}°"),
        Err(why) => print!(", no direction: {why}"),
    }
    println!(", {} frames filled", event.frames_filled);
}

/// The output of a camera.
enum Grabbed<'a> {
    Frame(&'a [u8]),
    Lost(u64),
    End,
}

/// A camera over whose picture a stripe of light moves upwards from frame 40 on. It loses two frames.
struct Grabber {
    frame: u32,
    bytes: Vec<u8>,
}

impl Grabber {
    fn new() -> Self {
        Self { frame: 0, bytes: vec![0; (BYTES_PER_ROW * SIZE.1) as usize] }
    }

    fn grab(&mut self) -> Grabbed<'_> {
        let frame = self.frame;
        self.frame += 1;
        match frame {
            50 => {
                self.frame += 1;
                return Grabbed::Lost(2);
            }
            140.. => return Grabbed::End,
            _ => {}
        }
        self.bytes.fill(2);
        if let Some(bottom) = frame.checked_sub(40).and_then(|frames| SIZE.1.checked_sub(18 * frames)) {
            let top = bottom.saturating_sub(40);
            let rows = (top * BYTES_PER_ROW) as usize..(bottom * BYTES_PER_ROW) as usize;
            self.bytes[rows].fill(200);
        }
        Grabbed::Frame(&self.bytes)
    }
}
