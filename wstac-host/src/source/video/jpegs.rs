//! Motion JPEG in a container: ffmpeg copies its pictures, which are decoded as those of a camera, and handed on as
//! Y4M.
//!
//! ffmpeg's decoder refuses or spoils pictures with bytes before markers, as many cameras send them.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Result as IoResult, Write, copy, sink};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::Sender;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::ffmpeg::{Decoder, Report};
use crate::camera::mjpeg::{self, Refusal};
use crate::error::Error;
use crate::files::readable;
use crate::source::StreamInfo;
use crate::source::jpeg_folder::MOST_BYTES;
use crate::source::y4m::{header_of, input::WAIT_MS};

/// Writes each picture behind its size to the output, and its time and its size to the descriptor of an input.
const COPY: &str = "-map 0:V:0 -c copy -copyinkf -flush_packets 1 -f mpjpeg pipe:1 \
                    -map 0:V:0 -c copy -copyinkf -flush_packets 1 -f framecrc pipe:0";

/// The time of a picture in milliseconds, not a number if it is unknown, and its bytes.
type Timed = (f64, Result<Vec<u8>, Refusal>);
const CUT: Refusal = Refusal::Corrupt("ffmpeg copies another number of bytes than it has");

/// Starts ffmpeg and a thread that decodes the pictures; `None` if the first one is of a kind that is left to ffmpeg.
pub(super) fn start(subject: &str, path: &Path, size: FrameSize) -> Result<Option<(Decoder, OwnedFd)>, Error> {
    let failed = |error| Error::io(subject, error);
    let (times, to_times) = std::io::pipe().map_err(failed)?;
    let (process, parts, reports) = Decoder::start(subject, path, COPY.split_ascii_whitespace(), to_times.into())?;
    let parts = File::from(OwnedFd::from(parts));
    // A signal that is handled ends the wait.
    while !readable(&parts, WAIT_MS).map_err(failed)? {}
    let (mut parts, mut times, mut tick_ms) = (BufReader::new(parts), BufReader::new(times), f64::NAN);
    let mut pictures = std::iter::from_fn(move || next_picture(&mut parts, &mut times, &mut tick_ms));
    let (mut decoder, first) = (mjpeg::Decoder::new(size), pictures.next());
    let Some((_, Ok(jpeg))) = &first else { return Ok(None) };
    if matches!(decoder.components(jpeg), Err(Refusal::OtherSize | Refusal::Unsupported(_))) {
        return Ok(None);
    }
    let header = header_of(&StreamInfo::new("", size, PixelFormat::Yuv444p, FrameRate::NOMINAL)).unwrap_or_default();
    let (frames, to) = UnixStream::pair().map_err(failed)?;
    // After the end of the source nobody reads.
    std::thread::spawn(move || hand_on(first.into_iter().chain(pictures), decoder, &header, to, &reports));
    Ok(Some((process, frames.into())))
}

/// Decodes pictures, and writes them as Y4M. Each is reported before; those that are refused in a row in one report, as
/// nothing holds them back.
fn hand_on(
    pictures: impl Iterator<Item = Timed>,
    mut decoder: mjpeg::Decoder,
    header: &str,
    mut to: UnixStream,
    reports: &Sender<Report>,
) -> IoResult<()> {
    to.write_all(header.as_bytes())?;
    let report = |report| drop(reports.send(report));
    let (mut frame, mut lost, mut is_first) = (Vec::new(), None, true);
    // A picture without bytes stands for one that the camera left out.
    for (time, jpeg) in pictures.filter(|(_, jpeg)| !jpeg.as_ref().is_ok_and(Vec::is_empty)) {
        match jpeg.and_then(|jpeg| decoder.components(&jpeg)) {
            Ok(components) => {
                lost.take().into_iter().chain([Report::Frame { time, is_key: true }]).for_each(&report);
                frame.clear();
                frame.extend_from_slice(b"FRAME\n");
                let pixels = components.as_chunks::<3>().0;
                frame.extend((0..3).flat_map(|plane| pixels.iter().map(move |pixel| pixel[plane])));
                to.write_all(&frame)?;
            }
            Err(why) => match &mut lost {
                Some(Report::Lost { time: last, frames, .. }) => (*last, *frames) = (time, *frames + 1),
                _ => lost = Some(Report::Lost { time, frames: 1, why, is_first: std::mem::take(&mut is_first) }),
            },
        }
    }
    lost.into_iter().for_each(report);
    Ok(())
}

/// Reads a picture, and its time and size from a line of ffmpeg's muxer `framecrc`: stream, times of decoding and of
/// showing, duration, bytes, checksum. Its head has the time base: `#tb 0: 1/30`. Returns `None` at the end of both.
fn next_picture(parts: &mut impl BufRead, times: &mut impl BufRead, tick_ms: &mut f64) -> Option<Timed> {
    let mut lines = parts.by_ref().split(b'\n').map_while(Result::ok);
    let bytes = lines.find_map(|line| str::from_utf8(&line).ok()?.strip_prefix("Content-length:")?.trim().parse().ok());
    // An empty line ends the header.
    lines.next();
    let (bytes, mut jpeg): (u64, _) = (bytes.unwrap_or_default(), Vec::new());
    parts.by_ref().take(bytes.min(MOST_BYTES)).read_to_end(&mut jpeg).ok()?;
    copy(&mut parts.take(bytes.saturating_sub(MOST_BYTES)), &mut sink()).ok()?;
    let tick = |line: &str| {
        let (numerator, denominator) = line.strip_prefix("#tb")?.rsplit_once(' ')?.1.split_once('/')?;
        Some(1000.0 * numerator.parse::<f64>().ok()? / denominator.parse::<f64>().ok()?)
    };
    let line = times.by_ref().lines().map_while(Result::ok).find(|line| {
        *tick_ms = tick(line).unwrap_or(*tick_ms);
        !line.starts_with('#')
    })?;
    let fields: Vec<i64> = line.split(',').map_while(|field| field.trim().parse().ok()).collect();
    let &[_, decoded, shown, _, size] = &fields[..] else { return None };
    let time = [shown, decoded].into_iter().find(|time| *time != i64::MIN);
    let is_whole = jpeg.len() as i64 == size;
    Some((time.map_or(f64::NAN, |time| time as f64 * *tick_ms), if is_whole { Ok(jpeg) } else { Err(CUT) }))
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn pictures_have_their_times_and_sizes() {
        let parts = b"--ffmpeg\r\nContent-type: image/jpeg\r\nContent-length: 3\r\n\r\n\xff\n\r\r\n--ffmpeg\r\n\
                      Content-length: 0\r\n\r\n\r\n--ffmpeg\r\nContent-length: 2\r\n\r\nab\r\n--ffmpeg\r\n\
                      Content-length: 3\r\n\r\nabc\xff\n\xff\r\n--ffmpeg\r\nContent-length: 9\r\n\r\ncut";
        let times = b"#software: x\n#tb 0: 1/50\n#media_type 0: video\n0, 0, 2, 1, 3, 0x5\n0, 1, 3, 1, 0, 0x0\n\
                      0, 4, -9223372036854775808, 1, 2, 0x5\n0, 5, 5, 1, 6, 0x5\n0, 5, 5, 1, 9, 0x5\n0, 6, 6, 1, 9, 0x5\n";
        let (mut parts, mut times, mut tick_ms) = (&parts[..], &times[..], f64::NAN);
        let found: Vec<_> = std::iter::from_fn(|| next_picture(&mut parts, &mut times, &mut tick_ms)).collect();
        let expected =
            [(40.0, Ok(b"\xff\n\r".to_vec())), (60.0, Ok(vec![])), (80.0, Ok(b"ab".to_vec())), (100.0, Err(CUT))];
        assert_eq!(found[..4], expected);
        // Bytes too many, too few, and none.
        assert_eq!(found[4..], [(100.0, Err(CUT)), (120.0, Err(CUT))]);
    }

    #[test]
    fn refused_pictures_in_a_row_are_one_report() {
        let ((reporter, reports), (to, _frames)) = (channel(), UnixStream::pair().expect("sockets"));
        let decoder = mjpeg::Decoder::new(FrameSize::new(8, 8).expect("a size"));
        let pictures = (0..1000).map(|n| (f64::from(n), Err(CUT)));
        hand_on(pictures, decoder, "", to, &reporter).expect("it ends");
        let expected = Report::Lost { time: 999.0, frames: 1000, why: CUT, is_first: true };
        assert_eq!(reports.try_iter().collect::<Vec<_>>(), [expected]);
    }
}
