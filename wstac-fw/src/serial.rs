//! USART3 of the STM32H743. It sends bytes from a queue, all of a message or none, and receives requests.
//!
//! Sending never waits. A message without room is left out, and its number in the sequence tells the host.

use core::cell::RefCell;
use core::convert::Infallible;

use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{self, Binding, Handler, Interrupt};
use embassy_stm32::pac::USART3;
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use heapless::Deque;

use crate::link::Line;
use crate::node::CHANGED;

/// The size of the queue of bytes to be sent: two of the longest messages.
const OUT: usize = 512;
/// The size of the queue of bytes to be read: the longest request, or the five requests of a host that connects, of 11
/// bytes each.
const IN: usize = if cfg!(feature = "settings") { 256 } else { 64 };

/// Both queues.
static QUEUES: CriticalSectionMutex<RefCell<Queues>> =
    CriticalSectionMutex::new(RefCell::new(Queues { out: Deque::new(), received: Deque::new() }));

struct Queues {
    out: Deque<u8, OUT>,
    received: Deque<u8, IN>,
}

/// Handles the interrupt of USART3.
pub struct SerialInterrupts;

// SAFETY: only hardware calls it; the data that it shares is behind a mutex.
#[allow(unsafe_code)]
impl Handler<typelevel::USART3> for SerialInterrupts {
    unsafe fn on_interrupt() {
        serve();
    }
}

/// The serial line.
pub struct Serial(());

impl Serial {
    /// Starts the line at this many bits per second, with eight data bits, no parity, and one stop bit.
    pub fn new(
        _usart: Peri<'static, peripherals::USART3>,
        _interrupts: impl Binding<typelevel::USART3, SerialInterrupts>,
        transmit: Peri<'static, impl TxPin<peripherals::USART3>>,
        receive: Peri<'static, impl RxPin<peripherals::USART3>>,
        baud: u32,
    ) -> Self {
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
        Self(())
    }
}

impl Line for Serial {
    fn is_drained(&self) -> bool {
        QUEUES.lock(|queues| queues.borrow().out.is_empty())
    }

    fn room(&self) -> usize {
        QUEUES.lock(|queues| OUT - queues.borrow().out.len())
    }
}

impl ErrorType for Serial {
    type Error = Infallible;
}

impl Write for Serial {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        // Without room it would wait for the interrupt.
        while self.room() == 0 {}
        Ok(QUEUES.lock(|queues| {
            let out = &mut queues.borrow_mut().out;
            let fit = bytes.len().min(OUT - out.len());
            out.extend(bytes.iter().take(fit).copied());
            USART3.cr1().modify(|w| w.set_txeie(true));
            fit
        }))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while !self.is_drained() {}
        Ok(())
    }
}

impl ReadReady for Serial {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(QUEUES.lock(|queues| !queues.borrow().received.is_empty()))
    }
}

impl Read for Serial {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        loop {
            if let Some(byte) = QUEUES.lock(|queues| queues.borrow_mut().received.pop_front()) {
                *first = byte;
                return Ok(1);
            }
        }
    }
}

fn serve() {
    QUEUES.lock(|queues| {
        let queues = &mut *queues.borrow_mut();
        let state = USART3.isr().read();
        if state.rxne() {
            let byte = USART3.rdr().read().0 as u8;
            // Without room the byte is lost, and the request with it.
            let _ = queues.received.push_back(byte);
            CHANGED.signal(());
        }
        if state.txe() {
            match queues.out.pop_front() {
                Some(byte) => USART3.tdr().write(|w| w.0 = byte.into()),
                None => USART3.cr1().modify(|w| w.set_txeie(false)),
            }
        }
    });
}
