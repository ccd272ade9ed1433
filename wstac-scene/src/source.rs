//! A simulated sensor as a source. Its frames come as fast as they are requested.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use crate::sensor::Fidelity;
use crate::{Scene, SceneConfig, SimulatedFrame, Truth};
use wstac_core::layout::FrameSize;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::open::{OpenOptions, SourceKind, without_controls};
use wstac_host::source::{Frame, ReadoutTime, Source, SourceEvent, StreamInfo, SummedFrame};

/// The frames of a scene.
#[derive(Clone, Debug)]
pub struct SceneSource {
    info: StreamInfo,
    scene: Scene,
}

impl SceneSource {
    /// Creates a source at the start of a scene.
    ///
    /// # Errors
    /// [`Scene::new`] fails.
    pub fn new(script: &SceneConfig) -> Result<Self, Error> {
        let scene = Scene::new(script)?;
        let touches = match &script.touches[..] {
            [one] => one.to_string(),
            all if all.iter().all(|touch| touch.slide().is_some()) => format!("{} slides", all.len()),
            all => format!("{} touches", all.len()),
        };
        let (width, height) = script.sensor.size.into();
        let sensor = scene.sensor();
        let (seed, frames, format) = (script.seed, scene.frames(), script.sensor.format);
        let what = match script.fidelity {
            Fidelity::Rendered => format!("frames of {width}x{height} {format}"),
            Fidelity::Taxel => format!("taxel sums of {width}x{height} {format}"),
        };
        let about = format!("scene: {touches}, seed {seed}, {frames} {what}");
        let mut info = StreamInfo::new(about, script.sensor.size, sensor.format(), script.sensor.rate);
        info.color = sensor.color();
        info.bytes_per_row = sensor.bytes_per_row() as u32;
        info.readout = ReadoutTime::from_ms(script.sensor.readout_ms as f32);
        info.is_simulated = true;
        info.taxels_only = script.fidelity == Fidelity::Taxel;
        Ok(Self { info, scene })
    }

    /// Returns the ground truth of the scene.
    pub fn truth(&self) -> &[Truth] {
        self.scene.truth()
    }
}

impl Source for SceneSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let frame = |bytes, encoded| SourceEvent::Frame(Frame { encoded, ..Frame::new(bytes) });
        Ok(match self.scene.next_shot() {
            Some(SimulatedFrame::Frame(bytes)) => frame(bytes, None),
            Some(SimulatedFrame::Jpeg(bytes, jpeg)) => frame(bytes, Some(jpeg)),
            Some(SimulatedFrame::Taxels(sums)) => SourceEvent::Taxels(SummedFrame::new(sums)),
            Some(SimulatedFrame::Lost(frames, reason)) => SourceEvent::Lost { frames: frames.into(), reason },
            None => SourceEvent::End,
        })
    }
}

/// Scenes as sources by name: `scene:FILE.toml`, or the short form, `scene:Saw3@150`.
///
/// ```
/// use wstac_host::output::Output;
/// use wstac_host::session::Session;
/// use wstac_host::source::open::{OpenOptions, open};
/// use wstac_scene::source::Scenes;
///
/// // For cameras, add &wstac_linux::source::Cameras to the kinds.
/// let source = open("scene:Saw3@150,90deg", &OpenOptions::default(), &[&Scenes])?;
/// for output in Session::builder(source).build()? {
///     if let Output::Event(event) = output? {
///         println!("{:?} {:?}", event.speed, event.direction.degrees);
///     }
/// }
/// # Ok::<(), wstac_host::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Scenes;

impl SourceKind for Scenes {
    fn expected(&self) -> &'static str {
        "scene:…"
    }

    fn open(&self, name: &OsStr, options: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>> {
        let scene = OsStr::from_bytes(name.as_bytes().strip_prefix(b"scene:")?);
        let opened = || {
            without_controls(name.display(), options)?;
            let source = SceneSource::new(&script(scene, options)?).map_err(|error| error.about(name.display()))?;
            Ok(Box::new(source) as Box<dyn Source>)
        };
        Some(opened())
    }
}

/// Returns the script of a scene, `FILE.toml` or the short form, with the options applied.
///
/// # Errors
/// The text is not a scene, the file cannot be read, or an option does not apply to a scene.
pub fn script(scene: impl AsRef<OsStr>, options: &OpenOptions) -> Result<SceneConfig, Error> {
    let path = Path::new(scene.as_ref());
    let scene = &*path.to_string_lossy();
    let is_file = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let mut script = if is_file {
        let text = wstac_host::text_file::file_text(path)?;
        SceneConfig::from_toml(scene, &text)?
    } else {
        SceneConfig::parse_short(scene)?
    };
    let refused =
        |message: &dyn std::fmt::Display| Error::new(ErrorKind::Config, format_args!("scene:{scene}"), message);
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
