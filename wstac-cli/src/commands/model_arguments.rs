//! Words of the command line about texture models: their samples, and what they tell apart.

use clap::ValueEnum;
use wstac_core::model::file::{Input, Task};

/// The sample that a model takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum SampleKind {
    Frames,
    Path,
    TaxelPath,
    Taxels,
}

impl From<SampleKind> for Input {
    fn from(sample: SampleKind) -> Self {
        match sample {
            SampleKind::Frames => Self::Frames,
            SampleKind::Path => Self::Path,
            SampleKind::TaxelPath => Self::TaxelPath,
            SampleKind::Taxels => Self::Taxels,
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
