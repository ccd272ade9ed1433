//! The end of the program by a signal, whatever a sensor or the network does meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use wstac_host::error::Error;

use crate::note;

/// Time in which sensors and the network end after a signal.
const PATIENCE: Duration = Duration::from_secs(10);
/// The time between two looks at the signal.
const LOOK: Duration = Duration::from_millis(100);

/// The sensors that are being read, for which the program waits at its end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ending {
    has_signal: Arc<AtomicBool>,
    /// The names of the sensors that are being read.
    reading: Arc<Mutex<Vec<String>>>,
}

impl Ending {
    /// Waits for a signal from now on. The program ends at the latest 10 seconds after it, or at once with a second
    /// one.
    ///
    /// # Errors
    /// The system refuses a handler or a thread.
    pub(crate) fn of_program() -> Result<Self, Error> {
        let ending = Self::default();
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            // A second signal ends the program at once.
            let signals = &ending.has_signal;
            let handlers = signal_hook::flag::register_conditional_shutdown(signal, 1, Arc::clone(signals))
                .and_then(|_| signal_hook::flag::register(signal, Arc::clone(signals)));
            handlers.map_err(|error| Error::io("signals", error))?;
        }
        let watched = ending.clone();
        // It is no thread that the program waits for.
        let watch = move || watched.watch();
        thread::Builder::new().name("ending".into()).spawn(watch).map_err(|error| Error::io("a thread", error))?;
        Ok(ending)
    }

    /// Returns the flag that a signal sets.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.has_signal
    }

    /// Notes that a sensor is being read, until the guard is dropped.
    pub(crate) fn reading(&self, sensor: &str) -> Reading<'_> {
        self.names(|names| names.push(sensor.to_owned()));
        Reading { ending: self, sensor: sensor.to_owned() }
    }

    fn names<T>(&self, of: impl FnOnce(&mut Vec<String>) -> T) -> T {
        of(&mut self.reading.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Ends the program if it has not ended in time after a signal.
    fn watch(&self) {
        while !self.has_signal.load(Ordering::Relaxed) {
            thread::sleep(LOOK);
        }
        thread::sleep(PATIENCE);
        let names = self.names(|names| names.join(", "));
        let what = if names.is_empty() { "a file or the network".to_owned() } else { format!("the sensors: {names}") };
        note(format_args!("ended by a signal; after {} s it no longer waits for {what}", PATIENCE.as_secs()));
        std::process::exit(1);
    }
}

/// A sensor that is being read.
pub(crate) struct Reading<'e> {
    ending: &'e Ending,
    sensor: String,
}

impl Drop for Reading<'_> {
    fn drop(&mut self) {
        self.ending.names(|names| names.retain(|name| *name != self.sensor));
    }
}
