//! Texture models to choose among.

use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::file::Input;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::{BEST, BEST_OF_ALL, BUILT_IN, ModelFile};
use wstac_host::texture::Texture;
use wstac_train::model::eval::labels_of;
use wstac_train::model::inspect::{Inspected, inspect};

/// The name for no model.
pub const NONE: &str = "none";

/// Returns a model's name without the prefix of all built-in models; that of the best one if it is `builtin`.
pub fn short(name: &str) -> &str {
    if name == BEST { BEST_OF_ALL } else { name.strip_prefix(BUILT_IN).unwrap_or(name) }
}

/// A model and the facts about it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Its name: `builtin:` and the name of a built-in model, whose price is known, or a file's path.
    pub name: String,
    /// The file.
    pub file: ModelFile,
    /// Its contents: kind, weights, trees, frames.
    pub about: Inspected,
    /// The sample that it takes.
    pub input: Input,
    /// The answers of the model, by class.
    answers: Vec<Texture>,
}

/// Results for specimen, pattern and depth: `true` if right, `None` if a model does not answer.
pub type Right = [Option<bool>; 3];

impl Candidate {
    /// Returns every model of specimens that comes with the program: the shipped ones, then those of the map.
    ///
    /// # Errors
    /// This does not fail: tests read all of them.
    pub fn all_built_in() -> Result<Vec<Self>, Error> {
        // An embedding answers as the shipped model of its input does, and is larger: it is there to learn from.
        let own = ModelFile::built_in().filter(|(name, _)| !name.ends_with("embedding"));
        let all = own.map(|(name, file)| Self::new(format!("{BUILT_IN}{name}"), file?));
        // Others, such as those that learn textures, say nothing about specimens.
        all.filter(|model| model.as_ref().is_ok_and(|model| model.tells()[0]) || model.is_err()).collect()
    }

    /// Returns the model that an argument names, built-in or from a file.
    ///
    /// # Errors
    /// There is no such model, its file is not valid, or a map cannot hold its path.
    pub fn named(name: &Path) -> Result<Self, Error> {
        let text = name.to_str().filter(|text| *text != NONE && !text.contains([',', '"', '\n', '\r']));
        let refused =
            "a map cannot hold this path, expected UTF-8 without comma, quotation mark or end of line, and not none";
        text.ok_or_else(|| Error::new(ErrorKind::Usage, name.display(), refused))?;
        let file = ModelFile::open(name)?;
        Self::new(file.about().to_owned(), file)
    }

    /// Creates a candidate from the model of a file.
    ///
    /// # Errors
    /// The file is not valid, or its model takes taxels.
    pub fn new(name: String, file: ModelFile) -> Result<Self, Error> {
        let model = file.model()?;
        if model.input() == Input::Taxels {
            let message = "takes taxels, which no board does, expected a model of frames, path or taxel_path";
            return Err(Error::new(ErrorKind::Unsupported, name, message));
        }
        let answers = labels_of(&model).into_iter().map(|label| Texture::of(model.task(), label)).collect();
        Ok(Self { about: inspect(&model, file.words()), input: model.input(), answers, name, file })
    }

    /// Returns the model itself.
    ///
    /// # Errors
    /// This does not fail: its file has been checked.
    pub fn model(&self) -> Result<Model<'_>, Error> {
        self.file.model()
    }

    /// Judges a class against the true texture of a specimen.
    pub(super) fn judge(&self, class: u8, truth: &Texture) -> Right {
        let Some(said) = self.answers.get(usize::from(class)) else { return [None; 3] };
        [
            said.specimen.as_ref().map(|specimen| Some(specimen) == truth.specimen.as_ref()),
            said.pattern.as_ref().map(|pattern| Some(pattern) == truth.pattern.as_ref()),
            said.depth_mm.map(|depth| truth.depth_mm.is_some_and(|truth| (depth - truth).abs() < 1e-9)),
        ]
    }

    /// Returns which of the three the model answers.
    pub(super) fn tells(&self) -> [bool; 3] {
        let any = |told: fn(&Texture) -> bool| self.answers.iter().any(told);
        [any(|said| said.specimen.is_some()), any(|said| said.pattern.is_some()), any(|said| said.depth_mm.is_some())]
    }
}
