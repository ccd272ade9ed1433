#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | what it has |
//! | --- | --- |
//! | [`source`] | frames: the trait, and Y4M; with features folders of pictures and recordings |
//! | [`session`] | a source read through `wstac-core` |
//! | `station` | a session that takes orders: a recording, a new baseline, a pause (feature `mcap`) |
//! | [`output`], [`json`] | the outputs of a session: typed, and as lines of JSON |
//! | [`text`] | the outputs as lines of text for a person |
//! | [`config`] | the configuration file |
//! | [`model_file`], [`texture`] | texture models, and their answers |
//! | `record` | recordings: written, planned and recovered (feature `mcap`) |
//! | `monitor` | the messages of a board (feature `board`) |
//! | [`picture`] | frames as small pictures, to show them |
//! | [`camera`] | facts about cameras: formats, modes, controls |
//! | [`text_file`] | configurations and other files of text, read up to a limit |
//! | [`error`] | errors for a person |
//! | [`plural`] | counts with their nouns |

#[cfg(feature = "atomic-write")]
pub mod atomic_write;
#[cfg(feature = "builtin-models")]
mod builtin_models;
pub mod camera;
pub mod config;
pub mod error;
pub mod files;
mod frame_clock;
pub mod json;
pub mod model_file;
#[cfg(feature = "board")]
pub mod monitor;
/// The former name of [`suggest`].
#[deprecated(since = "0.4.0", note = "use `suggest`")]
pub mod near {
    pub use crate::suggest::nearest;
}
pub mod output;
pub mod picture;
pub mod plural;
mod reasons;
#[cfg(feature = "mcap")]
pub mod record;
pub mod session;
pub mod source;
#[cfg(feature = "mcap")]
pub mod station;
pub mod statistics;
pub mod suggest;
pub mod text;
pub mod text_file;
pub mod texture;
pub mod visible;
