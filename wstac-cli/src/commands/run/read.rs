//! Reads the sources of one run: files in the order of their frames' times, others each in its own thread to its end.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use super::super::csv::Table;
use super::super::output::{LossReport, Stop, note};
use super::super::records::{Destination, Form, Records};
use super::super::signals::{Ending, finishing};
use super::super::source_arguments::{can_be_read_again, doubts_of_textures, models_of};
use super::Arguments;
use super::no_event::NoEvent;
use super::range::Range;
use wstac_core::params::LONGEST_FILLED_GAP;
use wstac_core::reason::Reason;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::monitor::port::port_of;
use wstac_host::monitor::{Report, telemetry};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::plural::counted;
use wstac_host::session::{Observer, Processor, Session, Step};
use wstac_host::source::decorate::Limited;
use wstac_host::source::every_sensor::NamedSource;
use wstac_host::source::{FaultKind, FramePolicy, Lag, SourceEvent};
use wstac_host::texture::{NoTexture, Textures};

/// The settings that all sensors of a run share.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) arguments: &'a Arguments,
    /// The form of the records, the kind of record of a table, and where they go.
    pub(super) form: Form,
    pub(super) table: Table,
    pub(super) destination: &'a Destination,
    /// The models of `--model`, if there are any.
    pub(super) given: Option<&'a [ModelFile]>,
    /// Requests the end.
    pub(super) interrupted: &'a AtomicBool,
}

impl<'a> Run<'a> {
    /// Opens a sensor.
    ///
    /// # Errors
    /// Returns an error if the source, the configuration or a model cannot be used.
    pub(super) fn open(self, sensor: &NamedSource) -> Result<Reading<'a>, Stop> {
        if port_of(&sensor.source).is_some() { self.open_board(sensor) } else { self.open_frames(sensor) }
    }

    fn records(self, sensor: &NamedSource) -> Records<'a> {
        let records = Records::to(self.destination, self.form, self.table);
        records.of_sensor(sensor.name.as_deref()).quiet(self.arguments.quiet)
    }

    fn ending(self) -> Ending {
        if self.arguments.file().is_some() { Ending::Whole } else { Ending::InTime }
    }

    fn wanted(self) -> OutputOptions {
        let Arguments { features, samples, motion, .. } = *self.arguments;
        OutputOptions { features, samples, motion, ..OutputOptions::default() }
    }

    fn open_board(self, sensor: &NamedSource) -> Result<Reading<'a>, Stop> {
        let arguments = self.arguments;
        let Arguments { frames, since, until, save_raw, baseline_at, .. } = arguments;
        let has_times = since.is_some() || until.is_some() || baseline_at.is_some();
        if frames.is_some() || has_times || save_raw.is_some() {
            let message = "is a board; leave out --frames, --since, --until, --baseline-at and --save-raw, which are for \
                           frames";
            return Err(Error::new(ErrorKind::Usage, sensor.source.display(), message).into());
        }
        let has_files = arguments.config.is_some() || !arguments.models.is_empty();
        let board = arguments.options.open_board(&sensor.source, arguments.baud, has_files)?;
        let session = Session::builder(board).outputs(self.wanted()).build()?;
        finishing(self.ending());
        let hint = "no model was given: wstac board --model builtin sends one to firmware with the feature models";
        Ok(self.reading(session, self.records(sensor), Some(hint)))
    }

    fn reading(self, session: Session, records: Records<'a>, hint: Option<&'static str>) -> Reading<'a> {
        let Self { arguments, interrupted, .. } = self;
        let mut no_event = NoEvent::default();
        no_event.is_board = session.info().is_board;
        let printer = Printer {
            records,
            raw: None,
            range: Range::new(arguments.since, arguments.until),
            outputs: VecDeque::new(),
            losses: LossReport::default(),
            no_event,
            uneven: None,
            unreliable: 0,
            hint,
            has_status: arguments.status,
            lost_events: 0,
            read_ns: 0,
            printed_ns: 0,
        };
        Reading { session, printer, interrupted, ended: None }
    }

    fn open_frames(self, sensor: &NamedSource) -> Result<Reading<'a>, Stop> {
        let Self { arguments, given, .. } = self;
        let records = self.records(sensor);
        if arguments.baseline_at.is_some() && !can_be_read_again(&sensor.source) {
            let message = "can be read only once, expected a file, a folder or a scene with --baseline-at";
            return Err(Error::new(ErrorKind::Usage, sensor.source.display(), message).into());
        }
        let delivery = if arguments.save_raw.is_some() { FramePolicy::Every } else { FramePolicy::Newest };
        let options = arguments.options.of(sensor);
        let (source, info, config) = options.open_configured(&sensor.source, delivery, arguments.config.as_deref())?;
        let files = models_of(given, &sensor.source, &info, &config)?;
        let mut session = Session::builder(Limited::new(source, arguments.frames))
            .info(info.clone())
            .config(config.clone())
            .outputs(self.wanted())
            .textures(Textures::new(&files)?);
        if let Some(seconds) = arguments.baseline_at {
            session = session.baseline_from(options.open(&sensor.source, delivery)?.0, seconds);
        }
        let session = session.build()?;
        // Only after opening and reading a baseline, which a signal ends at once, and before the first output.
        finishing(self.ending());
        records.note(&info.about);
        records.assumptions(&info, &config);
        let doubt = doubts_of_textures(&info, &files).inspect(|doubt| records.note(doubt));
        let hint = (given.is_none() && doubt.is_none()).then_some("no model was given: --model builtin names textures");
        config.doubts().for_each(|doubt| records.note(doubt));
        if let Some(doubt) = config.readout_note(&info) {
            let more = if config.readout(&info).is_none() { ", or give --readout MS" } else { "" };
            records.note(format_args!("{doubt}{more}"));
        }
        if info.rate.frames_added() > 1 {
            records.note(format_args!("{} camera frames are added up to one feature frame", info.rate.frames_added()));
        }
        if info.taxels_only && arguments.save_raw.is_some() {
            let message =
                "has no frames for --save-raw, expected a recording with pictures, or fidelity = \"rendered\"";
            return Err(Error::new(ErrorKind::Unsupported, &info.about, message).into());
        }
        let raw = arguments.save_raw.as_deref().map(RawFile::create).transpose()?;
        let mut reading = self.reading(session, records, hint);
        reading.printer.raw = raw;
        Ok(reading)
    }

    /// Reads all sensors, after all of them were opened. Each continues to its own end if others fail.
    ///
    /// # Errors
    /// Returns the number of sensors that failed. Each reports its own reason as soon as it fails.
    pub(super) fn all(self, sensors: &[NamedSource]) -> Result<(), Stop> {
        let is_at_rest = sensors.iter().all(|sensor| can_be_read_again(&sensor.source));
        let failures = if is_at_rest { self.in_order(sensors) } else { self.at_once(sensors) };
        if failures == 0 {
            return Ok(());
        }
        Err(Error::new(ErrorKind::Data, format_args!("{failures} of {} sensors", sensors.len()), "failed").into())
    }

    /// Reads the sensors of files frame by frame in the order of the frames' times, so that the records of every run
    /// have the same order. Returns how many failed.
    fn in_order(self, sensors: &[NamedSource]) -> usize {
        let opened: Vec<_> = sensors.iter().map(|sensor| (sensor, self.open_frames(sensor))).collect();
        if opened.iter().any(|(_, open)| open.is_err()) {
            let failed = opened.into_iter().filter(|(sensor, open)| !self.has_read(sensor, open.as_ref().map(drop)));
            return failed.count();
        }
        let readings = opened.into_iter().filter_map(|(sensor, open)| Some((sensor, open.ok()?)));
        let mut readings: Vec<_> = readings.collect();
        let mut failures = 0;
        while let Some(at) = (0..readings.len()).min_by_key(|at| readings[*at].1.next_ns()) {
            let (sensor, reading) = &mut readings[at];
            if let Some(ended) = reading.go_on() {
                failures += usize::from(!self.has_read(sensor, ended.as_ref().copied()));
                readings.remove(at);
            }
        }
        failures
    }

    /// Returns whether a sensor was read to its end, or reports why not.
    fn has_read(self, sensor: &NamedSource, result: Result<(), &Stop>) -> bool {
        match result {
            Ok(()) => true,
            Err(Stop::Failed(error)) => {
                let name = sensor.name.as_ref().map_or_else(|| sensor.source.to_string_lossy(), Into::into);
                note(format_args!("{name}: {error}"));
                false
            }
            Err(Stop::OutputClosed | Stop::Interrupted(_)) => {
                // Nobody reads the records of any sensor any more.
                self.interrupted.store(true, Ordering::Relaxed);
                true
            }
        }
    }

    /// Reads all sensors at once, each in its own thread. Returns how many failed.
    fn at_once(self, sensors: &[NamedSource]) -> usize {
        let (opened, failed) = (Barrier::new(sensors.len()), AtomicBool::new(false));
        let result_of = |sensor: &NamedSource| {
            let open = self.open(sensor);
            if open.is_err() {
                failed.store(true, Ordering::Relaxed);
            }
            opened.wait();
            match open {
                // The sensor that could not be opened reports the reason.
                Ok(_) if failed.load(Ordering::Relaxed) => Ok(()),
                Ok(opened) => opened.read(),
                Err(stop) => Err(stop),
            }
        };
        let succeeded = |sensor: &NamedSource| self.has_read(sensor, result_of(sensor).as_ref().copied());
        thread::scope(|scope| {
            let threads: Vec<_> = sensors.iter().map(|sensor| scope.spawn(|| succeeded(sensor))).collect();
            threads.into_iter().map(|thread| thread.join().unwrap_or(false)).filter(|succeeded| !succeeded).count()
        })
    }
}

/// A source that is ready for reading, or is being read.
pub(super) struct Reading<'a> {
    session: Session,
    printer: Printer<'a>,
    interrupted: &'a AtomicBool,
    /// The result of reading, once it has ended. Outputs may wait to be printed even then.
    ended: Option<Result<(), Stop>>,
}

impl Reading<'_> {
    /// Reads until the source ends or fails, or a signal requests the end. The end record is always written.
    ///
    /// # Errors
    /// Returns the error of the source, or of writing.
    pub(super) fn read(mut self) -> Result<(), Stop> {
        loop {
            if let Some(ended) = self.go_on() {
                return ended;
            }
        }
    }

    /// Returns the time of what it does next: of the output that it prints, or up to which it has read. No output that
    /// follows is about an earlier frame, apart from answers about a touch that is over.
    fn next_ns(&self) -> u64 {
        let Printer { outputs, read_ns, printed_ns, .. } = &self.printer;
        outputs.front().map_or(*read_ns, |output| output.time_ns().map_or(*printed_ns, |time| time.max(*printed_ns)))
    }

    /// Prints the next output, or reads the next item of the source if all are printed. Returns the result once
    /// everything is read and printed.
    fn go_on(&mut self) -> Option<Result<(), Stop>> {
        self.printer.printed_ns = self.next_ns();
        let printed = self.printer.print_next(self.session.processor());
        match (printed, &mut self.ended) {
            (Ok(true), _) => return None,
            (Ok(false), None) => {
                self.ended = self.read_next();
                return None;
            }
            // A failure of the source, or of the file of --save-raw, matters more than the output.
            (Err(_), Some(Err(Stop::Failed(_)))) | (Ok(false), Some(_)) => {}
            (Err(stop), ended) => *ended = Some(Err(stop)),
        }
        let ended = self.ended.take();
        self.say(matches!(ended, Some(Ok(()))));
        ended
    }

    /// Reads the next item of the source. Returns the result if it was the last one.
    fn read_next(&mut self) -> Option<Result<(), Stop>> {
        let Self { session, printer, interrupted, .. } = self;
        let stepped = if interrupted.load(Ordering::Relaxed) || printer.range.is_over(session.processor()) {
            session.finish(printer).map(|()| Step::Over)
        } else {
            session.step(printer)
        };
        match stepped {
            Ok(Step::GoesOn) => None,
            Ok(Step::Over) if interrupted.load(Ordering::Relaxed) => Some(Ok(())),
            Ok(Step::Over) => Some(printer.losses.expect_a_frame(&session.info().about).map_err(Stop::from)),
            Err(stop) => {
                // The end is printed whatever happens.
                let _ = session.finish(printer);
                Some(Err(stop))
            }
        }
    }

    /// Says at the end what was lost, and why there was no event, unless an error says it.
    fn say(&self, has_succeeded: bool) {
        let Self { session, printer, .. } = self;
        printer.losses.say(|message| printer.records.note(message));
        if let Some(uneven) = &printer.uneven {
            match printer.unreliable {
                0 => printer.records.note(uneven),
                1 => printer.records.note(format_args!("{uneven}; 1 event is not reliable for it")),
                events => printer.records.note(format_args!("{uneven}; {events} events are not reliable for it")),
            }
        }
        say_lag(session.lag(), &printer.records);
        // The frames behind --until were not read, so nothing is known of them.
        let is_known = has_succeeded && !printer.range.is_over(session.processor());
        if let Some(reason) = printer.no_event.reason().filter(|_| is_known) {
            printer.records.note(reason);
        }
        if printer.range.left_out > 0 {
            let events = counted(printer.range.left_out, "event");
            printer.records.note(format_args!("{events} outside of --since and --until"));
        }
    }
}

/// Prints a session's outputs, counts its frames and saves their bytes.
struct Printer<'a> {
    records: Records<'a>,
    raw: Option<RawFile>,
    range: Range,
    /// The outputs that are not printed yet.
    outputs: VecDeque<Output>,
    losses: LossReport,
    no_event: NoEvent,
    /// The last that the source says about frames that come unevenly or are missing in the file, and the events that
    /// are not reliable and have such frames.
    uneven: Option<String>,
    unreliable: u64,
    /// The note for the first slide without a texture because there is no model.
    hint: Option<&'static str>,
    /// Whether the state of a board is reported, and the number of its events that were lost.
    has_status: bool,
    lost_events: u64,
    /// The time of the last frame that was read, in nanoseconds.
    read_ns: u64,
    /// The latest time of what was printed.
    printed_ns: u64,
}

impl Printer<'_> {
    /// Prints the next output if it is in the range. Returns whether there was one.
    fn print_next(&mut self, processor: &Processor) -> Result<bool, Stop> {
        let Some(output) = self.outputs.pop_front() else { return Ok(false) };
        if let Some((output, time_s)) = self.range.select(output, processor) {
            // The rate of a board is not known here, and its records have their own times.
            self.records.write_at(&output, time_s.filter(|_| !self.no_event.is_board))?;
        }
        Ok(true)
    }
}

impl Observer for Printer<'_> {
    type Error = Stop;

    fn source_event(&mut self, event: &SourceEvent<'_>) -> Result<(), Stop> {
        self.losses.source_event(event);
        match event {
            SourceEvent::Frame(frame) => {
                if let Some(raw) = &mut self.raw {
                    raw.write(frame.bytes)?;
                }
            }
            SourceEvent::Fault(fault) if matches!(fault.kind, FaultKind::Uneven | FaultKind::Spacing) => {
                self.uneven = Some(fault.to_string());
            }
            SourceEvent::Report(Report::Note(text)) => self.records.note(text),
            SourceEvent::Report(report @ Report::LostEvents(lost)) => {
                self.lost_events += lost;
                let (message, all) = (report.message().unwrap_or_default(), self.lost_events);
                self.records.note(format_args!("{message}, {all} since the start"));
            }
            SourceEvent::Report(Report::Telemetry(state, clock)) if self.has_status => {
                self.records.note(format_args!("the board: {}", telemetry::in_words(state, *clock)));
            }
            _ => {}
        }
        Ok(())
    }

    fn output(&mut self, output: Output) -> Result<(), Stop> {
        self.no_event.output(&output);
        if let Output::Event(event) = &output {
            let has_gap = match event.doubt {
                Some(doubt) => matches!(doubt, Reason::Uneven | Reason::LostFrames),
                // Laws of durations have no doubt.
                None => u32::from(event.frames_filled) > LONGEST_FILLED_GAP,
            };
            self.unreliable += u64::from(!event.reliable && has_gap);
            if event.speed.is_ok() && event.texture == Err(NoTexture::NoModel) {
                self.hint.take().into_iter().for_each(|hint| self.records.note(hint));
            }
        }
        self.outputs.push_back(output);
        Ok(())
    }

    fn processed(&mut self, event: &SourceEvent<'_>, processor: &Processor) -> bool {
        self.no_event.processed(processor);
        // Lost frames have times of their own only once the next frame has come.
        if matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_)) {
            let last = processor.pipeline().next_frame().saturating_sub(1);
            self.read_ns = processor.nanoseconds(last).map_or(self.read_ns, |time| time.max(self.read_ns));
        }
        true
    }
}

/// Reports the largest delay behind a camera.
fn say_lag(lag: Lag, records: &Records) {
    if lag.most == 0 {
        return;
    }
    let latency =
        lag.latency.map(|latency| format!("; the last was read {} ms after it was taken", latency.as_millis()));
    let most = counted(lag.most, "frame");
    records.note(format_args!("up to {most} behind the camera{}", latency.unwrap_or_default()));
}

/// The file of `--save-raw`.
struct RawFile {
    file: File,
    path: PathBuf,
    /// Bytes and whole frames that were written.
    bytes: u64,
    frames: u64,
}

impl RawFile {
    /// Creates the file, and never overwrites another.
    fn create(path: &Path) -> Result<Self, Error> {
        let file = File::create_new(path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => {
                Error::new(ErrorKind::AlreadyExists, path.display(), "exists already, expected a new file")
                    .caused_by(error)
            }
            _ => Error::io(path.display(), error),
        })?;
        Ok(Self { file, path: path.to_owned(), bytes: 0, frames: 0 })
    }

    /// Writes a frame. If that fails, the file keeps the whole frames before it, and is removed if there are none.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let Err(error) = self.file.write_all(bytes) else {
            self.bytes += bytes.len() as u64;
            self.frames += 1;
            return Ok(());
        };
        let kept = if self.frames == 0 { std::fs::remove_file(&self.path) } else { self.file.set_len(self.bytes) };
        let rest = match kept {
            Ok(()) if self.frames == 0 => "no frame fits, so the file was removed".to_owned(),
            Ok(()) => format!("the file has the first {}", counted(self.frames, "frame")),
            Err(other) => format!("the file ends within a frame: {other}"),
        };
        Err(Error::new(error.kind().into(), self.path.display(), format_args!("{error}; {rest}")).caused_by(error))
    }
}
