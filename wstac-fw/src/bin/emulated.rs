//! The firmware on a board that QEMU emulates (`ci/firmware`).
//!
//! The file `frames` has frames of 400 × 400 [`setup::PIXELS`], which are taken in stripes as a DMA brings them. Events
//! go out of the UART, and requests come in. The greatest depth of the stack goes to the file `stack`.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::ReadoutTime;
use wstac_core::wire::{self, Decoder, Message, Received, Request};
use wstac_fw::emulated::bench::{LAW, LAYOUT};
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::{self, File};
use wstac_fw::emulated::stack;
use wstac_fw::emulated::uart::Uart;
use wstac_fw::reader::{Publisher, Reader};
use wstac_fw::setup;

const SIDE: usize = 400;
/// The rows that a DMA would bring at a time: fewer where a wave needs the memory.
const ROWS: usize = if cfg!(microbit) && setup::IS_WAVE { 1 } else { 8 };
const US_PER_30_FRAMES: u64 = 1_000_000;
const STRIPES_PER_30_FRAMES: u64 = 30 * (SIDE / ROWS) as u64;

/// The UART with the messages that are sent on it.
struct Link {
    uart: Uart,
    sequence: u16,
}

impl Publisher for Link {
    fn send(&mut self, message: &Message<'_>) {
        let mut buffer = [0; wire::LONGEST];
        self.uart.send(wire::encode(message, self.sequence, &mut buffer));
        self.sequence = self.sequence.wrapping_add(1);
    }
}

#[entry]
fn main() -> ! {
    match run() {
        Some(()) => host::done(),
        None => host::fail("the configuration does not fit frames of 400 x 400\n"),
    }
}

/// Answers until the frames end; `None` if the configuration does not fit them.
fn run() -> Option<()> {
    let frames = File::open(b"frames\0");
    // It stays in its result: taken out, it would be a second reader on the stack.
    let mut reader = Reader::new(LAYOUT, LAYOUT.frame(), FrameRate::NOMINAL, LAW);
    let reader = reader.as_mut().ok()?;
    // Frames are of a file: all rows are of one time.
    reader.state_readout(ReadoutTime::GLOBAL);
    Clock::tick();
    let mut link = Link { uart: Uart::start(), sequence: 0 };
    let mut decoder = Decoder::<16>::new();
    let mut stripe = [0; ROWS * SIDE * setup::PIXEL_BYTES];
    reader.hello(&mut link);
    let mut stripes = 0_u64;
    while frames.read(&mut stripe) {
        // The time is that of the frames, so that a run is always the same.
        stripes += 1;
        reader.set_time(stripes * US_PER_30_FRAMES / STRIPES_PER_30_FRAMES);
        while let Some(byte) = link.uart.receive() {
            if let Some(Ok(Received { message, .. })) = decoder.push::<Request>(byte) {
                reader.answer(message, &mut link);
            }
        }
        reader.rows(&stripe, &mut link).ok()?;
        while reader.send_held(&mut link) || reader.send_again(&mut link) {}
    }
    reader.finish(&mut link);
    let stack = (stack::deepest() - size_of_val(&stripe)) as u32;
    File::create(b"stack\0").write(&[stack as i16, (stack >> 16) as i16]);
    Some(())
}
