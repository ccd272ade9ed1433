//! The camera interface (DCMI) of the STM32H743 and one stream of its DMA, as [`Capture`].
//!
//! The DCMI captures frame after frame and drops every second byte, the chroma of YUYV. Stream 0 of DMA1 writes the rest
//! into a ring of two stripes, round and round, and interrupts when a half is full. No whole frame is kept anywhere.
//!
//! Frames are not cropped to the taxels: the host may ask for a picture of all that the camera sees, and then every row
//! has to be there, while frames go on being used.
//!
//! For a self-test, it captures all bytes of whole frames round and round into the same ring, and counts lines and
//! words.
//!
//! This is the only file that knows the DMA, and it has the only unsafe code of the capture. The ring is lent for ever,
//! no other code holds it, and the DMA is given its exact length. The DMA may overwrite rows while they are read; then
//! they are numbers, if wrong ones. [`Stripes::release`](super::Stripes::release) counts the stripes again after
//! reading, and the frame is given up.
//!
//! Register bits are those of the reference manual RM0433. The caches stay off (as after reset), so memory holds what
//! the DMA wrote.

use core::slice;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering, compiler_fence};

use embassy_stm32::interrupt::typelevel::{self, Handler, Interrupt};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::{DCMI, DMA1, DMAMUX1, RCC};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_time::Instant;
use wstac_core::layout::FrameSize;

use super::{Capture, Ring, Ticks, Trouble};
use crate::node::{CHANGED, Camera};
use crate::self_test::Probe;
use crate::sensor::Signals;

/// The stream of DMA1 that is used. The channel of DMAMUX1 has the same number.
const STREAM: usize = 0;
/// DMAMUX1's number of the DCMI's requests.
const REQUEST: u8 = 75;
/// CR bit 16: one of two bytes is captured (BSM = 01). The register crate does not name it.
const EVERY_SECOND_BYTE: u32 = 1 << 16;
/// CR bit 18: the second of them is captured (OEBS).
const THE_SECOND: u32 = 1 << 18;

/// The stripes complete since the restart, modulo 2^32.
static COMPLETE: AtomicU32 = AtomicU32::new(0);
/// The complete stripes of the frame under way.
static IN_FRAME: AtomicU32 = AtomicU32::new(0);
/// 0, or the [`Trouble`] since the restart.
static TROUBLE: AtomicU8 = AtomicU8::new(NONE);
/// The stripes of a frame and the words of a stripe, for the interrupts.
static PER_FRAME: AtomicU32 = AtomicU32::new(1);
static WORDS_PER_STRIPE: AtomicU32 = AtomicU32::new(0);

/// The vertical syncs since power was on, modulo 2^32, and the ticks at the last one.
static SYNCS: AtomicU32 = AtomicU32::new(0);
static SYNC_AT: AtomicU32 = AtomicU32::new(0);
/// Whether whole frames are measured.
static PROBING: AtomicBool = AtomicBool::new(false);
/// The syncs that the measurement has seen.
static PROBED: AtomicU32 = AtomicU32::new(0);
/// The ticks at the first sync that is used.
static PROBED_FROM: AtomicU32 = AtomicU32::new(0);
/// The lines of the frame under way, and those of the last one.
static LINES: AtomicU32 = AtomicU32::new(0);
static LAST_LINES: AtomicU32 = AtomicU32::new(0);
/// The words since the restart at the last sync, and those between the last two.
static WORDS_AT_SYNC: AtomicU32 = AtomicU32::new(0);
static LAST_WORDS: AtomicU32 = AtomicU32::new(0);

/// The number of times that the DMA is asked whether it has stopped.
const PATIENCE: u32 = 1000;

/// The signals before a sensor is known.
const DEFAULT_SIGNALS: Signals = Signals {
    vsync_high_between_frames: true,
    href_high_in_lines: true,
    sample_at_rising_edge: true,
    has_chroma: true,
    luma_first: true,
};

const NONE: u8 = 0;
const OVERRUN: u8 = 1;
const MISPLACED_SYNC: u8 = 2;

/// Handles the interrupts of the DCMI and of the DMA's stream. Both do all the work there is.
pub struct DcmiInterrupts;

// SAFETY: only hardware calls it, at one priority, so neither handler interrupts the other.
#[allow(unsafe_code)]
impl Handler<typelevel::DCMI> for DcmiInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

// SAFETY: only hardware calls it, at one priority, so neither handler interrupts the other.
#[allow(unsafe_code)]
impl Handler<typelevel::DMA1_STREAM0> for DcmiInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// The DCMI and its DMA.
pub struct Dcmi {
    ring: *const u8,
    stripe_bytes: usize,
    signals: Signals,
    /// The words of a frame's luma.
    frame_words: u32,
}

/// What is captured.
#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    /// Luma, to be used.
    Frames,
    /// All bytes, to be measured.
    AllBytes,
    /// Luma, to be measured.
    Luma,
}

impl Dcmi {
    /// Takes the interface, the DMA stream and the ring. Pins must be set up. Nothing is captured before
    /// [`Capture::restart`], and the sensor's signals must be known by then ([`Camera::set_signals`]).
    ///
    /// A stripe is `rows` rows of a frame. `WORDS` must be their number of words, which is checked.
    pub fn new<const WORDS: usize>(
        _dcmi: Peri<'static, peripherals::DCMI>,
        _stream: Peri<'static, peripherals::DMA1_CH0>,
        _interrupts: impl typelevel::Binding<typelevel::DCMI, DcmiInterrupts>
        + typelevel::Binding<typelevel::DMA1_STREAM0, DcmiInterrupts>,
        ring: &'static mut Ring<WORDS>,
        size: FrameSize,
        rows: u16,
    ) -> Option<Self> {
        let stripe_bytes = usize::from(size.width()) * usize::from(rows);
        // The DMA counts words in 16 bits.
        if stripe_bytes != 4 * WORDS || 2 * WORDS > usize::from(u16::MAX) || !size.height().is_multiple_of(rows) {
            return None;
        }
        PER_FRAME.store(u32::from(size.height() / rows), Ordering::Relaxed);
        WORDS_PER_STRIPE.store(WORDS as u32, Ordering::Relaxed);

        rcc::enable_and_reset::<peripherals::DCMI>();
        RCC.ahb1enr().modify(|w| w.set_dma1en(true));
        let stream = DMA1.st(STREAM);
        stream.cr().write(|w| w.set_en(false));
        stream.par().write_value(DCMI.dr().as_ptr() as u32);
        stream.m0ar().write_value(ring.as_mut_ptr() as u32);
        DMAMUX1.ccr(STREAM).write(|w| w.set_dmareq_id(REQUEST));

        typelevel::DCMI::unpend();
        typelevel::DMA1_STREAM0::unpend();
        // SAFETY: the handlers are bound, and use only registers and atomics.
        #[allow(unsafe_code)]
        unsafe {
            typelevel::DCMI::enable();
            typelevel::DMA1_STREAM0::enable();
        }
        let frame_words = u32::from(size.width()) * u32::from(size.height()) / 4;
        Some(Self { ring: ring.as_ptr().cast(), stripe_bytes, signals: DEFAULT_SIGNALS, frame_words })
    }

    /// Starts capture at the next vertical sync, of luma or of all bytes.
    fn start(&mut self, what: What) {
        let probe = what != What::Frames;
        critical_section::with(|_| {
            self.stop();
            let stream = DMA1.st(STREAM);
            stream.cr().modify(|w| w.set_en(false));
            // This waits at most for the transfer of one word. If the DMA does not stop, nothing is captured: the
            // sensor seems silent, and each attempt to set it up ends in a restart.
            if (0..PATIENCE).all(|_| stream.cr().read().en()) {
                defmt::error!("the DMA does not stop");
                COMPLETE.store(0, Ordering::Relaxed);
                TROUBLE.store(NONE, Ordering::Relaxed);
                return;
            }
            DMA1.ifcr(0).write(|w| {
                w.set_feif(STREAM, true);
                w.set_dmeif(STREAM, true);
                w.set_teif(STREAM, true);
                w.set_htif(STREAM, true);
                w.set_tcif(STREAM, true);
            });
            DCMI.icr().write(|w| {
                w.set_frame_isc(true);
                w.set_ovr_isc(true);
                w.set_err_isc(true);
                w.set_vsync_isc(true);
                w.set_line_isc(true);
            });
            for counter in [&COMPLETE, &IN_FRAME, &PROBED, &LINES, &LAST_LINES, &WORDS_AT_SYNC, &LAST_WORDS] {
                counter.store(0, Ordering::Relaxed);
            }
            TROUBLE.store(NONE, Ordering::Relaxed);
            PROBING.store(probe, Ordering::Relaxed);
            DCMI.cr().write(|w| {
                w.set_vspol(self.signals.vsync_high_between_frames);
                w.set_hspol(!self.signals.href_high_in_lines);
                w.set_pckpol(self.signals.sample_at_rising_edge);
                if what != What::AllBytes {
                    w.0 |= EVERY_SECOND_BYTE | if self.signals.luma_first { 0 } else { THE_SECOND };
                }
            });
            DCMI.ier().write(|w| {
                w.set_ovr_ie(true);
                w.set_err_ie(true);
                w.set_vsync_ie(true);
                w.set_line_ie(probe);
            });
            stream.ndtr().write(|w| w.set_ndt(2 * WORDS_PER_STRIPE.load(Ordering::Relaxed) as u16));
            stream.cr().write(|w| {
                w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
                w.set_psize(Size::BITS32);
                w.set_msize(Size::BITS32);
                w.set_minc(true);
                w.set_circ(true);
                w.set_pl(Pl::VERY_HIGH);
                w.set_htie(true);
                w.set_tcie(true);
                w.set_teie(true);
                w.set_en(true);
            });
            // The DMA comes first: the interface alone has room for only four words.
            DCMI.cr().modify(|w| w.set_enable(true));
            DCMI.cr().modify(|w| w.set_capture(true));
        });
    }
}

impl Capture for Dcmi {
    fn restart(&mut self) {
        self.start(What::Frames);
    }

    fn complete(&self) -> u32 {
        // By now the compiler has made all its reads of rows.
        compiler_fence(Ordering::SeqCst);
        COMPLETE.load(Ordering::Acquire)
    }

    fn trouble(&self) -> Option<Trouble> {
        match TROUBLE.load(Ordering::Relaxed) {
            NONE => None,
            MISPLACED_SYNC => Some(Trouble::MisplacedSync),
            _ => Some(Trouble::Overrun),
        }
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

impl Camera for Dcmi {
    fn set_signals(&mut self, signals: Signals) {
        self.signals = signals;
    }

    fn stop(&mut self) {
        // The frame under way ends first; then the interface is switched off.
        DCMI.cr().modify(|w| w.set_capture(false));
        DCMI.cr().modify(|w| w.set_enable(false));
    }

    fn begin_probe(&mut self) {
        self.start(What::AllBytes);
    }

    fn begin_luma_probe(&mut self) {
        self.start(What::Luma);
    }

    fn luma_words(&self) -> u32 {
        self.frame_words
    }

    fn probe(&self) -> Probe {
        critical_section::with(|_| Probe {
            frames: PROBED.load(Ordering::Relaxed).saturating_sub(1),
            ticks: SYNC_AT.load(Ordering::Relaxed).wrapping_sub(PROBED_FROM.load(Ordering::Relaxed)),
            lines: LAST_LINES.load(Ordering::Relaxed),
            words: LAST_WORDS.load(Ordering::Relaxed),
        })
    }

    fn syncs(&self) -> (u32, u32) {
        critical_section::with(|_| (SYNCS.load(Ordering::Relaxed), SYNC_AT.load(Ordering::Relaxed)))
    }
}

/// Counts complete stripes and takes note of faults.
fn serve() {
    let dma = DMA1.isr(0).read();
    let (half, full, error) = (dma.htif(STREAM), dma.tcif(STREAM), dma.teif(STREAM));
    DMA1.ifcr(0).write(|w| {
        w.set_htif(STREAM, half);
        w.set_tcif(STREAM, full);
        w.set_teif(STREAM, error);
    });
    let more = u32::from(half) + u32::from(full);
    let complete = COMPLETE.load(Ordering::Relaxed).wrapping_add(more);
    COMPLETE.store(complete, Ordering::Release);
    let in_frame =
        (IN_FRAME.load(Ordering::Relaxed) + more).checked_rem(PER_FRAME.load(Ordering::Relaxed)).unwrap_or(0);
    IN_FRAME.store(in_frame, Ordering::Relaxed);

    let camera = DCMI.ris().read();
    DCMI.icr().write(|w| {
        w.set_ovr_isc(camera.ovr_ris());
        w.set_err_isc(camera.err_ris());
        w.set_vsync_isc(camera.vsync_ris());
    });
    if camera.vsync_ris() {
        SYNCS.store(SYNCS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        SYNC_AT.store(Instant::now().as_ticks() as u32, Ordering::Relaxed);
    }
    if PROBING.load(Ordering::Relaxed) {
        measure(camera.line_ris(), camera.vsync_ris(), complete);
        return;
    }
    if error || camera.ovr_ris() || camera.err_ris() {
        TROUBLE.store(OVERRUN, Ordering::Relaxed);
    } else if camera.vsync_ris() && !(in_frame == 0 && is_at_end(complete)) {
        TROUBLE.store(MISPLACED_SYNC, Ordering::Relaxed);
    }
    CHANGED.signal(());
}

/// Counts lines, and at a vertical sync the words of the frame that it ends.
fn measure(line: bool, sync: bool, complete: u32) {
    if sync {
        let size = WORDS_PER_STRIPE.load(Ordering::Relaxed);
        let words = size.wrapping_mul(complete - complete % 2).wrapping_add(in_ring());
        LAST_WORDS.store(words.wrapping_sub(WORDS_AT_SYNC.load(Ordering::Relaxed)), Ordering::Relaxed);
        WORDS_AT_SYNC.store(words, Ordering::Relaxed);
        LAST_LINES.store(LINES.load(Ordering::Relaxed), Ordering::Relaxed);
        LINES.store(0, Ordering::Relaxed);
        let probed = PROBED.load(Ordering::Relaxed);
        if probed == 0 {
            PROBED_FROM.store(SYNC_AT.load(Ordering::Relaxed), Ordering::Relaxed);
        }
        PROBED.store(probed + 1, Ordering::Relaxed);
        CHANGED.signal(());
    }
    if line {
        DCMI.icr().write(|w| w.set_line_isc(true));
        LINES.store(LINES.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
    }
}

/// Returns the words from the ring's beginning to where the DMA writes next.
fn in_ring() -> u32 {
    2 * WORDS_PER_STRIPE.load(Ordering::Relaxed) - u32::from(DMA1.st(STREAM).ndtr().read().ndt())
}

/// Returns whether the ring has exactly this many whole stripes and not a word more.
fn is_at_end(complete: u32) -> bool {
    in_ring() == complete % 2 * WORDS_PER_STRIPE.load(Ordering::Relaxed)
}
