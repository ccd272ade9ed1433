//! The job that a page has asked of a sensor: a recording, a calibration or an examination, one at a time.

mod calibration;
mod examination;

use std::time::{Duration, Instant};

use serde::Serialize;
use wstac_core::layout::Layout;
use wstac_host::error::Error;
use wstac_host::picture::Picture;
use wstac_host::record::{FinishedRecording, first_free_file};
use wstac_host::source::{Labels, SourceEvent};
use wstac_host::station::Station;

use self::calibration::{Calibrated, Calibrating};
use self::examination::{Examined, Examining};
use crate::tools::Tools;

/// Least time between two looks of the page at the progress of a job.
const BETWEEN_LOOKS: Duration = Duration::from_millis(150);

enum Job {
    /// The station has it. It has these labels.
    Recording(Labels),
    Calibration(Box<Calibrating>),
    Examination(Examining),
}

/// A job in progress, as the page gets it.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Progress {
    Recording(RecordingProgress),
    Calibration(Box<calibration::CalibrationProgress>),
    Examination(examination::ExaminationProgress),
}

/// A recording in progress, as the page gets it.
#[derive(Debug, Serialize)]
struct RecordingProgress {
    file: String,
    labels: Labels,
    frames: u64,
    lost: u64,
    events: u64,
    /// Frames that wait for the disk.
    waiting: u64,
}

/// The result of a recording, as the page gets it.
#[derive(Debug, Serialize)]
struct RecordingResult {
    text: String,
    is_error: bool,
}

/// The jobs as the page shows them: the one in progress, and the last result of each kind.
#[derive(Debug, Serialize)]
struct Shown<'a> {
    job: Option<Progress>,
    layout: Option<LayoutShown>,
    recorded: &'a Option<RecordingResult>,
    calibrated: &'a Option<Calibrated>,
    examined: &'a Option<Examined>,
}

/// The layout since a calibration.
#[derive(Debug, Serialize)]
struct LayoutShown {
    taxel: [u16; 2],
    corners: Vec<[u16; 2]>,
}

#[derive(Default)]
pub(crate) struct Jobs {
    tools: Tools,
    name: Option<String>,
    job: Option<Job>,
    recorded: Option<RecordingResult>,
    calibrated: Option<Calibrated>,
    examined: Option<Examined>,
    /// The layout in use, if a calibration gave it.
    layout: Option<Layout>,
    /// The light that a calibration has seen, if the page has not got it yet.
    pub(crate) glow: Option<Picture>,
    /// The number of the next proposal.
    proposal: u64,
    /// Whether the page is to see a change at once.
    is_urgent: bool,
    looked: Option<Instant>,
    /// The state of the jobs that the page has got last, as JSON.
    seen: String,
    /// Lines for the person who started the program.
    told: Vec<String>,
    /// Recordings that could not be written.
    pub(crate) failures: usize,
}

/// Why something that a person asked for cannot be done now.
pub(crate) type JobRefusal = String;

impl Jobs {
    pub(crate) fn new(name: Option<&str>, tools: Tools) -> Self {
        Self { tools, name: name.map(str::to_owned), proposal: 1, ..Self::default() }
    }

    /// Refuses a second job, and a new baseline while a recording is in progress, whose replay would not know of it.
    pub(crate) fn expect_none(&self, is_baseline: bool) -> Result<(), JobRefusal> {
        let what = match self.job {
            None => return Ok(()),
            Some(Job::Recording(_)) => "a recording",
            _ if is_baseline => return Ok(()),
            Some(Job::Calibration(_)) => "a calibration",
            Some(Job::Examination(_)) => "an examination",
        };
        Err(format!("{what} is in progress; end it first"))
    }

    /// Starts a recording, whose first frame is the next one. If it is refused, nothing has changed.
    pub(crate) fn record(&mut self, mut labels: Labels, station: &mut Station) -> Result<(), JobRefusal> {
        self.expect_none(false)?;
        let Some(folder) = &self.tools.record_to else {
            return Err("recording is off: start wstac serve with --record-to FOLDER".to_owned());
        };
        if let Some(name) = &self.name {
            labels.entry("sensor".to_owned()).or_insert_with(|| name.clone());
        }
        let name = self.name.as_deref().unwrap_or("wstac");
        let create = || first_free_file(|number| folder.join(format!("{name}-{number}.mcap")));
        station.record(create, labels.clone(), false).map_err(|error| error.to_string())?;
        self.recorded = None;
        self.begin(Job::Recording(labels));
        Ok(())
    }

    pub(crate) fn calibrate(&mut self, station: &Station) -> Result<(), JobRefusal> {
        self.expect_none(false)?;
        let calibrating = Calibrating::start(station.info()).map_err(|error| error.to_string())?;
        self.calibrated = None;
        self.begin(Job::Calibration(Box::new(calibrating)));
        Ok(())
    }

    pub(crate) fn examine(&mut self, station: &Station) -> Result<(), JobRefusal> {
        self.expect_none(false)?;
        let examining = Examining::start(station, &self.tools).map_err(|error| error.to_string())?;
        self.examined = None;
        self.begin(Job::Examination(examining));
        Ok(())
    }

    fn begin(&mut self, job: Job) {
        (self.job, self.is_urgent) = (Some(job), true);
    }

    /// Finds the whiskers in what the calibration in progress has seen.
    pub(crate) fn find(&mut self) -> Result<(), JobRefusal> {
        let Some(Job::Calibration(calibrating)) = &mut self.job else {
            return Err("there is no calibration in progress; start one first".to_owned());
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

    /// Uses a calibration that a person has confirmed, and writes it. If anything fails, nothing has changed.
    pub(crate) fn confirm(&mut self, proposal: u64, station: &mut Station) -> Result<(), JobRefusal> {
        let refused = |error: Error| error.to_string();
        let Some(Job::Calibration(calibrating)) = &self.job else {
            return Err("there is no calibration in progress; start one first".to_owned());
        };
        let found = calibrating.proposed(proposal);
        let found = found.ok_or("this calibration is not the one that is shown now: look at it again")?;
        let (config, text) = found.applied_to(station.config(), &station.info().about).map_err(refused)?;
        // Whatever could refuse it does so before the file is written.
        config.pipeline(station.info()).map_err(refused)?;
        let done = if let Some(file) = &mut self.tools.calibrate_to {
            (file.write)(&text).map_err(refused)?;
            self.told.push(format!("wrote {}", file.name));
            Calibrated::confirmed(format!("The new layout is used, and {} has it.", file.name), None)
        } else {
            Calibrated::confirmed("The new layout is used until the server ends.".to_owned(), Some(text))
        };
        station.reconfigure(config).map_err(refused)?;
        (self.layout, self.calibrated) = (Some(*station.processor().geometry().layout()), Some(done));
        (self.job, self.is_urgent) = (None, true);
        Ok(())
    }

    /// Ends the job in progress. A recording is complete then; a calibration and an examination have no result.
    pub(crate) fn stop(&mut self, station: &mut Station) -> Result<(), JobRefusal> {
        match self.job.take() {
            None => return Err("nothing is in progress".to_owned()),
            Some(Job::Recording(_)) => {
                if let Some(recorded) = station.end_recording().transpose() {
                    self.recorded(recorded);
                }
            }
            Some(Job::Calibration(_) | Job::Examination(_)) => self.is_urgent = true,
        }
        Ok(())
    }

    fn recorded(&mut self, recorded: Result<FinishedRecording, Error>) {
        let is_error = recorded.is_err();
        self.failures += usize::from(is_error);
        let text = recorded.map_or_else(|error| error.to_string(), |recorded| recorded.to_string());
        self.told.push(text.clone());
        (self.recorded, self.is_urgent) = (Some(RecordingResult { text, is_error }), true);
    }

    /// Looks at what has ended by itself, and tells the person who started the program.
    pub(crate) fn look(&mut self, station: &mut Station, tell: &dyn Fn(&str)) {
        if let Some(recorded) = station.take_recorded() {
            self.job = None;
            self.recorded(recorded);
        }
        if let Some(Job::Examination(examining)) =
            self.job.take_if(|job| matches!(job, Job::Examination(examining) if examining.is_over()))
        {
            let examined = examining.finish(station, &self.tools).unwrap_or_else(|error| Examined::failed(&error));
            (self.examined, self.is_urgent) = (Some(examined), true);
        }
        self.told.drain(..).for_each(|line| tell(&line));
    }

    /// Takes an event of the source before it is processed.
    pub(crate) fn source_event(&mut self, event: &SourceEvent<'_>) {
        match &mut self.job {
            Some(Job::Calibration(calibrating)) => {
                let is_last = calibrating.take(event);
                self.glow = calibrating.glow.take().or(self.glow.take());
                if is_last {
                    // A refusal is a result, and nobody asked.
                    let _ = self.find();
                }
            }
            Some(Job::Examination(examining)) => examining.take(event),
            Some(Job::Recording(_)) | None => {}
        }
    }

    /// Ends all jobs: the source has ended or failed. A calibration that waits for a person's word stays.
    pub(crate) fn end(&mut self) {
        if self.job.take_if(|job| !matches!(job, Job::Calibration(found) if found.is_found())).is_some() {
            self.is_urgent = true;
        }
    }

    /// Returns what the page shows of the jobs, if that has changed and is due.
    pub(crate) fn news(&mut self, station: &Station) -> Option<String> {
        let is_due = self.looked.is_none_or(|at| at.elapsed() >= BETWEEN_LOOKS);
        if !(self.is_urgent || self.job.is_some() && is_due) {
            return None;
        }
        (self.is_urgent, self.looked) = (false, Some(Instant::now()));
        let job = self.job.as_ref().and_then(|job| {
            Some(match job {
                Job::Recording(labels) => {
                    let (recording, labels) = (station.recording()?, labels.clone());
                    Progress::Recording(RecordingProgress {
                        file: recording.path.display().to_string(),
                        labels,
                        frames: recording.frames,
                        lost: recording.lost,
                        events: recording.events,
                        waiting: recording.waiting(),
                    })
                }
                Job::Calibration(calibrating) => Progress::Calibration(Box::new(calibrating.progress())),
                Job::Examination(examining) => Progress::Examination(examining.progress()),
            })
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
}
