//! Texture models among which there is a choice.

use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::file::Task;

use crate::error::Error;
use crate::model::file::{BUILT_IN, ModelFile};
use crate::model::inspect::{Inspected, inspect};
use crate::texture::TextureRecord;

/// A model and what is known of it.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Its name: that of the program's own, or a file's path.
    pub name: String,
    /// Whether it comes with the program, so that its price is known.
    pub is_built_in: bool,
    /// The file.
    pub file: ModelFile,
    /// What is in it: kind, weights, trees, frames.
    pub about: Inspected,
    /// What it says, by class.
    answers: Vec<TextureRecord>,
}

/// Whether specimen, pattern and depth are right; nothing where a model does not tell them.
pub type Right = [Option<bool>; 3];

impl Candidate {
    /// Every model that comes with the program: the shipped ones, then those of the map.
    ///
    /// # Errors
    /// None: tests read them all.
    pub fn all_built_in() -> Result<Vec<Self>, Error> {
        ModelFile::built_in().map(|(name, file)| Self::new(name.to_owned(), true, file?)).collect()
    }

    /// The model that an argument names, of the program or of a file.
    ///
    /// # Errors
    /// Where there is none, or what is wrong with the file.
    pub fn named(name: &Path) -> Result<Self, Error> {
        let file = ModelFile::open(name)?;
        if let Some(built_in) = name.to_str().and_then(|name| name.strip_prefix(BUILT_IN)) {
            return Self::new(built_in.to_owned(), true, file);
        }
        Self::new(name.display().to_string().replace(',', ";"), false, file)
    }

    /// The model of a file.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn new(name: String, is_built_in: bool, file: ModelFile) -> Result<Self, Error> {
        let model = file.model()?;
        let (labels, task): (_, Task) = (model.labels(), model.task());
        let label = |class| labels.get(class).map(|label| label.to_string());
        let answers = (0..labels.len()).filter_map(label).map(|label| TextureRecord::of(task, label)).collect();
        Ok(Self { about: inspect(&model, file.words()), answers, name, is_built_in, file })
    }

    /// The model itself.
    ///
    /// # Errors
    /// None: its file has been checked.
    pub fn model(&self) -> Result<Model<'_>, Error> {
        self.file.model()
    }

    /// Whether a class is right of a specimen.
    pub(super) fn judge(&self, class: u8, truth: &TextureRecord) -> Right {
        let Some(said) = self.answers.get(usize::from(class)) else { return [None; 3] };
        [
            said.specimen.as_ref().map(|specimen| Some(specimen) == truth.specimen.as_ref()),
            said.pattern.as_ref().map(|pattern| Some(pattern) == truth.pattern.as_ref()),
            said.depth_mm.map(|depth| truth.depth_mm.is_some_and(|truth| (depth - truth).abs() < 1e-9)),
        ]
    }

    /// Which of the three it tells at all.
    pub(super) fn tells(&self) -> [bool; 3] {
        let any = |told: fn(&TextureRecord) -> bool| self.answers.iter().any(told);
        [any(|said| said.specimen.is_some()), any(|said| said.pattern.is_some()), any(|said| said.depth_mm.is_some())]
    }
}
