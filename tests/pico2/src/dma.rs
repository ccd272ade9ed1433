//! Two channels of the RP2350's DMA that take what machine 0 of PIO0 has (data sheet, 12.6). The emulated DMA lets a
//! channel that another one has just started take a word that is not there.

use rp2350_emu::Bus;

pub(crate) const BASE: u32 = 0x5000_0000;
/// The request of machine 0's receiver, and the interrupt that the program uses.
const REQUEST: u32 = 4;
const INTERRUPT: u32 = 11;
/// The register of the PIO from which its words are read.
const FIFO: u32 = 0x20;
const FIFO_ADDRESS: u32 = 0x5020_0020;

#[derive(Clone, Copy, Default)]
struct Channel {
    from: u32,
    to: u32,
    count: u32,
    left: u32,
    control: u32,
    is_busy: bool,
}

/// The channels, and what they interrupt.
#[derive(Default)]
pub(crate) struct Dma {
    channels: [Channel; 2],
    raised: u32,
    enabled: u32,
}

impl Dma {
    pub(crate) fn read(&self, offset: u32) -> u32 {
        let channel = self.channels.get((offset / 0x40) as usize).copied().unwrap_or_default();
        match offset {
            0x400 => self.raised,
            0x414 => self.enabled,
            0x41C => self.raised & self.enabled,
            0..0x80 => match offset % 0x40 {
                0x00 => channel.from,
                0x04 => channel.to,
                0x08 => channel.left,
                0x0C | 0x10 => channel.control | u32::from(channel.is_busy) << 26,
                _ => 0,
            },
            _ => 0,
        }
    }

    /// Writes a register; `now` is what it has after the write, with regard to aliases.
    pub(crate) fn write(&mut self, offset: u32, now: u32) {
        match offset {
            0x400 | 0x41C => self.raised &= !now,
            0x414 => self.enabled = now,
            0x450 => self.start(now),
            0x464 => {
                for (number, channel) in self.channels.iter_mut().enumerate() {
                    channel.is_busy &= now >> number & 1 == 0;
                }
            }
            0..0x80 => {
                let channel = &mut self.channels[(offset / 0x40) as usize];
                match offset % 0x40 {
                    0x00 => channel.from = now,
                    0x04 => channel.to = now,
                    0x08 => channel.count = now & 0x0FFF_FFFF,
                    0x0C | 0x10 => channel.control = now & !(1 << 26),
                    other => panic!("the program writes to register {other:#x} of a channel"),
                }
                if offset % 0x40 == 0x0C {
                    self.start(1 << (offset / 0x40));
                }
            }
            _ => panic!("the program writes to register {offset:#x} of the DMA"),
        }
    }

    fn start(&mut self, channels: u32) {
        for (number, channel) in self.channels.iter_mut().enumerate() {
            if channels >> number & 1 != 0 && channel.control & 1 != 0 && !channel.is_busy {
                (channel.left, channel.is_busy) = (channel.count, channel.count > 0);
            }
        }
    }

    /// Moves the words that are there, and interrupts.
    pub(crate) fn run(&mut self, bus: &mut Bus) {
        while let Some(number) = self.channels.iter().position(|channel| channel.is_busy) {
            if !bus.pio[0].rx_dreq(0) {
                break;
            }
            let channel = &mut self.channels[number];
            assert_eq!((channel.control >> 17 & 0x3F, channel.from), (REQUEST, FIFO_ADDRESS), "what the DMA waits for");
            assert_eq!(channel.control >> 2 & 0b11, 2, "the DMA moves words");
            let word = bus.pio[0].read32(FIFO);
            bus.write32(channel.to, word, 0);
            if channel.control & 1 << 6 != 0 {
                // A ring of addresses to write to: bits 11 to 8 are its size, bit 12 says so.
                let size = channel.control >> 8 & 15;
                let mask = if size > 0 && channel.control & 1 << 12 != 0 { (1 << size) - 1 } else { u32::MAX };
                channel.to = channel.to & !mask | (channel.to + 4) & mask;
            }
            channel.left -= 1;
            if channel.left == 0 {
                channel.is_busy = false;
                self.raised |= 1 << number;
                let next = channel.control >> 13 & 15;
                if next != number as u32 {
                    self.start(1 << next);
                }
            }
        }
        if self.raised & self.enabled != 0 {
            bus.assert_irq_shared(INTERRUPT);
        }
    }
}
