//! A board's side of the link: messages on the serial line, and reports of faults on every available way.

use core::mem;

use embedded_hal::digital::{OutputPin, PinState};
use embedded_io::{Read, ReadReady, Write};
#[cfg(feature = "settings")]
use wstac_core::wire::LONGEST_REQUEST;
use wstac_core::wire::{self, Bootloader, Decoder, Fault, FrameNumbers, FramePart, Message, Request};

use crate::picture;
use crate::reader::Publisher;
use crate::sensor::SensorError;

/// The number of bytes of the longest request.
#[cfg(not(feature = "settings"))]
const LONGEST_REQUEST: usize = 16;

impl<E> From<SensorError<E>> for Fault<'static> {
    fn from(error: SensorError<E>) -> Self {
        match error {
            SensorError::Bus { .. } => Self::SensorGone { lines: None },
            SensorError::Identity { found: id, .. } => Self::SensorUnknown { id },
            SensorError::NotTaken { register, values } => Self::SensorRefuses { register, values: Some(values) },
        }
    }
}

/// The last fault that a host was told of. Measured numbers are left out: every board has memory for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Told {
    /// No fault.
    #[default]
    None,
    /// A fault, of which a host that has just connected should know, too.
    Again,
    /// A fault of this kind, and its number.
    Fault(u8, u16),
}

impl Told {
    fn of(fault: &Fault<'_>) -> Self {
        match *fault {
            Fault::SensorUnknown { id } => Self::Fault(0, id),
            Fault::SensorRefuses { register, .. } => Self::Fault(1, register),
            Fault::SensorDiffers { part: FramePart::Pattern, .. } => Self::Fault(2, 0),
            Fault::SensorDiffers { register, .. } => Self::Fault(3, register),
            Fault::SensorGone { lines } => Self::Fault(4, lines.map_or(0, |lines| lines as u16)),
            _ => Self::Fault(5, 0),
        }
    }
}

/// A boot loader, and the function that starts it.
pub type EnterBootloader = (Bootloader, fn() -> !);

/// A serial line with a queue for what is sent. Neither reading nor writing waits if it is asked first.
pub trait Line: Read + ReadReady + Write {
    /// Returns how many more bytes can be queued.
    fn room(&self) -> usize;

    /// Returns whether all bytes have left the queue.
    fn is_drained(&self) -> bool;

    /// Returns a number that is another at each opening of the line; `None` if it is not open, and bytes are discarded.
    fn opened(&self) -> Option<u32> {
        Some(0)
    }

    /// Returns the board's boot loader, if it takes programs over USB.
    fn bootloader(&self) -> Option<EnterBootloader> {
        None
    }
}

/// The serial line with messages on it, and the light that shows a fault.
pub struct Link<S, T> {
    serial: S,
    sequence: u16,
    decoder: Decoder<LONGEST_REQUEST>,
    trouble: T,
    events: u32,
    opened: Option<u32>,
    has_reader: bool,
    is_leaving: bool,
}

impl<S: Line, T: OutputPin> Link<S, T> {
    /// Creates the link on this line; `trouble` is the light.
    pub fn new(serial: S, trouble: T) -> Self {
        let opened = serial.opened();
        // On a line that is open from the start, nothing says whether somebody reads.
        let has_reader = opened.is_some();
        Self { serial, sequence: 0, decoder: Decoder::new(), trouble, events: 0, opened, has_reader, is_leaving: false }
    }

    /// Returns true once when a host has opened the line since the last call.
    pub fn is_newly_open(&mut self) -> bool {
        let opened = self.serial.opened();
        let is_other = mem::replace(&mut self.opened, opened) != opened;
        self.has_reader &= !is_other;
        is_other && opened.is_some()
    }

    /// Returns whether a host has all messages. One that has opened the line counts once it has sent a request: other
    /// programs open every port to look for a modem.
    pub fn is_read(&self) -> bool {
        self.has_reader && self.serial.opened() == self.opened && self.is_drained()
    }

    /// Says whether the board has a boot loader. If it has one, it is to be started when that was sent.
    pub fn leave(&mut self) {
        let found = self.serial.bootloader();
        self.is_leaving |= found.is_some();
        self.send(&Message::Bootloader(found.map(|(kind, _)| kind)));
    }

    /// Returns what starts the boot loader, if that was asked for.
    pub fn leaving(&self) -> Option<fn() -> !> {
        self.serial.bootloader().filter(|_| self.is_leaving).map(|(_, enter)| enter)
    }

    /// Returns the number of events that were sent.
    pub fn events(&self) -> u32 {
        self.events
    }

    /// Returns whether there is room for any message.
    pub fn has_room(&self) -> bool {
        self.serial.room() >= wire::LONGEST
    }

    /// Returns whether there is room for a part of a picture, and for any message after it.
    pub fn has_room_for_picture(&self) -> bool {
        self.serial.room() >= picture::ROOM
    }

    /// Returns whether all messages have been sent.
    pub fn is_drained(&self) -> bool {
        self.serial.is_drained()
    }

    /// Returns whether nothing has arrived, and all messages have been sent.
    pub fn is_idle(&mut self) -> bool {
        self.is_drained() && !self.serial.read_ready().unwrap_or(true)
    }

    /// Returns the next request that has arrived.
    pub fn request(&mut self) -> Option<Request> {
        while let Some(byte) = self.receive() {
            if let Some(Ok(received)) = self.decoder.push::<Request>(byte) {
                self.has_reader = true;
                return Some(received.message);
            }
        }
        None
    }

    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        let is_there =
            self.serial.read_ready().unwrap_or(false) && self.serial.read(&mut byte).is_ok_and(|read| read > 0);
        let [byte] = byte;
        is_there.then_some(byte)
    }

    /// Sends all bytes, or none if they do not fit the queue. Returns whether they fit.
    fn send_all(&mut self, bytes: &[u8]) -> bool {
        self.serial.room() >= bytes.len() && self.serial.write_all(bytes).is_ok()
    }

    /// Reports a fault, on all ways.
    pub fn fault(&mut self, fault: Fault<'_>) {
        match fault {
            Fault::Overrun => defmt::warn!("overrun: a frame is lost"),
            Fault::LostSync => defmt::warn!("lost sync: a frame is lost"),
            Fault::SensorSilent => defmt::warn!("the sensor is silent"),
            Fault::SensorGone { .. } => defmt::error!("no sensor answers"),
            Fault::SensorUnknown { id } => defmt::error!("the sensor is {=u16:#06x}, which is not known", id),
            Fault::SensorRefuses { register, .. } => {
                defmt::error!("the sensor does not keep register {=u16:#04x}", register);
            }
            Fault::SensorDiffers { found: FrameNumbers { lines, words, millihertz }, .. } => {
                defmt::error!("{=u32} lines, {=u32} words, {=u32} frames in 1000 seconds", lines, words, millihertz);
            }
            Fault::SensorBack => defmt::info!("the sensor sends frames"),
            Fault::LastRun(_) => defmt::error!("the last run ended in a panic or a fault: the message says where"),
            _ => {}
        }
        let _ = self.trouble.set_state(PinState::from(!matches!(fault, Fault::SensorBack)));
        self.send(&Message::Fault(fault));
    }

    /// Reports the fault that keeps frames away, unless the host was told of it last.
    pub fn absence(&mut self, told: &mut Told, fault: Fault<'_>) {
        if mem::replace(told, Told::of(&fault)) != *told {
            self.fault(fault);
        }
    }

    /// Sends the board's time, for a request of the host's time.
    // It is not inlined, so that the message does not lie on the stack of a function that runs for ever.
    #[inline(never)]
    pub fn time(&mut self, host_us: u64, board_us: u64) {
        self.send(&Message::Time { host_us, board_us });
    }
}

impl<S: Line, T: OutputPin> Publisher for Link<S, T> {
    fn send(&mut self, message: &Message<'_>) {
        // An event that is sent again is none.
        if let Message::Event(answers) = message
            && answers.number == self.events as u16
        {
            defmt::info!("event at frame {=u64}", answers.frame);
            self.events = self.events.wrapping_add(1);
            let _ = self.trouble.set_low();
        }
        let mut buffer = [0; wire::LONGEST];
        if !self.send_all(wire::encode(message, self.sequence, &mut buffer)) {
            defmt::warn!("no room for a message on the line");
        }
        self.sequence = self.sequence.wrapping_add(1);
    }
}
