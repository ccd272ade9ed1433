//! A serial line with queues. It sends bytes from a queue, and receives requests into one. The interrupt of a board's
//! own peripheral moves them (`stm32::usart`, `rp::uart`), or the task of its USB (`usb`).
//!
//! Sending never waits. A message without room is left out, and its number in the sequence tells the host.

use core::cell::RefCell;
use core::convert::Infallible;

use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use heapless::Deque;

use crate::link::{EnterBootloader, Line};
use crate::node::CHANGED;

/// The size of the queue of bytes to be sent: two of the longest messages.
const OUT: usize = 512;
/// The size of the queue of bytes to be read: the longest request, or the six requests of a host that connects, of at
/// most 16 bytes each.
const IN: usize = if cfg!(feature = "settings") { 256 } else { 96 };

static QUEUES: CriticalSectionMutex<RefCell<Queues>> =
    CriticalSectionMutex::new(RefCell::new(Queues { out: Deque::new(), received: Deque::new() }));

struct Queues {
    out: Deque<u8, OUT>,
    received: Deque<u8, IN>,
}

/// The serial line.
pub struct Serial(&'static Peripheral);

/// The peripheral behind a serial line.
pub(crate) struct Peripheral {
    /// Lets it take the bytes to be sent.
    pub begin: fn(),
    /// Returns a number that is another at each opening of the line; `None` if it is not open.
    pub opened: fn() -> Option<u32>,
    /// Returns whether it has sent all bytes that it took.
    pub is_sent: fn() -> bool,
    /// The board's boot loader, if it takes programs over USB.
    pub bootloader: Option<EnterBootloader>,
}

impl Peripheral {
    /// Creates one that is always open, of a board without such a boot loader.
    pub(crate) const fn always_open(begin: fn()) -> Self {
        Self { begin, opened: || Some(0), is_sent: || true, bootloader: None }
    }
}

impl Serial {
    /// Creates the line of a peripheral that is set up.
    pub(crate) fn new(peripheral: &'static Peripheral) -> Self {
        Self(peripheral)
    }
}

/// Returns the next byte to be sent.
pub(crate) fn next() -> Option<u8> {
    QUEUES.lock(|queues| queues.borrow_mut().out.pop_front())
}

/// Takes a byte that has arrived. Without room it is lost, and the request with it.
pub(crate) fn arrived(byte: u8) {
    let _ = QUEUES.lock(|queues| queues.borrow_mut().received.push_back(byte));
    CHANGED.signal(());
}

/// Forgets the bytes to be sent.
#[cfg(feature = "usb")]
pub(crate) fn discard() {
    QUEUES.lock(|queues| queues.borrow_mut().out.clear());
}

/// Returns whether so many more bytes that arrive have room.
#[cfg(feature = "usb")]
pub(crate) fn takes(count: usize) -> bool {
    QUEUES.lock(|queues| IN - queues.borrow().received.len() >= count)
}

impl Line for Serial {
    fn is_drained(&self) -> bool {
        QUEUES.lock(|queues| queues.borrow().out.is_empty()) && (self.0.is_sent)()
    }

    fn opened(&self) -> Option<u32> {
        (self.0.opened)()
    }

    fn bootloader(&self) -> Option<EnterBootloader> {
        self.0.bootloader
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
        let fit = QUEUES.lock(|queues| {
            let out = &mut queues.borrow_mut().out;
            let fit = bytes.len().min(OUT - out.len());
            out.extend(bytes.iter().take(fit).copied());
            fit
        });
        (self.0.begin)();
        Ok(fit)
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
