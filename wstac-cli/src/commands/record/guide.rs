//! `wstac record --guide` guides a person through a plan, one file per slide.

use std::ffi::OsStr;
use std::fs;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::time::Duration;

use super::{Arguments, Shown, kept, labels};
use crate::commands::files::Outputs;
use crate::commands::output::{Stop, note, text_of};
use crate::commands::records::{Form, Records};
use crate::commands::signals::{Ending, finishing};
use crate::commands::source_arguments::doubts_of_textures;
use crate::open;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, OutputOptions, TactileEvent};
use wstac_host::plural::counted;
use wstac_host::record::about::About;
use wstac_host::record::plan::{self, PlannedSlide};
use wstac_host::record::{Compression, Recorder};
use wstac_host::session::Processor;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{FramePolicy, Labels, Source, SourceEvent, StreamInfo};
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

/// The longest wait for a key between two checks for signals.
const WAIT: Duration = Duration::from_millis(200);

/// The difference from the plan that is reported: a fraction of the speed, and degrees.
const SPEED_APART: f64 = 0.1;
const DEGREES_APART: f64 = 10.0;

/// A request of the person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Key {
    Start,
    Redo,
    Skip,
    Quit,
}

/// The result of a slide.
enum SlideOutcome {
    /// The slide has its file.
    Recorded,
    /// The slide failed for this reason and must be repeated.
    Again(&'static str),
    /// The source ended, or a signal came.
    Ended,
}

struct Session<'a> {
    source: Box<dyn Source>,
    info: StreamInfo,
    /// The stream as it is recorded.
    kept: StreamInfo,
    config: Config,
    models: &'a [ModelFile],
    labels: Labels,
    compression: Compression,
    /// Whether the source is a camera.
    is_live: bool,
    /// Lines of standard input.
    keys: Receiver<String>,
    shown: Shown,
    interrupted: Arc<AtomicBool>,
}

pub(super) fn run(arguments: &Arguments, source: &OsStr, plan_file: &Path) -> Result<(), Stop> {
    let slides = plan::read(plan_file)?;
    let labels = labels(&arguments.labels)?;
    let planned = slides.first().map(|slide| &slide.labels);
    if let Some((name, value)) = labels.iter().find(|(name, _)| planned.is_some_and(|own| own.contains_key(*name))) {
        let message = format_args!("{name} is {value:?}, but {} gives it; leave it out", plan_file.display());
        return Err(Error::new(ErrorKind::Usage, "--label", message).into());
    }
    let is_live = is_camera(source);
    let (source, info, config) =
        arguments.options.open_configured(source, FramePolicy::Every, arguments.config.as_deref())?;
    let models = ModelFile::open_all(&arguments.models)?;
    let folder = &arguments.output;
    // Errors of the settings come before a person waits.
    drop(Processor::new(&info, &config, OutputOptions::default())?.with_textures(Textures::new(&models)?));
    let kept = kept(arguments, &info, &config)?;
    About::new(&kept, &config, labels.clone(), Vec::new())?;
    if folder.exists() && !folder.is_dir() {
        let message = "is a file, expected a folder for the recordings of --guide";
        return Err(Error::new(ErrorKind::Io, folder.display(), message).into());
    }
    fs::create_dir_all(folder).map_err(|error| Error::io(folder.display(), error))?;
    let mut there = slides.iter().map(|slide| file_of(folder, slide)).filter(|file| file.exists());
    let before = there.find_map(|file| open(&file, &OpenOptions::default()).ok()?.info().sensor());
    if let Some((before, now)) = before.zip(info.sensor()).filter(|(before, now)| before != now) {
        let name = folder.display();
        note(format_args!(
            "{name} has slides of another sensor (found {before}, expected {now}): use a folder for each"
        ));
    }
    let interrupted = finishing(Ending::Whole);
    note(&info.about);
    let form = Form::json_if(arguments.json);
    let shown = Shown::new(Records::new(form));
    let keys = keys();
    doubts_of_textures(&info, &models).iter().for_each(note);
    let compression = arguments.compress.unwrap_or_default();
    let mut session =
        Session { is_live, source, info, kept, config, models: &models, labels, compression, keys, shown, interrupted };
    let recorded = session.lead(&slides, folder)?;
    let there = slides.iter().filter(|slide| file_of(folder, slide).exists()).count();
    let rest = match there == slides.len() {
        true => "",
        false if session.is_live => "; the same command continues with the others",
        false => "; a file or a scene that begins with the next slide continues",
    };
    let (all, folder) = (slides.len(), folder.display());
    let recorded = counted(recorded, "slide");
    note(format_args!("{folder}: {recorded} recorded now, {there} of {all} in total{rest}"));
    Ok(())
}

fn file_of(folder: &Path, slide: &PlannedSlide) -> PathBuf {
    folder.join(format!("{}.mcap", slide.name))
}

/// Returns the lines of standard input, read by a thread that ends with the program.
fn keys() -> Receiver<String> {
    let (sender, keys) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            if line.map_or(true, |line| sender.send(line).is_err()) {
                return;
            }
        }
    });
    keys
}

impl Session<'_> {
    /// Guides through the slides that have no file yet, and returns how many were recorded.
    fn lead(&mut self, slides: &[PlannedSlide], folder: &Path) -> Result<u64, Error> {
        let (mut at, mut last, mut redo, mut recorded) = (0, None, false, 0);
        while let Some(slide) = slides.get(at) {
            let path = file_of(folder, slide);
            if path.exists() && !redo {
                at += 1;
                continue;
            }
            let (number, all, about) = (at + 1, slides.len(), &slide.about);
            note(format_args!("slide {number} of {all}: {about}"));
            note("do not touch the sensor and press Enter; r: repeat the last slide, s: skip this one, q: quit");
            match self.key()? {
                None | Some(Key::Quit) => break,
                Some(Key::Skip) => {
                    (at, redo) = (at + 1, false);
                    continue;
                }
                Some(Key::Redo) => {
                    match last {
                        Some(last) => (at, redo) = (last, true),
                        None => note("no slide was recorded in this session yet"),
                    }
                    continue;
                }
                Some(Key::Start) => {}
            }
            match self.slide(slide, &path)? {
                SlideOutcome::Recorded => {
                    (last, redo) = (Some(at), false);
                    (at, recorded) = (at + 1, recorded + 1);
                }
                SlideOutcome::Again(why) => note(format_args!("{why}: repeat the same slide")),
                SlideOutcome::Ended => break,
            }
        }
        Ok(recorded)
    }

    /// Returns the request of the person, or `None` if the source ends or a signal comes. A camera is read meanwhile,
    /// and its frames are dropped. At the end of standard input, the session of a camera ends. Slides of a file start
    /// at once then.
    fn key(&mut self) -> Result<Option<Key>, Error> {
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let line = if self.is_live {
                match self.source.next_event()? {
                    SourceEvent::End => return Ok(None),
                    SourceEvent::Fault(fault) => note(format_args!("{}: {fault}", fault.kind)),
                    _ => {}
                }
                self.keys.try_recv().map_err(|error| error == TryRecvError::Disconnected)
            } else {
                self.keys.recv_timeout(WAIT).map_err(|error| error == RecvTimeoutError::Disconnected)
            };
            let ended = matches!(line, Err(true));
            match line.as_deref().map(str::trim) {
                Ok("") => return Ok(Some(Key::Start)),
                Ok("r") => return Ok(Some(Key::Redo)),
                Ok("s") => return Ok(Some(Key::Skip)),
                Ok("q") => return Ok(Some(Key::Quit)),
                Ok(other) => note(format_args!("{other:?} is no key, expected Enter, r, s or q")),
                Err(_) if ended && self.is_live => {
                    note("standard input ended, so the session ends");
                    return Ok(None);
                }
                Err(_) if ended => return Ok(Some(Key::Start)),
                Err(_) => {}
            }
        }
    }

    /// Records one slide: a quiet baseline, then one event. The file ends in `.part` until it is complete. That of a
    /// session that was killed stays: what is in it can be recovered.
    fn slide(&mut self, slide: &PlannedSlide, path: &Path) -> Result<SlideOutcome, Error> {
        loop {
            let part = new_part(path)?;
            // If it failed, the incomplete file stays.
            match self.attempt(slide, &part)? {
                Some(SlideOutcome::Recorded) => {
                    fs::rename(&part, path).map_err(|error| Error::io(path.display(), error))?;
                    note(format_args!("wrote {}", path.display()));
                    return Ok(SlideOutcome::Recorded);
                }
                ended => {
                    fs::remove_file(&part).map_err(|error| Error::io(part.display(), error))?;
                    if let Some(outcome) = ended {
                        return Ok(outcome);
                    }
                    note("the baseline was not quiet: do not touch the sensor; it is taken again");
                }
            }
        }
    }

    /// Makes one attempt, and returns `None` if the baseline was not quiet.
    fn attempt(&mut self, slide: &PlannedSlide, part: &Path) -> Result<Option<SlideOutcome>, Error> {
        let wanted = OutputOptions { features: true, ..OutputOptions::default() };
        let processor = Processor::new(&self.info, &self.config, wanted)?;
        let mut processor = processor.with_textures(Textures::new(self.models)?);
        let mut labels = self.labels.clone();
        labels.extend(slide.labels.clone());
        let models = self.models.iter().map(|file| file.about().to_owned()).collect();
        let about = About::new(&self.kept, &self.config, labels, models)?;
        let file = Outputs::default().create_at_once(part)?;
        let mut recorder = Recorder::compressed(file, part, &about, &processor, self.compression)?;
        let outcome = self.watch(slide, &mut processor, &mut recorder);
        // Even if the source failed, the file of what came before is complete.
        let written = recorder.finish();
        if outcome.is_err() && written.is_ok() {
            note(format_args!("{} has what was recorded before", part.display()));
        }
        // Both errors matter, but an incomplete file matters more.
        if let (Err(error), Err(_)) = (&outcome, &written) {
            note(error);
        }
        written?;
        outcome
    }

    /// Reads until there is a result, and returns `None` if the baseline was not quiet.
    fn watch(
        &mut self,
        slide: &PlannedSlide,
        processor: &mut Processor,
        recorder: &mut Recorder,
    ) -> Result<Option<SlideOutcome>, Error> {
        let (mut asked, mut outcome) = (false, None);
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(Some(SlideOutcome::Ended));
            }
            let item = self.source.next_event()?;
            recorder.source_event(&item);
            let mut was_disturbed = false;
            let shown = &mut self.shown;
            let goes_on = processor.process(&item, |output| {
                recorder.output(&output, &text_of(&output));
                match &output {
                    Output::Event(event) => {
                        // The labels are those of a slide. What is unclear may be one: before a rolling shutter, say.
                        let other = event.contact.filter(|contact| matches!(contact, Contact::Press | Contact::Poke));
                        if other.is_none() {
                            differences(event, &slide.labels).into_iter().for_each(note);
                        }
                        let again = |contact| SlideOutcome::Again(Reason::NoSlide(contact).as_str());
                        outcome.get_or_insert(other.map_or(SlideOutcome::Recorded, again));
                    }
                    Output::Interrupted(_) => outcome = Some(SlideOutcome::Again("too many frames were lost")),
                    Output::BaselineDisturbed { .. } => was_disturbed = true,
                    _ => {}
                }
                if matches!(output, Output::Event(_) | Output::Fault(_)) {
                    shown.show(&output);
                }
                Ok::<(), Error>(())
            })?;
            let has_room = recorder.processed(&item, processor);
            if was_disturbed {
                return Ok(None);
            }
            if !asked && processor.pipeline().baseline().is_some() {
                asked = true;
                note(format_args!("slide now: {}", slide.about));
            }
            // A recording has the whole sample of its event, of which the answer may come earlier.
            let is_whole = processor.pipeline().captured_frames().is_none();
            match outcome.take_if(|outcome| is_whole || !matches!(outcome, SlideOutcome::Recorded)) {
                Some(outcome) => return Ok(Some(outcome)),
                None if !goes_on || !has_room => {
                    note(if !has_room {
                        "the disk is full"
                    } else if self.is_live {
                        "the camera ended"
                    } else {
                        "it ended; a file has all slides of the plan, in order"
                    });
                    return Ok(Some(SlideOutcome::Ended));
                }
                None => {}
            }
        }
    }
}

/// Says where a slide was not as it was planned. Its labels are those of the plan.
fn differences(event: &TactileEvent, planned: &Labels) -> Vec<String> {
    let planned = |name: &str| planned.get(name)?.parse::<f64>().ok();
    let speed = event.speed.ok().map(|speed| f64::from(speed.mm_s)).zip(planned("speed"));
    let speed = speed.filter(|(found, planned)| (found - planned).abs() > SPEED_APART * planned);
    let direction = event.direction.degrees.ok().map(f64::from).zip(planned("direction"));
    let direction = direction
        .filter(|(found, planned)| ((found - planned + 540.0).rem_euclid(360.0) - 180.0).abs() > DEGREES_APART);
    let differs = |(found, planned): (f64, f64), unit: &str| {
        format!("measured {found:.1}{unit}, planned {planned}{unit}: the label is the planned one; r repeats the slide")
    };
    let unreliable = (!event.reliable).then(|| "the answers are not reliable; r repeats the slide".to_owned());
    let differing = [speed.map(|both| differs(both, " mm/s")), direction.map(|both| differs(both, "°"))];
    if unreliable.is_some() { unreliable.into_iter().collect() } else { differing.into_iter().flatten().collect() }
}

/// Returns the name of a slide's unfinished file: one that no other session has used.
fn new_part(path: &Path) -> Result<PathBuf, Error> {
    for number in 1..1000_u32 {
        let name = if number == 1 { "part".to_owned() } else { format!("{number}.part") };
        let part = path.with_added_extension(name);
        if part.symlink_metadata().is_err() {
            return Ok(part);
        }
        let (old, whole) = (part.display(), path.with_added_extension(format!("{number}.recovered.mcap")));
        note(format_args!(
            "{old} is of a session that did not end properly: wstac recover {old} -o {} brings back what is in it",
            whole.display()
        ));
    }
    Err(Error::new(ErrorKind::AlreadyExists, path.display(), "has 999 unfinished files; recover or delete them"))
}

#[cfg(test)]
mod tests {
    use wstac_core::green::any::PixelFormat;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;

    use super::*;
    use wstac_host::source::Frame;
    use wstac_host::source::mcap::McapSource;

    /// A camera that fails after some frames.
    struct Failing {
        info: StreamInfo,
        left: u32,
        bytes: Vec<u8>,
    }

    impl Source for Failing {
        fn info(&self) -> &StreamInfo {
            &self.info
        }

        fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
            self.left = self.left.checked_sub(1).ok_or_else(|| Error::new(ErrorKind::Device, "camera", "unplugged"))?;
            Ok(SourceEvent::Frame(Frame::new(&self.bytes)))
        }
    }

    /// Returns a session whose camera gives three frames and fails, and whose standard input is empty.
    fn session() -> Session<'static> {
        let size = FrameSize::new(100, 100).unwrap();
        let info = StreamInfo::new("a camera", size, PixelFormat::Gray, FrameRate::NOMINAL);
        let source = Box::new(Failing { info: info.clone(), left: 3, bytes: vec![9; 10_000] });
        let (config, labels, interrupted) = Default::default();
        let shown = Shown { is_read: false, ..Shown::new(Records::new(Form::Text)) };
        Session {
            source,
            kept: info.clone(),
            info,
            config,
            models: &[],
            labels,
            compression: Compression::None,
            is_live: true,
            keys: channel().1,
            shown,
            interrupted,
        }
    }

    #[test]
    fn where_a_camera_fails_what_came_before_is_in_a_whole_file() {
        let part = std::env::temp_dir().join(format!("wstac-guide-{}.mcap", std::process::id()));
        let _ = fs::remove_file(&part);
        let slide = PlannedSlide { labels: Labels::new(), about: String::new(), name: String::new() };
        let failed = session().attempt(&slide, &part).err().unwrap();
        assert_eq!(failed.to_string(), "camera: unplugged");
        let mut source = McapSource::open(&part, None).unwrap();
        for _ in 0..3 {
            assert!(matches!(source.next_event(), Ok(SourceEvent::Frame(_))));
        }
        assert!(matches!(source.next_event(), Ok(SourceEvent::End)));
        fs::remove_file(&part).unwrap();
    }

    #[test]
    fn a_cameras_session_ends_with_standard_input() {
        assert_eq!(session().key().unwrap(), None);
        let mut of_a_file = Session { is_live: false, ..session() };
        assert_eq!(of_a_file.key().unwrap(), Some(Key::Start));
    }
}
