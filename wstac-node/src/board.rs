//! Reads a board, which has found its events itself.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::SystemTime;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::monitor::port::{Got, Port, SILENT, WAIT};
use wstac_host::monitor::requests::Requests;
use wstac_host::monitor::{Monitor, Report, now};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;

use crate::note;
use crate::orders::{MOST_WAITING, Order};
use crate::publisher::PublisherHandle;

/// A board whose port is open.
pub(crate) struct Board {
    name: String,
    port: Port,
    monitor: Monitor,
    requests: Requests,
}

/// The kind of a board's port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PortKind {
    /// A serial device.
    Serial,
    /// A connection by TCP.
    Tcp,
}

impl PortKind {
    /// Returns the kind of the port that a source names; `None` if it names no board.
    pub(crate) fn of(source: &OsStr) -> Option<Self> {
        if source.as_bytes().starts_with(b"tcp:") {
            return Some(Self::Tcp);
        }
        // Devices often have names such as /dev/serial/by-id/usb-…, which are links. One that is missing has only its name.
        let path = fs::canonicalize(source).unwrap_or_else(|_| PathBuf::from(source));
        let is_device = fs::metadata(&path).map_or(true, |metadata| metadata.file_type().is_char_device());
        let is_named = |start: &str| path.as_os_str().as_bytes().starts_with(start.as_bytes());
        (is_device && (is_named("/dev/tty") || is_named("/dev/serial/") || path.starts_with(Path::new("/dev/pts"))))
            .then_some(Self::Serial)
    }
}

impl Board {
    /// Opens the port of a board.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub(crate) fn open(name: &str, source: &OsStr, baud: Option<u32>) -> Result<Self, Error> {
        let mut wanted = OutputOptions::default();
        (wanted.features, wanted.motion) = (true, true);
        let monitor = Monitor::new(wanted);
        let mut requests = Requests::default();
        requests.extend(monitor.requests());
        let port = Port::open(source, baud)?;
        note(format_args!("{name}: a board at {}", port.name()));
        Ok(Self { name: name.to_owned(), port, monitor, requests })
    }

    /// Reads until the board or its connection ends, or until `ends` is set. Returns whether it did not fail.
    ///
    /// Orders are refused: what a service could change is in the board.
    pub(crate) fn run(mut self, publisher: &PublisherHandle, orders: &Receiver<Order>, ends: &AtomicBool) -> bool {
        let read = self.read(publisher, orders, ends);
        if let Err(error) = &read {
            note(format_args!("{}: {error}", self.name));
        }
        read.is_ok()
    }

    fn read(&mut self, publisher: &PublisherHandle, orders: &Receiver<Order>, ends: &AtomicBool) -> Result<(), Error> {
        let read = self.read_to_end(publisher, orders, ends);
        if !matches!(read, Ok(true)) {
            // The board did not say its end: what is known here takes its place.
            publisher.output(&self.monitor.finish(), SystemTime::now())?;
        }
        read.map(|_| ())
    }

    /// Returns whether the board has said its end.
    fn read_to_end(
        &mut self,
        publisher: &PublisherHandle,
        orders: &Receiver<Order>,
        ends: &AtomicBool,
    ) -> Result<bool, Error> {
        let mut room = [0; 4096];
        let mut waits = 0_u32;
        while !ends.load(Ordering::Relaxed) {
            // No more than wait now: whoever asks without end holds up nobody.
            for order in orders.try_iter().take(MOST_WAITING) {
                let why = "is a board, which finds its events itself; wstac board changes its settings";
                order.refuse(ErrorKind::Unsupported, why);
            }
            self.requests.extend(self.monitor.set_now(now()));
            if let Some(reading) = self.requests.send(&mut self.port) {
                self.say(reading.in_words(self.port.name()));
            }
            match self.port.read(&mut room)? {
                Got::Bytes(count) => {
                    waits = 0;
                    self.requests.extend(self.monitor.set_now(now()));
                    if !self.take(&room[..count], publisher)? {
                        return Ok(true);
                    }
                }
                Got::Nothing => {
                    waits = waits.saturating_add(1);
                    if waits == SILENT {
                        self.say(format_args!("no data for {} s", (WAIT * SILENT).as_secs()));
                    }
                }
                Got::Gone => {
                    // A device that is gone needs no note about its silence.
                    waits = SILENT;
                    self.say(format_args!("{} is gone; waiting for it", self.port.name()));
                }
                Got::Back => {
                    waits = 0;
                    self.say(format_args!("{} is back", self.port.name()));
                    self.requests.extend(self.monitor.requests());
                }
                Got::Ended if self.monitor.heard() => return Ok(false),
                Got::Ended => {
                    let expected = "has no messages, expected those of a board";
                    return Err(Error::new(ErrorKind::Data, self.port.name(), expected));
                }
            }
        }
        Ok(false)
    }

    /// Takes bytes of the board and publishes what follows. Returns whether the board goes on.
    fn take(&mut self, bytes: &[u8], publisher: &PublisherHandle) -> Result<bool, Error> {
        let Self { name, monitor, requests, .. } = self;
        let stamp = SystemTime::now();
        let goes_on = monitor.take(bytes, |report| match report {
            Report::Output(output) => publisher.output(&output, stamp),
            Report::Request(request) => {
                requests.push(request);
                Ok(())
            }
            Report::Note(text) => {
                note(format_args!("{name}: {text}"));
                Ok(())
            }
            Report::LostEvents(lost) => {
                publisher.counts().lost_events.fetch_add(lost, Ordering::Relaxed);
                note(format_args!("{name}: {} lost", counted(lost, "event")));
                Ok(())
            }
            // The clock of the board is used, and the rest of its state is for wstac monitor --status.
            Report::Telemetry(_) => Ok(()),
        });
        if let Output::End(end) = monitor.finish() {
            publisher.counts().frames.store(end.frames, Ordering::Relaxed);
            publisher.counts().lost.store(end.dropped, Ordering::Relaxed);
        }
        goes_on
    }

    fn say(&self, text: impl std::fmt::Display) {
        note(format_args!("{}: {text}", self.name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_told_by_its_port() {
        for (source, kind) in [
            ("tcp:127.0.0.1:5000", Some(PortKind::Tcp)),
            ("/dev/ttyACM99", Some(PortKind::Serial)),
            ("/dev/serial/by-id/usb-none", Some(PortKind::Serial)),
            ("/dev/video0", None),
            ("/dev/null", None),
            ("scene:Saw3@150", None),
            ("tty.y4m", None),
        ] {
            assert_eq!(PortKind::of(OsStr::new(source)), kind, "{source}");
        }
    }
}
