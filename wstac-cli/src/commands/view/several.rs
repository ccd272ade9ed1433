//! Opens several sensors for `wstac view`.

use std::ffi::OsStr;

use super::super::output::{Stop, note};
use super::super::source_arguments::SourceArguments;
use super::{Arguments, can_reopen, counts, ended};
use crate::view::several::{Frames, Opened, Outcome, Sensor, run};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::monitor::pictures::port_of;
use wstac_host::monitor::port::Port;
use wstac_host::output::{Output, OutputOptions, StreamClock};
use wstac_host::session::{Processor, Session};
use wstac_host::source::names;
use wstac_host::source::{FramePolicy, StreamInfo};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

/// Refuses what one sensor alone can do.
fn check(arguments: &Arguments, has_board: bool) -> Result<(), Error> {
    let refused = |option: &str, only: &str| {
        Err(Error::new(ErrorKind::Usage, option, format_args!("is given, expected it only with {only}")))
    };
    match arguments {
        Arguments { record: Some(_), .. } => {
            refused("--record", "one sensor: wstac record writes a recording of several")
        }
        Arguments { baud: Some(_), .. } if !has_board => refused("--baud", "a board"),
        _ => Ok(()),
    }
}

/// Shows sources with names.
pub(super) fn watch(sensors: &[names::Sensor<'_>], arguments: &Arguments) -> Result<(), Stop> {
    check(arguments, sensors.iter().any(|sensor| port_of(sensor.source).is_some()))?;
    let files = ModelFile::open_all(&arguments.models)?;
    let textures = Textures::new(&files)?;
    let mut opened = Vec::with_capacity(sensors.len());
    for names::Sensor { name, source } in sensors {
        let sensor = match port_of(source) {
            Some(port) => Opened::Board(Port::open(port, arguments.baud)?),
            None => open(source, arguments.options.clone(), arguments, &textures, 0.0)?,
        };
        opened.push(Sensor { name: name.unwrap_or_default().to_owned(), opened: sensor });
    }
    show(opened, arguments)
}

/// Shows all sensors of a recording.
pub(super) fn watch_recording(source: &OsStr, names: &[String], arguments: &Arguments) -> Result<(), Stop> {
    check(arguments, false)?;
    let files = ModelFile::open_all(&arguments.models)?;
    let textures = Textures::new(&files)?;
    let options: Vec<_> = names.iter().map(|name| arguments.options.of_sensor(name)).collect();
    let zeros = options.iter().map(|options| zero(source, options)).collect::<Result<Vec<_>, _>>()?;
    let first = zeros.iter().copied().fold(f64::INFINITY, f64::min);
    let sensors = names.iter().zip(options).zip(zeros).map(|((name, options), zero)| {
        let opened = open(source, options, arguments, &textures, zero - first)?;
        Ok::<_, Error>(Sensor { name: name.clone(), opened })
    });
    show(sensors.collect::<Result<_, _>>()?, arguments)
}

/// Returns the time of a recorded sensor's frame 0 in seconds of the driver's clock; 0 if it has no such times.
fn zero(source: &OsStr, options: &SourceArguments) -> Result<f64, Error> {
    let (source, info) = options.open(source, FramePolicy::Newest)?;
    if info.clock == StreamClock::Frames {
        return Ok(0.0);
    }
    let period = f64::from(info.rate.frames_added()) / info.rate.per_second();
    let wanted = OutputOptions { features: true, ..OutputOptions::default() };
    let mut session = Session::builder(source).info(info).outputs(wanted).build()?;
    let first = session.find_map(|output| match output {
        Ok(Output::Features(frame)) => Some(Ok((frame.frame, frame.time_ns))),
        Ok(_) => None,
        Err(error) => Some(Err(error)),
    });
    Ok(match first.transpose()? {
        Some((frame, Some(time_ns))) => time_ns as f64 / 1e9 - frame as f64 * period,
        _ => 0.0,
    })
}

/// Opens a source with frames, of which the first is at `start` on the time line.
fn open<'a>(
    source: &'a OsStr,
    options: SourceArguments,
    arguments: &'a Arguments,
    textures: &Textures,
    start: f64,
) -> Result<Opened<'a>, Error> {
    let (live, can_reopen) = (is_camera(source), can_reopen(source));
    let name = source;
    let (source, info, config) = options.open_configured(name, FramePolicy::Newest, arguments.config.as_deref())?;
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    let textures = textures.clone();
    let processor =
        move |info: &StreamInfo| Ok::<_, Error>(Processor::new(info, &config, wanted)?.with_textures(textures.clone()));
    let first = processor(&info)?;
    let reopen = move || {
        let (source, info) = options.open(name, FramePolicy::Newest)?;
        let processor = processor(&info)?;
        Ok((source, processor))
    };
    let reopen = can_reopen.then(|| Box::new(reopen) as _);
    Ok(Opened::Frames(Box::new(Frames { source, info, processor: first, reopen, live, start })))
}

/// Shows sensors, and says what was seen of each.
fn show(sensors: Vec<Sensor<'_>>, arguments: &Arguments) -> Result<(), Stop> {
    let count = sensors.len();
    let outcomes = run(sensors, arguments.fast, false)?;
    let mut failures = 0;
    for Outcome { name, ending, failure } in &outcomes {
        note(format_args!("{name}: {}", counts(ending)));
        if let Some(error) = failure {
            note(format_args!("{name}: {error}"));
            failures += 1;
        }
    }
    if failures > 0 {
        return Err(Error::new(ErrorKind::Data, format_args!("{failures} of {count} sensors"), "failed").into());
    }
    outcomes.first().map_or(Ok(()), |outcome| ended(&outcome.ending))
}
