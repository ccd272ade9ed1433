//! The board's first UART, without interrupts.

use core::ptr::{read_volatile, write_volatile};

/// The UART of a microbit or an MPS2.
pub struct Uart(());

#[cfg(microbit)]
mod registers {
    pub(super) const START_RECEIVER: usize = 0x4000_2000;
    pub(super) const START_TRANSMITTER: usize = 0x4000_2008;
    pub(super) const RECEIVED: usize = 0x4000_2108;
    pub(super) const SENT: usize = 0x4000_211C;
    pub(super) const ENABLE: usize = 0x4000_2500;
    pub(super) const RECEIVE: usize = 0x4000_2518;
    pub(super) const SEND: usize = 0x4000_251C;
}

#[cfg(not(microbit))]
mod registers {
    pub(super) const DATA: usize = 0x4000_4000;
    /// Bit 0: the transmitter is full; bit 1: a byte is there.
    pub(super) const STATE: usize = 0x4000_4004;
    /// Bit 0: transmitter on; bit 1: receiver on.
    pub(super) const CONTROL: usize = 0x4000_4008;
    pub(super) const DIVIDER: usize = 0x4000_4010;
}

fn write(register: usize, value: u32) {
    // SAFETY: the registers of this module are the UART's, which only this type uses.
    unsafe { write_volatile(register as *mut u32, value) }
}

fn read(register: usize) -> u32 {
    // SAFETY: the registers of this module are the UART's, which only this type uses.
    unsafe { read_volatile(register as *const u32) }
}

impl Uart {
    /// Turns the UART on.
    pub fn start() -> Self {
        #[cfg(microbit)]
        {
            write(registers::ENABLE, 4);
            write(registers::START_TRANSMITTER, 1);
            write(registers::START_RECEIVER, 1);
        }
        #[cfg(not(microbit))]
        {
            write(registers::DIVIDER, 16);
            write(registers::CONTROL, 3);
        }
        Self(())
    }

    /// Sends bytes, and waits until they have been handed to the transmitter.
    pub fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            #[cfg(microbit)]
            {
                write(registers::SENT, 0);
                write(registers::SEND, byte.into());
                while read(registers::SENT) == 0 {}
            }
            #[cfg(not(microbit))]
            {
                while read(registers::STATE) & 1 != 0 {}
                write(registers::DATA, byte.into());
            }
        }
    }

    /// Returns a byte that has arrived.
    pub fn receive(&mut self) -> Option<u8> {
        #[cfg(microbit)]
        {
            if read(registers::RECEIVED) == 0 {
                return None;
            }
            write(registers::RECEIVED, 0);
            Some(read(registers::RECEIVE) as u8)
        }
        #[cfg(not(microbit))]
        {
            (read(registers::STATE) & 2 != 0).then(|| read(registers::DATA) as u8)
        }
    }
}
