//! Model files: those of a user, and those that come with the program.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use self_cell::self_cell;

use wstac_core::model::Model;
use wstac_core::model::file::ModelError;

#[cfg(feature = "builtin-models")]
use crate::builtin_models::{MODELS, VARIANTS};
use crate::error::{Error, ErrorKind};
use crate::files;
use crate::suggest::nearest;

/// Size of the largest model file that is read, in bytes.
pub const MOST_BYTES: u64 = 256 << 20;

/// The prefix of the names of models that come with the program.
pub const BUILT_IN: &str = "builtin:";

/// The name of the best model that comes with the program, [`BEST_OF_ALL`].
pub const BEST: &str = "builtin";

/// The name of the best model among all: none is more accurate beyond doubt, and it is the smallest of its equals.
pub const BEST_OF_ALL: &str = "taxel-path-svm";

/// The models that this build comes with.
#[cfg(not(feature = "builtin-models"))]
const MODELS: &[(&str, &[u8])] = &[];
#[cfg(not(feature = "builtin-models"))]
const VARIANTS: &[&str] = &[];

/// A model file's content.
#[derive(Clone, Debug)]
pub struct ModelFile {
    about: String,
    words: Arc<[u32]>,
}

self_cell! {
    /// A model together with the words that it reads.
    pub struct OwnedModel {
        owner: Arc<[u32]>,
        #[covariant]
        dependent: Model,
    }

    impl {Debug}
}

impl OwnedModel {
    /// Returns the model.
    pub fn get(&self) -> &Model<'_> {
        self.borrow_dependent()
    }
}

impl ModelFile {
    /// Opens a model file for each name, as [`ModelFile::open`] does.
    ///
    /// # Errors
    /// The error of the first file that cannot be opened.
    pub fn open_all(names: &[PathBuf]) -> Result<Vec<Self>, Error> {
        names.iter().map(|name| Self::open(name)).collect()
    }

    /// Reads `builtin` ([`BEST`]), `builtin:NAME`, or the file of that name. [`ModelFile::model`] checks the content.
    ///
    /// # Errors
    /// There is no such model, the file cannot be read, or it is too large.
    pub fn open(name: &Path) -> Result<Self, Error> {
        let is_best = name == Path::new(BEST);
        let about = if is_best { format!("{BUILT_IN}{BEST_OF_ALL}") } else { name.display().to_string() };
        let Some(built_in) = about.strip_prefix(BUILT_IN) else {
            return match file_bytes(name) {
                Err(error) if error.kind() == ErrorKind::NotFound => {
                    let meant = Self::meant(about.rsplit(':').next().unwrap_or_default());
                    let help = meant.map_or("wstac model list --all lists built-in models".to_owned(), |meant| {
                        format!("did you mean {meant}?")
                    });
                    let message = format_args!("no such file; {help}");
                    Err(Error::new(ErrorKind::NotFound, &about, message).caused_by(error))
                }
                read => Self::of_bytes(about, &read?),
            };
        };
        let found = MODELS.iter().find(|(name, _)| *name == built_in);
        let (_, bytes) = found.ok_or_else(|| {
            if MODELS.is_empty() {
                let message = "this build comes without models: build with the feature builtin-models";
                return Error::new(ErrorKind::Unsupported, &about, message);
            }
            let expected = Self::meant(built_in).map_or_else(
                || {
                    format!(
                        ", expected {}, …; wstac model list --all has all",
                        Self::usual_names().collect::<Vec<_>>().join(", ")
                    )
                },
                |meant| format!("; did you mean {meant}?"),
            );
            Error::new(ErrorKind::NotFound, &about, format_args!("is no model that comes with wstac{expected}"))
        })?;
        Self::of_bytes(about, bytes)
    }

    /// Returns all models that come with the program, with their names.
    pub fn built_in() -> impl Iterator<Item = (&'static str, Result<Self, Error>)> {
        MODELS.iter().map(|&(name, bytes)| (name, Self::of_bytes(format!("{BUILT_IN}{name}"), bytes)))
    }

    /// Returns the names of all models that come with the program.
    pub fn names() -> impl Iterator<Item = &'static str> {
        MODELS.iter().map(|&(name, _)| name)
    }

    /// Returns the names of [`full_names`](Self::full_names) without those that only the study of speed against
    /// accuracy weighs.
    pub fn usual_names() -> impl Iterator<Item = String> {
        let is_usual = |name: &&str| !VARIANTS.contains(name);
        std::iter::once(BEST.to_owned()).chain(Self::names().filter(is_usual).map(|name| format!("{BUILT_IN}{name}")))
    }

    /// Returns the names by which the models that come with the program are opened: [`BEST`] first.
    pub fn full_names() -> impl Iterator<Item = String> {
        std::iter::once(BEST.to_owned()).chain(Self::names().map(|name| format!("{BUILT_IN}{name}")))
    }

    /// Returns the full name of the model that comes with the program whose name is nearest to this one.
    fn meant(given: &str) -> Option<String> {
        let name = nearest(given, std::iter::once(BEST).chain(Self::names()))?;
        Some(if name == BEST { BEST.to_owned() } else { format!("{BUILT_IN}{name}") })
    }

    /// Takes the bytes of a model file; `about` is its name for messages. [`ModelFile::model`] checks the content.
    ///
    /// # Errors
    /// The bytes are no model file.
    pub fn of_bytes(about: String, bytes: &[u8]) -> Result<Self, Error> {
        // This check comes before that of the length, which says little of a file of another kind.
        match bytes.first_chunk() {
            Some(b"WSM1" | b"WSM2") => {}
            Some([b'W', b'S', b'M', version]) => {
                return Err(Error::with_cause(ErrorKind::Format, about, ModelError::Version(*version)));
            }
            _ => return Err(Error::new(ErrorKind::Format, &about, not_a_model(&about)).caused_by(ModelError::Magic)),
        }
        let (words, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            let message = format_args!("{} bytes, expected a multiple of four", bytes.len());
            return Err(Error::new(ErrorKind::Format, about, message));
        }
        Ok(Self { about, words: words.iter().map(|word| u32::from_le_bytes(*word)).collect() })
    }

    /// Returns the file's name for messages.
    pub fn about(&self) -> &str {
        &self.about
    }

    /// Returns all of the file as 32-bit words, which [`Model::from_words`] takes. They are little-endian in the file.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Checks the whole file and returns the model.
    ///
    /// # Errors
    /// The file is no valid model. The error says what is wrong with it.
    pub fn model(&self) -> Result<Model<'_>, Error> {
        Model::from_words(&self.words).map_err(|error| Error::with_cause(ErrorKind::Format, &self.about, error))
    }

    /// Checks the whole file and returns the model with its words.
    ///
    /// # Errors
    /// The file is no valid model. The error says what is wrong with it.
    pub fn owned(&self) -> Result<Arc<OwnedModel>, Error> {
        let model = OwnedModel::try_new(Arc::clone(&self.words), |words| Model::from_words(words));
        model.map(Arc::new).map_err(|error| Error::with_cause(ErrorKind::Format, &self.about, error))
    }
}

/// Returns the message about a file that is no model file. One of a trainer is imported first.
fn not_a_model(name: &str) -> String {
    let is_of_trainer = ["onnx", "ubj", "json"]
        .iter()
        .any(|ending| Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending)));
    let made = Path::new(name).with_extension("wsm");
    let help = format!("; help: wstac model import {name} -o {}", made.display());
    format!("{}{}", ModelError::Magic, if is_of_trainer { &help } else { "" })
}

/// Returns the content of a model file or of a trainer's file.
///
/// # Errors
/// The file cannot be read, or is larger than [`MOST_BYTES`].
pub fn file_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let content = files::content(path, MOST_BYTES).map_err(|error| Error::io(path.display(), error))?;
    content.ok_or_else(|| {
        let message = format_args!("is larger than {} MB, expected a model", MOST_BYTES >> 20);
        Error::new(ErrorKind::Format, path.display(), message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_no_model_are_refused() {
        let version = ModelError::Version(b'3').to_string();
        let magic = ModelError::Magic.to_string();
        for (name, bytes, expected) in [
            ("a.wsm", &b"WSM1\0\0\0"[..], "7 bytes, expected a multiple of four"),
            ("a.wsm", b"WSM2\0\0\0\0\0", "9 bytes, expected a multiple of four"),
            ("a.wsm", b"WSM3\0", &version),
            ("a.wsm", b"WSM", &magic),
            ("a.onnx", b"\x08\x07", &format!("{magic}; help: wstac model import a.onnx -o a.wsm")),
        ] {
            let error = ModelFile::of_bytes(name.into(), bytes).unwrap_err();
            assert_eq!(error.to_string(), format!("{name}: {expected}"));
        }
        for start in [b"WSM1", b"WSM2"] {
            assert!(ModelFile::of_bytes("a.wsm".into(), start).is_ok());
        }
    }
}
