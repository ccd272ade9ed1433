#![doc = include_str!("../README.md")]

use std::ffi::OsStr;

pub use wstac_core as core;
pub use wstac_host::*;
#[cfg(feature = "camera")]
pub use wstac_linux as linux;
#[cfg(feature = "scene")]
pub use wstac_scene as scene;
#[cfg(feature = "train")]
pub use wstac_train as train;

use self::error::Error;
use self::session::Session;
use self::source::Source;
use self::source::open::{OpenOptions, SourceKind};

/// The kinds of sources of this build besides files.
pub const SOURCE_KINDS: &[&dyn SourceKind] = &[
    #[cfg(feature = "board")]
    &monitor::line::Boards,
    #[cfg(feature = "camera")]
    &linux::source::Cameras,
    #[cfg(feature = "scene")]
    &scene::source::Scenes,
];

/// Opens a session over any source by its name, with default options.
///
/// [`Session::builder`] over [`open_source`] also takes options, a configuration and models.
///
/// # Errors
/// The source cannot be opened, or its configuration does not fit it.
pub fn open(name: impl AsRef<OsStr>) -> Result<Session, Error> {
    Session::builder(open_source(name, &OpenOptions::default())?).build()
}

/// Opens any source by its name: a camera, a scene, a board, a file, a folder or standard input.
///
/// # Errors
/// As [`source::open::open`] with [`SOURCE_KINDS`].
pub fn open_source(name: impl AsRef<OsStr>, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    source::open::open(name, options, SOURCE_KINDS)
}
