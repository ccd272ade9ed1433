//! Data sets: samples of many simulated slides, or of recordings, for training.
//!
//! [`sweep`] selects the slides, and [`samples`] computes them. [`npz`] and [`arrays`] write them for NumPy. [`path`]
//! has random slides and their samples along the path, and [`random`] the file that selects them. [`recordings`] and
//! [`recorded_arrays`] do the same for recordings.

pub mod arrays;
pub mod npz;
pub mod path;
pub mod random;
pub mod recorded_arrays;
pub mod recordings;
pub mod sweep;

use rayon::prelude::*;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};

use wstac_core::paper::speed::LitSpan;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::output::{Output, OutputOptions, SampleFrames, TactileEvent};
use wstac_host::session::Session;
use wstac_host::source::Source;
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;

/// A sample in units of 2^-11: ten features over 70 frames.
pub type Sample = [[i16; SAMPLE_FRAMES]; FEATURES];

/// Facts about a sample in addition to its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// `true` if its baseline was quiet and at most 7 of its frames were filled.
    pub reliable: bool,
    /// Its event's duration in frames, by the threshold of `[speed]`, or `None` if it is cut off or never lights up.
    pub duration: Option<u8>,
}

impl Facts {
    fn of(event: &TactileEvent) -> Self {
        let duration = event.lit_span.filter(|span| !span.is_cut_off()).map(LitSpan::frames);
        Self { reliable: event.sample_reliable, duration }
    }
}

/// The result of a slide.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The sample of its first event.
    Sample(Box<Sample>, Facts),
    /// No event was triggered.
    NoEvent,
    /// Its sample was interrupted by the end of the scene or by too many lost frames.
    Incomplete,
}

/// Computes the sample of a scene's first event.
///
/// The scene is a stream of its own, with its own baseline, through the whole core.
///
/// # Errors
/// The scene cannot be created, or does not fit the configuration.
pub fn sample(script: &SceneConfig, config: &Config) -> Result<Outcome, Error> {
    for output in session(SceneSource::new(script)?, config, false)? {
        // The rest of the scene after the first event does not matter.
        match output? {
            Output::Event(event) => {
                if let Some(sample) = event.sample.as_deref() {
                    return Ok(Outcome::Sample(by_feature(sample), Facts::of(&event)));
                }
            }
            Output::Interrupted(_) => return Ok(Outcome::Incomplete),
            Output::End(end) if end.incomplete.is_some() => return Ok(Outcome::Incomplete),
            _ => {}
        }
    }
    Ok(Outcome::NoEvent)
}

/// Checks that a scene can be created and fits the configuration, without computing its frames.
///
/// # Errors
/// [`sample`] would fail.
pub fn check(script: &SceneConfig, config: &Config) -> Result<(), Error> {
    session(SceneSource::new(script)?, config, false).map(drop)
}

/// Returns a session that gives the samples of a source's events, also along their paths if `paths` is set.
fn session(source: impl Source + 'static, config: &Config, paths: bool) -> Result<Session, Error> {
    let wanted = OutputOptions { samples: true, paths, ..OutputOptions::default() };
    Session::builder(source).config(config.clone()).outputs(wanted).build()
}

/// Returns a sample feature by feature instead of frame by frame.
fn by_feature(frames: &SampleFrames) -> Box<Sample> {
    let mut sample = Box::new([[0; SAMPLE_FRAMES]; FEATURES]);
    for (frame, features) in frames.iter().enumerate() {
        for (row, feature) in sample.iter_mut().zip(features) {
            row[frame] = *feature;
        }
    }
    sample
}

/// Computes the [`sample`] of every script in parallel.
///
/// The results are in the order of the scripts, whatever the number of threads.
///
/// # Errors
/// [`sample`] fails.
pub fn samples(scripts: &[SceneConfig], config: &Config) -> Result<Vec<Outcome>, Error> {
    scripts.par_iter().map(|script| sample(script, config)).collect()
}

/// Computes the [`sample`] of the script of every number in parallel.
///
/// `take` receives them one by one as they are ready, in any order. Its error ends the whole computation.
///
/// # Errors
/// [`sample`] or `take` fails.
pub fn each_sample<E: From<Error> + Send>(
    numbers: &[u32],
    script: impl Fn(u32) -> SceneConfig + Sync,
    config: &Config,
    take: impl FnMut(u32, Outcome) -> Result<(), E> + Send,
) -> Result<(), E> {
    let take = std::sync::Mutex::new(take);
    numbers.par_iter().with_max_len(1).try_for_each(|&number| {
        let outcome = sample(&script(number), config)?;
        // A poisoned lock means that another thread's `take` panicked, and that panic ends everything anyway.
        let mut take = take.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        take(number, outcome)
    })
}

#[cfg(test)]
mod tests;
