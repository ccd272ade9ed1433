//! The arguments of every command that reads a source.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use wstac_core::green::ycbcr::{QuantizationRange, YcbcrMatrix};
use wstac_core::rate::FrameRate;

use super::output::note;
use super::values::one_of;
use crate::open;
use wstac_host::config::{Config, Estimator};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::{BEST, ModelFile};
use wstac_host::monitor::port::{has_board_bytes, port_of};
use wstac_host::source::every_sensor::{NamedSource, every_sensor};
use wstac_host::source::names::SensorSpec;
use wstac_host::source::open::{OpenOptions, recorded_sensors};
use wstac_host::source::{FramePolicy, ReadoutTime, Source, StreamInfo, config_of};
use wstac_scene::source::script;
use wstac_scene::{Scene, Truth};
use wstac_tradeoff::candidate::NONE;

/// The options for opening and reading a source.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct SourceArguments {
    #[command(flatten)]
    options: OpenOptions,

    /// Matrix of a YCbCr source, instead of the stated one
    #[arg(long, value_parser = one_of([("bt601", YcbcrMatrix::Bt601), ("bt709", YcbcrMatrix::Bt709)]))]
    matrix: Option<YcbcrMatrix>,

    /// Quantization range of a YCbCr source, instead of the stated one
    #[arg(long, value_parser = one_of([("limited", QuantizationRange::Limited), ("full", QuantizationRange::Full)]))]
    range: Option<QuantizationRange>,

    /// Time of the camera's rolling shutter, in ms
    ///
    /// It is from the first to the last row of the picture before it was turned: 0 for a global shutter, below 0 if the
    /// bottom comes first. Without it, [sensor] readout_ms holds, or what the source states.
    #[arg(long, value_name = "MS", allow_negative_numbers = true, value_parser = parsed_readout)]
    pub(super) readout: Option<ReadoutTime>,

    /// Read this sensor of a recording of several
    ///
    /// wstac run, view, serve and dataset read all of them without it.
    #[arg(long, value_name = "NAME")]
    pub(super) sensor: Option<String>,
}

fn parsed_readout(text: &str) -> Result<ReadoutTime, String> {
    let time = text.parse().ok().and_then(ReadoutTime::from_ms);
    time.ok_or_else(|| "expected -1000 to 1000 milliseconds".into())
}

impl SourceArguments {
    /// Opens a source and returns it with its stream information and its configuration. The configuration is that of
    /// the given file, or else of the source, or else the default.
    pub(super) fn open_configured(
        &self,
        source: &OsStr,
        delivery: FramePolicy,
        file: Option<&Path>,
    ) -> Result<(Box<dyn Source>, StreamInfo, Config), Error> {
        // The file is read first, so that a camera or standard input is not opened in vain.
        let given = file.map(Config::read).transpose()?;
        let (source, info) = self.open(source, delivery)?;
        let mut config = config_of(&info, given)?;
        config.sensor.readout = self.readout.or(config.sensor.readout);
        Ok((source, info, config))
    }

    /// Opens a source of frames and returns it with its stream information, as the arguments change it.
    pub(super) fn open(&self, source: &OsStr, delivery: FramePolicy) -> Result<(Box<dyn Source>, StreamInfo), Error> {
        let options = OpenOptions { delivery, sensor: self.sensor.clone(), ..self.options.clone() };
        if port_of(source).is_some() {
            let message = "is a board or its bytes, expected frames: wstac run, view and calibrate read a board";
            return Err(Error::new(ErrorKind::Unsupported, source.display(), message));
        }
        if Path::new(source).metadata().is_ok_and(|metadata| metadata.file_type().is_fifo()) {
            note(format_args!("{}: waits for Y4M from a program that writes to this pipe", source.display()));
        }
        let source = open(source, &options).map_err(|error| self.with_advice(source, error))?;
        let mut info = source.info().clone();
        if (self.matrix.is_some() || self.range.is_some()) && !info.format.is_ycbcr() {
            let message = "has no Y, Cb and Cr, which --matrix and --range are about; leave them out";
            return Err(Error::new(ErrorKind::Usage, &info.about, message));
        }
        if (self.matrix.is_some() || self.range.is_some()) && info.taxels_only && info.recorded.is_some() {
            let message = "was recorded without pictures, so --matrix and --range change nothing; leave them out";
            return Err(Error::new(ErrorKind::Usage, &info.about, message));
        }
        info.color.matrix = self.matrix.unwrap_or(info.color.matrix);
        info.color.range = self.range.unwrap_or(info.color.range);
        Ok((source, info))
    }

    /// Adds to an error what helps: the commands that read a board, or the option that names one of several sensors.
    fn with_advice(&self, source: &OsStr, error: Error) -> Error {
        if has_board_bytes(source.as_ref()) {
            let message = "has a board's bytes, expected frames: wstac run, view and calibrate read them as board:FILE";
            return Error::new(error.kind(), source.display(), message);
        }
        if error.kind() != ErrorKind::Usage || self.sensor.is_some() {
            return error;
        }
        match recorded_sensors(source).unwrap_or_default().first() {
            Some(first) => {
                Error::new(error.kind(), error.subject(), format_args!("{}: --sensor {first}", error.message()))
            }
            None => error,
        }
    }

    /// Opens a board. Options of sources of frames, and files that only they need, are refused.
    pub(super) fn open_board(
        &self,
        source: &OsStr,
        baud: Option<u32>,
        has_files: bool,
    ) -> Result<Box<dyn Source>, Error> {
        self.expect_none(source)?;
        if has_files {
            let message = "is a board, whose firmware has its own; leave --config and --model out";
            return Err(Error::new(ErrorKind::Usage, source.display(), message));
        }
        open(source, &OpenOptions { baud, ..OpenOptions::default() })
    }

    /// Refuses the options of a camera or a recording, for a source that is a board.
    pub(super) fn expect_none(&self, source: &OsStr) -> Result<(), Error> {
        let Self { options, matrix, range, readout, sensor } = self;
        let is_changed = matrix.is_some() || range.is_some() || readout.is_some() || sensor.is_some();
        if *options != OpenOptions::default() || is_changed {
            let message = "is a board, whose firmware sets the camera up; leave options of a camera out";
            return Err(Error::new(ErrorKind::Usage, source.display(), message));
        }
        Ok(())
    }

    /// Returns the names of the sensors of a recording if all of them are to be read; none for other sources.
    pub(super) fn sensors_in(&self, source: &OsStr) -> Result<Vec<String>, Error> {
        if self.sensor.is_none() { recorded_sensors(source) } else { Ok(Vec::new()) }
    }

    /// Returns the sensors of all sources: of a recording of several, all, unless the options name one. One of several
    /// sources without a name ends the process.
    pub(super) fn every_sensor(&self, given: &[SensorSpec<'_>]) -> Result<Vec<NamedSource>, Error> {
        if given.len() > 1 && given.iter().any(|sensor| sensor.name.is_none()) {
            let message = "several sources need names, expected NAME=SOURCE for each";
            super::wrong_arguments(clap::error::ErrorKind::ArgumentConflict, message).exit();
        }
        if self.sensor.is_none() {
            return every_sensor(given).map_err(|error| {
                match given.iter().find(|sensor| sensor.source.to_string_lossy() == error.subject()) {
                    Some(wrong) => self.with_advice(wrong.source, error),
                    None => error,
                }
            });
        }
        let plain = |sensor: &SensorSpec<'_>| NamedSource {
            name: sensor.name.map(str::to_owned),
            source: sensor.source.to_owned(),
            recorded: None,
        };
        Ok(given.iter().map(plain).collect())
    }

    /// Returns the same arguments for one of the sensors that [`every_sensor`](Self::every_sensor) lists.
    pub(super) fn of(&self, sensor: &NamedSource) -> Self {
        Self { sensor: sensor.recorded.clone().or_else(|| self.sensor.clone()), ..self.clone() }
    }

    pub(super) fn with_format(&self, format: [u8; 4], size: (u32, u32)) -> Self {
        let options = OpenOptions { format: Some(format), size: Some(size), ..self.options.clone() };
        Self { options, matrix: None, range: None, readout: self.readout, sensor: self.sensor.clone() }
    }

    pub(super) fn asked_fps(&self) -> f64 {
        self.options.fps.unwrap_or(FrameRate::NOMINAL).per_second()
    }

    /// Returns the number of camera frames of a scene before its first slide; `None` for other sources.
    pub(super) fn frames_before_touch(&self, source: &OsStr) -> Result<Option<u64>, Error> {
        let Some(scene) = source.as_bytes().strip_prefix(b"scene:").map(OsStr::from_bytes) else { return Ok(None) };
        let scene = Scene::new(&script(scene, &self.options)?).map_err(|error| error.about(source.display()))?;
        Ok(scene.truth().first().map(Truth::start_frame))
    }
}

/// Returns whether a source gives the same frames if it is opened again: a file or a folder of frames, or a scene.
pub(super) fn can_be_read_again(source: &OsStr) -> bool {
    let is_file = Path::new(source).metadata().is_ok_and(|there| there.is_file() || there.is_dir());
    port_of(source).is_none() && (is_file || source.as_encoded_bytes().starts_with(b"scene:"))
}

/// Opens the models of `--model`; `None` without the option. `none` alone is no model.
pub(super) fn open_models(given: &[PathBuf]) -> Result<Option<Vec<ModelFile>>, Error> {
    let named = if given == [Path::new(NONE)] { &[] } else { given };
    (!given.is_empty()).then(|| ModelFile::open_all(named)).transpose()
}

/// Returns the models of a source: those that are given, or else `builtin` for a scene with a motion and a rate for
/// which it is accurate.
pub(super) fn models_of(
    given: Option<&[ModelFile]>,
    source: &OsStr,
    info: &StreamInfo,
    config: &Config,
) -> Result<Vec<ModelFile>, Error> {
    let is_by_wave = config.speed.estimator() == Some(Estimator::Wave);
    let has_best = source.as_bytes().starts_with(b"scene:") && is_by_wave && is_of_training(info);
    let best = has_best.then(|| BEST.into());
    given.map_or_else(|| ModelFile::open_all(best.as_slice()), |given| Ok(given.to_vec()))
}

/// Returns doubts about textures: if a recording was made with models and none is given now, or if frames come at
/// another rate than the models were trained at.
pub(super) fn doubts_of_textures(info: &StreamInfo, given: &[ModelFile]) -> Option<String> {
    let recorded = info.recorded.as_ref().map_or(&[][..], |recorded| &recorded.models);
    if given.is_empty() {
        let missing = !recorded.is_empty();
        missing.then(|| format!("recorded with model {}: --model gives its textures", recorded.join("; ")))
    } else {
        (!is_of_training(info)).then(|| {
            format!(
                "textures may be wrong: features come {:.2} times per second, and models are trained at {} unless \
                 their maker says otherwise",
                ratio_to_nominal(info) * FrameRate::NOMINAL.per_second(),
                FrameRate::NOMINAL.per_second()
            )
        })
    }
}

/// Returns how often features come, as a multiple of the nominal rate.
fn ratio_to_nominal(info: &StreamInfo) -> f64 {
    info.rate.per_second() / f64::from(info.rate.frames_added()) / FrameRate::NOMINAL.per_second()
}

/// Returns whether features come about as often as in the training of the models that come with the program.
fn is_of_training(info: &StreamInfo) -> bool {
    (1.0 - RATE_OFF..=1.0 + RATE_OFF).contains(&ratio_to_nominal(info))
}

/// The fraction by which the rate may differ from the nominal one without harm to textures.
const RATE_OFF: f64 = 0.1;
