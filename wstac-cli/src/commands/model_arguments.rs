//! Words of the command line about texture models: their samples, and what they tell apart.

use clap::ValueEnum;
use wstac_core::model::file::{Input, Task};

/// The sample that a model takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Sample {
    #[default]
    Frames,
    Path,
    TaxelPath,
}

impl From<Sample> for Input {
    fn from(sample: Sample) -> Self {
        match sample {
            Sample::Frames => Self::Frames,
            Sample::Path => Self::Path,
            Sample::TaxelPath => Self::TaxelPath,
        }
    }
}

/// The task of a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Classes {
    #[default]
    Specimen,
    Pattern,
    Depth,
    Other,
}

impl From<Classes> for Task {
    fn from(classes: Classes) -> Self {
        match classes {
            Classes::Specimen => Self::Specimen,
            Classes::Pattern => Self::Pattern,
            Classes::Depth => Self::Depth,
            Classes::Other => Self::Other,
        }
    }
}
