//! Channel 0 of an STM32U575's GPDMA1. It begins the ring anew by a list of one item, which links to itself and loads
//! length and address.

use core::sync::atomic::{AtomicU32, Ordering};

pub(super) use embassy_stm32::interrupt::typelevel::{DCMI_PSSI as CameraInterrupt, GPDMA1_CHANNEL0 as DmaInterrupt};
use embassy_stm32::pac::gpdma::regs::{ChBr1, ChFcr, ChLlr};
use embassy_stm32::pac::gpdma::vals::{Ap, Dreq, Dw, Prio};
use embassy_stm32::pac::{DCMI, GPDMA1, RCC};
pub(crate) use embassy_stm32::peripherals::GPDMA1_CH0 as Stream;

const CHANNEL: usize = 0;
/// GPDMA1's number of the DCMI's requests.
const REQUEST: u8 = 86;
/// All flags of the channel.
const FLAGS: ChFcr = ChFcr(0x7F00);
/// The item: the registers BR1, DAR and LLR (RM0456, 17.4.4).
const LOADS: u32 = 1 << 29 | 1 << 27 | 1 << 16;
static ITEM: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];

/// Sets the channel up for the ring at this address.
pub(super) fn set_up(ring: u32) {
    RCC.ahb1enr().modify(|w| w.set_gpdma1en(true));
    ITEM[1].store(ring, Ordering::Relaxed);
}

/// Stops the channel as soon as a word under way is written. Returns whether it has stopped.
pub(super) fn stop() -> bool {
    let channel = GPDMA1.ch(CHANNEL);
    if !channel.cr().read().en() {
        return true;
    }
    channel.cr().modify(|w| w.set_susp(true));
    channel.sr().read().suspf()
}

/// Starts the channel at the beginning of a ring of so many words.
pub(super) fn start(words: u32) {
    let channel = GPDMA1.ch(CHANNEL);
    channel.cr().write(|w| w.set_reset(true));
    channel.fcr().write_value(FLAGS);
    // The channel writes by port 1, and reads the camera interface by port 0.
    channel.tr1().write(|w| {
        w.set_sdw(Dw::WORD);
        w.set_ddw(Dw::WORD);
        w.set_dinc(true);
        w.set_dap(Ap::PORT1);
    });
    channel.tr2().write(|w| {
        w.set_reqsel(REQUEST);
        w.set_dreq(Dreq::SOURCE_PERIPHERAL);
    });
    channel.sar().write_value(DCMI.dr().as_ptr() as u32);
    let item = ITEM.as_ptr() as u32;
    let link = LOADS | item & 0xFFFC;
    ITEM[0].store(4 * words, Ordering::Relaxed);
    ITEM[2].store(link, Ordering::Relaxed);
    channel.br1().write_value(ChBr1(4 * words));
    channel.dar().write_value(ITEM[1].load(Ordering::Relaxed));
    channel.lbar().write(|w| w.set_lba((item >> 16) as u16));
    channel.llr().write_value(ChLlr(link));
    cortex_m::asm::dsb();
    channel.cr().write(|w| {
        w.set_prio(Prio::HIGH);
        w.set_lap(Ap::PORT1);
        w.set_htie(true);
        w.set_tcie(true);
        w.set_dteie(true);
        w.set_uleie(true);
        w.set_useie(true);
        w.set_en(true);
    });
}

/// Returns whether the first half of the ring was written, the second one, and whether the channel failed, since the
/// last call.
pub(super) fn take_flags() -> (bool, bool, bool) {
    let channel = GPDMA1.ch(CHANNEL);
    let flags = channel.sr().read();
    channel.fcr().write_value(ChFcr(flags.0 & FLAGS.0));
    (flags.htf(), flags.tcf(), flags.dtef() || flags.ulef() || flags.usef())
}

/// Returns the words from where the channel writes next to the ring's end. These are all, too, until it has loaded the
/// item.
pub(super) fn words_left() -> u32 {
    let bytes = match GPDMA1.ch(CHANNEL).br1().read().bndt() {
        0 => ITEM[0].load(Ordering::Relaxed),
        bytes => bytes.into(),
    };
    bytes / 4
}
