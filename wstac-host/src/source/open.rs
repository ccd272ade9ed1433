//! Opens sources by the names that users give them.

use std::ffi::OsStr;
use std::fmt;
use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use wstac_core::rate::FrameRate;

#[cfg(feature = "jpeg")]
use super::jpeg_folder::JpegFolder;
#[cfg(feature = "mcap")]
use super::mcap::McapSource;
use super::names;
#[cfg(feature = "clap")]
use super::option_text;
#[cfg(feature = "png")]
use super::png_folder::PngFolder;
#[cfg(any(feature = "jpeg", feature = "png"))]
use super::spacing::Spaced;
use super::video::{self, Video};
use super::y4m::{MAGIC, Y4m};
use super::{FramePolicy, Source};
#[cfg(any(feature = "jpeg", feature = "png"))]
use super::{picture_files, picture_names::Places};
use crate::camera::ControlSetting;
use crate::camera::formats::FourCc;
use crate::error::{Error, ErrorKind};

/// The rates that a file may have, in frames per second.
const RATES: std::ops::RangeInclusive<f64> = 0.5..=1000.0;

/// The options of a user for a source. By default, none changes anything.
///
/// This is the one list of them: with the feature `clap`, each field that a command can set is an argument, and its
/// comment is the argument's help. The C and Python libraries and cameras take the same fields.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct OpenOptions {
    /// Frames per second, such as 30 or 30000/1001
    ///
    /// Of a recording, the rate replaces the one in the file. A camera is asked for it. A scene is simulated at it.
    #[cfg_attr(feature = "clap", arg(long, value_name = "RATE", allow_negative_numbers = true, value_parser = option_text::frame_rate))]
    pub fps: Option<FrameRate>,

    /// Pixel format to ask a camera for, such as YUYV, GREY or MJPG
    ///
    /// It is a four-character code. wstac devices lists those of a camera.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FOURCC", value_parser = option_text::four_characters))]
    pub format: Option<FourCc>,

    /// Frame size to ask a camera for, or to simulate
    #[cfg_attr(feature = "clap", arg(long, value_name = "WIDTHxHEIGHT", value_parser = option_text::size))]
    pub size: Option<(u32, u32)>,

    /// Do not lock a camera's controls
    ///
    /// Exposure, gain, white balance, focus and the like stay automatic.
    #[cfg_attr(feature = "clap", arg(long))]
    pub keep_controls: bool,

    /// Set a control of a camera, such as gain=20
    ///
    /// The camera keeps the value. The option can be given any number of times. Names and values are those of v4l2-ctl
    /// -L; the error for an unknown name lists all names.
    #[cfg_attr(feature = "clap", arg(long = "control", value_name = "NAME=VALUE", value_parser = option_text::control))]
    pub controls: Vec<ControlSetting>,

    /// Bits per second of a board's serial device; 115200 by default.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub baud: Option<u32>,

    /// The choice of frames of a camera that are handed out if the program is slower.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub delivery: FramePolicy,

    /// The sensor to read of a recording of several.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub sensor: Option<String>,
}

/// The files that this build reads, for messages.
const FILES: &str = match (cfg!(feature = "mcap"), cfg!(feature = "png"), cfg!(feature = "jpeg")) {
    // Recordings bring JPEG.
    (true, true, _) => "a .y4m, .mcap or video file, a folder of PNGs or JPEGs, or -",
    (true, false, _) => "a .y4m, .mcap or video file, a folder of JPEGs, or -",
    (false, true, true) => "a .y4m or video file, a folder of PNGs or JPEGs, or -",
    (false, true, false) => "a .y4m or video file, a folder of PNGs, or -",
    (false, false, true) => "a .y4m or video file, a folder of JPEGs, or -",
    (false, false, false) => "a .y4m or video file or -",
};
/// The starts of names of sources that other crates open, the kinds of source that open them, and the features of the
/// crate `wstac` that have these.
const OTHER_CRATES: [(&str, &str, &str); 2] =
    [("scene:", "wstac_scene::source::Scenes", "scene"), ("/dev/video", "wstac_linux::source::Cameras", "camera")];
/// The first bytes of an MCAP file.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The message about options that only a camera has.
const OF_A_CAMERA: &str = "expected only with a camera or a scene: a file states its own";

/// A kind of source that another crate adds, such as cameras or simulated sensors.
pub trait SourceKind: Sync {
    /// Returns the form of this kind's names for messages, such as `/dev/videoN`; empty to leave it out.
    fn expected(&self) -> &'static str {
        ""
    }

    /// Opens the source that `name` stands for; `None` if it is not of this kind.
    fn open(&self, name: &OsStr, options: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>>;
}

/// Opens a source by its name.
///
/// The name is one of `kinds`, a Y4M file, a named pipe, a recording, a video, a folder of PNGs or JPEGs, or `-`. `-`
/// stands for Y4M on standard input. Videos are decoded by ffmpeg, if the machine has it. Boards are of the kind
/// `monitor::line::Boards`.
///
/// Files are recognized by their first bytes or by their names. A name need not be UTF-8.
///
/// # Errors
/// The name stands for none of these, the source cannot be used, or an option does not apply to it. The error says what
/// was found and what was expected.
pub fn open(
    name: impl AsRef<OsStr>,
    options: &OpenOptions,
    kinds: &[&dyn SourceKind],
) -> Result<Box<dyn Source>, Error> {
    let name = name.as_ref();
    let path = Path::new(name);
    let is_missing = ends(path, "mcap") && !path.exists();
    if let Some(sensor) = options.sensor.as_ref().filter(|_| !is_recording(name) && !is_missing) {
        let message = format_args!("sensor is {sensor:?}, expected only with a recording of several sensors");
        return Err(Error::new(ErrorKind::Usage, name.display(), message));
    }
    if let Some(opened) = kinds.iter().find_map(|kind| kind.open(name, options)) {
        return opened;
    }
    let source = open_file(name, options, kinds)?;
    // Every speed would be absurd with an absurd rate.
    let rate = source.info().rate.per_second();
    if RATES.contains(&rate) {
        return Ok(source);
    }
    let (least, most) = (RATES.start(), RATES.end());
    let rate = if rate < 1.0 { format!("{rate:.4}") } else { format!("{rate:.0}") };
    let (kind, found, help) = match options.fps {
        Some(_) => (ErrorKind::Usage, "--fps is", ""),
        None => (ErrorKind::Format, "states", "; state the rate with --fps"),
    };
    let message = format_args!("{found} {rate} frames per second, expected {least} to {most}{help}");
    Err(Error::new(kind, name.display(), message))
}

/// Opens a file, a folder or standard input, whatever its rate is.
fn open_file(name: &OsStr, options: &OpenOptions, kinds: &[&dyn SourceKind]) -> Result<Box<dyn Source>, Error> {
    let path = Path::new(name);
    if name == "-" {
        of_a_file(name.display(), options)?;
        return Ok(Box::new(Y4m::standard_input(options.fps)?));
    }
    let refused =
        |kind, message: &str| Error::new(kind, format_args!("SOURCE is {:?}", name.to_string_lossy()), message);
    let none_of_these = |kind, why: &str| {
        let names = kinds.iter().map(|kind| kind.expected()).filter(|names| !names.is_empty());
        refused(kind, &format!("{why}expected {}", names.chain([FILES]).collect::<Vec<_>>().join(", ")))
    };
    let is_missing = |start: &str| !kinds.iter().any(|kind| kind.expected().starts_with(start));
    let starts = |start: &str| name.as_encoded_bytes().starts_with(start.as_bytes());
    if let Some((_, kind, feature)) = OTHER_CRATES.iter().find(|(start, ..)| starts(start) && is_missing(start)) {
        let message = format!(
            "this program opens no such source: it needs the feature {feature} of the crate wstac, or must pass the kind \
             {kind} to open"
        );
        return Err(refused(ErrorKind::Unsupported, &message));
    }
    let kind = match path.metadata() {
        Ok(metadata) => metadata.file_type(),
        Err(_) if names::is_named(name) => {
            let why = "several sources, each with a name, are for wstac run, view, serve and record; here ";
            return Err(none_of_these(ErrorKind::Usage, why));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let is_slide = path.to_str().is_some_and(|name| name.contains('@'));
            let why = if is_slide { "no such file; a simulated slide is scene:Saw3@150; " } else { "no such file; " };
            return Err(none_of_these(ErrorKind::NotFound, why).caused_by(error));
        }
        Err(error) => return Err(Error::io(name.display(), error)),
    };
    of_a_file(name.display(), options)?;
    if kind.is_dir() {
        return open_folder(path, options.fps);
    }
    // The first bytes of a pipe cannot be read without taking them from the source.
    let has_magic = |magic| starts_with(path, magic).map_err(|error| Error::io(name.display(), error));
    if kind.is_file() && (ends(path, "mcap") || has_magic(MCAP_MAGIC)?) {
        return open_recording(path, options);
    }
    let is_y4m = kind.is_fifo() || ends(path, "y4m");
    if is_y4m || (kind.is_file() && has_magic(MAGIC)?) {
        return Ok(Box::new(Y4m::open(path, options.fps)?));
    }
    if video::is_video(path) || (kind.is_file() && video::starts_as_video(path)) {
        return Ok(Box::new(Video::open(path, options.fps)?));
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let why = match extension.to_str() {
        Some("toml") => "a scene's file is scene:FILE.toml; ",
        Some("png" | "jpg" | "jpeg") => "a picture is read with all of its folder, so name that; ",
        _ if kind.is_file() => {
            "its name and first bytes are not of a known kind (wstac run board:FILE reads what a board sent); "
        }
        _ => "",
    };
    Err(none_of_these(ErrorKind::Unsupported, why))
}

#[cfg(any(feature = "jpeg", feature = "png"))]
fn open_folder(path: &Path, rate: Option<FrameRate>) -> Result<Box<dyn Source>, Error> {
    match picture_files::are_jpegs(path)? {
        #[cfg(feature = "jpeg")]
        true => JpegFolder::open(path, rate).map(|mut folder| spaced(path, folder.pictures.places.take(), folder)),
        #[cfg(feature = "png")]
        false => PngFolder::open(path, rate).map(|mut folder| spaced(path, folder.pictures.places.take(), folder)),
        #[cfg(not(all(feature = "jpeg", feature = "png")))]
        _ => Err(picture_files::without_pictures(path)),
    }
}

/// Reports the gaps between pictures of these places.
#[cfg(any(feature = "jpeg", feature = "png"))]
fn spaced(path: &Path, places: Places, folder: impl Source + 'static) -> Box<dyn Source> {
    match places {
        Some((kind, places)) => Box::new(Spaced::new(folder, path.display().to_string(), kind, places)),
        None => Box::new(folder),
    }
}

#[cfg(not(any(feature = "jpeg", feature = "png")))]
fn open_folder(path: &Path, _: Option<FrameRate>) -> Result<Box<dyn Source>, Error> {
    let message = "this build reads no folders of pictures: build with the feature png or jpeg";
    Err(Error::new(ErrorKind::Unsupported, path.display(), message))
}

#[cfg(feature = "mcap")]
fn open_recording(path: &Path, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    Ok(Box::new(McapSource::open_sensor(path, options.sensor.as_deref(), options.fps)?))
}

#[cfg(not(feature = "mcap"))]
fn open_recording(path: &Path, _: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    let message = "this build reads no MCAP recordings: build with the feature mcap";
    Err(Error::new(ErrorKind::Unsupported, path.display(), message))
}

/// Returns the names of the sensors of a recording of several; none for a recording of one, and for other sources.
///
/// # Errors
/// The recording cannot be read.
pub fn recorded_sensors(name: &OsStr) -> Result<Vec<String>, Error> {
    #[cfg(feature = "mcap")]
    if is_recording(name) {
        return McapSource::sensors(Path::new(name));
    }
    let _ = name;
    Ok(Vec::new())
}

fn is_recording(name: &OsStr) -> bool {
    let path = Path::new(name);
    path.is_file() && (ends(path, "mcap") || starts_with(path, MCAP_MAGIC).unwrap_or(false))
}

/// Returns whether a name ends as those of files of frames do.
#[cfg(feature = "board")]
pub(crate) fn is_named_for_frames(path: &Path) -> bool {
    ends(path, "mcap") || ends(path, "y4m") || video::is_video(path)
}

fn ends(path: &Path, with: &str) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(with))
}

/// Refuses options that a file does not have.
fn of_a_file(spec: impl fmt::Display, options: &OpenOptions) -> Result<(), Error> {
    let size = options.size.map(|(width, height)| format!("size is {width}x{height}"));
    if let Some(stated) = size.or(options.format.map(|format| format!("format is {}", format.escape_ascii()))) {
        return Err(Error::new(ErrorKind::Usage, spec, format_args!("{stated}, {OF_A_CAMERA}")));
    }
    without_controls(spec, options)
}

/// Refuses camera controls of a source that has none.
///
/// # Errors
/// The options set a control.
pub fn without_controls(spec: impl fmt::Display, options: &OpenOptions) -> Result<(), Error> {
    let refused = |ControlSetting { name, value }: &ControlSetting| {
        Error::new(ErrorKind::Usage, &spec, format_args!("control {name}={value} is set, expected only with a camera"))
    };
    options.controls.first().map_or(Ok(()), |setting| Err(refused(setting)))
}

fn starts_with(path: &Path, magic: &[u8]) -> std::io::Result<bool> {
    let mut start = Vec::new();
    crate::files::open(path)?.take(magic.len() as u64).read_to_end(&mut start)?;
    Ok(start == magic)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "mcap")]
    #[test]
    fn recordings_are_known_by_the_bytes_that_the_library_writes() {
        assert_eq!(MCAP_MAGIC, ::mcap::MAGIC);
    }

    #[test]
    fn a_name_of_another_crates_source_says_which_kind_is_missing() {
        struct Other;
        impl SourceKind for Other {
            fn expected(&self) -> &'static str {
                "other:NAME"
            }

            fn open(&self, _: &OsStr, _: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>> {
                None
            }
        }
        let error_of =
            |name, kinds: &[&dyn SourceKind]| open(name, &OpenOptions::default(), kinds).map(|_| ()).unwrap_err();
        for (name, kind) in
            [("scene:Saw3@150", "wstac_scene::source::Scenes"), ("/dev/video0", "wstac_linux::source::Cameras")]
        {
            for error in [error_of(name, &[]), error_of(name, &[&Other])] {
                assert_eq!(error.kind(), ErrorKind::Unsupported);
                assert!(error.to_string().contains(kind), "{error}");
            }
        }
        let error = error_of("nothing", &[]);
        assert_eq!(error.kind(), ErrorKind::NotFound);
        assert!(error.to_string().contains("expected a .y4m"), "{error}");
        let error = error_of("nothing", &[&Other, &Other]).to_string();
        assert!(error.contains("expected other:NAME, other:NAME, a .y4m"), "{error}");
    }

    #[cfg(not(all(feature = "mcap", feature = "png")))]
    #[test]
    fn a_build_names_the_feature_that_it_lacks() {
        let folder = std::env::temp_dir().join(format!("wstac-features-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let recording = folder.join("recording");
        std::fs::write(&recording, MCAP_MAGIC).unwrap();
        let error_of = |path: &Path| {
            open(path.to_str().unwrap(), &OpenOptions::default(), &[]).map(|_| ()).unwrap_err().to_string()
        };
        if cfg!(not(feature = "mcap")) {
            assert!(error_of(&recording).ends_with("build with the feature mcap"));
        }
        if cfg!(not(any(feature = "png", feature = "jpeg"))) {
            assert!(error_of(&folder).ends_with("build with the feature png or jpeg"));
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
