//! Samples of recordings: one for every event, with its recording's labels.
//!
//! Frames are read again, so the samples are those of the current program, whatever version recorded them.

use std::path::{Path, PathBuf};

use wstac_core::model::file::{Input, Task};
use wstac_core::rate::FrameRate;

use super::path::path_sample;
use super::{Facts, Sample, by_feature, session};
use crate::model::trained::vec_in_file_order;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::{Output, Paths};
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::source::Labels;
use wstac_host::source::mcap::McapSource;
use wstac_host::texture::pattern_and_depth;

pub use wstac_host::record::labels::{NAMES, check};

/// A part of a recording: what one of its sensors has recorded.
#[derive(Clone, Debug, Eq, PartialEq)]
pub struct RecordingPart {
    /// The recording.
    pub file: PathBuf,
    /// Name of one of several sensors; `None` for a recording of one.
    pub sensor: Option<String>,
}

impl RecordingPart {
    /// Returns the path, for one of several sensors with `:` and the sensor's name behind it.
    pub fn name(&self) -> String {
        let file = self.file.display();
        self.sensor.as_ref().map_or_else(|| file.to_string(), |sensor| format!("{file}:{sensor}"))
    }

    fn open(&self) -> Result<McapSource, Error> {
        McapSource::open_sensor(&self.file, self.sensor.as_deref(), None)
    }
}

/// A recording's samples and labels.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Its path, as given or found; of one of several sensors with `:` and the sensor's name behind it.
    pub name: String,
    /// The path alone.
    pub file: PathBuf,
    /// Name of the specimen.
    pub specimen: String,
    /// Pattern by the specimen's name.
    pub pattern: String,
    /// Depth by the specimen's name in mm, if it has one.
    pub depth_mm: Option<f64>,
    /// Speed in mm/s, if it is labeled.
    pub speed_mm_s: Option<f64>,
    /// Direction in degrees, if it is labeled.
    pub direction: Option<u16>,
    /// Its events: number of the first frame, sample, facts.
    pub samples: Vec<(u64, Box<Sample>, Facts)>,
    /// Its samples along the path, one for each event; empty unless they were read ([`read_paths`]).
    pub paths: Vec<Paths>,
    /// Name of the sensor, if it is labeled.
    pub sensor: Option<String>,
    /// Number of events that a gap or the end interrupted.
    pub incomplete: u64,
    about: About,
    config: Config,
}

impl Recording {
    /// Creates a recording without its samples, with its own configuration unless another is given.
    ///
    /// # Errors
    /// Its labels or its configuration cannot be used.
    fn labeled(part: &RecordingPart, about: &About, config: Option<Config>) -> Result<Self, Error> {
        let name = part.name();
        let own = || Config::parse(&about.configuration).map_err(|error| error.about(&name));
        let config = config.map_or_else(own, Ok)?;
        let recording = labeled(&name, &about.labels, about, config);
        let mut recording = recording.map_err(|message| Error::new(ErrorKind::Data, &name, message))?;
        part.file.clone_into(&mut recording.file);
        recording.sensor = recording.sensor.or_else(|| part.sensor.clone());
        Ok(recording)
    }

    /// Returns the samples along the path that a model of this input takes, one for each event; `None` for an event
    /// without one, and for all unless they were read ([`read_paths`]).
    pub fn path_samples(&self, input: Input) -> Vec<Option<&[i16]>> {
        let none = self.samples.iter().skip(self.paths.len()).map(|_| None);
        self.paths.iter().map(|paths| path_sample(paths, input)).chain(none).collect()
    }

    /// Returns the sample of an event that a model of this input takes, frame by frame as it does; `None` without one.
    pub fn sample(&self, event: usize, input: Input) -> Option<Vec<i16>> {
        match input {
            Input::Frames => {
                let sample = self.samples.get(event)?.1.as_flattened();
                Some(vec_in_file_order(sample))
            }
            _ => path_sample(self.paths.get(event)?, input).map(<[i16]>::to_vec),
        }
    }

    /// Returns the label that a model of this task should give to its events. A depth that is not known is empty.
    pub fn label(&self, task: Task) -> String {
        match task {
            Task::Pattern => self.pattern.clone(),
            Task::Depth => self.depth_mm.map_or_else(String::new, |depth| depth.to_string()),
            _ => self.specimen.clone(),
        }
    }

    /// Returns the frames per second of its camera.
    pub fn rate(&self) -> FrameRate {
        self.about.info.rate
    }
}

/// Finds recordings by name, each once: files as given, and every `.mcap` of a folder, in order.
///
/// # Errors
/// A file or folder cannot be read, or a folder has no recordings.
pub fn find(sources: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let mut found: Vec<PathBuf> = Vec::new();
    for source in sources {
        let failed = |error: std::io::Error| Error::io(source.display(), error);
        if !source.metadata().map_err(failed)?.is_dir() {
            found.push(source.clone());
            continue;
        }
        let mut inside = Vec::new();
        for entry in source.read_dir().map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
                inside.push(path);
            }
        }
        if inside.is_empty() {
            return Err(Error::new(
                ErrorKind::Data,
                source.display(),
                "has no .mcap file, expected a folder of recordings",
            ));
        }
        inside.sort();
        found.append(&mut inside);
    }
    let mut seen = Vec::new();
    found.retain(|path| {
        let real = path.canonicalize().unwrap_or_else(|_| path.clone());
        let is_new = !seen.contains(&real);
        seen.push(real);
        is_new
    });
    Ok(found)
}

/// Returns the parts of recordings: of a file with several sensors one for each.
///
/// A file that cannot be read is one part, so that whoever reads the parts names all such files.
pub fn parts(files: Vec<PathBuf>) -> Vec<RecordingPart> {
    let mut found = Vec::new();
    for file in files {
        let names = McapSource::sensors(&file).unwrap_or_default();
        let sensors = if names.is_empty() { vec![None] } else { names.into_iter().map(Some).collect() };
        found.extend(sensors.into_iter().map(|sensor| RecordingPart { file: file.clone(), sensor }));
    }
    found
}

/// Reads the labels and the description of a recording, without its samples.
///
/// # Errors
/// The recording cannot be read, or its labels cannot be used.
pub fn read_labels(part: &RecordingPart, config: Option<&Config>) -> Result<Recording, Error> {
    Recording::labeled(part, part.open()?.about(), config.cloned())
}

/// Reads a recording, or one sensor of a recording of several, with its own configuration unless another is given.
///
/// # Errors
/// The recording cannot be read, its labels cannot be used, or the configuration does not fit it.
pub fn read(part: &RecordingPart, config: Option<&Config>) -> Result<Recording, Error> {
    read_with(part, config, false)
}

/// Reads a recording as [`read`] does, with the samples along the paths of its events.
///
/// # Errors
/// [`read`] fails.
pub fn read_paths(part: &RecordingPart, config: Option<&Config>) -> Result<Recording, Error> {
    read_with(part, config, true)
}

fn read_with(part: &RecordingPart, config: Option<&Config>, paths: bool) -> Result<Recording, Error> {
    let source = part.open()?;
    let about = source.about().clone();
    let mut recording = Recording::labeled(part, &about, config.cloned())?;
    for output in session(source, &recording.config, paths)? {
        match output? {
            Output::Event(event) => {
                let sample = event.sample.as_deref().map(by_feature);
                recording.samples.extend(sample.map(|sample| (event.frame, sample, Facts::of(&event))));
                recording.paths.extend(event.paths.map(|paths| *paths));
            }
            Output::Interrupted(_) => recording.incomplete += 1,
            Output::End(end) => recording.incomplete += u64::from(end.incomplete.is_some()),
            _ => {}
        }
    }
    Ok(recording)
}

/// Creates a recording without its samples.
fn labeled(name: &str, labels: &Labels, about: &About, config: Config) -> Result<Recording, String> {
    let found = || labels.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(", ");
    let Some(specimen) = labels.get("specimen") else {
        return Err(format!("has no label specimen (labels: {}), expected a label such as specimen=Saw3", found()));
    };
    let (speed_mm_s, direction) = check(labels)?;
    let (pattern, depth_mm) = pattern_and_depth(specimen);
    Ok(Recording {
        name: name.into(),
        file: name.into(),
        specimen: specimen.clone(),
        pattern: pattern.unwrap_or_default(),
        depth_mm,
        speed_mm_s,
        direction,
        samples: Vec::new(),
        paths: Vec::new(),
        sensor: labels.get("sensor").cloned(),
        incomplete: 0,
        about: about.clone(),
        config,
    })
}

/// Checks that the recordings' samples can be compared, and returns doubts about them for a person.
///
/// # Errors
/// Features of two recordings do not have the same meaning; the message names both.
pub fn comparable(recordings: &[Recording]) -> Result<Vec<String>, Error> {
    let mut doubts = Vec::new();
    let Some(first) = recordings.first() else { return Ok(doubts) };
    let features = |recording: &Recording| {
        let Config { green, features, trigger, .. } = &recording.config;
        format!("{green:?} {features:?} {trigger:?}")
    };
    let nominal = |recording: &Recording| recording.rate().nominal_frames();
    let mut kinds = [
        ("their layouts differ", 0),
        ("their pixel formats or sizes differ", 0),
        ("their [speed] differs, and so may durations", 0),
    ];
    for other in recordings {
        let differ = |what: &str, hint: &str| {
            Err(Error::new(
                ErrorKind::Data,
                &other.name,
                format_args!("{what} differs from that of {}{hint}", first.name),
            ))
        };
        if features(other) != features(first) {
            return differ("its [green], [features] or [trigger]", "; help: --config FILE reads all of them with one");
        }
        if (nominal(other) - nominal(first)).abs() > 0.01 * nominal(first) {
            return differ("its rate of frames", "; help: train on recordings of one rate");
        }
        let info = |recording: &Recording| (recording.about.info.format, recording.about.info.size);
        kinds[0].1 += u32::from(format!("{:?}", other.config.layout) != format!("{:?}", first.config.layout));
        kinds[1].1 += u32::from(info(other) != info(first));
        kinds[2].1 += u32::from(format!("{:?}", other.config.speed) != format!("{:?}", first.config.speed));
        let camera = other.about.info.camera.as_deref();
        if let Some(camera) = camera.filter(|camera| camera.is_unlocked()) {
            let loose = camera.controls.iter().filter(|control| !control.locked);
            let loose: Vec<&str> = loose.map(|control| control.name.as_str()).collect();
            doubts.push(format!(
                "{}: the camera was not locked ({}): light may have drifted",
                other.name,
                loose.join(", ")
            ));
        }
    }
    let differing = kinds.into_iter().filter(|(_, recordings)| *recordings > 0);
    doubts.extend(
        differing.map(|(what, count)| format!("{} unlike {}: {what}", counted(count, "recording"), first.name)),
    );
    Ok(doubts)
}

/// Returns for each recording whether it is for tests.
///
/// Each specimen gives this fraction of its recordings, at least one if there are two or more. A recording is never
/// split, and sensors of one file stay together.
pub fn for_tests(recordings: &[Recording], share: f64) -> Vec<bool> {
    let mut tests = vec![false; recordings.len()];
    let mut specimens: Vec<&str> = recordings.iter().map(|recording| recording.specimen.as_str()).collect();
    specimens.sort_unstable();
    specimens.dedup();
    for specimen in specimens {
        let of_it = |recording: &Recording| recording.specimen == specimen;
        let members = recordings.iter().filter(|recording| of_it(recording));
        let mut files: Vec<&Path> = members.map(|recording| recording.file.as_path()).collect();
        // Sensors of one file stand side by side.
        files.dedup();
        // Sorted by a number from the file's name: it does not depend on other files, and has no order of time.
        files.sort_by_key(|file| crc32fast::hash(file.file_name().unwrap_or_default().as_encoded_bytes()));
        files.truncate(share_of(files.len(), share));
        for (test, recording) in tests.iter_mut().zip(recordings) {
            *test |= of_it(recording) && files.contains(&recording.file.as_path());
        }
    }
    tests
}

/// Returns how many of so many recordings or groups a share is: never all, and at least one of two if the share is
/// above 0.
pub(crate) fn share_of(count: usize, share: f64) -> usize {
    let most = count.saturating_sub(1);
    let least = usize::from(share > 0.0).min(most);
    ((share * count as f64).round() as usize).clamp(least, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_host::camera::{CameraState, LockedControl};
    use wstac_host::source::Source;
    use wstac_scene::source::SceneSource;

    fn recording(name: &str, specimen: &str, configuration: &str, change: impl Fn(&mut About)) -> Recording {
        let script = wstac_scene::SceneConfig::from_toml("s", "specimen = \"Saw3\"\nspeed = 150").unwrap();
        let info = SceneSource::new(&script).unwrap().info().clone();
        let labels = Labels::from([("specimen".into(), specimen.into())]);
        let config = Config::parse(configuration).unwrap();
        let mut about = About::new(&info, &config, labels, Vec::new()).unwrap();
        change(&mut about);
        labeled(name, &about.labels, &about, config).unwrap()
    }

    #[test]
    fn what_cannot_be_compared_is_refused_and_what_is_doubtful_is_said() {
        let plain = || recording("a", "Saw3", "", |_| {});
        let doubts = |other| comparable(&[plain(), other]);
        assert_eq!(doubts(plain()).unwrap(), [""; 0]);
        let error = doubts(recording("b", "Saw3", "[trigger]\nwindow = 6", |_| {})).unwrap_err().to_string();
        assert!(error.starts_with("b: its [green]") && error.contains("that of a"), "{error}");
        let fast = |about: &mut About| about.info.rate = FrameRate::new(40, 1).unwrap();
        assert!(doubts(recording("b", "Saw3", "", fast)).unwrap_err().to_string().contains("rate of frames"));
        let unlocked = |about: &mut About| {
            let control = LockedControl { name: "Gain".into(), ..LockedControl::default() };
            about.info.camera = Some(Box::new(CameraState { controls: vec![control], ..CameraState::default() }));
        };
        let said = doubts(recording("b", "Saw3", "[speed]\nthreshold = 0.1", unlocked)).unwrap().join("\n");
        assert!(said.contains("b: the camera was not locked (Gain)") && said.contains("[speed] differs"), "{said}");
    }

    #[test]
    fn a_share_of_every_specimens_recordings_is_for_tests() {
        let names: Vec<String> = (0..23).map(|k| format!("{k}.mcap")).collect();
        let specimen = |k: usize| ["Saw3", "Fla0", "Tri2"][usize::from(k >= 10) + usize::from(k == 22)];
        let all: Vec<Recording> = (0..23).map(|k| recording(&names[k], specimen(k), "", |_| {})).collect();
        let tests = for_tests(&all, 0.2);
        let of = |name| (0..23).filter(|&k| specimen(k) == name && tests[k]).count();
        assert_eq!((of("Saw3"), of("Fla0"), of("Tri2")), (2, 2, 0));
        assert!(!for_tests(&all, 0.0).contains(&true));
    }

    #[test]
    fn labels_are_checked() {
        let with = |labels: &[(&str, &str)]| {
            let plain = recording("a", "Saw3", "", |_| {});
            let labels = labels.iter().map(|&(name, value)| (name.into(), value.into())).collect();
            labeled("a", &labels, &plain.about, plain.config.clone())
        };
        let good = with(&[("specimen", "Saw3"), ("speed", "150.5"), ("direction", "90")]).unwrap();
        assert_eq!((good.speed_mm_s, good.direction, good.depth_mm), (Some(150.5), Some(90), Some(3.0)));
        assert!(with(&[("speed", "150")]).unwrap_err().contains("no label specimen (labels: speed=150)"));
        assert!(with(&[("specimen", "Saw3"), ("speed", "fast")]).unwrap_err().contains("speed is \"fast\""));
        assert!(with(&[("specimen", "Saw3"), ("direction", "360")]).unwrap_err().contains("direction is \"360\""));
    }
}
