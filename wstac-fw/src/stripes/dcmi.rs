//! The camera interface (DCMI) of an STM32 and one stream of its DMA, as [`Capture`].
//!
//! The DCMI captures frame after frame and drops every second byte if that is the chroma of YUYV. The DMA's stream
//! writes the rest into a ring of two stripes, round and round, and interrupts when a half is full. No whole frame is
//! kept anywhere.
//!
//! Frames are cropped to what is inside a sensor's border, and not to the taxels: the host may ask for a picture of all
//! that the camera sees, and then every row has to be there, while frames go on being used.
//!
//! For a self-test, it captures all bytes of whole frames round and round into the same ring, and counts lines and
//! words.
//!
//! Only this file and the chip's module `dma` know the DMA, and this one has the only unsafe code of the capture. The
//! ring is lent for ever, no other code holds it, and the DMA is given its exact length. The DMA may overwrite rows
//! while they are read; then they are numbers, if wrong ones. [`Stripes::release`](super::Stripes::release) counts the
//! stripes again after reading, and the frame is given up.
//!
//! Register bits are those of the reference manuals RM0433 and RM0456. The core keeps no copies of the ring's memory,
//! so it reads what the DMA wrote.

use core::slice;
use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::peripheral::SCB;
use embassy_stm32::interrupt::typelevel::{Binding, Handler, Interrupt};
use embassy_stm32::pac::DCMI;
use embassy_stm32::pac::dcmi::regs::Icr;
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_time::Instant;
use wstac_core::layout::FrameSize;

pub(crate) use self::dma::Stream;
use self::dma::{CameraInterrupt, DmaInterrupt};
use super::counts::COUNTS;
use super::{Capture, Ring, Ticks, Trouble, What};
use crate::meanwhile;
use crate::node::{CHANGED, Camera};
use crate::self_test::Probe;
use crate::sensor::Signals;

#[cfg_attr(feature = "h7", path = "dcmi/stream.rs")]
#[cfg_attr(feature = "u575", path = "dcmi/gpdma.rs")]
mod dma;

/// CR bit 16: one of two bytes is captured (BSM = 01). The register crate does not name it.
const EVERY_SECOND_BYTE: u32 = 1 << 16;
/// CR bit 18: the second of them is captured (OEBS).
const THE_SECOND: u32 = 1 << 18;

/// The exceptions of its two interrupts.
const DCMI_EXCEPTION: u32 = 16 + CameraInterrupt::IRQ as u32;
const DMA_EXCEPTION: u32 = 16 + DmaInterrupt::IRQ as u32;

/// All flags of the DCMI.
const FLAGS: Icr = Icr(0x1F);

/// The number of times that the DMA is asked whether it has stopped.
const PATIENCE: u32 = 1000;

/// Handles the interrupts of the DCMI and of the DMA's stream. Both do all the work there is.
pub struct DcmiInterrupts;

// SAFETY: only hardware calls it, at one priority, so neither handler interrupts the other.
#[allow(unsafe_code)]
impl<I: Interrupt> Handler<I> for DcmiInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// The DCMI and its DMA.
pub struct Dcmi {
    ring: *const u8,
    stripe_bytes: usize,
    signals: Signals,
    /// Width and height of what is used of frames.
    size: [u16; 2],
}

// SAFETY: the pointer is that of the ring, which it alone has.
#[allow(unsafe_code)]
unsafe impl Send for Dcmi {}

impl Dcmi {
    /// Takes the interface, the DMA stream and the ring. Pins must be set up. Nothing is captured before
    /// [`Capture::restart`].
    ///
    /// A stripe is `rows` rows of a frame. `WORDS` must be their number of words, which is checked.
    pub fn new<const WORDS: usize>(
        _dcmi: Peri<'static, peripherals::DCMI>,
        _stream: Peri<'static, Stream>,
        _interrupts: impl Binding<CameraInterrupt, DcmiInterrupts> + Binding<DmaInterrupt, DcmiInterrupts>,
        ring: &'static mut Ring<WORDS>,
        size: FrameSize,
        rows: u16,
        signals: Signals,
    ) -> Option<Self> {
        let stripe_bytes = usize::from(size.width()) * usize::from(rows);
        // The DMA counts words, or their bytes, in 16 bits.
        if stripe_bytes != 4 * WORDS || 8 * WORDS > usize::from(u16::MAX) || !size.height().is_multiple_of(rows) {
            return None;
        }
        COUNTS.set_size(u32::from(size.height() / rows), WORDS as u32);

        rcc::enable_and_reset::<peripherals::DCMI>();
        dma::set_up(ring.as_mut_ptr() as u32);

        CameraInterrupt::unpend();
        DmaInterrupt::unpend();
        // SAFETY: the handlers are bound, and use only registers and atomics.
        #[allow(unsafe_code)]
        unsafe {
            CameraInterrupt::enable();
            DmaInterrupt::enable();
        }
        let size = [size.width(), size.height()];
        Some(Self { ring: ring.as_ptr().cast(), stripe_bytes, signals, size })
    }
}

impl Capture for Dcmi {
    fn restart(&mut self) {
        self.begin(What::Frames);
    }

    fn complete(&self) -> u32 {
        // By now the compiler has made all its reads of rows.
        compiler_fence(Ordering::SeqCst);
        COUNTS.complete()
    }

    fn trouble(&self) -> Option<Trouble> {
        COUNTS.trouble()
    }

    fn lines_come(&self) -> bool {
        DCMI.ris().read().line_ris()
    }

    fn rows(&self, half: usize) -> &[u8] {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: the ring has two stripes of these bytes, lives for ever, and is initialized; every byte is a number.
        // No code writes to it. Only the DMA does, a writer that the compiler does not see. It writes to the other half
        // until that is full, which is the time there is to read this one. So the bytes stay as they are while they are
        // lent, as a reference requires, unless the core is too late. Nothing prevents that. The core then reads bytes
        // of a later row. They give wrong sums, but neither a length nor an index is made of them. The fences here and
        // in `complete` keep the reads between the two counts that detect it.
        #[allow(unsafe_code)]
        unsafe {
            slice::from_raw_parts(self.ring.add(half % 2 * self.stripe_bytes), self.stripe_bytes)
        }
    }

    fn now(&self) -> Ticks {
        Instant::now().as_ticks()
    }
}

impl Dcmi {
    /// Leaves the border of frames out unless all bytes are captured: so many clocks of each line, and so many lines.
    fn leave_border_out(&self, what: What) {
        let Signals { border, early, .. } = self.signals;
        let is_cropped = border > 0 && what != What::AllBytes;
        DCMI.cr().modify(|w| w.set_crop(is_cropped));
        if is_cropped {
            let [width, height] = self.size;
            DCMI.cwstrt().write(|w| {
                w.set_hoffcnt(border + early);
                w.set_vst(border);
            });
            DCMI.cwsize().write(|w| {
                w.set_capcnt(width - 1);
                w.set_vline(height - 1);
            });
        }
    }
}

impl Camera for Dcmi {
    fn set_signals(&mut self, signals: Signals) {
        self.signals = signals;
    }

    fn stop(&mut self) {
        // The frame under way ends first; then the interface is switched off.
        DCMI.cr().modify(|w| w.set_capture(false));
        DCMI.cr().modify(|w| w.set_enable(false));
    }

    fn begin(&mut self, what: What) {
        let probe = what != What::Frames;
        critical_section::with(|_| {
            self.stop();
            COUNTS.restart(probe);
            // This waits at most for the transfer of one word. If the DMA does not stop, nothing is captured: the
            // sensor seems silent, and each attempt to set it up ends in a restart.
            if !(0..PATIENCE).any(|_| dma::stop()) {
                defmt::error!("the DMA does not stop");
                return;
            }
            DCMI.icr().write_value(FLAGS);
            DCMI.cr().write(|w| {
                w.set_vspol(self.signals.vsync_high_between_frames);
                w.set_hspol(!self.signals.href_high_in_lines);
                w.set_pckpol(self.signals.sample_at_rising_edge);
                if what != What::AllBytes && self.signals.has_chroma {
                    w.0 |= EVERY_SECOND_BYTE | if self.signals.luma_first { 0 } else { THE_SECOND };
                }
            });
            self.leave_border_out(what);
            DCMI.ier().write(|w| {
                w.set_ovr_ie(true);
                w.set_err_ie(true);
                w.set_vsync_ie(true);
                w.set_line_ie(probe);
            });
            dma::start(2 * COUNTS.words_per_stripe());
            // The DMA comes first: the interface alone has room for only four words.
            DCMI.cr().modify(|w| w.set_enable(true));
            DCMI.cr().modify(|w| w.set_capture(true));
        });
    }

    fn luma_words(&self) -> u32 {
        let [width, height] = self.size;
        u32::from(width) * u32::from(height) / 4
    }

    fn probe(&self) -> Probe {
        COUNTS.probe()
    }

    fn syncs(&self) -> (u32, u32) {
        COUNTS.syncs()
    }

    fn doze(&self, alarm: Ticks) -> bool {
        let pending = critical_section::with(|_| {
            if CHANGED.signaled() || self.now() >= alarm {
                return 0;
            }
            // A masked interrupt ends it, and is served after the section: none can come in between and be slept
            // through.
            cortex_m::asm::wfi();
            // SAFETY: the register is only read.
            #[allow(unsafe_code)]
            let state = unsafe { (*SCB::PTR).icsr.read() };
            state >> 12 & 0x1FF
        });
        (pending == DCMI_EXCEPTION || pending == DMA_EXCEPTION) && CHANGED.try_take().is_some()
    }
}

/// Counts complete stripes and takes note of faults.
fn serve() {
    let (half, full, error) = dma::take_flags();
    let complete = COUNTS.add_stripes(u32::from(half) + u32::from(full));

    let camera = DCMI.ris().read();
    DCMI.icr().write(|w| {
        w.set_ovr_isc(camera.ovr_ris());
        w.set_err_isc(camera.err_ris());
        w.set_vsync_isc(camera.vsync_ris());
    });
    if camera.vsync_ris() {
        COUNTS.add_sync();
    }
    if COUNTS.is_probing() {
        if camera.vsync_ris() {
            let whole = COUNTS.words_per_stripe().wrapping_mul(complete - complete % 2);
            COUNTS.end_probed_frame(whole.wrapping_add(in_ring()));
            CHANGED.signal(());
        }
        if camera.line_ris() {
            DCMI.icr().write(|w| w.set_line_isc(true));
            COUNTS.add_line();
        }
        return;
    }
    if error || camera.ovr_ris() || camera.err_ris() {
        COUNTS.set_trouble(Trouble::Overrun);
    } else if camera.vsync_ris() && !(COUNTS.is_between_frames() && is_at_end(complete)) {
        COUNTS.set_trouble(Trouble::MisplacedSync);
    }
    CHANGED.signal(());
    // SAFETY: both interrupts have one priority.
    #[allow(unsafe_code)]
    unsafe {
        meanwhile::interrupt();
    }
}

/// Returns the words from the ring's beginning to where the DMA writes next.
fn in_ring() -> u32 {
    2 * COUNTS.words_per_stripe() - dma::words_left()
}

/// Returns whether the ring has exactly this many whole stripes and not a word more.
fn is_at_end(complete: u32) -> bool {
    in_ring() == complete % 2 * COUNTS.words_per_stripe()
}
