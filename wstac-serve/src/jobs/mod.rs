//! What a page has asked of a sensor: a recording, a calibration or an examination, one at a time.

mod calibration;
mod examination;
mod recording;

use std::time::{Duration, Instant};

use serde::Serialize;
use wstac_core::layout::Layout;
use wstac_host::camera::CameraState;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::output::Output;
use wstac_host::picture::Picture;
use wstac_host::session::Processor;
use wstac_host::source::{Labels, SourceEvent, StreamInfo};

use self::calibration::{Calibrated, Calibrating};
use self::examination::{Examined, Examining};
use self::recording::Recording;
use crate::tools::Tools;

/// Least time between two looks of the page at the progress of a job.
const BETWEEN_LOOKS: Duration = Duration::from_millis(150);

/// A job in progress.
enum Job {
    Recording(Box<Recording>),
    Calibration(Box<Calibrating>),
    Examination(Examining),
}

/// A job in progress, as the page gets it.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Progress {
    Recording(recording::Progress),
    Calibration(Box<calibration::Progress>),
    Examination(examination::Progress),
}

/// The result of a recording, as the page gets it.
#[derive(Debug, Serialize)]
struct Recorded {
    text: String,
    is_error: bool,
}

/// What the page shows of the jobs: the one in progress, and the last result of each kind.
#[derive(Debug, Serialize)]
struct Shown<'a> {
    job: Option<Progress>,
    layout: Option<LayoutShown>,
    recorded: &'a Option<Recorded>,
    calibrated: &'a Option<Calibrated>,
    examined: &'a Option<Examined>,
}

/// The layout since a calibration.
#[derive(Debug, Serialize)]
struct LayoutShown {
    taxel: [u16; 2],
    corners: Vec<[u16; 2]>,
}

/// The jobs of a sensor.
pub(crate) struct Jobs {
    tools: Tools,
    /// The name of the sensor, if it has one.
    name: Option<String>,
    /// The stream and the configuration in use.
    info: StreamInfo,
    pub(crate) config: Config,
    job: Option<Job>,
    recorded: Option<Recorded>,
    calibrated: Option<Calibrated>,
    examined: Option<Examined>,
    /// The layout in use, if a calibration gave it.
    layout: Option<Layout>,
    /// The light that a calibration has seen, if the page has not got it yet.
    glow: Option<Picture>,
    /// The number of the next proposal.
    proposal: u64,
    /// Whether the page is to see a change at once.
    is_urgent: bool,
    looked: Option<Instant>,
    /// What the page has got last.
    seen: String,
    /// Lines for the person who started the program.
    told: Vec<String>,
    /// Recordings that could not be written.
    failures: usize,
}

/// A recording whose file is open and which has not begun.
pub(crate) struct OpenRecording(Box<Recording>);

/// Why something that a person asked for cannot be done now.
pub(crate) type Refusal = String;

impl Jobs {
    pub(crate) fn new(name: Option<&str>, info: StreamInfo, config: Config, tools: Tools) -> Self {
        Self {
            tools,
            name: name.map(str::to_owned),
            info,
            config,
            job: None,
            recorded: None,
            calibrated: None,
            examined: None,
            layout: None,
            glow: None,
            proposal: 1,
            is_urgent: false,
            looked: None,
            seen: String::new(),
            told: Vec::new(),
            failures: 0,
        }
    }

    /// Refuses a second job, and a new baseline while a recording is in progress, whose replay would not know of it.
    pub(crate) fn expect_none(&self, is_baseline: bool) -> Result<(), Refusal> {
        let what = match self.job {
            None => return Ok(()),
            Some(Job::Recording(_)) => "a recording",
            _ if is_baseline => return Ok(()),
            Some(Job::Calibration(_)) => "a calibration",
            Some(Job::Examination(_)) => "an examination",
        };
        Err(format!("{what} is in progress, expected none: end it first"))
    }

    /// Opens a recording. If it is refused, nothing has changed; otherwise the caller restarts `processor` and then
    /// [begins](Self::record) it.
    pub(crate) fn open_recording(&self, mut labels: Labels, processor: &Processor) -> Result<OpenRecording, Refusal> {
        self.expect_none(false)?;
        let Some(folder) = &self.tools.record_to else {
            return Err("recording is off: start wstac serve with --record-to FOLDER".to_owned());
        };
        if let Some(name) = &self.name {
            labels.entry("sensor".to_owned()).or_insert_with(|| name.clone());
        }
        let name = self.name.as_deref().unwrap_or("wstac");
        let described = (&self.info, &self.config, &*self.tools.models);
        let recording = Recording::start(folder, name, labels, described, processor);
        recording.map(|recording| OpenRecording(Box::new(recording))).map_err(|error| error.to_string())
    }

    /// Begins a recording, whose first frame is the next one.
    pub(crate) fn record(&mut self, OpenRecording(recording): OpenRecording) {
        self.recorded = None;
        self.begin(Job::Recording(recording));
    }

    /// Starts a calibration.
    pub(crate) fn calibrate(&mut self) -> Result<(), Refusal> {
        self.expect_none(false)?;
        let calibrating = Calibrating::start(&self.info).map_err(|error| error.to_string())?;
        self.calibrated = None;
        self.begin(Job::Calibration(Box::new(calibrating)));
        Ok(())
    }

    /// Starts an examination.
    pub(crate) fn examine(&mut self) -> Result<(), Refusal> {
        self.expect_none(false)?;
        let examining = Examining::start(&self.info, &self.config, &self.tools).map_err(|error| error.to_string())?;
        self.examined = None;
        self.begin(Job::Examination(examining));
        Ok(())
    }

    fn begin(&mut self, job: Job) {
        (self.job, self.is_urgent) = (Some(job), true);
    }

    /// Finds the whiskers in what the calibration in progress has seen.
    pub(crate) fn find(&mut self) -> Result<(), Refusal> {
        let Some(Job::Calibration(calibrating)) = &mut self.job else {
            return Err("there is no calibration in progress, expected one".to_owned());
        };
        if calibrating.is_found() {
            return Ok(());
        }
        self.is_urgent = true;
        let found = calibrating.find(self.proposal);
        self.glow = calibrating.glow.take();
        match found {
            Ok(()) => self.proposal += 1,
            Err(refused) => (self.calibrated, self.job) = (Some(refused), None),
        }
        Ok(())
    }

    /// Uses a calibration that a person has confirmed, and writes it. Returns the layout of the taxels.
    ///
    /// `apply` makes the sensor use the configuration. If anything fails, nothing has changed.
    pub(crate) fn confirm(
        &mut self,
        proposal: u64,
        apply: impl FnOnce(&StreamInfo, &Config) -> Result<Layout, Error>,
    ) -> Result<Layout, Refusal> {
        let Some(Job::Calibration(calibrating)) = &self.job else {
            return Err("there is no calibration in progress, expected one".to_owned());
        };
        let found = calibrating.proposed(proposal);
        let found = found.ok_or("this calibration is not the one that is shown now: look at it again")?;
        let (config, text) = found.applied_to(&self.config, &self.info.about).map_err(|error| error.to_string())?;
        // Whatever could refuse it does so before the file is written.
        config.pipeline(&self.info).map_err(|error| error.to_string())?;
        let done = if let Some(file) = &mut self.tools.calibrate_to {
            (file.write)(&text).map_err(|error| error.to_string())?;
            self.told.push(format!("wrote {}", file.name));
            Calibrated::confirmed(format!("The new layout is used, and {} has it.", file.name), None)
        } else {
            Calibrated::confirmed("The new layout is used until the server ends.".to_owned(), Some(text))
        };
        let layout = apply(&self.info, &config).map_err(|error| error.to_string())?;
        (self.config, self.layout, self.calibrated) = (config, Some(layout), Some(done));
        (self.job, self.is_urgent) = (None, true);
        Ok(layout)
    }

    /// Returns whether an examination is in progress.
    pub(crate) fn is_examining(&self) -> bool {
        matches!(self.job, Some(Job::Examination(_)))
    }

    /// Ends the job in progress. A recording is complete then; a calibration and an examination have no result.
    pub(crate) fn stop(&mut self) -> Result<(), Refusal> {
        match self.job {
            None => Err("nothing is in progress".to_owned()),
            Some(Job::Recording(_)) => {
                self.end_recording();
                Ok(())
            }
            Some(Job::Calibration(_) | Job::Examination(_)) => {
                (self.job, self.is_urgent) = (None, true);
                Ok(())
            }
        }
    }

    /// Ends the recording in progress, if there is one.
    pub(crate) fn end_recording(&mut self) {
        let Some(Job::Recording(recording)) = self.job.take_if(|job| matches!(job, Job::Recording(_))) else { return };
        let written = recording.finish();
        self.failures += usize::from(written.is_err());
        let is_error = written.is_err();
        let text = written.unwrap_or_else(|error| error.to_string());
        self.told.push(text.clone());
        (self.recorded, self.is_urgent) = (Some(Recorded { text, is_error }), true);
    }

    /// Takes an event of the source before it is processed.
    pub(crate) fn source_event(&mut self, event: &SourceEvent<'_>) {
        match &mut self.job {
            Some(Job::Recording(recording)) => recording.source_event(event),
            Some(Job::Calibration(calibrating)) => {
                let is_last = calibrating.take(event);
                self.glow = calibrating.glow.take().or(self.glow.take());
                if is_last {
                    // A refusal is a result, and nobody asked.
                    let _ = self.find();
                }
            }
            Some(Job::Examination(_)) | None => {}
        }
    }

    pub(crate) fn output(&mut self, output: &Output) {
        if let Some(Job::Recording(recording)) = &mut self.job {
            recording.output(output, self.tools.words);
        }
    }

    /// Takes an event of the source after its outputs. `camera` is the state of the camera.
    pub(crate) fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor, camera: Option<&CameraState>) {
        match &mut self.job {
            Some(Job::Recording(recording)) => {
                if !recording.processed(event, processor) {
                    self.end_recording();
                }
            }
            Some(Job::Examination(examining)) => {
                let is_over = examining.take(event);
                if !matches!(is_over, Ok(false)) {
                    self.end_examination(is_over.err(), camera);
                }
            }
            Some(Job::Calibration(_)) | None => {}
        }
    }

    fn end_examination(&mut self, error: Option<Error>, camera: Option<&CameraState>) {
        let Some(Job::Examination(examining)) = self.job.take_if(|job| matches!(job, Job::Examination(_))) else {
            return;
        };
        let examined = match error {
            Some(error) => Err(error),
            None => examining.finish((&self.info, &self.config, &self.tools), camera),
        };
        let examined = examined.unwrap_or_else(|error| Examined::failed(&error));
        (self.examined, self.is_urgent) = (Some(examined), true);
    }

    /// Ends all jobs: the source has ended or failed. A calibration that waits for a person's word stays.
    pub(crate) fn end(&mut self) {
        self.end_recording();
        if self.job.take_if(|job| !matches!(job, Job::Calibration(found) if found.is_found())).is_some() {
            self.is_urgent = true;
        }
    }

    /// Returns the light that a calibration has seen, if the page has not got it yet.
    pub(crate) fn glow(&mut self) -> Option<Picture> {
        self.glow.take()
    }

    /// Returns what the page shows of the jobs, if that has changed and is due.
    pub(crate) fn news(&mut self) -> Option<String> {
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= BETWEEN_LOOKS);
        if !(self.is_urgent || self.job.is_some() && is_due) {
            return None;
        }
        (self.is_urgent, self.looked) = (false, Some(Instant::now()));
        let job = self.job.as_ref().map(|job| match job {
            Job::Recording(recording) => Progress::Recording(recording.progress()),
            Job::Calibration(calibrating) => Progress::Calibration(Box::new(calibrating.progress())),
            Job::Examination(examining) => Progress::Examination(examining.progress()),
        });
        let layout =
            self.layout.map(|layout| LayoutShown { taxel: layout.taxel(), corners: layout.corners().to_vec() });
        let Self { recorded, calibrated, examined, .. } = &*self;
        // Numbers and texts can always be JSON.
        let text = serde_json::to_string(&Shown { job, layout, recorded, calibrated, examined }).ok()?;
        let is_new = self.seen != text;
        self.seen.clone_from(&text);
        is_new.then_some(text)
    }

    /// Returns the lines for the person who started the program since the last time.
    pub(crate) fn told(&mut self) -> Vec<String> {
        std::mem::take(&mut self.told)
    }

    /// Returns the number of recordings that could not be written.
    pub(crate) fn failures(&self) -> usize {
        self.failures
    }

    /// Returns the folder of recordings and the file of calibrations, for people.
    pub(crate) fn places(tools: &Tools) -> [Option<String>; 2] {
        let folder = tools.record_to.as_ref().map(|folder| folder.display().to_string());
        [folder, tools.calibrate_to.as_ref().map(|file| file.name.clone())]
    }
}
