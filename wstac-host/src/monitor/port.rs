//! The origin of a board's bytes: a serial device, a TCP connection, standard input, or a file.
//!
//! The serial port is set up here in a few lines, because one read with one timeout serves all these kinds of ports.
//! Serial port libraries have a reader of their own.

use std::ffi::OsStr;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::termios::{ControlModes, OptionalActions, isatty, tcgetattr, tcsetattr};
use wstac_core::wire::{DecodeError, Decoder, LONGEST, Message};

use crate::error::{Error, ErrorKind};
use crate::files::readable;
use crate::source::open::is_named_for_frames;

/// Bits per second of a serial device by default.
pub const DEFAULT_BAUD: u32 = 115_200;
/// Longest wait of [`Port::read`].
pub const WAIT: Duration = Duration::from_millis(200);
/// The number of waits without a byte after which a board counts as silent. It sends its state about once per second.
pub const SILENT: u32 = 15;
/// Longest wait for a TCP connection.
const CONNECT: Duration = Duration::from_secs(5);
/// The start of a name that stands for a board's bytes, and not for a recording.
const PREFIX: &[u8] = b"board:";
/// The bytes at the start of a file among which a board's have a whole message.
const SEARCHED: u64 = 32 * LONGEST as u64;
/// The starts of the names of serial devices.
const SERIAL: [&str; 4] = ["/dev/tty", "/dev/serial/", "/dev/pts/", "/dev/rfcomm"];

/// Returns the port that a source's name stands for; `None` if it is no board.
///
/// The name is `board:` and a port, `tcp:HOST:PORT`, a serial device, or a file of bytes that a board sent.
pub fn port_of(name: &OsStr) -> Option<&OsStr> {
    if let Some(port) = name.as_bytes().strip_prefix(PREFIX) {
        return Some(OsStr::from_bytes(port));
    }
    // Devices often have names such as /dev/serial/by-id/usb-…, which are links. One that is missing has only its name.
    let path = std::fs::canonicalize(name).unwrap_or_else(|_| name.into());
    let is_board = match std::fs::metadata(&path).map(|metadata| metadata.file_type()) {
        _ if name.as_bytes().starts_with(b"tcp:") => true,
        Ok(kind) if kind.is_file() => !is_named_for_frames(Path::new(name)) && has_board_bytes(&path),
        Ok(kind) if !kind.is_char_device() => false,
        _ => SERIAL.iter().any(|start| path.to_string_lossy().starts_with(start)),
    };
    is_board.then_some(name)
}

/// Returns whether a message of a board is at the start of a file, however the file is named.
pub fn has_board_bytes(path: &Path) -> bool {
    let mut start = Vec::new();
    let mut decoder = Decoder::<LONGEST>::new();
    // A message of another version is one, too: whoever reads the board reports it.
    let is_message = |byte| decoder.push::<Message>(byte).is_some_and(|read| read != Err(DecodeError::Damaged));
    path.is_file()
        && crate::files::open(path).and_then(|file| file.take(SEARCHED).read_to_end(&mut start)).is_ok()
        && start.into_iter().any(is_message)
}

/// An open port, or one that is waited for.
#[derive(Debug)]
pub struct Port {
    name: String,
    path: PathBuf,
    /// Bits per second of a serial device, which are set again after it was gone.
    baud: Option<u32>,
    /// The open file; `None` while a device is gone. Neither reads nor writes of it wait if it is writable.
    file: Option<File>,
    writable: bool,
    /// The rest of a message of which only a part could be sent.
    unsent: Vec<u8>,
}

/// The result of a read of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Got {
    /// The number of bytes that were read.
    Bytes(usize),
    /// No bytes in time.
    Nothing,
    /// The device is gone. It is waited for.
    Gone,
    /// The device is back.
    Back,
    /// The end of the stream.
    Ended,
}

/// The kinds of ports, for messages.
const EXPECTED: &str = "a serial device such as /dev/ttyACM0, tcp:HOST:PORT, - or a file of recorded bytes";

impl Port {
    /// Opens `/dev/tty…`, `tcp:HOST:PORT`, `-` for standard input, or a file of bytes that were recorded.
    ///
    /// # Errors
    /// The port cannot be opened, or bits per second are given for something other than a serial device.
    pub fn open(name: impl AsRef<OsStr>, baud: Option<u32>) -> Result<Self, Error> {
        let path = Path::new(name.as_ref());
        let name = &*path.to_string_lossy();
        let about = |error: io::Error| match error.kind() {
            io::ErrorKind::NotFound => {
                Error::new(ErrorKind::NotFound, name, format_args!("{error}, expected {EXPECTED}")).caused_by(error)
            }
            io::ErrorKind::PermissionDenied => {
                let hint = "serial devices are often for members of the group dialout alone";
                Error::new(ErrorKind::Io, name, format_args!("{error}: {hint}")).caused_by(error)
            }
            _ => Error::io(name, error),
        };
        let (file, serial, writable) = if name == "-" {
            (File::from(io::stdin().as_fd().try_clone_to_owned().map_err(about)?), false, false)
        } else if let Some(address) = name.strip_prefix("tcp:") {
            if !has_port(address) {
                let what = "is no address of a board, expected tcp:HOST:PORT, such as tcp:127.0.0.1:7000";
                return Err(Error::new(ErrorKind::Usage, name, what));
            }
            let stream = connect(address).map_err(about)?;
            // A peer that does not read would otherwise hold a write for ever.
            stream.set_nonblocking(true).map_err(about)?;
            (File::from(OwnedFd::from(stream)), false, true)
        } else {
            let kind = std::fs::metadata(path).map_err(about)?.file_type();
            if kind.is_dir() {
                return Err(Error::new(ErrorKind::Usage, name, format_args!("is a folder, expected {EXPECTED}")));
            }
            let device = if kind.is_char_device() { Some(open_device(path).map_err(about)?) } else { None };
            match device {
                Some(device) if isatty(&device) => (device, true, true),
                Some(_) | None => (crate::files::open(path).map_err(about)?, false, false),
            }
        };
        if !serial && baud.is_some() {
            return Err(Error::new(ErrorKind::Usage, name, "is no serial device; leave --baud out"));
        }
        let baud = serial.then_some(baud.unwrap_or(DEFAULT_BAUD));
        if let Some(baud) = baud {
            set_up(&file, baud).map_err(about)?;
        }
        Ok(Self { name: name.to_owned(), path: path.to_owned(), baud, file: Some(file), writable, unsent: Vec::new() })
    }

    /// Returns whether requests reach the board: a file or standard input takes none.
    pub fn takes_requests(&self) -> bool {
        self.writable
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads bytes that have arrived, and waits at most [`WAIT`].
    ///
    /// # Errors
    /// The port cannot be read. A serial device that cannot be read is waited for instead.
    pub fn read(&mut self, room: &mut [u8]) -> Result<Got, Error> {
        self.send_rest();
        let Some(file) = &mut self.file else { return Ok(self.reopen()) };
        let read = readable(file, WAIT.as_millis() as libc::c_int)
            .and_then(|ready| if ready { file.read(room).map(Some) } else { Ok(None) });
        match read {
            Ok(Some(0)) if self.baud.is_none() => Ok(Got::Ended),
            Ok(Some(0)) => Ok(self.gone()),
            Ok(Some(bytes)) => Ok(Got::Bytes(bytes)),
            Ok(None) => Ok(Got::Nothing),
            Err(error) => match error.kind() {
                io::ErrorKind::Interrupted | io::ErrorKind::WouldBlock => Ok(Got::Nothing),
                io::ErrorKind::ConnectionReset => Ok(Got::Ended),
                _ if self.baud.is_some() => Ok(self.gone()),
                _ => Err(Error::io(&self.name, error)),
            },
        }
    }

    /// Sends a message to the board if the port can send. It never waits.
    ///
    /// Returns false if the board does not read: then no byte of the message is sent, and the caller may try again. A
    /// message that was begun is finished by later calls, or by [`Port::read`].
    ///
    /// Bytes that do not arrive are not sent again. A board that needs them reports that it has started.
    pub fn send(&mut self, message: &[u8]) -> bool {
        if !self.send_rest() {
            return false;
        }
        let sent = self.write(message);
        let rest = message.get(sent..).unwrap_or_default();
        if sent == 0 && !rest.is_empty() {
            return false;
        }
        self.unsent.extend(rest);
        true
    }

    /// Sends the rest of the last message, and returns whether nothing of it is left.
    fn send_rest(&mut self) -> bool {
        let unsent = std::mem::take(&mut self.unsent);
        let sent = self.write(&unsent);
        self.unsent.extend(unsent.get(sent..).unwrap_or_default());
        self.unsent.is_empty()
    }

    /// Writes without waiting, and returns how many bytes are done with. Bytes for a port that cannot send are.
    fn write(&mut self, mut bytes: &[u8]) -> usize {
        let length = bytes.len();
        let Some(file) = self.file.as_mut().filter(|_| self.writable) else { return length };
        while !bytes.is_empty() {
            match file.write(bytes) {
                Ok(written) if written > 0 => bytes = bytes.get(written..).unwrap_or_default(),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Ok(_) => break,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                // The next read meets the same error, and says so.
                Err(_) => return length,
            }
        }
        length - bytes.len()
    }

    fn gone(&mut self) -> Got {
        self.file = None;
        self.unsent.clear();
        Got::Gone
    }

    fn reopen(&mut self) -> Got {
        let open = |baud| {
            let device = open_device(&self.path)?;
            set_up(&device, baud).map(|()| device)
        };
        if let Some(Ok(device)) = self.baud.map(open) {
            self.file = Some(device);
            return Got::Back;
        }
        std::thread::sleep(WAIT);
        Got::Nothing
    }
}

/// Returns whether an address is `HOST:PORT`. The host may be an IPv6 address in brackets.
fn has_port(address: &str) -> bool {
    address.rsplit_once(':').is_some_and(|(host, port)| {
        let is_whole = !host.contains(':') || (host.starts_with('[') && host.ends_with(']'));
        !host.is_empty() && is_whole && port.parse::<u16>().is_ok()
    })
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut result = Err(io::Error::new(io::ErrorKind::NotFound, "there is no such address"));
    for address in address.to_socket_addrs()? {
        result = TcpStream::connect_timeout(&address, CONNECT);
        if result.is_ok() {
            break;
        }
    }
    result
}

/// Opens a device without waiting for a carrier, and without becoming its terminal's process.
fn open_device(name: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).custom_flags(libc::O_NOCTTY | libc::O_NONBLOCK).open(name)
}

/// Sets a device to raw bytes: eight bits, no parity, one stop bit, no flow control.
fn set_up(device: &File, baud: u32) -> io::Result<()> {
    let mut settings = tcgetattr(device)?;
    settings.make_raw();
    settings.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    settings.control_modes &= !(ControlModes::CSTOPB | ControlModes::CRTSCTS);
    settings.set_speed(baud)?;
    Ok(tcsetattr(device, OptionalActions::Now, &settings)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_without_a_port_says_what_is_expected() {
        for name in
            ["tcp:", "tcp:127.0.0.1", "tcp:nowhere", "tcp:127.0.0.1:", "tcp::7000", "tcp:::1:7000", "tcp:[::1]:70000"]
        {
            let error = Port::open(name, None).unwrap_err();
            let expected =
                format!("{name}: is no address of a board, expected tcp:HOST:PORT, such as tcp:127.0.0.1:7000");
            assert_eq!(error.to_string(), expected);
        }
        // These are addresses, whether a board listens there or not.
        for address in ["127.0.0.1:7000", "localhost:7000", "[::1]:7000"] {
            assert!(has_port(address), "{address}");
        }
    }

    #[test]
    fn boards_are_told_from_other_sources() {
        let sent = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/board.bin");
        assert_eq!(port_of(OsStr::new(sent)), Some(OsStr::new(sent)));
        let port = |name: &'static str| port_of(OsStr::new(name)).and_then(OsStr::to_str);
        assert_eq!(port("board:a.bin"), Some("a.bin"));
        assert_eq!(port("tcp:localhost:7000"), Some("tcp:localhost:7000"));
        for name in ["a.y4m", "-", "scene:Saw3@150", "/dev/video0", "/dev/null", "/etc/passwd", "/nowhere"] {
            assert_eq!(port(name), None, "{name}");
        }
        for name in ["/dev/ttyACM99", "/dev/serial/by-id/usb-none"] {
            assert_eq!(port(name), Some(name));
        }
        // A name of frames says what a file is, and its content is not looked at.
        let folder = tempfile::tempdir().unwrap();
        for (name, is_board) in [("a.y4m", false), ("a.MCAP", false), ("a.mp4", false), ("a.bin", true), ("a", true)] {
            let path = folder.path().join(name);
            std::fs::copy(sent, &path).unwrap();
            assert_eq!(port_of(path.as_os_str()).is_some(), is_board, "{name}");
        }
    }
}
