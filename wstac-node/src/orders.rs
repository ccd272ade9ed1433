//! The orders of services to a sensor, and the settings that others may read and change while it is read.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::Labels;
use wstac_host::texture::Textures;
use wstac_host::visible;

use crate::arguments::Arguments;

/// The orders that wait for a sensor at most.
pub(crate) const MOST_WAITING: usize = 16;

/// An order of a service to a sensor. Files were read before: a sensor waits for none.
#[derive(Debug)]
pub(crate) enum Action {
    RestartBaseline,
    UseConfig {
        config: Box<Config>,
        file: PathBuf,
    },
    /// Name textures with the model that this file has, in place of all others.
    UseModel {
        textures: Textures,
        file: PathBuf,
    },
    /// Record to a new file: of this name in the folder, or of the first that is free.
    StartRecording {
        folder: PathBuf,
        file: String,
        features_only: bool,
        labels: Labels,
    },
    StopRecording,
}

/// An action, and the way of its result: a text for people.
///
/// Whatever becomes of an order, it is answered: one that is dropped says that its sensor has ended.
pub(crate) struct Order {
    sensor: String,
    /// The action and its answer, until the order is answered.
    content: Option<(Action, Reply)>,
}

pub(crate) type Reply = Box<dyn FnOnce(Result<String, Error>) + Send>;

impl Order {
    pub(crate) fn new(sensor: &str, action: Action, answer: Reply) -> Self {
        Self { sensor: sensor.to_owned(), content: Some((action, answer)) }
    }

    /// Does what is asked, and answers with the result.
    pub(crate) fn answer(mut self, follow: impl FnOnce(Action) -> Result<String, Error>) {
        if let Some((action, answer)) = self.content.take() {
            answer(follow(action));
        }
    }

    /// Answers that the sensor does not do it.
    pub(crate) fn refuse(mut self, kind: ErrorKind, why: &str) {
        self.end(kind, why);
    }

    fn end(&mut self, kind: ErrorKind, why: &str) {
        if let Some((_, answer)) = self.content.take() {
            answer(Err(Error::new(kind, &self.sensor, why)));
        }
    }
}

impl Drop for Order {
    fn drop(&mut self) {
        self.end(ErrorKind::Usage, "has ended");
    }
}

/// The way to a sensor.
#[derive(Clone)]
pub(crate) struct Control {
    pub(crate) name: String,
    orders: SyncSender<Order>,
    pub(crate) settings: Arc<Settings>,
}

impl Control {
    /// Creates the way to the sensor of this name and source. The sensor takes the orders.
    pub(crate) fn new(name: &str, source: &str, arguments: &Arguments) -> (Self, Receiver<Order>) {
        let (orders, arriving) = sync_channel(MOST_WAITING);
        let settings = Settings {
            source: source.to_owned(),
            frame_id: Mutex::new(format!("{name}_frame").into()),
            picture: AtomicBool::new(arguments.picture),
            config: Mutex::new(arguments.config.as_deref().map(shown).unwrap_or_default()),
            models: Mutex::new(arguments.models.iter().map(|model| shown(model)).collect()),
        };
        (Self { name: name.to_owned(), orders, settings: Arc::new(settings) }, arriving)
    }

    /// Hands an action over. It is answered at once if the sensor takes none.
    pub(crate) fn order(&self, action: Action, answer: Reply) {
        match self.orders.try_send(Order::new(&self.name, action, answer)) {
            Err(TrySendError::Full(order)) => order.refuse(ErrorKind::Usage, "has too many requests that wait"),
            // One that a sensor at its end does not take is answered when it is dropped.
            Ok(()) | Err(TrySendError::Disconnected(_)) => {}
        }
    }
}

#[derive(Debug)]
pub(crate) struct Settings {
    pub(crate) source: String,
    /// The coordinate frame of messages of ROS 2.
    pub(crate) frame_id: Mutex<Arc<str>>,
    /// Whether frames are published as pictures.
    pub(crate) picture: AtomicBool,
    /// The file of the configuration; empty without one.
    pub(crate) config: Mutex<String>,
    /// The files of the models.
    pub(crate) models: Mutex<Vec<String>>,
}

/// Returns a copy of what a lock holds, even if a thread that held it panicked.
pub(crate) fn copy_of<T: Clone>(held: &Mutex<T>) -> T {
    held.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

pub(crate) fn replace<T>(held: &Mutex<T>, value: T) {
    *held.lock().unwrap_or_else(PoisonError::into_inner) = value;
}

pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Returns the path of a file that a service names.
///
/// # Errors
/// The program has no folder for services, or the name has folders or leads out of it.
pub(crate) fn path_in(folder: Option<&Path>, file: &str) -> Result<PathBuf, Error> {
    let Some(folder) = folder else {
        return Err(Error::new(ErrorKind::Usage, "the node", "has no folder for files, expected --files FOLDER"));
    };
    let is_name =
        !file.is_empty() && !file.starts_with('.') && !file.contains(['/', '\\']) && visible::line(file) == file;
    if is_name {
        Ok(folder.join(file))
    } else {
        Err(Error::new(
            ErrorKind::Usage,
            format_args!("file is \"{file}\""),
            "expected the name of a file without folders",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn an_order_is_answered_whatever_becomes_of_it() {
        let arguments = Arguments::try_parse_from(["wstac-node", "a.y4m"]).unwrap();
        let (control, orders) = Control::new("left", "a.y4m", &arguments);
        let (answers, answered) = std::sync::mpsc::channel();
        let ask = || {
            let answers = answers.clone();
            let answer =
                move |result: Result<String, Error>| answers.send(result.map_err(|error| error.to_string())).unwrap();
            control.order(Action::RestartBaseline, Box::new(answer));
        };
        let ended = Err("left: has ended".to_owned());
        (0..=MOST_WAITING).for_each(|_| ask());
        assert_eq!(answered.try_iter().collect::<Vec<_>>(), [Err("left: has too many requests that wait".to_owned())]);
        orders.recv().unwrap().answer(|_| Ok("done".to_owned()));
        assert_eq!(answered.try_iter().collect::<Vec<_>>(), [Ok("done".to_owned())]);
        // The sensor ends while orders wait.
        drop(orders);
        assert_eq!(answered.try_iter().collect::<Vec<_>>(), vec![ended.clone(); MOST_WAITING - 1]);
        ask();
        assert_eq!(answered.try_iter().collect::<Vec<_>>(), [ended]);
    }

    #[test]
    fn a_name_stays_in_its_folder() {
        let folder = Some(Path::new("files"));
        assert_eq!(path_in(folder, "a b.wsm").unwrap(), Path::new("files/a b.wsm"));
        for name in ["", ".", "..", "../a", "a/b", "/etc/passwd", "a\\b", "a\0", ".hidden", "a\n", "a\u{202e}"] {
            assert!(path_in(folder, name).is_err(), "{name:?}");
        }
        assert!(path_in(None, "a").unwrap_err().to_string().contains("--files"));
    }
}
