//! The process of `rpicam-vid`: starts it, reads its three streams, and says why it ended.

use std::collections::VecDeque;
use std::io::{self, ErrorKind as IoErrorKind, PipeReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
use wstac_host::error::{Error, ErrorKind};

/// The names of the program, the newest first.
const PROGRAMS: [&str; 2] = ["rpicam-vid", "libcamera-vid"];
/// The file that the program writes metadata to: its standard input, which it does not read, is a pipe's other end.
pub(super) const METADATA: &str = "/dev/fd/0";
/// Most bytes that are read of metadata or of the log at once, and that are kept of an unfinished part.
const CHUNK: usize = 1 << 16;
/// Most bytes of a frame: 16,384 by 16,384 pixels.
const MOST_BYTES: usize = 3 << 27;
/// Most faults that wait to be reported.
const MOST_FAULTS: usize = 16;

/// The program, and what has come of it.
#[derive(Debug)]
pub(super) struct Program {
    subject: String,
    pub(super) name: &'static str,
    process: Child,
    /// Ends the process after the end of this program, however that comes. It ends before the process is waited for,
    /// whose number is another's then.
    guard: Option<Child>,
    /// Its standard output, the metadata and the log; `None` after the end of each.
    frames: Option<ChildStdout>,
    metadata: Option<PipeReader>,
    errors: Option<ChildStderr>,
    pub(super) came: Came,
}

/// The bytes that have come so far, and what they say.
#[derive(Debug, Default)]
pub(super) struct Came {
    /// The frame that comes, or the one that was taken last, and how many of its bytes have come. It is empty until the
    /// log says how long frames are.
    pub(super) frame: Vec<u8>,
    filled: usize,
    block: Vec<u8>,
    blocks: VecDeque<Metadata>,
    line: Vec<u8>,
    pub(super) log: Log,
}

/// The metadata of a frame, as far as the program states them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Metadata {
    /// The time when the first row began to be exposed, on the monotonic clock.
    pub(super) time: Option<Duration>,
    /// The time of a frame and its exposure, in µs.
    pub(super) period: Option<u32>,
    pub(super) exposure: Option<f64>,
    /// Gains and the position of the lens, in hundredths.
    pub(super) gain: Option<f64>,
    pub(super) red: Option<f64>,
    pub(super) blue: Option<f64>,
    pub(super) lens: Option<f64>,
}

/// The facts that the log has told.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Log {
    /// The size of frames, and their color space.
    pub(super) size: Option<(u32, u32)>,
    pub(super) color: Option<String>,
    /// The sensor's name, such as `imx219`, and the place where it is connected.
    pub(super) sensor: Option<String>,
    pub(super) place: Option<String>,
    /// The size of the sensor's own frames.
    pub(super) mode: Option<(u32, u32)>,
    pub(super) frame_bytes: usize,
    /// The first error, the last one, and those that wait to be reported.
    first: Option<String>,
    last: Option<String>,
    /// The last line that says none of this: what a program says that does not start.
    other: Option<String>,
    faults: VecDeque<String>,
}

impl Program {
    pub(super) fn start(subject: &str, arguments: &str) -> Result<Self, Error> {
        for name in PROGRAMS {
            let failed = |error: io::Error| {
                Error::new(ErrorKind::Io, subject, format_args!("{name} does not start: {error}")).caused_by(error)
            };
            let (metadata, writer) = io::pipe().map_err(failed)?;
            let mut command = Command::new(name);
            command.args(arguments.split(' ')).stdin(writer).stdout(Stdio::piped()).stderr(Stdio::piped());
            // The log is read, and the program sets its level.
            command.env_remove("LIBCAMERA_LOG_LEVELS").env_remove("LIBCAMERA_LOG_FILE");
            command.env("LIBCAMERA_LOG_NO_COLOR", "1");
            // A signal to this program must not end the camera before this program has read what it wants.
            let mut process = match command.process_group(0).spawn() {
                Err(error) if error.kind() == IoErrorKind::NotFound => continue,
                other => other.map_err(failed)?,
            };
            let (frames, errors) = (process.stdout.take(), process.stderr.take());
            let (subject, metadata, came) = (subject.to_owned(), Some(metadata), Came::default());
            let mut started = Self { subject, name, process, guard: None, frames, metadata, errors, came };
            started.guard = Some(guard(&started.process).map_err(|error| Error::io("sh", error))?);
            return Ok(started);
        }
        let message = "a Raspberry Pi's camera is read by rpicam-vid, which is not installed; \
                       help: sudo apt install rpicam-apps";
        Err(Error::new(ErrorKind::Unsupported, subject, message))
    }

    /// Returns whether a whole frame has come, with its metadata.
    pub(super) fn has_frame(&self) -> bool {
        !self.came.frame.is_empty() && self.came.filled == self.came.frame.len() && !self.came.blocks.is_empty()
    }

    /// Returns the metadata of the frame that has come.
    pub(super) fn metadata(&self) -> Metadata {
        self.came.blocks.front().copied().unwrap_or_default()
    }

    /// Takes the frame that has come. Its bytes stay until the next one is read.
    pub(super) fn take(&mut self) -> Metadata {
        self.came.filled = 0;
        self.came.blocks.pop_front().unwrap_or_default()
    }

    /// Takes the errors that the program has reported.
    pub(super) fn faults(&mut self) -> impl Iterator<Item = String> {
        let name = self.name;
        std::mem::take(&mut self.came.log.faults).into_iter().map(move |line| format!("{name} reports: {line}"))
    }

    /// Returns whether the frame after the one that has come begins to come.
    pub(super) fn has_begun_next(&self) -> bool {
        let Some(frames) = &self.frames else { return false };
        let mut descriptor = [PollFd::new(frames, PollFlags::IN)];
        poll(&mut descriptor, Some(&Timespec::default())).is_ok() && descriptor[0].revents().contains(PollFlags::IN)
    }

    /// Reads what there is of all streams, and waits for it if there is none. Returns false if it waited in vain.
    ///
    /// # Errors
    /// The program has ended.
    pub(super) fn read(&mut self, wait: Duration) -> Result<bool, Error> {
        let wait = Timespec::try_from(wait).unwrap_or_default();
        // The log comes first: it says how long the frame is.
        let wants_frame = self.came.filled < self.came.frame.len();
        let frames = self.frames.as_ref().filter(|_| wants_frame).map(|frames| PollFd::new(frames, PollFlags::IN));
        let metadata = self.metadata.as_ref().map(|metadata| PollFd::new(metadata, PollFlags::IN));
        let errors = self.errors.as_ref().map(|errors| PollFd::new(errors, PollFlags::IN));
        let mut descriptors: Vec<_> = [&errors, &metadata, &frames].into_iter().flatten().cloned().collect();
        if descriptors.is_empty() {
            return Err(self.ended());
        }
        match poll(&mut descriptors, Some(&wait)) {
            Err(rustix::io::Errno::INTR) => return Ok(true),
            Err(error) => return Err(Error::io(&self.subject, error.into())),
            // A process that it started may hold its streams open.
            Ok(0) if self.has_ended() => return Err(self.ended()),
            Ok(0) => return Ok(false),
            Ok(_) => {}
        }
        let mut ready = descriptors.iter().map(|descriptor| !descriptor.revents().is_empty());
        let ready = [errors.is_some(), metadata.is_some(), frames.is_some()]
            .map(|stream| stream && ready.next().unwrap_or_default());
        drop(descriptors);
        if ready[0] && self.read_log()? {
            self.errors = None;
        }
        if ready[1] && self.read_metadata()? {
            self.metadata = None;
        }
        if ready[2] && self.read_frame()? {
            self.frames = None;
        }
        Ok(true)
    }

    /// Returns whether the log has ended, as those below do.
    fn read_log(&mut self) -> Result<bool, Error> {
        let ended = append(&mut self.errors, &mut self.came.line).map_err(|error| Error::io(&self.subject, error))?;
        while let Some(end) = self.came.line.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.came.line.drain(..=end).collect();
            self.came.log.note(&String::from_utf8_lossy(&line));
        }
        if self.came.frame.is_empty() && (1..=MOST_BYTES).contains(&self.came.log.frame_bytes) {
            self.came.frame = vec![0; self.came.log.frame_bytes];
        }
        Ok(ended)
    }

    fn read_metadata(&mut self) -> Result<bool, Error> {
        let ended = append(&mut self.metadata, &mut self.came.block).map_err(|why| Error::io(&self.subject, why))?;
        while let Some(end) = self.came.block.windows(2).position(|bytes| bytes == b"\n\n") {
            let block: Vec<u8> = self.came.block.drain(..end + 2).collect();
            self.came.blocks.push_back(Metadata::parse(&String::from_utf8_lossy(&block)));
        }
        Ok(ended)
    }

    fn read_frame(&mut self) -> Result<bool, Error> {
        let Some(frames) = &mut self.frames else { return Ok(true) };
        let count = retried(|| frames.read(&mut self.came.frame[self.came.filled..]));
        let count = count.map_err(|error| Error::io(&self.subject, error))?;
        self.came.filled += count;
        Ok(count == 0)
    }

    /// Returns whether the process has ended. It keeps its number.
    fn has_ended(&self) -> bool {
        let how = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(Pid::from_child(&self.process)), how).is_ok_and(|status| status.is_some())
    }

    fn end_guard(&mut self) {
        if let Some(mut guard) = self.guard.take() {
            let _ = guard.kill().and_then(|()| guard.wait());
        }
    }

    /// Creates an error that says how the program ended, and why.
    fn ended(&mut self) -> Error {
        self.end_guard();
        let status = self.process.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
        let rest = std::mem::take(&mut self.came.line);
        self.came.log.note(&String::from_utf8_lossy(&rest));
        let (first, last) = (self.came.log.first.take(), self.came.log.last.take());
        let last = last.filter(|last| first.as_ref() != Some(last));
        let first = first.or_else(|| self.came.log.other.take());
        let why: Vec<_> = first.into_iter().chain(last).collect();
        let why = if why.is_empty() { "it reports no error".to_owned() } else { why.join("; ") };
        Error::new(ErrorKind::Device, &self.subject, format_args!("{} has ended ({status}): {why}", self.name))
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.end_guard();
        // If it was waited for, this says so, which changes nothing.
        let _ = self.process.kill().and_then(|()| self.process.wait());
    }
}

/// Starts a shell that waits until this program has ended, which closes its standard input, and then ends the process:
/// one that writes nothing would not notice.
fn guard(process: &Child) -> io::Result<Child> {
    let mut command = Command::new("sh");
    command.args(["-c", "read -r _; kill -KILL \"$0\"", &process.id().to_string()]).stdin(Stdio::piped());
    command.stdout(Stdio::null()).stderr(Stdio::null()).process_group(0).spawn()
}

/// Reads once and appends, and drops the start of what has no end. Returns whether the stream has ended.
fn append(stream: &mut Option<impl Read>, bytes: &mut Vec<u8>) -> io::Result<bool> {
    let Some(stream) = stream else { return Ok(true) };
    if bytes.len() >= CHUNK {
        bytes.clear();
    }
    let start = bytes.len();
    bytes.resize(start + CHUNK, 0);
    let count = retried(|| stream.read(&mut bytes[start..]));
    bytes.truncate(start + *count.as_ref().unwrap_or(&0));
    Ok(count? == 0)
}

fn retried(mut read: impl FnMut() -> io::Result<usize>) -> io::Result<usize> {
    loop {
        match read() {
            Err(error) if error.kind() == IoErrorKind::Interrupted => {}
            other => return other,
        }
    }
}

impl Metadata {
    /// Reads a block of `Name=value` lines: `ColourGains=[ 1.500000, 1.250000 ]`.
    fn parse(block: &str) -> Self {
        let value = |name: &str| block.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        let number = |name| value(name)?.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let hundredths = |name| number(name).map(|number| 100.0 * number);
        let gains: Vec<f64> = value("ColourGains")
            .map(|list| {
                list.trim_matches(['[', ' ', ']']).split(',').filter_map(|gain| gain.trim().parse().ok()).collect()
            })
            .unwrap_or_default();
        Self {
            time: value("SensorTimestamp").and_then(|time| time.trim().parse().ok()).map(Duration::from_nanos),
            period: number("FrameDuration").map(|period| period as u32),
            exposure: number("ExposureTime"),
            gain: hundredths("AnalogueGain"),
            red: gains.first().map(|gain| 100.0 * gain),
            blue: gains.get(1).map(|gain| 100.0 * gain),
            lens: hundredths("LensPosition"),
        }
    }
}

/// Reads the size of `1640x1232-SBGGR10_1X10`.
fn size_of(format: &str) -> Option<(u32, u32)> {
    let (width, height) = format.split_once('-')?.0.split_once('x')?;
    Some((width.parse().ok()?, height.parse().ok()?))
}

impl Log {
    /// Notes a line of the program or of libcamera.
    fn note(&mut self, line: &str) {
        let line = line.trim();
        let after = |mark: &str| line.split_once(mark).map(|(_, rest)| rest.trim());
        if let Some(stream) = after("configuring streams: (0) ").and_then(|rest| rest.split(' ').next()) {
            // 640x480-YUV420/sYCC; older versions state no color space.
            let format = stream.split_once('-').unwrap_or_default().1;
            self.size = size_of(stream);
            self.color = match format.split_once('/') {
                Some(("YUV420", color)) => Some(color.to_owned()),
                _ if format == "YUV420" => None,
                _ => Some(format.to_owned()),
            };
        } else if let Some((place, mode)) =
            after("Sensor: ").and_then(|rest| rest.split_once(" - Selected sensor format: "))
        {
            self.mode = size_of(mode);
            let name = place.rsplit('/').next().unwrap_or(place);
            self.sensor = Some(name.split('@').next().unwrap_or(name).to_owned());
            self.place = Some(place.to_owned());
        } else if let Some((_, bytes)) = after("FileOutput: output buffer ").and_then(|rest| rest.split_once(" size "))
        {
            if self.frame_bytes == 0 {
                self.frame_bytes = bytes.parse().unwrap_or_default();
            }
        } else if let Some(error) = line.find("ERROR").map(|start| &line[start..]) {
            // Before it are the time and the thread, which differ from run to run.
            let error = error.trim_start_matches("ERROR: *** ").trim_end_matches(" ***").to_owned();
            if self.last.as_ref() != Some(&error) && self.faults.len() < MOST_FAULTS {
                self.faults.push_back(error.clone());
            }
            self.first.get_or_insert_with(|| error.clone());
            self.last = Some(error);
        } else if !line.is_empty() && ![" INFO ", " WARN ", "Viewfinder "].iter().any(|mark| line.contains(mark)) {
            self.other = Some(line.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_states_what_no_option_fixes() {
        let mut log = Log::default();
        for line in [
            "[0:40:18.591] [2071]  INFO Camera camera.cpp:1205 configuring streams: (0) 1296x972-YUV420/sYCC (1) \
             1296x972-GBRG_PISP_COMP1/RAW\n",
            "[0:40:18.592] [2074]  INFO RPI pisp.cpp:1485 Sensor: /base/axi/pcie@120000/rp1/i2c@88000/ov5647@36 - Selected \
             sensor format: 1296x972-SGBRG10_1X10/RAW - Selected CFE format: 1296x972-GBP1/RAW\n",
            "FileOutput: output buffer 0x7fff1c8000 size 2052864",
            "FileOutput: output buffer 0x7fff1c8000 size 12",
            "[0:40:19.102] [2074] ERROR RPI pipeline_base.cpp:1367 Camera frontend has timed out!",
            "ERROR: *** no cameras available ***",
        ] {
            log.note(line);
        }
        assert_eq!((log.size, log.color.as_deref()), (Some((1296, 972)), Some("sYCC")));
        assert_eq!((log.sensor.as_deref(), log.mode), (Some("ov5647"), Some((1296, 972))));
        assert_eq!(log.frame_bytes, 2_052_864);
        assert_eq!(log.first.as_deref(), Some("ERROR RPI pipeline_base.cpp:1367 Camera frontend has timed out!"));
        assert_eq!(log.last.as_deref(), Some("no cameras available"));
        let mut log = Log::default();
        log.note("INFO Camera camera.cpp:1028 configuring streams: (0) 640x480-YUV420 (1) 1640x1232-SBGGR10_CSI2P");
        assert_eq!((log.size, log.color), (Some((640, 480)), None));
    }

    #[test]
    fn metadata_are_read_as_far_as_they_are_stated() {
        let block = "SensorTimestamp=2418611384000\nExposureTime=19985\nColourGains=[ 1.500000, 1.250000 ]\n\
                     AnalogueGain=1.000000\nFrameDuration=33333\nScalerCrop=(0, 0)/3280x2464\n\n";
        let metadata = Metadata::parse(block);
        assert_eq!(metadata.time, Some(Duration::from_micros(2_418_611_384)));
        assert_eq!((metadata.period, metadata.exposure, metadata.gain), (Some(33_333), Some(19_985.0), Some(100.0)));
        assert_eq!((metadata.red, metadata.blue, metadata.lens), (Some(150.0), Some(125.0), None));
        for broken in ["SensorTimestamp=-1\nExposureTime=NaN\nColourGains=[ ]\n\n", "\n\n", "=\n\n"] {
            assert_eq!(Metadata::parse(broken), Metadata::default(), "{broken:?}");
        }
    }
}
