//! The driver's buffers, mapped into memory: the capture stream itself.

use std::fmt::Debug;
use std::io;
use std::ops::Deref;
use std::os::fd::AsRawFd;
use std::ptr::NonNull;
use std::time::Duration;

use v4l::v4l_sys as sys;

use super::device::{CAPTURE, DQBUF, Device, QBUF, QUERYBUF, REQBUFS, STREAMOFF, STREAMON, zeroed};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;

/// The number of buffers to ask for. A quarter of a second at 30 frames per second may pass before frames are lost.
const WANTED: u32 = 8;
/// The least number of buffers: one is with the program, one with the driver.
const LEAST: u32 = 2;
/// Calls in a row that may fail to give a buffer back before that is an error.
const FAILED_RETURNS: u32 = 30;

/// A buffer that the driver has filled. It belongs to the program until it is given back.
#[derive(Debug)]
#[must_use = "a buffer that is not given back is lost to the driver"]
pub(crate) struct Filled {
    pub(crate) index: usize,
    /// Bytes of it that the driver wrote.
    pub(crate) bytes: usize,
    /// The driver's frame counter.
    pub(crate) sequence: u32,
    /// The time when it was taken; `None` if the driver's clock is not the monotonic one.
    pub(crate) timestamp: Option<Duration>,
    /// Whether the driver says that its contents may be wrong.
    pub(crate) damaged: bool,
}

/// The result of a wait for a buffer.
#[derive(Debug)]
pub(crate) enum Wait {
    Filled(Filled),
    TimedOut,
    /// No buffer yet: a signal ended the wait, or another thread took the buffer.
    Interrupted,
}

/// A capture stream: a driver's, or a test's.
pub(crate) trait Stream: Debug + Send {
    fn device(&self) -> &Device;

    /// Returns whether the driver says that it takes times from the monotonic clock.
    fn has_times(&self) -> bool;

    /// Waits for the next buffer.
    ///
    /// # Errors
    /// The driver's error. EIO concerns one buffer only: the stream may go on.
    fn wait(&mut self, timeout: Duration) -> io::Result<Wait>;

    /// Returns the bytes that the driver wrote.
    fn bytes(&self, filled: &Filled) -> &[u8];

    /// Gives a buffer back. The next wait hands it to the driver.
    fn give_back(&mut self, filled: Filled);
}

/// The streaming buffers of a device. Dropping them stops the stream.
#[derive(Debug)]
pub(crate) struct Buffers {
    device: Device,
    maps: Vec<Map>,
    /// Buffers that the driver has not taken back yet.
    idle: Vec<usize>,
    failed_returns: u32,
    is_monotonic: bool,
}

impl Buffers {
    /// Maps the driver's buffers, hands them all over and starts the stream.
    ///
    /// # Errors
    /// The driver refuses. The error says what, in words.
    pub(crate) fn start(device: Device) -> Result<Self, Error> {
        let mut request: sys::v4l2_requestbuffers = zeroed();
        request.count = WANTED;
        request.type_ = CAPTURE;
        request.memory = sys::v4l2_memory_V4L2_MEMORY_MMAP;
        device.call(&REQBUFS, &mut request).map_err(|error| device.error("buffers are refused", error))?;
        // From here on, dropping the buffers gives back those that there are.
        let mut buffers = Self { device, maps: Vec::new(), idle: Vec::new(), failed_returns: 0, is_monotonic: false };
        for index in 0..request.count {
            let map = Map::of(&buffers.device, index);
            let (map, flags) = map.map_err(|error| buffers.device.error("a buffer cannot be mapped", error))?;
            buffers.maps.push(map);
            buffers.is_monotonic = is_monotonic(flags);
        }
        let device = &buffers.device;
        if request.count < LEAST {
            let message = format!("the driver has {}, expected at least {LEAST}", counted(request.count, "buffer"));
            return Err(Error::new(ErrorKind::Device, device.path.display(), message));
        }
        for index in 0..buffers.maps.len() {
            buffers.hand_over(index).map_err(|error| device.error("a buffer is refused", error))?;
        }
        let mut kind = CAPTURE as std::ffi::c_int;
        device.call(&STREAMON, &mut kind).map_err(|error| device.error("the stream cannot be started", error))?;
        Ok(buffers)
    }

    /// Hands idle buffers to the driver. One that it refuses is offered again next time.
    fn return_idle(&mut self) -> io::Result<()> {
        let mut refused = None;
        for index in std::mem::take(&mut self.idle) {
            if let Err(error) = self.hand_over(index) {
                self.idle.push(index);
                refused = Some(error);
            }
        }
        let Some(error) = refused else {
            self.failed_returns = 0;
            return Ok(());
        };
        self.failed_returns += 1;
        let gone = error.raw_os_error() == Some(libc::ENODEV);
        // If all buffers are refused, no frame will ever come.
        if gone || self.idle.len() == self.maps.len() || self.failed_returns >= FAILED_RETURNS {
            Err(error)
        } else {
            Ok(())
        }
    }

    fn hand_over(&self, index: usize) -> io::Result<()> {
        self.device.call(&QBUF, &mut described(index as u32))
    }
}

impl Stream for Buffers {
    fn device(&self) -> &Device {
        &self.device
    }

    fn has_times(&self) -> bool {
        self.is_monotonic
    }

    fn wait(&mut self, timeout: Duration) -> io::Result<Wait> {
        self.return_idle()?;
        let mut poll = libc::pollfd { fd: self.device.file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let timeout = timeout.as_millis().min(1000) as libc::c_int;
        // SAFETY: one pollfd, alive for the length of the call.
        match unsafe { libc::poll(&raw mut poll, 1, timeout) } {
            0 => return Ok(Wait::TimedOut),
            1.. => {}
            _ => {
                let error = io::Error::last_os_error();
                return if error.kind() == io::ErrorKind::Interrupted { Ok(Wait::Interrupted) } else { Err(error) };
            }
        }
        // The error flag is ignored, because taking the buffer says which error it is.
        let mut raw = described(0);
        match self.device.call(&DQBUF, &mut raw) {
            // Without a buffer, the error would come again at once, forever. The stream itself has failed.
            Err(error) if poll.revents & libc::POLLIN == 0 && is_of_the_stream(&error) => {
                return Err(io::Error::other("the driver says that the stream has failed"));
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(Wait::Interrupted),
            other => other?,
        }
        let index = raw.index as usize;
        let Some(map) = self.maps.get(index) else {
            return Err(io::Error::other(format!("the driver gave buffer {index} of {}", self.maps.len())));
        };
        Ok(Wait::Filled(Filled {
            index,
            bytes: (raw.bytesused as usize).min(map.len()),
            sequence: raw.sequence,
            timestamp: if is_monotonic(raw.flags) { duration(raw.timestamp) } else { None },
            damaged: raw.flags & sys::V4L2_BUF_FLAG_ERROR != 0,
        }))
    }

    fn bytes(&self, filled: &Filled) -> &[u8] {
        self.maps.get(filled.index).and_then(|map| map.get(..filled.bytes)).unwrap_or(&[])
    }

    fn give_back(&mut self, filled: Filled) {
        self.idle.push(filled.index);
    }
}

impl Drop for Buffers {
    fn drop(&mut self) {
        // A camera that is gone refuses every call, and there is nothing to stop.
        let mut kind = CAPTURE as std::ffi::c_int;
        let _ = self.device.call(&STREAMOFF, &mut kind);
        self.maps.clear();
        let mut request: sys::v4l2_requestbuffers = zeroed();
        request.type_ = CAPTURE;
        request.memory = sys::v4l2_memory_V4L2_MEMORY_MMAP;
        let _ = self.device.call(&REQBUFS, &mut request);
    }
}

/// Returns whether an error concerns the stream, if no buffer is ready.
fn is_of_the_stream(error: &io::Error) -> bool {
    matches!(error.raw_os_error(), Some(libc::EIO | libc::EAGAIN))
}

/// Creates a request about the buffer of this number.
fn described(index: u32) -> sys::v4l2_buffer {
    let mut raw: sys::v4l2_buffer = zeroed();
    raw.index = index;
    raw.type_ = CAPTURE;
    raw.memory = sys::v4l2_memory_V4L2_MEMORY_MMAP;
    raw
}

/// Returns whether a buffer's time is that of the monotonic clock, by its flags.
fn is_monotonic(flags: u32) -> bool {
    flags & sys::V4L2_BUF_FLAG_TIMESTAMP_MASK == sys::V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC
}

/// Returns a driver's time; `None` if it is negative or exactly 0, which means that it was not set.
fn duration(time: sys::timeval) -> Option<Duration> {
    let seconds = u64::try_from(time.tv_sec).ok()?;
    let microseconds = u32::try_from(time.tv_usec).ok().filter(|microseconds| *microseconds < 1_000_000)?;
    Some(Duration::new(seconds, microseconds * 1000)).filter(|time| !time.is_zero())
}

/// A buffer of the driver in this program's memory.
#[derive(Debug)]
struct Map {
    start: NonNull<u8>,
    length: usize,
}

impl Map {
    /// Maps a buffer, and returns its flags, too.
    fn of(device: &Device, index: u32) -> io::Result<(Self, u32)> {
        let mut raw = described(index);
        device.call(&QUERYBUF, &mut raw)?;
        let length = raw.length as usize;
        if length == 0 {
            return Err(io::Error::other("the driver's buffer is empty"));
        }
        // SAFETY: for memory-mapped buffers the driver fills in the offset; any bytes are a number.
        let offset = unsafe { raw.m.offset };
        // SAFETY: a new mapping at an address of the kernel's choice overlaps nothing.
        let start = unsafe {
            v4l::v4l2::mmap(
                std::ptr::null_mut(),
                length,
                libc::PROT_READ,
                libc::MAP_SHARED,
                device.file.as_raw_fd(),
                offset as libc::off_t,
            )
        }?;
        let start = NonNull::new(start.cast()).ok_or_else(|| io::Error::other("mapped at address 0"))?;
        Ok((Self { start, length }, raw.flags))
    }
}

impl Deref for Map {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        // SAFETY: mapped readable with this length until it is dropped. It is only looked into through a `Filled`,
        // which the driver does not write to until it is given back, and giving back needs `&mut Buffers`.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.length) }
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        // SAFETY: this mapping, unmapped once; no slice of it outlives `self`.
        let _ = unsafe { v4l::v4l2::munmap(self.start.as_ptr().cast(), self.length) };
    }
}

// SAFETY: the mapping is owned, and reading it is not tied to a thread.
unsafe impl Send for Map {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_make_no_sense_are_none() {
        let time = |tv_sec, tv_usec| duration(sys::timeval { tv_sec, tv_usec });
        assert_eq!(time(1, 500_000), Some(Duration::from_millis(1500)));
        for (seconds, microseconds) in [(0, 0), (-1, 0), (1, -1), (1, 1_000_000)] {
            assert_eq!(time(seconds, microseconds), None);
        }
    }
}
