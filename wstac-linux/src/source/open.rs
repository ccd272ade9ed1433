//! From what a user calls a source to the source.

use std::fs::File;
use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::camera::CameraSource;
use super::mcap::McapSource;
use super::png_folder::PngFolder;
use super::scene::SceneSource;
use super::y4m::{MAGIC, Y4m};
use super::{Delivery, Source};
use crate::camera::{CameraRequest, ControlSetting};
use crate::error::Error;
use crate::scene::Script;

/// What a user asks of a source; nothing asked, nothing changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OpenOptions {
    /// Frames a second: of a file, what it is taken to have; of a camera or a scene, what it is set to.
    pub fps: Option<FrameRate>,
    /// Pixel format by its four-character code; cameras and scenes.
    pub format: Option<[u8; 4]>,
    /// Width and height in pixels; cameras and scenes.
    pub size: Option<(u32, u32)>,
    /// Which frames of a camera are handed out where the program is slower.
    pub delivery: Delivery,
    /// Leave a camera's controls as they are, instead of locking them.
    pub keep_controls: bool,
    /// Values of a camera's controls that are to be set.
    pub controls: Vec<ControlSetting>,
}

/// What a source can be, for messages.
const EXPECTED: &str = "expected /dev/videoN, scene:…, a .y4m or .mcap file, a folder of PNGs or -";
/// What only a camera has a choice of.
const OF_A_CAMERA: &str = "expected only with a camera or a scene: a file states its own";

/// Opens a source: `/dev/videoN` (any character device), `scene:FILE.toml`, `scene:Saw3@150`, a Y4M file by its
/// first bytes or named pipe, a recording by its first bytes or its name, a folder of PNGs, or `-` for Y4M on standard
/// input.
///
/// # Errors
/// Where it is none of these, cannot be used, or an option does not apply to it: says what was found and what was
/// expected.
pub fn open(spec: &str, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    if let Some(scene) = spec.strip_prefix("scene:") {
        without_controls(spec, options)?;
        let source = SceneSource::new(&script(scene, options)?).map_err(|error| error.about(spec))?;
        return Ok(Box::new(source));
    }
    if spec == "-" {
        of_a_file(spec, options)?;
        return Ok(Box::new(Y4m::standard_input(options.fps)?));
    }
    let path = Path::new(spec);
    let none_of_these = |why: &str| Error::new(format_args!("SOURCE is {spec:?}"), format_args!("{why}{EXPECTED}"));
    let kind = match path.metadata() {
        Ok(metadata) => metadata.file_type(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound && spec.starts_with("/dev/video") => {
            return Err(Error::new(spec, "no such camera; wstac devices lists those that there are"));
        }
        Err(_) if spec.starts_with("cam:") => {
            return Err(none_of_these("several sources, each with a name, are for wstac run; here "));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Err(none_of_these("no such file; ")),
        Err(error) => return Err(Error::new(spec, error)),
    };
    if kind.is_char_device() {
        let OpenOptions { fps: rate, format, size, delivery, keep_controls, controls } = options.clone();
        let request = CameraRequest { path: path.into(), format, size, rate, delivery, keep_controls, controls };
        return Ok(Box::new(CameraSource::open(&request)?));
    }
    of_a_file(spec, options)?;
    if kind.is_dir() {
        return Ok(Box::new(PngFolder::open(path, options.fps)?));
    }
    // A pipe cannot be looked into first.
    let has_magic = |magic| starts_with(path, magic).map_err(|error| Error::new(spec, error));
    let is_mcap = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"));
    if kind.is_file() && (is_mcap || has_magic(::mcap::MAGIC)?) {
        return Ok(Box::new(McapSource::open(path, options.fps)?));
    }
    let is_y4m = kind.is_fifo() || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("y4m"));
    if is_y4m || (kind.is_file() && has_magic(MAGIC)?) {
        return Ok(Box::new(Y4m::open(path, options.fps)?));
    }
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    Err(none_of_these(match extension.to_str() {
        Some("toml") => "a scene's file is scene:FILE.toml; ",
        Some("png") => "a PNG is read with all of its folder, so name that; ",
        Some("mp4" | "mkv" | "mov" | "avi" | "webm" | "mjpeg") => {
            "a video is read by ffmpeg -i FILE -pix_fmt yuv420p -f yuv4mpegpipe - | wstac run - ; "
        }
        _ => "",
    }))
}

/// Whether a source, by what a user calls it, makes its frames now, at a pace of its own: a camera.
pub fn is_live(spec: &str) -> bool {
    Path::new(spec).metadata().is_ok_and(|metadata| metadata.file_type().is_char_device())
}

/// The script of a scene, with what the options change: `FILE.toml` or the short form.
///
/// # Errors
/// Where it is no scene, cannot be read, or an option does not apply to it.
pub fn script(scene: &str, options: &OpenOptions) -> Result<Script, Error> {
    let is_file = Path::new(scene).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let mut script = if is_file {
        let text = std::fs::read_to_string(scene).map_err(|error| Error::new(scene, error))?;
        Script::from_toml(scene, &text)?
    } else {
        Script::parse_short(scene)?
    };
    let refused = |message: &dyn std::fmt::Display| Error::new(format_args!("scene:{scene}"), message);
    let sensor = &mut script.sensor;
    if let Some(format) = options.format {
        sensor.format = format.escape_ascii().to_string().parse().map_err(|error: String| refused(&error))?;
    }
    if let Some((width, height)) = options.size {
        sensor.size = FrameSize::new(width, height).map_err(|error| refused(&error))?;
    }
    sensor.rate = options.fps.unwrap_or(sensor.rate);
    if sensor.rate.numerator() < sensor.rate.denominator() {
        let (numerator, denominator) = (sensor.rate.numerator(), sensor.rate.denominator());
        return Err(refused(&format_args!("fps is {numerator}/{denominator}, expected at least 1")));
    }
    Ok(script)
}

/// Refuses what a file has no choice of.
fn of_a_file(spec: &str, options: &OpenOptions) -> Result<(), Error> {
    if let Some((width, height)) = options.size {
        return Err(Error::new(spec, format_args!("size is {width}x{height}, {OF_A_CAMERA}")));
    }
    if let Some(format) = options.format {
        return Err(Error::new(spec, format_args!("format is {}, {OF_A_CAMERA}", format.escape_ascii())));
    }
    without_controls(spec, options)
}

/// Refuses controls where there are none.
fn without_controls(spec: &str, options: &OpenOptions) -> Result<(), Error> {
    let refused = |ControlSetting { name, value }: &ControlSetting| {
        Error::new(spec, format_args!("control {name}={value} is set, expected only with a camera"))
    };
    options.controls.first().map_or(Ok(()), |setting| Err(refused(setting)))
}

/// Whether a file starts with these bytes.
fn starts_with(path: &Path, magic: &[u8]) -> std::io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(magic.len() as u64).read_to_end(&mut start)?;
    Ok(start == magic)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use wstac_core::green::any::PixelFormat;

    use crate::source::Item;

    fn message(spec: &str, options: &OpenOptions) -> String {
        open(spec, options).err().unwrap().to_string()
    }

    #[test]
    fn every_kind_of_source_opens() {
        let folder = std::env::temp_dir().join(format!("wstac-open-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let y4m = b"YUV4MPEG2 W1 H1 F25:1 Cmono\nFRAME\nx";
        fs::write(path("clip.y4m"), y4m).unwrap();
        fs::write(path("clip.dat"), y4m).unwrap();
        fs::write(path("other.dat"), "other").unwrap();
        fs::write(path("empty.y4m"), "").unwrap();
        fs::write(path("s.toml"), "specimen = \"Saw3\"\nspeed = 150").unwrap();
        for name in ["clip.y4m", "clip.dat"] {
            let mut source = open(&path(name), &OpenOptions::default()).unwrap();
            assert!(matches!(source.next(), Ok(Item::Frame { bytes: b"x", .. })));
        }
        let scene = open(&format!("scene:{}", path("s.toml")), &OpenOptions::default()).unwrap();
        assert!(scene.info().about.contains("Saw3 at 150 mm/s"), "{}", scene.info().about);
        let none = OpenOptions::default();
        let expected = "expected /dev/videoN, scene:…, a .y4m or .mcap file, a folder of PNGs or -";
        let error = message(&path("other.dat"), &none);
        assert!(error.starts_with("SOURCE is \"") && error.contains(expected), "{error}");
        assert!(message(&path("empty.y4m"), &none).contains("is empty"));
        assert!(message(&path(""), &none).contains("no .png file"));
        let error = message("nothing", &none);
        assert!(error.starts_with("SOURCE is \"nothing\": no such file; expected /dev/videoN"), "{error}");
        assert!(message("", &none).starts_with("SOURCE is \"\": no such file"));
        let sized = OpenOptions { size: Some((4, 4)), ..none.clone() };
        assert!(message(&path("clip.y4m"), &sized).contains("size is 4x4, expected only with a camera"));
        let format = OpenOptions { format: Some(*b"YUYV"), ..none.clone() };
        assert!(message(&path("clip.y4m"), &format).contains("format is YUYV, expected only with a camera"));
        let controls = vec![ControlSetting { name: "gain".into(), value: 3 }];
        let controlled = OpenOptions { controls, ..none.clone() };
        for spec in [&*path("clip.y4m"), "scene:Saw3@150", "-"] {
            let error = message(spec, &controlled);
            assert!(error.contains("control gain=3 is set, expected only with a camera"), "{error}");
        }
        assert!(message("/dev/null", &none).starts_with("/dev/null: "), "a device is taken for a camera");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn scenes_take_options() {
        let rate = FrameRate::new(60, 1).unwrap();
        let options =
            OpenOptions { fps: Some(rate), format: Some(*b"GREY"), size: Some((100, 80)), ..OpenOptions::default() };
        let source = open("scene:Saw3@150,90deg", &options).unwrap();
        assert_eq!((source.info().rate, source.info().size.width()), (rate, 100));
        assert!(message("scene:Saw3", &options).contains("scene:Saw3: slide is \"Saw3\", expected"));
        assert!(message("scene:no.toml", &options).contains("no.toml: No such file"));
        let yuyv = OpenOptions { format: Some(*b"YUYV"), ..options.clone() };
        assert_eq!(open("scene:Saw3@150", &yuyv).unwrap().info().format, PixelFormat::Yuyv);
        let format = OpenOptions { format: Some(*b"H264"), ..options.clone() };
        let error = message("scene:Saw3@150", &format);
        assert!(error.contains("H264") && error.contains("expected"), "{error}");
        let tiny = OpenOptions { size: Some((3, 3)), ..options.clone() };
        assert!(message("scene:Saw3@150", &tiny).contains("taxel size"));
    }
}
