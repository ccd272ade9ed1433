//! Labeled slides of data sets, recordings and simulations.

use std::path::Path;

use wstac_core::model::file::{Input, Task};
use wstac_host::error::{Error, ErrorKind};

use super::TrainOptions;
use crate::dataset::arrays::name;
use crate::dataset::path::PathSlide;
use crate::dataset::random::RandomSweep;
use crate::dataset::recordings::Recording;
use crate::model::eval::{array_of, is_sample, label_arrays, samples, texts};
use crate::model::npz::Npz;
use crate::model::trained::in_set_order;

/// A slide with its label.
#[derive(Clone, Debug)]
pub struct LabeledSlide {
    /// Its sample, feature after feature as data sets have it; `None` if it has none of the wanted input.
    pub numbers: Option<Vec<i16>>,
    /// The right answer.
    pub label: String,
    /// Its sensor or recording: slides of one group are never split.
    pub group: String,
    /// Its speed in mm/s, as labeled or measured; `None` if it is not known.
    pub speed_mm_s: Option<f64>,
    /// Whether it is for tests; `None` if that is not decided yet.
    pub is_test: Option<bool>,
}

/// Labeled slides of one or more sources.
#[derive(Clone, Debug, Default)]
pub struct TrainingSet {
    /// The slides.
    pub slides: Vec<LabeledSlide>,
    /// Names of the sources.
    pub sources: Vec<String>,
    /// Number of the slides that were simulated for the training.
    pub simulated: usize,
}

impl TrainingSet {
    /// Takes over another set's slides.
    pub fn extend(&mut self, other: Self) {
        self.slides.extend(other.slides);
        self.sources.extend(other.sources);
        self.simulated += other.simulated;
    }

    /// Returns the names of the sources, of many only the first ones.
    pub(super) fn about(&self) -> String {
        const MOST: usize = 3;
        let names = self.sources.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
        let more = self.sources.len().saturating_sub(MOST);
        if more > 0 { format!("{names} and {more} more") } else { names }
    }

    /// Returns what to do for more slides of a texture.
    pub(super) fn more_slides(&self) -> &'static str {
        if self.is_simulated() { "let the sweep have more slides" } else { "record it in more recordings" }
    }

    /// Returns whether a sweep made all slides.
    pub(super) fn is_simulated(&self) -> bool {
        self.simulated == self.slides.len()
    }

    /// Returns all labels, in order.
    pub(super) fn labels(&self) -> Vec<String> {
        let mut labels: Vec<String> = self.slides.iter().map(|slide| slide.label.clone()).collect();
        labels.sort_unstable();
        labels.dedup();
        labels
    }

    /// Gathers simulated slides. Their groups are their sensors.
    pub fn of_sweep(sweep: &RandomSweep, slides: &[PathSlide], options: &TrainOptions) -> Self {
        let labeled = |slide: &PathSlide| {
            let specimen = &slide.slide.specimen;
            LabeledSlide {
                numbers: slide.sample(options.input).map(in_set_order),
                label: match options.task {
                    Task::Pattern => specimen.pattern.name().to_owned(),
                    Task::Depth => specimen.depth_mm.to_string(),
                    _ => name(specimen),
                },
                group: format!("sensor {}", slide.sensor),
                speed_mm_s: Some(slide.slide.speed_mm_s),
                is_test: Some(sweep.is_for_tests(slide.sensor)),
            }
        };
        let sources = vec!["simulated slides".to_owned()];
        Self { slides: slides.iter().map(labeled).collect(), sources, simulated: slides.len() }
    }

    /// Gathers the events of recordings. Their groups are the labels `sensor`, if every recording has one and there are
    /// at least two, or else the recordings.
    ///
    /// # Errors
    /// A depth is wanted, and a specimen's name has none.
    pub fn of_recordings(recordings: &[Recording], options: &TrainOptions) -> Result<Self, Error> {
        let sensors: Vec<Option<&String>> = recordings.iter().map(|recording| recording.sensor.as_ref()).collect();
        let by_sensor = sensors.iter().all(Option::is_some) && sensors.iter().any(|sensor| *sensor != sensors[0]);
        let mut set = Self::default();
        for recording in recordings {
            if options.task == Task::Depth && recording.depth_mm.is_none() {
                let found = &recording.specimen;
                let message = format_args!("label specimen is {found:?}, expected a name with a depth, such as Saw3");
                return Err(Error::new(ErrorKind::Data, &recording.name, message));
            }
            let label = recording.label(options.task);
            let group = match &recording.sensor {
                Some(sensor) if by_sensor => format!("sensor {sensor}"),
                _ => format!("recording {}", recording.name),
            };
            for event in 0..recording.samples.len() {
                let numbers = recording.sample(event, options.input).map(|sample| in_set_order(&sample));
                let (label, group) = (label.clone(), group.clone());
                let speed_mm_s = recording.speed_mm_s;
                set.slides.push(LabeledSlide { numbers, label, group, speed_mm_s, is_test: None });
            }
            set.sources.push(recording.name.clone());
        }
        Ok(set)
    }

    /// Reads a data set.
    ///
    /// Its groups are the sensors, if the array `sensor` has at least two, or else those of the array `recording`. A
    /// set without these is a group of its own. The array `split` says which slides are for tests.
    ///
    /// # Errors
    /// The file cannot be used; the message names the array.
    pub fn read(path: &Path, options: &TrainOptions) -> Result<Self, Error> {
        let npz = Npz::open(path)?;
        let array = array_of(options.input);
        let has = |name: &str| npz.names().any(|found| found == name);
        if !has(array) {
            let others = [Input::Path, Input::TaxelPath, Input::Frames, Input::Taxels];
            let other = others.into_iter().find(|input| has(array_of(*input)));
            let help = other.map_or_else(String::new, |input| {
                format!(": it has {} for --input {}", array_of(input), input.name().replace('_', "-"))
            });
            return Err(npz.error(array, format_args!("is missing, expected samples of the input{help}")));
        }
        let samples = samples(&npz, array, 1)?;
        let n = samples.len();
        let wanted = label_arrays(options.task);
        let labels = wanted.iter().find(|name| has(name)).copied().unwrap_or(wanted[0]);
        let labels = texts(&npz, labels, n)?;
        let optional = |name: &str| has(name).then(|| texts(&npz, name, n)).transpose();
        let sensors = optional("sensor")?.filter(|sensors| sensors.iter().any(|sensor| *sensor != sensors[0]));
        let groups = match (sensors, optional("recording")?) {
            (Some(sensors), _) => sensors.into_iter().map(|sensor| format!("sensor {sensor}")).collect(),
            (None, Some(names)) => names.into_iter().map(|name| format!("recording {name}")).collect(),
            (None, None) => vec![format!("data set {}", path.display()); n],
        };
        let splits = optional("split")?;
        let speeds = [optional("speed")?, optional("measured_speed")?];
        let speed_of = |number: usize| {
            let numbers = speeds.iter().flatten().filter_map(|column| column[number].parse().ok());
            numbers.into_iter().find(|speed: &f64| speed.is_finite())
        };
        let is_test = |number: usize| match splits.as_ref().map(|splits| splits[number].as_str()) {
            None => Ok(None),
            Some("train") => Ok(Some(false)),
            Some("test") => Ok(Some(true)),
            Some(other) => Err(npz.error("split", format_args!("has {other:?}, expected train or test"))),
        };
        let mut slides = Vec::with_capacity(n);
        for (number, ((sample, label), group)) in samples.into_iter().zip(labels).zip(groups).enumerate() {
            let (speed_mm_s, is_test) = (speed_of(number), is_test(number)?);
            let numbers = is_sample(&sample).then_some(sample);
            slides.push(LabeledSlide { numbers, label, group, speed_mm_s, is_test });
        }
        Ok(Self { slides, sources: vec![path.display().to_string()], simulated: 0 })
    }
}
