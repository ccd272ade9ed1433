//! Texture models (SPEC §6). A model is one small file that a board compiles in and a host loads. It answers as the
//! trained model did.
//!
//! [`mod@file`] has the byte layout. A model is checked when it is created, on a board in a `const`
//! ([`crate::include_model!`]). After that it answers without checks that could fail, panics or allocation. An
//! application that names the one kind it uses ([`LinearSvm`], [`Forest`], [`Boosted`], [`Network`]) links only that
//! kind. [`Model`] is any of them.

pub mod boosted;
mod bytes;
pub mod calibration;
mod descent;
mod dot;
pub mod file;
pub mod forest;
pub mod labels;
pub mod linear_svm;
pub mod network;
pub mod place;
mod rows;
pub mod speeds;
pub mod trees;
mod walk;

use self::boosted::Boosted;
use self::calibration::Calibration;
use self::file::{Header, Input, MOST_CLASSES, ModelError, Task};
use self::forest::Forest;
use self::labels::Labels;
use self::linear_svm::LinearSvm;
use self::network::Network;
use self::place::Place;
use self::speeds::KnownSpeeds;

/// The answer of a model for a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Classification {
    /// The number of the class.
    pub class: u8,
    /// The probability that the class is right, in units of 2^-15, below 1; `None` for a model without a calibration.
    ///
    /// It holds for samples like those of the calibration: for an unknown sample it says nothing.
    pub confidence: Option<u16>,
    /// Whether the sample is like those of the training; `None` if the model does not tell.
    pub known: Option<bool>,
}

/// Labels, header and calibration of a model.
#[derive(Clone, Copy, Debug)]
struct ModelParts<'a> {
    labels: Labels<'a>,
    header: Header,
    calibration: Calibration<'a>,
}

impl<'a> ModelParts<'a> {
    // A copy of the parts would take 100 bytes of stack.
    #[inline(always)]
    const fn new(words: &'a [u32], header: Header) -> Result<Self, ModelError> {
        let calibration = attempt!(Calibration::new(words, &header));
        Ok(Self { labels: Labels::new(words, &header), header, calibration })
    }
}

/// Implements the methods that all models have in common, given where its [`ModelParts`] are.
macro_rules! common {
    ($($kind:ident[$($parts:tt)*])*) => {$(
        impl<'a> $kind<'a> {
            /// Creates a model from its file's bytes, which are checked and used where they lie.
            ///
            /// # Errors
            /// Returns a [`ModelError`] that says what is wrong with the file. Bytes must be aligned to four, and the
            /// machine little-endian.
            pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, ModelError> {
                Self::from_words(bytes::words(bytes)?)
            }

            /// Returns the class of a sample: 0 to the number of [`labels`](Self::labels) less one. If several are
            /// equally good, it is the lowest of them.
            ///
            /// A sample is 700 features in units of 2^-11, frame by frame
            /// ([`crate::paper::sample::Sample::flat`]), or what else the [`input`](Self::input) says.
            ///
            /// `N` is [`INPUTS`](file::INPUTS). It is [`TAXEL_INPUTS`](file::TAXEL_INPUTS) for a model of taxels, and
            /// may be for any model: then its sample is in front. Other samples have an answer without meaning.
            #[inline(always)]
            pub fn classify<const N: usize>(&self, sample: &[i16; N]) -> u8 {
                self.decide::<true, N>(sample, false, |_, _| {})
            }

            /// Returns the class of a sample, and how sure the answer is if the model has a calibration.
            #[inline(always)]
            pub fn classification<const N: usize>(&self, sample: &[i16; N]) -> Classification {
                self.calibrated::<true, N>(sample)
            }

            /// Returns the classification of a sample, either by fast kernels or by plain code.
            #[inline(always)]
            pub(crate) fn calibrated<const FAST: bool, const N: usize>(&self, sample: &[i16; N]) -> Classification {
                if !self.$($parts)*.calibration.is_some() {
                    let class = self.decide::<FAST, N>(sample, false, |_, _| {});
                    return Classification { class, confidence: None, known: None };
                }
                let mut softmax = self.$($parts)*.calibration.softmax();
                let class = self.decide::<FAST, N>(sample, true, |_, score| softmax.push(score));
                let known = self.$($parts)*.calibration.is_known::<FAST, N>(sample, &self.$($parts)*.header, class);
                Classification { class, confidence: Some(softmax.confidence()), known }
            }

            /// Returns the probability of every class in units of 2^-15, for as many classes as there are
            /// [`labels`](Self::labels); `None` if the model has no calibration.
            ///
            /// The probability of the answer is the [`confidence`](Classification::confidence). All are rounded.
            pub fn probabilities<const N: usize>(&self, sample: &[i16; N]) -> Option<[u16; MOST_CLASSES]> {
                if !self.$($parts)*.calibration.is_some() {
                    return None;
                }
                let (mut softmax, mut probabilities) = (self.$($parts)*.calibration.softmax(), [0; MOST_CLASSES]);
                self.decide::<true, N>(sample, true, |_, score| softmax.push(score));
                self.decide::<true, N>(sample, true, |class, score| {
                    if let Some(place) = probabilities.get_mut(usize::from(class)) {
                        *place = softmax.probability(score);
                    }
                });
                Some(probabilities)
            }

            /// Passes the score of every class to `give`, in their order.
            ///
            /// Scores are what a [`calibration`] makes probabilities of: the page describes them.
            pub fn each_score<const N: usize>(&self, sample: &[i16; N], give: impl FnMut(u8, i64)) {
                self.decide::<true, N>(sample, true, give);
            }

            /// Returns whether the model says how sure an answer is.
            pub const fn is_calibrated(&self) -> bool {
                self.$($parts)*.calibration.is_some()
            }

            /// Returns whether the model says if a sample is like those of its training.
            pub const fn tells_unknown(&self) -> bool {
                self.$($parts)*.calibration.dimensions() > 0
            }

            /// Returns the place of a sample in the model's projection; `None` if the model does not tell what is
            /// unknown.
            pub fn place<const N: usize>(&self, sample: &[i16; N]) -> Option<Place> {
                self.$($parts)*.calibration.place::<true, N>(sample, &self.$($parts)*.header)
            }

            /// Returns the place around which the training's samples of a class lie; `None` if the model does not tell
            /// what is unknown, or has no such class.
            pub fn mean_place(&self, class: u8) -> Option<Place> {
                self.$($parts)*.calibration.mean_place(&self.$($parts)*.header, class)
            }

            /// Returns the version of the file's layout, 1 or 2.
            pub const fn layout(&self) -> u8 {
                self.$($parts)*.header.layout
            }

            /// Returns the checksum of the model's file, which tells one model from another.
            pub const fn checksum(&self) -> u32 {
                self.$($parts)*.labels.checksum()
            }

            /// Returns the names of the classes.
            pub const fn labels(&self) -> Labels<'a> {
                self.$($parts)*.labels
            }

            /// Returns the task of the model: what it tells apart.
            pub const fn task(&self) -> Task {
                self.$($parts)*.header.task
            }

            /// Returns the number of frames of the sample that the model needs, from the first on: 1 to 70. Of a sample
            /// along a path it is the tens of its numbers.
            pub const fn frames(&self) -> u8 {
                self.$($parts)*.header.frames
            }

            /// Returns the sample that the model takes.
            pub const fn input(&self) -> Input {
                self.$($parts)*.header.input
            }

            /// Returns the speeds of the slides that the model was trained on; `None` if its file does not state them.
            pub const fn known_speeds(&self) -> Option<KnownSpeeds> {
                self.$($parts)*.header.speeds
            }

            /// Returns the number of trees; 0 for a model without trees.
            pub const fn trees(&self) -> u16 {
                self.$($parts)*.header.trees
            }
        }
    )*};
}

/// A model of any kind.
#[derive(Clone, Copy, Debug)]
// It is exhaustive: whoever inspects a model or compiles one in must know every kind.
pub enum Model<'a> {
    /// A linear model: weighted sums.
    LinearSvm(LinearSvm<'a>),
    /// A random forest.
    Forest(Forest<'a>),
    /// Boosted trees.
    Boosted(Boosted<'a>),
    /// A network.
    Network(Network<'a>),
}

impl<'a> Model<'a> {
    /// Creates a model from its file's words and checks all of them.
    ///
    /// # Errors
    /// Returns a [`ModelError`] that says what is wrong with the file.
    pub const fn from_words(words: &'a [u32]) -> Result<Self, ModelError> {
        let header = attempt!(Header::read(words));
        Ok(match header.kind {
            file::ONE_AGAINST_REST | file::ONE_AGAINST_ONE => Self::LinearSvm(attempt!(LinearSvm::from_words(words))),
            file::FOREST => Self::Forest(attempt!(Forest::from_words(words))),
            file::BOOSTED => Self::Boosted(attempt!(Boosted::from_words(words))),
            file::NETWORK => Self::Network(attempt!(Network::from_words(words))),
            _ => return Err(ModelError::Header { half: 6, found: header.kind }),
        })
    }

    const fn parts(&self) -> &ModelParts<'a> {
        match self {
            Self::LinearSvm(model) => &model.parts,
            Self::Forest(model) => &model.parts,
            Self::Boosted(model) => &model.parts,
            Self::Network(model) => &model.parts,
        }
    }

    fn decide<const FAST: bool, const N: usize>(&self, sample: &[i16; N], all: bool, give: impl FnMut(u8, i64)) -> u8 {
        match self {
            Self::LinearSvm(model) => model.decide::<FAST, N>(sample, all, give),
            Self::Forest(model) => model.decide::<FAST, N>(sample, all, give),
            Self::Boosted(model) => model.decide::<FAST, N>(sample, all, give),
            Self::Network(model) => model.decide::<FAST, N>(sample, all, give),
        }
    }
}
common!(LinearSvm[parts] Forest[parts] Boosted[parts] Network[parts] Model[parts()]);

/// Returns a file's bytes as words, in a `const`. It is for [`include_model!`].
#[doc(hidden)]
pub const fn words<const N: usize>(bytes: &[u8]) -> [u32; N] {
    let mut words = [0; N];
    let mut left = bytes;
    let mut word = 0;
    while word < N
        && let Some((first, rest)) = left.split_first_chunk::<4>()
    {
        words[word] = u32::from_le_bytes(*first);
        left = rest;
        word += 1;
    }
    words
}

/// Compiles a model file into the program. The compiler checks it, so that a bad file does not build.
///
/// The kind is [`LinearSvm`](crate::model::linear_svm::LinearSvm), [`Forest`](crate::model::forest::Forest),
/// [`Boosted`](crate::model::boosted::Boosted), [`Network`](crate::model::network::Network) or
/// [`Model`](crate::model::Model), by its name in scope. Only the kind that it names is linked. The path is relative to
/// the source file, as for `include_bytes!`.
///
/// ```
/// use wstac_core::{include_model, model::forest::Forest};
/// static TEXTURE: Forest<'static> = include_model!(Forest, "../../tests/models/small.wsm");
/// assert!(TEXTURE.classify(&[0; 700]) < 20);
/// ```
///
/// One bit of this file is wrong, so it does not compile:
///
/// ```compile_fail,E0080
/// use wstac_core::{include_model, model::forest::Forest};
/// static TEXTURE: Forest<'static> = include_model!(Forest, "../../tests/models/damaged.wsm");
/// ```
#[macro_export]
macro_rules! include_model {
    ($kind:ident, $path:expr) => {{
        const BYTES: &[u8] = include_bytes!($path);
        const _: () =
            assert!(BYTES.len() % 4 == 0, "its length is no multiple of four: it is no model file, or cut off");
        #[allow(long_running_const_eval)]
        static WORDS: [u32; BYTES.len() / 4] = $crate::model::words(BYTES);
        #[allow(long_running_const_eval)]
        const MODEL: $kind<'static> = match $kind::from_words(&WORDS) {
            Ok(model) => model,
            Err(error) => panic!("{}", error.describe()),
        };
        MODEL
    }};
}

#[cfg(test)]
mod tests;
