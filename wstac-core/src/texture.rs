//! The texture that slid: a texture model's answer for an event, in words (SPEC §6; paper, "Texture Classification").

use crate::model::boosted::Boosted;
use crate::model::file::{INPUTS, Task};
use crate::model::forest::Forest;
use crate::model::labels::{Label, Labels};
use crate::model::linear_svm::LinearSvm;
use crate::model::{Classification, Model, network::Network};

/// The answer of a texture model.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Texture<'m> {
    /// The number of the class.
    pub class: u8,
    /// The name of the class. If it names a specimen, a pattern and a depth in mm, it is such as `Saw3`.
    pub label: Label<'m>,
    /// The task of the model: what it tells apart.
    pub task: Task,
    /// The probability that the class is right, in units of 2^-15, below 1; `None` for a model without a calibration.
    pub confidence: Option<u16>,
    /// Whether the sample is like those of the training; `None` if the model does not tell.
    ///
    /// If it is `Some(false)`, the class is the likeliest of those that the model knows, and probably wrong.
    pub known: Option<bool>,
}

/// A texture model of any kind, or of only one kind, so that no other kind is linked.
pub trait TextureModel<'m, const N: usize = INPUTS> {
    /// Returns the class of a sample of so many numbers, frame by frame, and how sure it is.
    fn classification(&self, sample: &[i16; N]) -> Classification;
    /// Returns the names of the classes.
    fn labels(&self) -> Labels<'m>;
    /// Returns what the model tells apart.
    fn task(&self) -> Task;
}

macro_rules! texture_models {
    ($($model:ident)*) => {$(
        impl<'m, const N: usize> TextureModel<'m, N> for $model<'m> {
            fn classification(&self, sample: &[i16; N]) -> Classification {
                self.classification(sample)
            }

            fn labels(&self) -> Labels<'m> {
                self.labels()
            }

            fn task(&self) -> Task {
                self.task()
            }
        }
    )*};
}
texture_models!(LinearSvm Forest Boosted Network Model);

/// Returns a model's answer for a sample of its input, such as 700 numbers:
/// [`Sample::flat`](crate::paper::sample::Sample::flat) of an event, or
/// [`SamplePrefix::flat`](crate::paper::early::SamplePrefix::flat) of a sample that is still under way.
pub fn texture<'m, const N: usize>(numbers: &[i16; N], model: &impl TextureModel<'m, N>) -> Texture<'m> {
    let Classification { class, confidence, known } = model.classification(numbers);
    Texture { class, label: model.labels().of(class), task: model.task(), confidence, known }
}
