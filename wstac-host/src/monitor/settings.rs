//! The settings of a board: asked for, set, and read back.

use std::cell::Cell;
use std::ffi::OsStr;
use std::fmt::Display;
use std::time::{Duration, Instant};

use wstac_core::error::ConfigError;
use wstac_core::features::Floor;
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::Layout;
use wstac_core::wire::{
    Bootloader, DecodeError, Decoder, LONGEST, Message, Request, Settings, SettingsInUse, VERSION, encode,
};

use super::foreign::Foreign;
use super::port::{Got, Port};
use crate::config::Config;
use crate::error::{Error, ErrorKind};
use crate::source::StreamInfo;

/// The time after which a request is sent again.
const AGAIN: Duration = Duration::from_secs(1);
/// The time between two looks at a board that starts again.
const RESTART: Duration = Duration::from_millis(100);
/// The longest wait for an answer. A board that was just set starts again first.
const LONGEST_WAIT: Duration = Duration::from_secs(10);

/// A board whose settings can be set.
#[derive(Debug)]
pub struct SettableBoard {
    pub(super) port: Port,
    decoder: Decoder,
    foreign: Foreign,
    /// Whether a message has arrived.
    heard: bool,
    sequence: u16,
}

impl SettableBoard {
    /// Opens a port as `wstac monitor` does.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub fn open(port: &OsStr, baud: Option<u32>) -> Result<Self, Error> {
        let (port, decoder, foreign) = (Port::open(port, baud)?, Decoder::new(), Foreign::default());
        Ok(Self { port, decoder, foreign, heard: false, sequence: 0 })
    }

    /// Returns the settings that the board uses.
    ///
    /// # Errors
    /// The port cannot be read, or the board does not answer.
    pub fn in_use(&mut self) -> Result<SettingsInUse, Error> {
        self.ask(&[Request::Settings], |message| match message {
            Message::Settings(settings) => Some(*settings),
            _ => None,
        })
    }

    /// Returns what a host knows about the board's frames.
    ///
    /// # Errors
    /// As those of [`SettableBoard::in_use`].
    pub fn info(&mut self) -> Result<StreamInfo, Error> {
        self.ask(&[Request::Hello], super::pictures::info_in)
    }

    /// Sets settings, waits until the board has started again with them, and reads them back.
    ///
    /// # Errors
    /// The board refuses them, does not answer, or uses others after that. The port cannot be read.
    pub fn set(&mut self, settings: &Settings) -> Result<(), Error> {
        self.change(&Request::Set(*settings), |found| found.set && found.settings == *settings)
    }

    /// Returns the board to the settings that were compiled in, and waits until it has started again.
    ///
    /// # Errors
    /// As those of [`SettableBoard::set`].
    pub fn forget(&mut self) -> Result<(), Error> {
        self.change(&Request::Forget, |found| !found.set)
    }

    /// Lets the board start its boot loader, which takes a new program over USB, and returns its kind.
    ///
    /// # Errors
    /// The board has none, or its firmware does not know this request. The port cannot be read.
    pub fn start_bootloader(&mut self) -> Result<Bootloader, Error> {
        // An older firmware only answers the second request. A board that has just been opened says hello unasked, and
        // an answer may be lost once: the third hello decides.
        let hellos = Cell::new(0);
        let found = self.ask(&[Request::Bootloader, Request::Hello], |message| match message {
            Message::Bootloader(found) => Some(Ok(*found)),
            Message::Hello(_) => {
                hellos.update(|hellos| hellos + 1);
                (hellos.get() > 2).then_some(Err("does not know of a boot loader"))
            }
            _ => None,
        })?;
        let found = found.and_then(|found| found.ok_or("has no boot loader that takes programs over USB"));
        found.map_err(|what| {
            self.lacks(format_args!("{what}; help: flash it as wstac-fw/README.md says for this board"))
        })
    }

    fn change(&mut self, request: &Request, is_done: impl Fn(&SettingsInUse) -> bool) -> Result<(), Error> {
        let answer = self.ask(&[*request], |message| match message {
            Message::Set(answer) => Some(*answer),
            _ => None,
        })?;
        answer.map_err(|refusal| self.failed(format_args!("refuses the settings: {refusal}")))?;
        let late = "does not use the settings that it took";
        self.wait_for((LONGEST_WAIT, RESTART), late, |board| Ok(is_done(&board.in_use()?)))
    }

    /// Takes a byte, and returns what `pick` takes of the message that it ends.
    pub(super) fn push<T>(
        &mut self,
        byte: u8,
        pick: impl FnOnce(&Message<'_>) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        self.foreign.take(byte);
        match self.decoder.push::<Message>(byte) {
            Some(Ok(received)) => {
                self.heard = true;
                Ok(pick(&received.message))
            }
            Some(Err(DecodeError::Version(version))) => {
                let message = format!("speaks version {version} of the link, expected {VERSION}");
                Err(Error::new(ErrorKind::Unsupported, "the board's firmware", message))
            }
            _ => Ok(None),
        }
    }

    /// Sends requests until `pick` takes a message.
    pub(super) fn ask<T>(
        &mut self,
        requests: &[Request],
        pick: impl Fn(&Message<'_>) -> Option<T>,
    ) -> Result<T, Error> {
        self.ask_within(LONGEST_WAIT, requests, pick)?.ok_or_else(|| {
            let message = if self.port.takes_requests() {
                "does not answer, expected a board whose settings can be set"
            } else {
                "is a file of what a board sent, expected the board itself, such as /dev/ttyACM0"
            };
            self.failed(if self.heard { message.to_owned() } else { self.foreign.in_words() })
        })
    }

    /// Repeats requests until a message is picked; `None` if none is within this time, or if no board sends.
    pub(super) fn ask_within<T>(
        &mut self,
        longest: Duration,
        requests: &[Request],
        pick: impl Fn(&Message<'_>) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        let began = Instant::now();
        let mut asked = None::<Instant>;
        let mut byte = [0];
        loop {
            if asked.is_none_or(|asked| asked.elapsed() > AGAIN) {
                asked = Some(Instant::now());
                for request in requests {
                    self.send(request);
                }
            }
            let got = self.port.read(&mut byte)?;
            let is_foreign = !self.heard && self.foreign.is_sure();
            if got == Got::Ended || is_foreign || began.elapsed() > longest {
                return Ok(None);
            }
            let Got::Bytes(1) = got else { continue };
            if let Some(picked) = self.push(byte[0], &pick)? {
                return Ok(Some(picked));
            }
        }
    }

    pub(super) fn send(&mut self, request: &Request) {
        self.port.send(encode(request, self.sequence, &mut [0; LONGEST]));
        self.sequence = self.sequence.wrapping_add(1);
    }

    /// Returns the error about a board that does not do what it should.
    pub(super) fn failed(&self, message: impl Display) -> Error {
        Error::new(ErrorKind::Data, self.port.name(), message)
    }

    /// Returns the error about a firmware that lacks something.
    pub(super) fn lacks(&self, message: impl Display) -> Error {
        Error::new(ErrorKind::Unsupported, self.port.name(), message)
    }

    /// Waits until a state is reached that the board reports.
    pub(super) fn wait_for(
        &mut self,
        (longest, pause): (Duration, Duration),
        late: &str,
        mut is_done: impl FnMut(&mut Self) -> Result<bool, Error>,
    ) -> Result<(), Error> {
        let began = Instant::now();
        while !is_done(self)? {
            if began.elapsed() > longest {
                return Err(self.failed(late));
            }
            std::thread::sleep(pause);
        }
        Ok(())
    }
}

/// Returns the settings of a configuration for a board: layout, darkness floor and trigger.
///
/// The layout is not checked: the board does that.
///
/// # Errors
/// The configuration has no floor or trigger for such frames.
pub fn settings_of(config: &Config, info: &StreamInfo, exposure: Option<u16>) -> Result<Settings, ConfigError> {
    let green = Any::new(info.format, YcbcrEncoding::default(), YcbcrMethod::Exact);
    let floor = Floor::new(config.features.floor_levels, green.full_scale())?;
    let mut settings = Settings::new(&Layout::paper(info.size)?, floor, config.trigger()?, exposure);
    if let Some(frame) = config.layout.frame() {
        settings.frame = frame;
    }
    if let Some((taxel, corners)) = config.layout.explicit() {
        (settings.taxel, settings.corners) = (taxel, corners);
    }
    Ok(settings)
}
