//! USART3 as the serial line.

use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{self, Binding, Handler, Interrupt};
use embassy_stm32::pac::USART3;
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, peripherals, rcc};

use crate::serial::{self, Peripheral, Serial};

/// Handles the interrupt of USART3.
pub struct UsartInterrupts;

// SAFETY: only hardware calls it; the data that it shares is behind a mutex.
#[allow(unsafe_code)]
impl Handler<typelevel::USART3> for UsartInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// Starts the line at this many bits per second, with eight data bits, no parity, and one stop bit.
pub fn usart3(
    _usart: Peri<'static, peripherals::USART3>,
    _interrupts: impl Binding<typelevel::USART3, UsartInterrupts>,
    transmit: Peri<'static, impl TxPin<peripherals::USART3>>,
    receive: Peri<'static, impl RxPin<peripherals::USART3>>,
    baud: u32,
) -> Serial {
    let (sends, receives) = (transmit.af_num(), receive.af_num());
    let mut transmit = Flex::new(transmit);
    transmit.set_as_af_unchecked(sends, AfType::output(OutputType::PushPull, Speed::Medium));
    let mut receive = Flex::new(receive);
    receive.set_as_af_unchecked(receives, AfType::input(Pull::Up));
    // A dropped pin would be disconnected.
    core::mem::forget((transmit, receive));
    rcc::enable_and_reset::<peripherals::USART3>();
    let clock = rcc::frequency::<peripherals::USART3>().0;
    USART3.brr().write(|w| w.set_brr(((clock + baud / 2) / baud) as u16));
    // Bytes that are not read in time are lost; requests are sent again.
    USART3.cr3().write(|w| w.set_ovrdis(true));
    USART3.cr1().write(|w| {
        w.set_te(true);
        w.set_re(true);
        w.set_rxneie(true);
        w.set_ue(true);
    });
    typelevel::USART3::unpend();
    // SAFETY: the handler is bound, and shares its queues only behind a mutex.
    #[allow(unsafe_code)]
    unsafe {
        typelevel::USART3::enable();
    }
    Serial::new(&PERIPHERAL)
}

static PERIPHERAL: Peripheral = Peripheral::always_open(|| USART3.cr1().modify(|w| w.set_txeie(true)));

fn serve() {
    let state = USART3.isr().read();
    if state.rxne() {
        serial::arrived(USART3.rdr().read().0 as u8);
    }
    if state.txe() {
        match serial::next() {
            Some(byte) => USART3.tdr().write(|w| w.0 = byte.into()),
            None => USART3.cr1().modify(|w| w.set_txeie(false)),
        }
    }
}
