//! SIGINT, SIGTERM and SIGHUP end every command within a second.
//!
//! A command that has something to finish says so with [`finishing`] before its first output, and then looks at the
//! flag. Every other command, and every command before that, ends at once, like a program without handlers. Nothing
//! half-written stays behind. A signal that the parent ignores (`nohup`) stays ignored.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use std::{io, thread};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::low_level;

use super::output::Stop;
use wstac_host::atomic_write::remove_unfinished;

/// Time that a command has for its end.
const DEADLINE: Duration = Duration::from_millis(900);
/// Time that whoever reads the output has to take the rest of it.
const READERS_TIME: Duration = Duration::from_millis(300);

/// The end of a command after the first signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Ending {
    AtOnce,
    /// As soon as the command has written its end. If that takes longer than [`DEADLINE`], without it.
    InTime,
    /// As soon as the command has finished its file, however long a slow disk takes. A second signal ends it at once.
    Whole,
    /// As soon as the terminal is restored, however long that takes. A second signal changes nothing.
    Restored,
}

const ENDINGS: [Ending; 4] = [Ending::AtOnce, Ending::InTime, Ending::Whole, Ending::Restored];

/// The way in which this command ends: an index of [`ENDINGS`].
static ENDING: AtomicU8 = AtomicU8::new(0);
static CAUGHT: OnceLock<Caught> = OnceLock::new();

/// The state that the handlers set.
#[derive(Debug, Default)]
struct Caught {
    /// Whether a signal has come.
    flag: Arc<AtomicBool>,
    /// The number of the last signal.
    number: Arc<AtomicUsize>,
    /// The time of the first signal, as soon as the thread has seen it.
    at: OnceLock<Instant>,
}

fn caught() -> &'static Caught {
    CAUGHT.get_or_init(Caught::default)
}

/// Handles signals from now on.
///
/// # Errors
/// The system refuses a handler or a thread.
pub(super) fn install() -> io::Result<()> {
    let ignored = ignored();
    let is_ignored = |signal: i32| ignored >> (signal - 1) & 1 == 1;
    // A file that becomes too large is an error of writing, and not the end of the process.
    if !is_ignored(SIGXFSZ) {
        signal_hook::flag::register(SIGXFSZ, Arc::default())?;
    }
    let handled: Vec<i32> = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| !is_ignored(*signal)).collect();
    for &signal in &handled {
        signal_hook::flag::register_usize(signal, Arc::clone(&caught().number), signal as usize)?;
        signal_hook::flag::register(signal, Arc::clone(&caught().flag))?;
    }
    let mut signals = Signals::new(handled)?;
    thread::Builder::new().name("signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            received(signal);
        }
    })?;
    Ok(())
}

/// Ends the process, or sees to it that it ends.
fn received(signal: i32) {
    let is_first = caught().at.set(Instant::now()).is_ok();
    match ending() {
        Ending::AtOnce => {
            remove_unfinished();
            // The parent sees that the signal ended the process. If it cannot be sent again, the code says so.
            let _ = low_level::emulate_default_handler(signal);
            low_level::exit(128 + signal);
        }
        Ending::Restored => {}
        Ending::InTime if is_first => {
            let _ = thread::Builder::new().spawn(move || {
                thread::sleep(DEADLINE);
                remove_unfinished();
                low_level::exit(128 + signal);
            });
        }
        Ending::Whole if is_first => {}
        Ending::InTime | Ending::Whole => {
            remove_unfinished();
            low_level::exit(128 + signal);
        }
    }
}

fn ending() -> Ending {
    ENDINGS[usize::from(ENDING.load(Ordering::SeqCst)).min(ENDINGS.len() - 1)]
}

/// Makes the command end in its own way from now on, and returns the flag of a signal that asks for it.
pub(crate) fn finishing(ending: Ending) -> Arc<AtomicBool> {
    ENDING.store(ending as u8, Ordering::SeqCst);
    flag()
}

/// Returns the flag of a signal that asks for the end.
pub(crate) fn flag() -> Arc<AtomicBool> {
    Arc::clone(&caught().flag)
}

/// Returns the number of the last signal that asked for the end; 0 if there was none.
pub(crate) fn number() -> Arc<AtomicUsize> {
    Arc::clone(&caught().number)
}

/// Returns the number of the signal that ended a command; that of SIGTERM if there was none.
pub(super) fn code() -> u8 {
    u8::try_from(number().load(Ordering::SeqCst)).ok().filter(|number| *number != 0).unwrap_or(SIGTERM as u8)
}

/// Fails if a signal has asked for the end.
pub(super) fn check() -> Result<(), Stop> {
    if caught().flag.load(Ordering::Relaxed) { Err(Stop::Interrupted(code())) } else { Ok(()) }
}

/// Returns whether a signal has come, and whoever reads the output had time to take the rest of it.
pub(super) fn is_readers_time_over() -> bool {
    caught().at.get().is_some_and(|at| at.elapsed() > READERS_TIME)
}

/// Returns the signals that the parent ignores: bit `n - 1` is that of signal `n`.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
