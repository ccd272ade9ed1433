//! Stream 0 of an STM32H743's DMA1, whose requests come through DMAMUX1.

pub(super) use embassy_stm32::interrupt::typelevel::{DCMI as CameraInterrupt, DMA1_STREAM0 as DmaInterrupt};
use embassy_stm32::pac::dma::regs::Ixr;
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::{DCMI, DMA1, DMAMUX1, RCC};
pub(crate) use embassy_stm32::peripherals::DMA1_CH0 as Stream;

/// The stream of DMA1 that is used. The channel of DMAMUX1 has the same number.
const STREAM: usize = 0;
/// DMAMUX1's number of the DCMI's requests.
const REQUEST: u8 = 75;
/// All flags of the stream.
const FLAGS: Ixr = Ixr(0x3D);

/// Sets the stream up for the ring at this address.
pub(super) fn set_up(ring: u32) {
    RCC.ahb1enr().modify(|w| w.set_dma1en(true));
    let stream = DMA1.st(STREAM);
    stream.cr().write(|w| w.set_en(false));
    stream.par().write_value(DCMI.dr().as_ptr() as u32);
    stream.m0ar().write_value(ring);
    DMAMUX1.ccr(STREAM).write(|w| w.set_dmareq_id(REQUEST));
}

/// Stops the stream as soon as a word under way is written. Returns whether it has stopped.
pub(super) fn stop() -> bool {
    let control = DMA1.st(STREAM).cr();
    control.modify(|w| w.set_en(false));
    !control.read().en()
}

/// Starts the stream at the beginning of a ring of so many words.
pub(super) fn start(words: u32) {
    DMA1.ifcr(0).write_value(FLAGS);
    let stream = DMA1.st(STREAM);
    stream.ndtr().write(|w| w.set_ndt(words as u16));
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
}

/// Returns whether the first half of the ring was written, the second one, and whether the stream failed, since the
/// last call.
pub(super) fn take_flags() -> (bool, bool, bool) {
    let dma = DMA1.isr(0).read();
    DMA1.ifcr(0).write_value(dma);
    (dma.htif(STREAM), dma.tcif(STREAM), dma.teif(STREAM))
}

/// Returns the words from where the stream writes next to the ring's end.
pub(super) fn words_left() -> u32 {
    DMA1.st(STREAM).ndtr().read().ndt().into()
}
