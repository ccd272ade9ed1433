//! A PIO of the RP2040 or RP2350 and two chained channels of its DMA, as [`Capture`].
//!
//! Four state machines share the 32 instructions of the PIO:
//!
//! | machine | what it does |
//! | --- | --- |
//! | 0 | takes the pixels of a line, without the border, when machine 1 says that a line has begun |
//! | 1 | counts the lines of a frame behind its sync, without the border, and clears the flag of machine 3 after the last |
//! | 2 | raises an interrupt at the end of every frame, and one at its beginning |
//! | 3 | sets a flag at every line: to measure frames, and to see lines that are too many |
//!
//! The rows of the border below the picture are captured, too. So a line that is missing leaves the frame with too few
//! words when the next sync comes. A line that is too many, or in two parts, sets the flag before the frame has ended.
//! Both are [`Trouble::MisplacedSync`], and the last stripe of a frame counts only after its end. A pixel clock that is
//! missing or too many moves the rest of its line by a pixel, which nothing detects; the lines that follow stay in
//! their places.
//!
//! The two channels of the DMA write half of the ring each, start each other, and interrupt when they are done. A half
//! is a block at which the DMA wraps around: without the interrupt it writes to the same block again, and to nothing
//! else. For a self-test, machine 0 takes every pixel of every line, and lines and words are counted.
//!
//! This is the only file that knows the DMA, and it has the only unsafe code of the capture; the reasons are those of
//! the STM32H743's `dcmi`. The RP2040 has no caches between the DMA and its memory.

use core::slice;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering, compiler_fence};

use embassy_rp::interrupt::typelevel::{self, Handler, Interrupt};
use embassy_rp::pac::dma::vals::{DataSize, TreqSel};
use embassy_rp::pac::io::vals::{Inover, Oeover, Outover};
use embassy_rp::pac::{DMA, IO_BANK0, PADS_BANK0, PIO0, RESETS};
use embassy_rp::{Peri, peripherals};
use embassy_time::Instant;

use super::counts::COUNTS;
use super::{Capture, Ticks, Trouble, What};
use crate::meanwhile;
use crate::node::{CHANGED, Camera};
use crate::self_test::Probe;
use crate::sensor::Signals;

/// The channels of the DMA, one for each half of the ring.
const CHANNELS: [usize; 2] = [0, 1];
/// The bits of both channels of the DMA.
const BOTH: u32 = 0b11;
/// The interrupt of the DMA that is used.
const DMA_INTERRUPT: usize = 1;
/// The function of pins that the PIO reads.
const PIO0_PINS: u8 = 6;
/// The numbers of the PIO's state machines.
const PIXELS: usize = 0;
const LINES: usize = 1;
const SYNC: usize = 2;
const LINE_COUNTER: usize = 3;
/// The PIO's flags: of machine 2 and 3 to the core, and of machine 1 to machine 0.
const SYNC_FLAG: u16 = 0;
const LINE_FLAG: u16 = 1;
const END_FLAG: u16 = 2;
const BEGIN_FLAG: u16 = 4;
/// The size of a half of the ring is a power of 2: this one.
const BLOCK: u8 = 13;
/// The words of a half.
const BLOCK_WORDS: usize = 1 << BLOCK >> 2;
/// The number of times that the DMA is asked whether it has stopped.
const PATIENCE: u32 = 1000;

/// The addresses of the halves of the ring.
static HALVES: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];
/// The complete stripes that may be read, modulo 2^32, and whether the frame of the last ones has ended.
static READABLE: AtomicU32 = AtomicU32::new(0);
static HAS_ENDED: AtomicBool = AtomicBool::new(false);

/// Half of the ring, with a stripe at its beginning. The DMA wraps around at its end.
#[derive(Clone, Copy)]
#[repr(C, align(8192))]
struct Block([u32; BLOCK_WORDS]);

const _: () = assert!(align_of::<Block>() == 1 << BLOCK && size_of::<Block>() == 1 << BLOCK);

/// The ring that the DMA writes to.
pub struct Blocks([Block; 2]);

impl Blocks {
    /// Creates the ring.
    pub(crate) const fn new() -> Self {
        Self([Block([0; BLOCK_WORDS]); 2])
    }
}

/// Handles the interrupts of the PIO and of the DMA.
pub struct PioInterrupts;

// SAFETY: only hardware calls it, at one priority, so neither handler interrupts the other.
#[allow(unsafe_code)]
impl<I: Interrupt> Handler<I> for PioInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// The wires of a parallel camera. Data wires are at consecutive pins.
#[derive(Clone, Copy, Debug)]
pub struct Wires {
    /// The pin of the lowest data wire.
    pub data: u8,
    /// The number of data wires: 1, 4 or 8.
    pub count: u8,
    /// The pin of the pixel clock.
    pub pclk: u8,
    /// The pin that is high or low in lines.
    pub href: u8,
    /// The pin that is high or low between frames.
    pub vsync: u8,
}

/// The part of a frame that is captured, and how it is divided.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// The width of what is used of a frame, in pixels of one byte.
    pub width: u16,
    /// The rows that are captured: those that are used, and those below them.
    pub height: u16,
    /// The pixels left and right of it and the rows above it that are left out.
    pub border: u16,
    /// The rows of a stripe.
    pub rows: u16,
}

/// The PIO and its DMA.
pub struct Pio {
    halves: [*const u8; 2],
    stripe_bytes: usize,
    wires: Wires,
    area: Area,
    signals: Signals,
}

// SAFETY: the pointers are those of the ring, which it alone has.
#[allow(unsafe_code)]
unsafe impl Send for Pio {}

impl Pio {
    /// Takes the PIO, the channels of the DMA, the pins and the ring. Nothing is captured before [`Capture::restart`],
    /// and the sensor's signals must be known by then ([`Camera::set_signals`]).
    ///
    /// Returns `None` if a stripe does not fit the ring or the frame, or the wires are not 1, 4 or 8.
    pub fn new(
        _pio: Peri<'static, peripherals::PIO0>,
        _channels: (Peri<'static, peripherals::DMA_CH0>, Peri<'static, peripherals::DMA_CH1>),
        _interrupts: impl typelevel::Binding<typelevel::PIO0_IRQ_0, PioInterrupts>
        + typelevel::Binding<typelevel::DMA_IRQ_1, PioInterrupts>,
        ring: &'static mut Blocks,
        wires: Wires,
        area: Area,
        signals: Signals,
    ) -> Option<Self> {
        let Area { width, height, border, rows } = area;
        let stripe_bytes = usize::from(width) * usize::from(rows);
        // A machine counts the clocks of the border in five bits, and of as many early pixels.
        let is_right = matches!(wires.count, 1 | 4 | 8) && 2 * u32::from(border) * clocks(wires) <= 32;
        if stripe_bytes > 1 << BLOCK || stripe_bytes % 4 != 0 || rows == 0 || !height.is_multiple_of(rows) || !is_right
        {
            return None;
        }
        COUNTS.set_size(u32::from(height / rows), stripe_bytes as u32 / 4);
        let halves = ring.0.each_ref().map(|Block(words)| words.as_ptr().cast::<u8>());
        for (half, stripe) in HALVES.iter().zip(halves) {
            half.store(stripe as u32, Ordering::Relaxed);
        }
        RESETS.reset().modify(|w| {
            w.set_pio0(false);
            w.set_dma(false);
        });
        while !(RESETS.reset_done().read().pio0() && RESETS.reset_done().read().dma()) {}
        let data = (0..wires.count).map(|wire| wires.data + wire);
        for pin in data.chain([wires.pclk, wires.href, wires.vsync]) {
            connect(usize::from(pin));
        }
        let pio = Self { halves, stripe_bytes, wires, area, signals };
        DMA.inte(DMA_INTERRUPT).write_value(BOTH);
        typelevel::PIO0_IRQ_0::unpend();
        typelevel::DMA_IRQ_1::unpend();
        // SAFETY: the handlers are bound, and use only registers and atomics.
        #[allow(unsafe_code)]
        unsafe {
            typelevel::PIO0_IRQ_0::enable();
            typelevel::DMA_IRQ_1::enable();
        }
        Some(pio)
    }

    /// Stops the machines and the DMA. Returns whether the DMA has stopped.
    fn halt() -> bool {
        PIO0.ctrl().write(|w| w.set_sm_enable(0));
        // An aborted channel may interrupt, and may start the other one.
        DMA.inte(DMA_INTERRUPT).write_value(0);
        for channel in CHANNELS {
            DMA.ch(channel).al1_ctrl().write_value(0);
        }
        DMA.chan_abort().write(|w| w.set_chan_abort(BOTH as u16));
        let is_stopped =
            (0..PATIENCE).any(|_| CHANNELS.iter().all(|channel| !DMA.ch(*channel).ctrl_trig().read().busy()));
        DMA.ints(DMA_INTERRUPT).write_value(BOTH);
        DMA.inte(DMA_INTERRUPT).write_value(BOTH);
        is_stopped
    }

    /// Loads the programs, and sets the machines to their beginnings.
    fn load(&self, whole: bool) {
        let Self { wires, area: Area { width, height, border, .. }, signals, .. } = *self;
        let (between, in_line, edge) =
            (signals.vsync_high_between_frames, signals.href_high_in_lines, signals.sample_at_rising_edge);
        let frame = [wait(between, wires.vsync), wait(!between, wires.vsync)];
        let clock = [wait(edge, wires.pclk), wait(!edge, wires.pclk)];
        let take = read_pins(wires.count);
        let lost = (u32::from(border + signals.early) * clocks(wires)).saturating_sub(1) as u16;
        let mut program = Program::default();
        let skips = border > 0;

        // Every pixel of a line, or those inside the border.
        let pixels = if whole {
            program.add(&[wait(in_line, wires.href), clock[0], take, clock[1]])
        } else {
            let begin = program.add(&[wait_flag(BEGIN_FLAG)]);
            if skips {
                let [_, top] = program.add(&[set_y(lost)]);
                program.add(&[clock[0], clock[1], jump_y(top)]);
            }
            let [_, top] = program.add(&[MOVE_OSR_TO_X]);
            let [_, end] = program.add(&[clock[0], take, clock[1], jump_x(top)]);
            [begin[0], end]
        };
        let lines = {
            let begin = program.add(&frame);
            if skips {
                let [_, top] = program.add(&[set_y(border.saturating_sub(1))]);
                program.add(&[wait(in_line, wires.href), wait(!in_line, wires.href), jump_y(top)]);
            }
            let [_, top] = program.add(&[MOVE_OSR_TO_X]);
            let line = [wait(in_line, wires.href), set_flag(BEGIN_FLAG), wait(!in_line, wires.href), jump_x(top)];
            program.add(&line);
            let [_, end] = program.add(&[clear_flag(LINE_FLAG)]);
            [begin[0], end]
        };
        let sync = program.add(&[frame[0], set_flag(END_FLAG), frame[1], set_flag(SYNC_FLAG)]);
        let counter = program.add(&[wait(!in_line, wires.href), wait(in_line, wires.href), set_flag(LINE_FLAG)]);

        PIO0.irq().write(|w| w.set_irq(0xFF));
        PIO0.fdebug().write(|w| w.set_rxstall(0xF));
        for (machine, [first, end]) in [(PIXELS, pixels), (LINES, lines), (SYNC, sync), (LINE_COUNTER, counter)] {
            let registers = PIO0.sm(machine);
            registers.clkdiv().write(|w| w.set_int(1));
            registers.execctrl().write(|w| {
                w.set_wrap_bottom(first as u8);
                w.set_wrap_top(end as u8 - 1);
            });
            // Changing the join empties the queue.
            registers.shiftctrl().write(|w| w.set_fjoin_tx(true));
            registers.shiftctrl().write(|w| {
                w.set_autopush(machine == PIXELS);
                w.set_in_shiftdir(true);
            });
            registers.pinctrl().write(|w| w.set_in_base(wires.data));
            PIO0.ctrl().write(|w| w.set_sm_restart(1 << machine));
            while PIO0.fstat().read().rxempty() & 1 << machine == 0 {
                let _ = PIO0.rxf(machine).read();
            }
            // The counts, less one, by the queue to the output register.
            let count = match machine {
                PIXELS => u32::from(width) * clocks(wires),
                LINES => u32::from(height),
                _ => 1,
            };
            PIO0.txf(machine).write_value(count - 1);
            registers.instr().write(|w| w.set_instr(PULL));
            if machine == PIXELS {
                registers.shiftctrl().modify(|w| w.set_fjoin_rx(true));
            }
            registers.instr().write(|w| w.set_instr(first));
        }
    }
}

impl Camera for Pio {
    fn set_signals(&mut self, signals: Signals) {
        self.signals = signals;
    }

    fn stop(&mut self) {
        critical_section::with(|_| {
            let _ = Self::halt();
        });
    }

    fn begin(&mut self, what: What) {
        critical_section::with(|_| {
            // If the DMA does not stop, nothing is captured: the sensor seems silent, and each attempt to set it up
            // ends in a restart.
            let is_stopped = Self::halt();
            COUNTS.restart(what != What::Frames);
            READABLE.store(0, Ordering::Relaxed);
            HAS_ENDED.store(false, Ordering::Relaxed);
            if !is_stopped {
                defmt::error!("the DMA does not stop");
                return;
            }
            self.load(what == What::AllBytes);
            PIO0.irqs(0).inte().write(|w| {
                w.set_sm0(true);
                w.set_sm1(what != What::Frames);
                w.set_sm2(what == What::Frames);
            });
            for channel in CHANNELS {
                let next = CHANNELS[1 - channel];
                let registers = DMA.ch(channel);
                registers.read_addr().write_value(PIO0.rxf(PIXELS).as_ptr() as u32);
                registers.write_addr().write_value(HALVES[channel].load(Ordering::Relaxed));
                set_count(channel);
                let mut control = embassy_rp::pac::dma::regs::CtrlTrig(0);
                control.set_en(true);
                control.set_high_priority(true);
                control.set_data_size(DataSize::SIZE_WORD);
                control.set_incr_write(true);
                control.set_ring_sel(true);
                control.set_ring_size(BLOCK);
                control.set_chain_to(next as u8);
                control.set_treq_sel(TreqSel::PIO0_RX0);
                // This register does not start it.
                registers.al1_ctrl().write_value(control.0);
            }
            DMA.multi_chan_trigger().write(|w| w.set_multi_chan_trigger(1 << CHANNELS[0]));
            // The DMA comes first: the machine alone has room for only eight words.
            let lines = if what == What::AllBytes { 0 } else { 1 << LINES };
            PIO0.ctrl().write(|w| w.set_sm_enable(1 << PIXELS | lines | 1 << SYNC | 1 << LINE_COUNTER));
        });
    }

    fn luma_words(&self) -> u32 {
        u32::from(self.area.width) * u32::from(self.area.height) / 4
    }

    fn probe(&self) -> Probe {
        COUNTS.probe()
    }

    fn syncs(&self) -> (u32, u32) {
        COUNTS.syncs()
    }
}

impl Capture for Pio {
    fn restart(&mut self) {
        self.begin(What::Frames);
    }

    fn complete(&self) -> u32 {
        // By now the compiler has made all its reads of rows.
        compiler_fence(Ordering::SeqCst);
        READABLE.load(Ordering::Acquire)
    }

    fn trouble(&self) -> Option<Trouble> {
        COUNTS.trouble().or(has_stalled().then_some(Trouble::Overrun))
    }

    fn lines_come(&self) -> bool {
        PIO0.irq().read().irq() & 1 << LINE_FLAG != 0
    }

    fn rows(&self, half: usize) -> &[u8] {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: each half of the ring has a stripe of these bytes, lives for ever, and is initialized; every byte is
        // a number. No code writes to it, only the DMA. As for the STM32H743 (`dcmi`), rows that it overwrites while
        // they are read are wrong numbers, and the count of stripes in `complete` detects that.
        #[allow(unsafe_code)]
        unsafe {
            slice::from_raw_parts(self.halves[half % 2], self.stripe_bytes)
        }
    }

    fn now(&self) -> Ticks {
        Instant::now().as_ticks()
    }
}

/// Counts complete stripes and takes note of faults.
fn serve() {
    let done = DMA.ints(DMA_INTERRUPT).read() & BOTH;
    DMA.ints(DMA_INTERRUPT).write_value(done);
    for channel in CHANNELS.into_iter().filter(|channel| done & 1 << channel != 0) {
        // The channel begins here when the other one starts it; its count is loaded anew then.
        DMA.ch(channel).write_addr().write_value(HALVES[channel].load(Ordering::Relaxed));
    }
    let complete = COUNTS.add_stripes(done.count_ones());

    let probing = COUNTS.is_probing();
    let flags = PIO0.irq().read().irq();
    let is_set = |flag: u16| flags & 1 << flag != 0;
    let (sync, line, end) = (is_set(SYNC_FLAG), is_set(LINE_FLAG), is_set(END_FLAG));
    // If frames are used, the flag of lines stays, and shows that they come.
    let seen = 1 << SYNC_FLAG | 1 << END_FLAG | if probing { 1 << LINE_FLAG } else { 0 };
    PIO0.irq().write(|w| w.set_irq(flags & seen));
    // A frame ends before the next one begins. If it has too few words, the sync shows it: a restart in the middle of a
    // frame would take the rest for another one.
    if end && !probing && complete > 0 && COUNTS.is_between_frames() {
        if line {
            COUNTS.set_trouble(Trouble::MisplacedSync);
        } else {
            HAS_ENDED.store(true, Ordering::Relaxed);
        }
    }
    if HAS_ENDED.load(Ordering::Relaxed) || !COUNTS.is_between_frames() {
        READABLE.store(complete, Ordering::Release);
    }
    if sync {
        HAS_ENDED.store(false, Ordering::Relaxed);
        COUNTS.add_sync();
    }
    if probing {
        if sync {
            let whole = COUNTS.words_per_stripe().wrapping_mul(complete);
            COUNTS.end_probed_frame(whole.wrapping_add(in_half(complete)));
        }
        if line {
            COUNTS.add_line();
        }
    } else if sync && !(COUNTS.is_between_frames() && in_half(complete) == 0) {
        COUNTS.set_trouble(Trouble::MisplacedSync);
    } else if has_stalled() {
        COUNTS.set_trouble(Trouble::Overrun);
    }
    if sync || end || done != 0 {
        CHANGED.signal(());
        // SAFETY: both interrupts have one priority.
        #[allow(unsafe_code)]
        unsafe {
            meanwhile::interrupt();
        }
    }
}

/// Returns the words of the stripe under way. The DMA counts down from a stripe's.
fn in_half(complete: u32) -> u32 {
    let left = count_left(CHANNELS[complete as usize % 2]);
    COUNTS.words_per_stripe().saturating_sub(left)
}

/// Returns whether a pixel found no room: the machine has waited for the DMA.
fn has_stalled() -> bool {
    PIO0.fdebug().read().rxstall() & 1 << PIXELS != 0
}

#[cfg(feature = "rp2040")]
fn set_count(channel: usize) {
    DMA.ch(channel).trans_count().write_value(COUNTS.words_per_stripe());
}

#[cfg(not(feature = "rp2040"))]
fn set_count(channel: usize) {
    DMA.ch(channel).trans_count().write(|w| w.set_count(COUNTS.words_per_stripe()));
}

#[cfg(feature = "rp2040")]
fn count_left(channel: usize) -> u32 {
    DMA.ch(channel).trans_count().read()
}

#[cfg(not(feature = "rp2040"))]
fn count_left(channel: usize) -> u32 {
    DMA.ch(channel).trans_count().read().count()
}

/// Gives a pin to the PIO as an input with a pull, so that a wire that is off does not float. It is a pull-down on the
/// RP2040, and a pull-up on the RP2350, whose pull-downs are weaker than what its pins leak (erratum E9).
fn connect(pin: usize) {
    PADS_BANK0.gpio(pin).write(|w| {
        w.set_ie(true);
        w.set_schmitt(true);
        #[cfg(feature = "rp2040")]
        w.set_pde(true);
        #[cfg(not(feature = "rp2040"))]
        {
            w.set_pue(true);
            w.set_iso(false);
        }
    });
    IO_BANK0.gpio(pin).ctrl().write(|w| {
        w.set_funcsel(PIO0_PINS);
        w.set_inover(Inover::NORMAL);
        w.set_outover(Outover::NORMAL);
        w.set_oeover(Oeover::DISABLE);
    });
}

/// Returns the pixel clocks of a pixel.
const fn clocks(wires: Wires) -> u32 {
    8 / wires.count as u32
}

/// The instructions of a PIO (RP2040 data sheet, 3.4).
const PULL: u16 = 0x80A0;
const MOVE_OSR_TO_X: u16 = 0xA027;

const fn wait(high: bool, pin: u8) -> u16 {
    0x2000 | (high as u16) << 7 | pin as u16
}

/// Waits for a flag, and clears it.
const fn wait_flag(flag: u16) -> u16 {
    0x20C0 | flag
}

const fn set_flag(flag: u16) -> u16 {
    0xC000 | flag
}

const fn clear_flag(flag: u16) -> u16 {
    0xC040 | flag
}

const fn read_pins(count: u8) -> u16 {
    0x4000 | count as u16
}

const fn set_y(value: u16) -> u16 {
    0xE040 | value & 31
}

const fn jump_x(to: u16) -> u16 {
    0x0040 | to & 31
}

const fn jump_y(to: u16) -> u16 {
    0x0080 | to & 31
}

/// The position behind the instructions that were loaded.
#[derive(Default)]
struct Program {
    end: u16,
}

impl Program {
    /// Loads instructions behind the others. Returns where they begin and end.
    fn add(&mut self, instructions: &[u16]) -> [u16; 2] {
        let first = self.end;
        for instruction in instructions {
            PIO0.instr_mem(usize::from(self.end)).write(|w| w.set_instr_mem(*instruction));
            self.end += 1;
        }
        [first, self.end]
    }
}
