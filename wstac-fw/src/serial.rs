//! USART3 of the STM32H743. It sends bytes from a queue, all of a message or none, and receives requests.
//!
//! Sending never waits. A message without room is left out, and its number in the sequence tells the host.

use core::cell::RefCell;

use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::typelevel::{self, Binding, Handler, Interrupt};
use embassy_stm32::pac::USART3;
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use heapless::Deque;

use crate::stripes::dcmi::CHANGED;

/// The size of the queue of bytes to be sent: two of the longest messages.
const OUT: usize = 512;
/// The size of the queue of bytes to be read: the longest request.
const IN: usize = if cfg!(feature = "settings") { 256 } else { 32 };
/// The number of the pins' function.
const USART3_PINS: u8 = 7;

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
        transmit: Peri<'static, peripherals::PD8>,
        receive: Peri<'static, peripherals::PD9>,
        baud: u32,
    ) -> Self {
        let mut transmit = Flex::new(transmit);
        transmit.set_as_af_unchecked(USART3_PINS, AfType::output(OutputType::PushPull, Speed::Medium));
        let mut receive = Flex::new(receive);
        receive.set_as_af_unchecked(USART3_PINS, AfType::input(Pull::Up));
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

    /// Sends all bytes, or none if they do not fit the queue. Returns whether they fit.
    pub fn send(&mut self, bytes: &[u8]) -> bool {
        QUEUES.lock(|queues| {
            let out = &mut queues.borrow_mut().out;
            if OUT - out.len() < bytes.len() {
                return false;
            }
            out.extend(bytes.iter().copied());
            USART3.cr1().modify(|w| w.set_txeie(true));
            true
        })
    }

    /// Returns whether all bytes have left the queue.
    pub fn is_drained(&self) -> bool {
        QUEUES.lock(|queues| queues.borrow().out.is_empty())
    }

    /// Returns how many more bytes can be queued.
    pub fn room(&self) -> usize {
        QUEUES.lock(|queues| OUT - queues.borrow().out.len())
    }

    /// Returns the next byte that has arrived.
    pub fn receive(&mut self) -> Option<u8> {
        QUEUES.lock(|queues| queues.borrow_mut().received.pop_front())
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
