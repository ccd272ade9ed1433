//! UART0 as the serial line.

use embassy_rp::interrupt::typelevel::{self, Binding, Handler, Interrupt};
use embassy_rp::pac::UART0;
use embassy_rp::uart::{Config, RxPin, TxPin, Uart};
use embassy_rp::{Peri, peripherals};

use crate::serial::{self, Peripheral, Serial};

/// Handles the interrupt of UART0.
pub struct UartInterrupts;

// SAFETY: only hardware calls it; the data that it shares is behind a mutex.
#[allow(unsafe_code)]
impl Handler<typelevel::UART0_IRQ> for UartInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// Starts the line at this many bits per second, with eight data bits, no parity, and one stop bit.
pub fn uart0(
    uart: Peri<'static, peripherals::UART0>,
    _interrupts: impl Binding<typelevel::UART0_IRQ, UartInterrupts>,
    transmit: Peri<'static, impl TxPin<peripherals::UART0>>,
    receive: Peri<'static, impl RxPin<peripherals::UART0>>,
    baud: u32,
) -> Serial {
    let mut config = Config::default();
    config.baudrate = baud;
    let uart = Uart::new_blocking(uart, transmit, receive, config);
    // A dropped one would be disconnected.
    core::mem::forget(uart);
    UART0.uartimsc().write(|w| {
        w.set_rxim(true);
        w.set_rtim(true);
    });
    typelevel::UART0_IRQ::unpend();
    // SAFETY: the handler is bound, and shares its queues only behind a mutex.
    #[allow(unsafe_code)]
    unsafe {
        typelevel::UART0_IRQ::enable();
    }
    Serial::new(&PERIPHERAL)
}

/// The interrupt comes when the transmitter's queue gets emptier, and not because it is empty. So the first bytes are
/// written at once.
static PERIPHERAL: Peripheral = Peripheral::always_open(|| {
    critical_section::with(|_| {
        UART0.uartimsc().modify(|w| w.set_txim(true));
        fill();
    });
});

fn serve() {
    UART0.uarticr().write(|w| {
        w.set_rxic(true);
        w.set_rtic(true);
        w.set_txic(true);
    });
    while !UART0.uartfr().read().rxfe() {
        serial::arrived(UART0.uartdr().read().data());
    }
    fill();
}

/// Writes queued bytes while there is room for them.
fn fill() {
    while !UART0.uartfr().read().txff() {
        let Some(byte) = serial::next() else {
            UART0.uartimsc().modify(|w| w.set_txim(false));
            return;
        };
        UART0.uartdr().write(|w| w.set_data(byte));
    }
}
