//! The properties of a video: what `ffprobe` states, and what follows from it.

use std::collections::BTreeSet;
use std::path::Path;

use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::RowOrder;

use super::ffmpeg::{ffmpeg, not_started, without_context};
use crate::error::{Error, ErrorKind};
use crate::source::{StreamInfo, replaced_rate, spacing};

/// The pixel formats that are decoded as they are.
const KEPT: [&str; 10] =
    ["gray", "gray10le", "gray12le", "gray16le", "yuv420p", "yuv422p", "yuv444p", "yuvj420p", "yuvj422p", "yuvj444p"];
/// The starts of the names of pixel formats that have red, green and blue, and of those that have gray alone.
const RGB: [&str; 13] =
    ["0bgr", "0rgb", "abgr", "argb", "bayer", "bgr", "gbr", "pal8", "rgb", "rgba", "x2bgr", "x2rgb", "xyz"];
const GRAY: [&str; 4] = ["gray", "mono", "ya16", "ya8"];
/// The formats of ffmpeg that are streams without times: ffmpeg makes up 25 frames per second, unless the stream states
/// another rate.
const WITHOUT_TIMES: [&str; 9] = ["cavsvideo", "dirac", "h263", "h264", "hevc", "m4v", "mjpeg", "obu", "vc1"];
/// A format of which it makes up as much, whatever is asked for.
const PARTS: &str = "mpjpeg";
const MADE_UP: (u32, u32) = (25, 1);
/// Another rate for ffmpeg to make up. A rate that is 25 with it, too, is stated by the stream.
const OTHER_MADE_UP: (u32, u32) = (23, 1);
/// The error of ffmpeg about a format that is not to be read.
const NOT_LISTED: &str = "Format not on whitelist";
/// Frames that show how far frames are apart.
const PROBED: &str = "%+#150";
/// A rate that a file states is that of its time stamps if it differs by at most this part.
const SAME_RATE: f64 = 0.003;

/// The properties of a video that `ffprobe` states.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Stated {
    pixels: String,
    range: Option<QuantizationRange>,
    matrix: Option<YcbcrMatrix>,
    /// The name of a matrix that is not read.
    other_matrix: Option<String>,
    pub(super) rate: Option<FrameRate>,
    /// The usual time between frames in milliseconds, by their time stamps, and whether the rate follows from it alone.
    pub(super) step: Option<f64>,
    is_by_times: bool,
    /// Whether the frames are to be turned or mirrored, which ffmpeg does, and where their rows then follow each other.
    pub(super) is_turned: bool,
    row_order: RowOrder,
    /// Whether ffmpeg may have made the rate up.
    is_made_up: bool,
    pub(super) codec: String,
    size: Option<FrameSize>,
    /// The number of its video tracks.
    tracks: usize,
}

impl Stated {
    /// Reads what `ffprobe` prints: a line per entry, as `key=value`.
    fn parse(text: &str) -> Self {
        Self::parse_with(text, MADE_UP)
    }

    /// Reads it where ffmpeg makes up this rate for a stream without times.
    fn parse_with(text: &str, made_up: (u32, u32)) -> Self {
        let value = |key: &str| {
            text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('=')).unwrap_or_default().trim()
        };
        let pixels = value("pix_fmt").to_owned();
        let range = match value("color_range") {
            "pc" | "full" | "jpeg" => Some(QuantizationRange::Full),
            "tv" | "limited" | "mpeg" => Some(QuantizationRange::Limited),
            _ if pixels.starts_with("yuvj") => Some(QuantizationRange::Full),
            _ => None,
        };
        let matrix = match value("color_space") {
            "bt709" => Some(YcbcrMatrix::Bt709),
            "bt470bg" | "smpte170m" | "fcc" => Some(YcbcrMatrix::Bt601),
            _ => None,
        };
        let is_stated = |name: &&str| !matches!(*name, "" | "unknown" | "unspecified" | "reserved" | "gbr" | "N/A");
        let other_matrix = Some(value("color_space")).filter(|name| matrix.is_none() && is_stated(name));
        let other_matrix = other_matrix.map(str::to_owned);
        let row_order = row_order(text).unwrap_or_default();
        let is_rotated = value("rotation").parse::<f64>().is_ok_and(|degrees| degrees != 0.0);
        let is_turned = is_rotated || row_order != RowOrder::Down;
        let rate_of = |key| {
            let (numerator, denominator) = value(key).split_once('/')?;
            FrameRate::new(numerator.parse().ok()?, denominator.parse().ok()?).ok()
        };
        let (mean, base) = (rate_of("avg_frame_rate"), rate_of("r_frame_rate"));
        let codec = value("codec_name").to_owned();
        let side = |key| value(key).parse().unwrap_or_default();
        let size = FrameSize::new(side("width"), side("height")).ok();
        let known = Self { pixels, range, matrix, other_matrix, is_turned, row_order, codec, size, ..Self::default() };
        let format = value("format_name");
        if format.ends_with("_pipe") || format == PARTS || WITHOUT_TIMES.contains(&format) {
            let rate = mean.or(base).filter(|rate| <(u32, u32)>::from(*rate) != made_up);
            let is_made_up = rate.is_none() && WITHOUT_TIMES.contains(&format);
            return Self { rate, is_made_up, ..known };
        }
        let times_of = |key| {
            let times = text.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('='));
            times.filter_map(|time| Some(1000.0 * time.trim().parse::<f64>().ok()?)).collect::<Vec<_>>()
        };
        // ffmpeg decodes only some of some cameras' pictures.
        let times = times_of(if known.codec == "mjpeg" { "pts_time" } else { "best_effort_timestamp_time" });
        let step = spacing::step(&times);
        // The mean of a file whose frames come unevenly is the rate of none of them, and ffmpeg guesses the other.
        let is_same =
            |rate: &FrameRate| step.is_none_or(|step| (rate.per_second() * step / 1000.0 - 1.0).abs() < SAME_RATE);
        let by_header = mean.filter(is_same).or(base.filter(is_same));
        let by_times = step.and_then(spacing::rate_of);
        let is_by_times = by_header.is_none() && by_times.is_some();
        // Time stamps that never grow say nothing of the frames' places, so that all of them come unevenly.
        let are_equal = step.is_none() && times.len() > 1;
        let step = step.or_else(|| by_header.filter(|_| are_equal).map(|rate| 1000.0 / rate.per_second()));
        let rate = by_header.or(by_times);
        Self { rate, step, is_by_times, ..known }
    }

    /// Returns the size of JPEG pictures of Y, Cb and Cr that have times and are not to be turned.
    pub(super) fn size_of_jpegs(&self) -> Option<FrameSize> {
        let is_plain =
            self.codec == "mjpeg" && self.pixels.starts_with("yuv") && !self.is_turned && self.step.is_some();
        self.size.filter(|_| is_plain)
    }

    /// Returns the filter that makes pixels that are read, and their format.
    ///
    /// ffmpeg makes limited range of anything unless its options say otherwise.
    pub(super) fn conversion(&self) -> (String, &'static str) {
        let pixels = self.pixels.as_str();
        let starts = |names: &[&str]| names.iter().any(|name| pixels.starts_with(name));
        let is_deep = ["10", "12", "14", "16", "48", "64", "9", "f32"].iter().any(|bits| pixels.contains(bits));
        if let Some(kept) = KEPT.iter().find(|kept| **kept == pixels) {
            return (String::new(), kept);
        }
        match (starts(&RGB), starts(&GRAY), is_deep) {
            (true, _, false) => ("format=gbrp,extractplanes=g,".into(), "gray"),
            (true, _, true) => ("format=gbrp16le,extractplanes=g,".into(), "gray16le"),
            (_, true, false) => (String::new(), "gray"),
            (_, true, true) => (String::new(), "gray16le"),
            _ => {
                let range = if self.range == Some(QuantizationRange::Full) { "full" } else { "limited" };
                (format!("scale=in_range={range}:out_range={range},"), "yuv444p")
            }
        }
    }

    pub(super) fn describe(&self, subject: &str, frames: &StreamInfo, given: Option<FrameRate>) -> StreamInfo {
        let color = YcbcrEncoding {
            matrix: self.matrix.unwrap_or(frames.color.matrix),
            range: self.range.unwrap_or(frames.color.range),
        };
        let ((width, height), rate) = (frames.size.into(), replaced_rate::readable(frames.rate));
        let mut about = format!("{subject}: video, {width}x{height} {}, {rate} frames per second", self.pixels);
        about += &replaced_rate::remark(self.rate, given);
        if self.rate.is_none() && given.is_none() {
            about += " (assumed: state another with --fps)";
        } else if self.is_by_times && given.is_none() {
            about += " by its time stamps";
        }
        let hundredths = 100.0 / frames.rate.per_second();
        if self.codec == "gif" && (hundredths - hundredths.round()).abs() > 0.01 {
            about += "; a GIF's times are hundredths of a second, so these frames come unevenly: ffmpeg -i FILE -vf \
                      fps=RATE -c:v ffv1 NEW.mkv makes them even";
        }
        if frames.format.is_ycbcr() && self.range.is_none() {
            about += "; no range is stated: limited, unless --range says full";
        }
        match &self.other_matrix {
            _ if !frames.format.is_ycbcr() || self.matrix.is_some() => {}
            // A file's words reach a terminal escaped.
            Some(other) => {
                about.extend(["; its matrix is ", other, ": read as bt601, unless --matrix says bt709"]);
            }
            None => about += "; no matrix is stated: bt601, unless --matrix says bt709",
        }
        if self.tracks > 1 {
            let another = "another: ffmpeg -i FILE -map 0:V:1 -c copy NEW.mkv";
            about.extend(["; the first of ", &self.tracks.to_string(), " video tracks (", another, ")"]);
        }
        let mut info = StreamInfo::new(about, frames.size, frames.format, frames.rate);
        (info.color, info.bytes_per_row, info.row_order) = (color, frames.bytes_per_row, self.row_order);
        info
    }
}

/// Returns where the stored rows follow each other, by the matrix that `ffprobe` prints: its second line is their step
/// to the right and down.
fn row_order(text: &str) -> Option<RowOrder> {
    let line = text.lines().find_map(|line| line.trim().strip_prefix("00000001:"))?;
    let mut steps = line.split_ascii_whitespace().map(str::parse::<i64>);
    let (right, down) = (steps.next()?.ok()?, steps.next()?.ok()?);
    Some(match (right.abs() > down.abs(), right > 0, down < 0) {
        (true, true, _) => RowOrder::Right,
        (true, false, _) => RowOrder::Left,
        (false, _, true) => RowOrder::Up,
        (false, _, false) => RowOrder::Down,
    })
}

/// Asks `ffprobe` for the properties of a video.
pub(super) fn probe(subject: &str, path: &Path) -> Result<Stated, Error> {
    let entries = "format=format_name,nb_streams:stream=codec_name,width,height,pix_fmt,color_range,color_space,avg_frame_rate,\
                   r_frame_rate:stream_side_data=rotation,displaymatrix:packet=pts_time:frame=best_effort_timestamp_time";
    let ask = |options: &[&str]| {
        let mut command = ffmpeg("ffprobe", path);
        command.args(["-select_streams", "V:0", "-read_intervals", PROBED, "-show_entries", entries]);
        command.args(["-of", "default=noprint_wrappers=1"]).args(options);
        command.output().map_err(|error| not_started(subject, error))
    };
    let done = ask(&[])?;
    let mut stated = Stated::parse(&String::from_utf8_lossy(&done.stdout));
    if stated.is_made_up {
        let again = ask(&["-framerate", "23"])?;
        stated.rate = Stated::parse_with(&String::from_utf8_lossy(&again.stdout), OTHER_MADE_UP).rate;
    }
    if done.status.success() && !stated.pixels.is_empty() {
        if !String::from_utf8_lossy(&done.stdout).contains("nb_streams=1\n") {
            let mut command = ffmpeg("ffprobe", path);
            command.args(["-select_streams", "V", "-show_entries", "stream=index", "-of", "csv=p=0"]);
            let listed = command.output().map_err(|error| not_started(subject, error))?.stdout;
            // Programs of a transport stream list their tracks once more.
            stated.tracks = String::from_utf8_lossy(&listed).lines().collect::<BTreeSet<_>>().len();
        }
        return Ok(stated);
    }
    let reported = String::from_utf8_lossy(&done.stderr);
    // The last line only says that the data are invalid.
    let first = reported.lines().map(without_context).find(|line| !line.is_empty());
    // ffprobe begins with the name of the file.
    let name = format!("file:{subject}: ");
    let why = match first {
        None => "has no picture, expected a video",
        Some(line) if line.starts_with(NOT_LISTED) => {
            "is a list of other files, or none of the formats of videos; expected a video"
        }
        Some(line) => &format!("ffmpeg cannot read it: {}, so no frame can be read", line.trim_start_matches(&name)),
    };
    Err(Error::new(ErrorKind::Format, subject, why))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::spacing::{Positions, Spacing};
    use crate::source::{FaultKind, SourceEvent};

    #[test]
    fn what_a_video_states_is_read() {
        let text = "pix_fmt=yuv420p\ncolor_range=tv\ncolor_space=bt709\nr_frame_rate=30/1\navg_frame_rate=30/1\n";
        let stated = Stated::parse(text);
        assert_eq!(stated.range, Some(QuantizationRange::Limited));
        assert_eq!(stated.matrix, Some(YcbcrMatrix::Bt709));
        assert_eq!(stated.rate, FrameRate::new(30, 1).ok());
        // A camera's Motion JPEG, of which the container states nothing.
        let text = "pix_fmt=yuvj422p\ncolor_range=unknown\ncolor_space=unknown\nr_frame_rate=30/1\navg_frame_rate=29970/1000\n";
        let stated = Stated::parse(text);
        assert_eq!((stated.range, stated.matrix), (Some(QuantizationRange::Full), None));
        // A quarter clockwise, upside down, mirrored from top to bottom, and as it is.
        for (rows, order) in [
            ("-65536 0", RowOrder::Left),
            ("0 -65536", RowOrder::Up),
            ("65536 0", RowOrder::Right),
            ("0 65536", RowOrder::Down),
        ] {
            let stated = Stated::parse(&format!("displaymatrix=\n00000000: 0 1 0\n00000001:  {rows}  0\n\n"));
            assert_eq!((stated.row_order, stated.is_turned), (order, order != RowOrder::Down), "{rows}");
        }
        let other = |name: &str| Stated::parse(&format!("color_space={name}\n")).other_matrix;
        assert_eq!([other("bt2020nc").as_deref(), other("bt709").as_deref()], [Some("bt2020nc"), None]);
        assert_eq!((other("unknown"), other("gbr")), (None, None));
        assert!(Stated::parse("rotation=-90\n").is_turned && !Stated::parse("rotation=0\n").is_turned);
        assert_eq!(stated.rate, FrameRate::new(29_970, 1000).ok());
        assert_eq!(Stated::parse("avg_frame_rate=0/0\nrubbish"), Stated::default());
    }

    #[test]
    fn the_rate_is_that_of_the_time_stamps() {
        let times = |step: f64| {
            (0..20).map(move |frame| format!("best_effort_timestamp_time={:.3}\n", f64::from(frame) * step))
        };
        let rate_of = |format: &str, mean: &str, base: &str, step: f64| {
            let head = format!("format_name={format}\navg_frame_rate={mean}\nr_frame_rate={base}\n");
            let stated = Stated::parse(&(times(step).collect::<String>() + &head));
            (stated.rate.map(<(u32, u32)>::from), stated.is_by_times)
        };
        assert_eq!(rate_of("mov,mp4", "30/1", "30/1", 1.0 / 30.0), (Some((30, 1)), false));
        assert_eq!(rate_of("mov,mp4", "26/1", "30/1", 1.0 / 30.0), (Some((30, 1)), false));
        assert_eq!(rate_of("matroska,webm", "0/0", "1000/1", 0.04), (Some((25, 1)), true));
        assert_eq!(rate_of("matroska,webm", "0/0", "1000/1", 0.035), (Some((1_000_000, 35_000)), true));
        assert_eq!(rate_of("avi", "25/1", "25/1", 0.04), (Some((25, 1)), false));
        let packets = "codec_name=mjpeg\npts_time=0.04\npts_time=0.08\npts_time=0.12\n".to_owned();
        assert_eq!(Stated::parse(&(packets + &times(0.4).collect::<String>())).rate, FrameRate::new(25, 1).ok());
        // ffmpeg makes times up.
        assert_eq!(rate_of("jpeg_pipe", "25/1", "25/1", 0.04), (None, false));
        assert_eq!(rate_of("h264", "25/1", "25/1", 0.04), (None, false));
        assert_eq!(rate_of("mpjpeg", "25/1", "25/1", 0.04), (None, false));
        assert_eq!(rate_of("h264", "30/1", "30/1", 0.04), (Some((30, 1)), false));
    }

    #[test]
    fn time_stamps_that_do_not_grow_are_uneven() {
        let head = "format_name=mov,mp4\navg_frame_rate=30/1\nr_frame_rate=30/1\n";
        let stated = Stated::parse(&("best_effort_timestamp_time=0.5\n".repeat(20) + head));
        assert_eq!(stated.rate, FrameRate::new(30, 1).ok());
        let mut spacing = Spacing::new(String::new(), Positions::Times, stated.step.expect("a step"));
        for _ in 0..20 {
            spacing.arrive(500.0);
        }
        let mut events = std::iter::from_fn(|| spacing.next_event());
        assert!(events.any(|event| matches!(event, SourceEvent::Fault(fault) if fault.kind == FaultKind::Uneven)));
        // A picture has no second frame to compare with.
        assert_eq!(Stated::parse(&format!("best_effort_timestamp_time=0.5\n{head}")).step, None);
    }

    #[test]
    fn pixels_keep_their_range() {
        let conversion = |pixels: &str, range| {
            let stated = Stated { pixels: pixels.into(), range, ..Stated::default() };
            let (filter, pixels) = stated.conversion();
            filter + pixels
        };
        for (pixels, expected) in [
            ("gray", "gray"),
            ("ya8", "gray"),
            ("gray16be", "gray16le"),
            ("gray10le", "gray10le"),
            ("yuvj422p", "yuvj422p"),
            ("gbrp", "format=gbrp,extractplanes=g,gray"),
            ("bgr0", "format=gbrp,extractplanes=g,gray"),
            ("rgb48be", "format=gbrp16le,extractplanes=g,gray16le"),
            ("nv12", "scale=in_range=limited:out_range=limited,yuv444p"),
        ] {
            assert_eq!(conversion(pixels, None), expected, "{pixels}");
        }
        let full = conversion("yuv422p10le", Some(QuantizationRange::Full));
        assert_eq!(full, "scale=in_range=full:out_range=full,yuv444p");
    }
}
