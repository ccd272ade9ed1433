//! What slid: a texture model's answer for an event, in words (SPEC §6; paper, "Texture Classification").

use crate::model::Model;
use crate::model::boosted::Boosted;
use crate::model::file::{INPUTS, Task};
use crate::model::forest::Forest;
use crate::model::labels::{Label, Labels};
use crate::model::linear_svm::LinearSvm;

/// What a model says.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'m> {
    /// Number of the class.
    pub class: u8,
    /// Its name; of a specimen, pattern and depth in mm, such as `Saw3`.
    pub label: Label<'m>,
    /// What the model tells apart.
    pub task: Task,
}

/// A model of any kind, or of one kind alone, so that no other is linked.
pub trait TextureModel<'m> {
    /// The class of a sample: 700 numbers, frame by frame.
    fn class(&self, sample: &[i16; INPUTS]) -> u8;
    /// The names of its classes.
    fn labels(&self) -> Labels<'m>;
    /// What it tells apart.
    fn task(&self) -> Task;
}

macro_rules! texture_models {
    ($($model:ident)*) => {$(
        impl<'m> TextureModel<'m> for $model<'m> {
            fn class(&self, sample: &[i16; INPUTS]) -> u8 {
                self.classify(sample)
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
texture_models!(LinearSvm Forest Boosted Model);

/// What a model says of 700 numbers: [`Sample::flat`](crate::sample::Sample::flat) of an event, or
/// [`SamplePrefix::flat`](crate::early::SamplePrefix::flat) of one that is still under way.
pub fn texture<'m>(numbers: &[i16; INPUTS], model: &impl TextureModel<'m>) -> Texture<'m> {
    let class = model.class(numbers);
    Texture { class, label: model.labels().of(class), task: model.task() }
}
