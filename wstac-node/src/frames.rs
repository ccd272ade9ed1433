//! Reads one source of frames: a camera, a file or a scene.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::thread;
use std::time::{Duration, SystemTime};

use serde_json::Value;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{FrameFeatures, Output, OutputOptions, ReadoutUsed};
use wstac_host::plural::counted;
use wstac_host::record::{FinishedRecording, first_free_file, new_file};
use wstac_host::session::{Observer, Processor};
use wstac_host::source::open::{OpenOptions, SourceKind, open};
use wstac_host::source::{FramePolicy, SourceEvent, config_of};
use wstac_host::station::{Station, Turn};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

use crate::arguments::{Arguments, NamedSource};
use crate::note;
use crate::orders::{Action, Order, path_in, replace, shown};
use crate::publisher::PublisherHandle;
use crate::ros::picture::RosImageShape;
use crate::sums::FrameSums;

/// The kinds of sources besides files.
const KINDS: &[&dyn SourceKind] = &[&wstac_linux::source::Cameras, &wstac_scene::source::Scenes];

/// A source of frames that is ready for reading.
pub(crate) struct FrameSource {
    name: String,
    station: Station,
    picture: Option<RosImageShape>,
    is_camera: bool,
}

impl FrameSource {
    /// Opens a source.
    ///
    /// # Errors
    /// The source, the configuration or a model cannot be used.
    pub(crate) fn open(named: &NamedSource, arguments: &Arguments, models: &[ModelFile]) -> Result<Self, Error> {
        let NamedSource { name, source: source_name, recorded } = named;
        let options =
            OpenOptions { delivery: delivery(arguments), sensor: recorded.clone(), ..arguments.camera.clone() };
        let source = open(source_name, &options, KINDS)?;
        let info = source.info().clone();
        let given = arguments.config.as_deref().map(Config::read).transpose()?;
        let config = config_of(&info, given)?;
        let mut station = Station::new(source, info, config, Textures::new(models)?, OutputOptions::LIVE)?;
        let is_camera = is_camera(source_name);
        if !is_camera {
            station = station.paced();
        }
        note(format_args!("{name}: {}", station.info().about));
        station.config().notes(station.info()).for_each(|text| note(format_args!("{name}: {text}")));
        let picture = RosImageShape::of(station.info());
        if arguments.picture && picture.is_none() {
            note(format_args!("{name}: its frames are no pictures of ROS 2; they are not published"));
        }
        Ok(Self { name: name.to_owned(), station, picture, is_camera })
    }

    /// Reads to the end of the source, or until `ends` is set. Returns whether the source did not fail.
    pub(crate) fn run(
        self,
        publisher: PublisherHandle,
        orders: &Receiver<Order>,
        share: f64,
        ends: &AtomicBool,
    ) -> bool {
        let Self { name, mut station, picture, is_camera } = self;
        let rate = station.info().rate;
        replace(&publisher.counts().stated, stated(&station));
        if !is_camera {
            // A frame of a file may last for hours.
            thread::sleep(Duration::from_secs_f64((share / rate.per_second()).min(1.0)));
        }
        let (stamp, sums) = (SystemTime::now(), FrameSums::new(rate));
        let mut reader = PublishingObserver { publisher, picture, stamp, completed: None, sums };
        let (mut turn, mut is_good) = (Ok(Turn::Read), true);
        while !matches!(turn, Ok(Turn::Over) | Err(_)) {
            if ends.load(Ordering::Relaxed) {
                turn = station.finish(&mut reader).map(|()| Turn::Over);
                break;
            }
            // One for each frame: whoever asks without end does not hold up the sensor.
            if matches!(turn, Ok(Turn::Read))
                && let Ok(order) = orders.try_recv()
            {
                order.answer(|action| follow(action, &name, &mut station, &mut reader));
            }
            if let Some(full) = station.take_recorded() {
                // The sensor goes on without a recording for which the disk has no room.
                note(recorded(full).unwrap_or_else(|error| error.to_string()));
            }
            turn = station.advance(&mut reader);
        }
        if let Err(error) = &turn {
            note(format_args!("{name}: {error}"));
            is_good = false;
        }
        if let Some(recorded) = station.take_recorded().map(recorded) {
            is_good &= recorded.is_ok();
            note(format_args!("{name}: {}", recorded.unwrap_or_else(|error| error.to_string())));
        }
        is_good
    }
}

/// Returns which frames of a camera are read: all, if they can be recorded. Otherwise the newest one is worth more than
/// those before it.
fn delivery(arguments: &Arguments) -> FramePolicy {
    if arguments.files.is_some() { FramePolicy::Every } else { FramePolicy::Newest }
}

/// Returns a line about a recording.
fn recorded(recorded: Result<FinishedRecording, Error>) -> Result<String, Error> {
    recorded.map(|recorded| {
        let FinishedRecording { path, written, .. } = &recorded;
        let (frames, doubt) = (counted(written.frames, "frame"), recorded.doubt());
        format!("{}: {frames} recorded, {:.1} MB{doubt}", path.display(), written.bytes as f64 / 1e6)
    })
}

/// Does what a service asks. Returns a text for people.
///
/// # Errors
/// A file cannot be used, or the sensor is in a state in which it cannot be done. Nothing has changed then.
fn follow(action: Action, name: &str, station: &mut Station, reader: &mut PublishingObserver) -> Result<String, Error> {
    let state = |why: &str| Err(Error::new(ErrorKind::Usage, name, why));
    match action {
        // Whatever else changes, a replay of the recording would not know of it.
        Action::StopRecording => match station.end_recording().transpose() {
            Some(ended) => recorded(ended),
            None => state("has no recording in progress"),
        },
        _ if station.recording().is_some() => state("has a recording in progress; stop it first"),
        Action::RestartBaseline => {
            station.rezero();
            Ok("the baseline is gathered; leave the sensor untouched for 25 frames".to_owned())
        }
        Action::UseConfig { config, file } => {
            // The sample under way ends here. Numbers and times of frames go on.
            station.reconfigure(*config)?;
            reader.sums.restart();
            replace(&reader.publisher.counts().stated, stated(station));
            replace(&reader.publisher.settings().config, shown(&file));
            Ok(format!("{} is used", file.display()))
        }
        Action::UseModel { textures, file } => {
            station.set_textures(textures);
            replace(&reader.publisher.settings().models, vec![shown(&file)]);
            Ok(format!("{} is used", file.display()))
        }
        Action::StartRecording { folder, file, features_only, labels } => {
            if station.info().taxels_only && !features_only {
                return state("has taxel sums and no frames, expected features_only");
            }
            station.record(|| file_of(&folder, &file, name), labels, features_only)?;
            reader.sums.restart();
            Ok(station.recording().map(|recording| recording.path.display().to_string()).unwrap_or_default())
        }
    }
}

/// Returns the readout that motion is computed with, and whether nothing states where taxels are, for the state of a
/// sensor.
fn stated(station: &Station) -> Vec<(&'static str, Value)> {
    let (config, info) = (station.config(), station.info());
    let note = config.layout_note(info).map(|_| ("note", "default-layout".into()));
    [("readout_ms", ReadoutUsed::of(config.readout(info)).ms().into())].into_iter().chain(note).collect()
}

/// Creates the file of this name, or the first one that is free: SENSOR-1.mcap, SENSOR-2.mcap …
fn file_of(folder: &Path, file: &str, sensor: &str) -> Result<(File, PathBuf), Error> {
    if file.is_empty() {
        return first_free_file(|number| folder.join(format!("{sensor}-{number}.mcap")));
    }
    let path = path_in(Some(folder), file)?;
    Ok((new_file(&path)?, path))
}

/// Hands everything over that a session finds.
struct PublishingObserver {
    publisher: PublisherHandle,
    picture: Option<RosImageShape>,
    /// The wall-clock time of the last frame: the driver's, or else when it was read.
    stamp: SystemTime,
    /// The features that the last event of the source has completed.
    completed: Option<FrameFeatures>,
    /// The taxel sums that the next features are made of.
    sums: FrameSums,
}

impl Observer for PublishingObserver {
    type Error = Error;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Error> {
        match event {
            SourceEvent::Frame(frame) => {
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
                if let Some(picture) = self.picture {
                    self.publisher.picture(picture, frame.bytes, self.stamp);
                }
            }
            SourceEvent::Taxels(frame) => {
                self.stamp = frame.stamp.map_or_else(SystemTime::now, |stamp| stamp.time);
            }
            SourceEvent::Lost { frames, reason } => self.publisher.counts().lose(*frames, reason),
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Error> {
        if let Output::Features(features) = &output {
            self.completed = Some(*features);
        }
        self.publisher.output(&output, self.stamp)
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        let is_frame = matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        if let Some(sums) = processor.taxel_sums().filter(|_| is_frame) {
            self.sums.add(&sums);
        }
        if let Some(features) = self.completed.take()
            && let Some(sums) = self.sums.complete()
        {
            self.publisher.taxels(&features, &sums, self.stamp);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::{SyncSender, channel, sync_channel};

    use clap::Parser;

    use super::*;
    use crate::orders::Control;
    use crate::publisher::Queue;

    fn arguments(more: &[&str]) -> Arguments {
        Arguments::try_parse_from(["wstac-node", "scene:Saw3@150"].iter().chain(more)).unwrap()
    }

    #[test]
    fn every_frame_is_read_if_it_can_be_recorded() {
        assert_eq!(delivery(&arguments(&[])), FramePolicy::Newest);
        assert_eq!(delivery(&arguments(&["--ros", "--files", "."])), FramePolicy::Every);
    }

    /// Gives an order that notes the next frame and gives another one: there is always one that waits.
    fn ask(orders: &SyncSender<Order>, count: u64, done: Arc<dyn Fn(u64) + Send + Sync>) {
        let again = orders.clone();
        let answer = move |_| {
            done(count);
            if count < 9 {
                ask(&again, count + 1, done);
            }
        };
        orders.send(Order::new("sensor", Action::StopRecording, Box::new(answer))).unwrap();
    }

    #[test]
    fn cameras_are_asked_for_what_is_given() {
        let arguments = arguments(&["--size", "640x360", "--fps", "60", "--format", "YUYV"]);
        let named = arguments.sensors().unwrap().remove(0);
        let frames = FrameSource::open(&named, &arguments, &[]).unwrap();
        let info = frames.station.info();
        assert_eq!((info.size.width(), info.size.height(), info.rate.per_second()), (640, 360, 60.0));
        assert!(info.format.is_ycbcr());
    }

    #[test]
    fn whoever_asks_without_end_does_not_hold_up_a_sensor() {
        let arguments = arguments(&[]);
        let named = arguments.sensors().unwrap().remove(0);
        let frames = FrameSource::open(&named, &arguments, &[]).unwrap();
        let (control, _) = Control::new(&named.name, "", &arguments);
        let (queue, _found) = Queue::of_test();
        let counts = Arc::clone(&queue.counts);
        let publisher = PublisherHandle::new(queue, Arc::clone(&control.settings), &arguments);
        let ends = Arc::new(AtomicBool::new(false));
        let (seen, frames_seen) = channel();
        let (orders, arriving) = sync_channel(1);
        let stop = Arc::clone(&ends);
        let done = move |count| {
            seen.send(counts.frames.load(Ordering::Relaxed)).unwrap();
            stop.store(count == 9, Ordering::Relaxed);
        };
        ask(&orders, 0, Arc::new(done));
        assert!(frames.run(publisher, &arriving, 0.0, &ends));
        // One order for each frame.
        assert_eq!(frames_seen.try_iter().collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
    }

    #[test]
    fn names_are_new_ones() {
        let folder = std::env::temp_dir().join(format!("wstac-node-names-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let of = |file: &str| file_of(&folder, file, "left").map(|(_, path)| path).map_err(|error| error.to_string());
        let found = ["", "", "a.mcap", "a.mcap", "../b.mcap"].map(of);
        std::fs::remove_dir_all(&folder).unwrap();
        let expected = ["left-1.mcap", "left-2.mcap", "a.mcap"].map(|name| Ok(folder.join(name)));
        assert_eq!(found[..3], expected);
        assert!(found[3].as_ref().is_err_and(|error| error.contains("a.mcap")), "{:?}", found[3]);
        assert!(found[4].as_ref().is_err_and(|error| error.contains("without folders")), "{:?}", found[4]);
    }
}
