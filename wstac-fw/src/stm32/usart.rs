//! A USART as the serial line: which one is the chip's (`Usart`, `USART`).

use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{Binding, Handler, Interrupt};
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, rcc};

use super::chip::{USART, Usart, UsartInterrupt};
use crate::serial::{self, Peripheral, Serial};

/// Handles the interrupt of the USART.
pub struct UsartInterrupts;

// SAFETY: only hardware calls it; the data that it shares is behind a mutex.
#[allow(unsafe_code)]
impl Handler<UsartInterrupt> for UsartInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// Starts the line at this many bits per second, with eight data bits, no parity, and one stop bit.
pub fn usart(
    _usart: Peri<'static, Usart>,
    _interrupts: impl Binding<UsartInterrupt, UsartInterrupts>,
    transmit: Peri<'static, impl TxPin<Usart>>,
    receive: Peri<'static, impl RxPin<Usart>>,
    baud: u32,
) -> Serial {
    let (sends, receives) = (transmit.af_num(), receive.af_num());
    let mut transmit = Flex::new(transmit);
    transmit.set_as_af_unchecked(sends, AfType::output(OutputType::PushPull, Speed::Medium));
    let mut receive = Flex::new(receive);
    receive.set_as_af_unchecked(receives, AfType::input(Pull::Up));
    // A dropped pin would be disconnected.
    core::mem::forget((transmit, receive));
    rcc::enable_and_reset::<Usart>();
    let clock = rcc::frequency::<Usart>().0;
    USART.brr().write(|w| w.set_brr(((clock + baud / 2) / baud) as u16));
    // Bytes that are not read in time are lost; requests are sent again.
    USART.cr3().write(|w| w.set_ovrdis(true));
    USART.cr1().write(|w| {
        w.set_te(true);
        w.set_re(true);
        w.set_rxneie(true);
        w.set_ue(true);
    });
    UsartInterrupt::unpend();
    // SAFETY: the handler is bound, and shares its queues only behind a mutex.
    #[allow(unsafe_code)]
    unsafe {
        UsartInterrupt::enable();
    }
    Serial::new(&PERIPHERAL)
}

static PERIPHERAL: Peripheral = Peripheral::always_open(|| USART.cr1().modify(|w| w.set_txeie(true)));

fn serve() {
    let state = USART.isr().read();
    if state.rxne() {
        serial::arrived(USART.rdr().read().0 as u8);
    }
    if state.txe() {
        match serial::next() {
            Some(byte) => USART.tdr().write(|w| w.0 = byte.into()),
            None => USART.cr1().modify(|w| w.set_txeie(false)),
        }
    }
}
