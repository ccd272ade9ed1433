//! Reads one sensor: a camera, a file or a scene, or a board, which finds its events itself.

use std::os::unix::ffi::OsStrExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, SystemTime};

use serde_json::Value;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::monitor::{Report, port::port_of};
use wstac_host::output::{FrameFeatures, Output, OutputOptions, ReadoutUsed, StreamSummary};
use wstac_host::session::Observer;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{SourceEvent, config_of};
use wstac_host::station::{Station, Turn};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

use crate::arguments::{Arguments, NamedSource};
use crate::note;
use crate::publisher::PublisherHandle;
use crate::records::locked;

/// A sensor that is ready for reading.
pub(crate) struct ConnectedSensor {
    name: String,
    station: Station,
    is_camera: bool,
}

impl ConnectedSensor {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(named: &NamedSource, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        let NamedSource { name, source: source_name, recorded } = named;
        let options = match port_of(source_name) {
            // Ports of other kinds have no bits per second, and boards have none of the other options.
            Some(port) => {
                let baud = arguments.baud.filter(|_| port.as_bytes().starts_with(b"/"));
                OpenOptions { baud, ..OpenOptions::default() }
            }
            None => OpenOptions { sensor: recorded.clone(), ..arguments.camera.clone() },
        };
        let source = wstac::open_source(source_name, &options)?;
        let info = source.info().clone();
        let (file, models) = if info.is_board { (None, &[][..]) } else { (arguments.config.as_deref(), models) };
        let config = config_of(&info, file.map(Config::read).transpose()?)?;
        let mut station = Station::new(source, info, config, Textures::new(models)?, OutputOptions::LIVE)?;
        let is_camera = is_camera(source_name);
        if !is_camera {
            station = station.paced();
        }
        note(format_args!("{name}: {}", station.info().about));
        station.config().notes(station.info()).for_each(|text| note(format_args!("{name}: {text}")));
        Ok(Self { name: name.to_owned(), station, is_camera })
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    pub(crate) fn run(self, publisher: PublisherHandle, share: f64, ends: &AtomicBool) -> bool {
        let Self { name, mut station, is_camera } = self;
        let rate = station.info().rate;
        if !station.info().is_board {
            *locked(&publisher.counts().stated) = stated(&station);
        }
        if !is_camera && !station.info().is_board {
            // A frame of a file may last for hours.
            thread::sleep(Duration::from_secs_f64((share / rate.per_second()).min(1.0)));
        }
        let mut reader = PublishingObserver { name: &name, publisher, stamp: SystemTime::now() };
        let mut turn = Ok(Turn::Read);
        while !matches!(turn, Ok(Turn::Over) | Err(_)) {
            if ends.load(Ordering::Relaxed) {
                turn = station.finish(&mut reader).map(|()| Turn::Over);
                break;
            }
            turn = station.advance(&mut reader);
        }
        if let Err(error) = &turn {
            note(format_args!("{name}: {error}"));
        }
        turn.is_ok()
    }
}

/// Returns the readout that motion is computed with, and whether nothing states where taxels are, for the state of a
/// sensor.
fn stated(station: &Station) -> Vec<(&'static str, Value)> {
    let (config, info) = (station.config(), station.info());
    let note = config.layout_note(info).map(|_| ("note", "default-layout".into()));
    [("readout_ms", ReadoutUsed::of(config.readout(info)).ms().into())].into_iter().chain(note).collect()
}

/// Hands everything over that a session finds.
struct PublishingObserver<'a> {
    name: &'a str,
    publisher: PublisherHandle,
    /// The wall-clock time of the last frame: the driver's, or else when it was read.
    stamp: SystemTime,
}

impl PublishingObserver<'_> {
    fn report(&mut self, report: &Report) {
        let (name, counts) = (self.name, self.publisher.counts());
        let count = |stream: &StreamSummary| {
            counts.frames.store(stream.frames, Ordering::Relaxed);
            counts.lost.store(stream.dropped, Ordering::Relaxed);
        };
        self.stamp = SystemTime::now();
        if let Some(message) = report.message() {
            note(format_args!("{name}: {message}"));
        }
        match report {
            Report::Output(Output::End(stream)) | Report::Progress(stream) => count(stream),
            Report::LostEvents(lost) => _ = counts.lost_events.fetch_add(*lost, Ordering::Relaxed),
            // The clock of the board is used, and the rest of its state is for wstac run --status.
            Report::Output(_) | Report::Note(_) | Report::Telemetry(..) | Report::Request(_) => {}
        }
    }
}

impl Observer for PublishingObserver<'_> {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        match event {
            SourceEvent::Frame(frame) => {
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
            }
            SourceEvent::Taxels(frame) => {
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
            }
            SourceEvent::Lost { frames, reason } => self.publisher.counts().lose(*frames, reason),
            SourceEvent::Report(report) => self.report(report),
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        self.publisher.output(&output, self.stamp)?;
        if let Output::Features(features @ FrameFeatures { sums: Some(sums), .. }) = &output {
            self.publisher.taxels(features, sums, self.stamp);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[test]
    fn cameras_are_asked_for_what_is_given() {
        let words = ["wstac-node", "scene:Saw3@150", "--size", "640x360", "--fps", "60", "--format", "YUYV"];
        let arguments = Arguments::try_parse_from(words).unwrap();
        let named = arguments.sensors().unwrap().remove(0);
        let frames = ConnectedSensor::open(&named, &arguments, &[]).unwrap();
        let info = frames.station.info();
        assert_eq!((info.size.width(), info.size.height(), info.rate.per_second()), (640, 360, 60.0));
        assert!(info.format.is_ycbcr());
    }
}
