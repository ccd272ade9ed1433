//! Texture models among which there is a choice.

use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::file::Task;

use wstac_host::error::Error;
use wstac_host::model_file::{BUILT_IN, ModelFile};
use wstac_host::texture::Texture;
use wstac_train::model::inspect::{Inspected, inspect};

/// What stands for no model.
pub const NONE: &str = "none";

/// A model's name without what all of the program's own start with.
pub fn short(name: &str) -> &str {
    name.strip_prefix(BUILT_IN).unwrap_or(name)
}

/// A model and what is known of it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Its name: `builtin:` and that of one of the program's own, whose price is known, or a file's path.
    pub name: String,
    /// The file.
    pub file: ModelFile,
    /// What is in it: kind, weights, trees, frames.
    pub about: Inspected,
    /// What it says, by class.
    answers: Vec<Texture>,
}

/// Whether specimen, pattern and depth are right; nothing where a model does not tell them.
pub type Right = [Option<bool>; 3];

impl Candidate {
    /// Every model that comes with the program: the shipped ones, then those of the map.
    ///
    /// # Errors
    /// None: tests read them all.
    pub fn all_built_in() -> Result<Vec<Self>, Error> {
        ModelFile::built_in().map(|(name, file)| Self::new(format!("{BUILT_IN}{name}"), file?)).collect()
    }

    /// The model that an argument names, of the program or of a file.
    ///
    /// # Errors
    /// Where there is none, what is wrong with the file, or a path that a map cannot hold.
    pub fn named(name: &Path) -> Result<Self, Error> {
        let text = name.to_str().filter(|text| *text != NONE && !text.contains([',', '"', '\n', '\r']));
        let refused =
            "a map cannot hold this path, expected UTF-8 without comma, quotation mark or end of line, and not none";
        let text = text.ok_or_else(|| Error::new(name.display(), refused))?;
        Self::new(text.to_owned(), ModelFile::open(name)?)
    }

    /// The model of a file.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn new(name: String, file: ModelFile) -> Result<Self, Error> {
        let model = file.model()?;
        let (labels, task): (_, Task) = (model.labels(), model.task());
        let label = |class| labels.get(class).map(|label| label.to_string());
        let answers = (0..labels.len()).filter_map(label).map(|label| Texture::of(task, label)).collect();
        Ok(Self { about: inspect(&model, file.words()), answers, name, file })
    }

    /// The model itself.
    ///
    /// # Errors
    /// None: its file has been checked.
    pub fn model(&self) -> Result<Model<'_>, Error> {
        self.file.model()
    }

    /// Whether a class is right of a specimen.
    pub(super) fn judge(&self, class: u8, truth: &Texture) -> Right {
        let Some(said) = self.answers.get(usize::from(class)) else { return [None; 3] };
        [
            said.specimen.as_ref().map(|specimen| Some(specimen) == truth.specimen.as_ref()),
            said.pattern.as_ref().map(|pattern| Some(pattern) == truth.pattern.as_ref()),
            said.depth_mm.map(|depth| truth.depth_mm.is_some_and(|truth| (depth - truth).abs() < 1e-9)),
        ]
    }

    /// Which of the three it tells at all.
    pub(super) fn tells(&self) -> [bool; 3] {
        let any = |told: fn(&Texture) -> bool| self.answers.iter().any(told);
        [any(|said| said.specimen.is_some()), any(|said| said.pattern.is_some()), any(|said| said.depth_mm.is_some())]
    }
}
