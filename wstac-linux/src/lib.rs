//! Host side of WSTac: sources of frames, a simulated sensor, what is read of them, and the `wstac` command.
//!
//! | to | module |
//! | --- | --- |
//! | open a camera, a recording, a video, a folder or a simulated sensor | [`source`], [`source::open`] |
//! | read its events, features and faults | [`reading`], set up by a [`config`] |
//! | name textures | [`texture`], with models of [`model::file`]; [`model`] makes them of trainers' files |
//! | record | [`record`] |
//! | simulate | [`scene`] |
//! | find cameras, lock their controls | [`camera`] |
//!
//! The arithmetic is that of [`wstac_core`]: one event of a source is what a board would have said of the same frames.
//!
//! ```
//! use wstac_linux::config::Config;
//! use wstac_linux::error::Error;
//! use wstac_linux::reading::{Reading, Record, Wanted, read_all};
//! use wstac_linux::source::open::{OpenOptions, open};
//!
//! // As on the command line: /dev/video0, a file, a folder, or a simulated slide.
//! let mut source = open("scene:Saw3@150,90deg", &OpenOptions::default())?;
//! let mut reading = Reading::new(source.info(), &Config::default(), Wanted::default())?;
//! let mut events = Vec::new();
//! read_all::<Error>(source.as_mut(), &mut reading, |record| {
//!     if let Record::Event(event) = record {
//!         events.push(event);
//!     }
//!     Ok(())
//! })?;
//! assert_eq!(events.len(), 1);
//! assert_eq!(events[0].direction.deg, Some(90));
//! # Ok::<(), Error>(())
//! ```
//!
//! `examples/` has the same of a recording (`events`) and of two cameras with a thread each (`two_cameras`).
//!
//! # Errors
//! Every [`error::Error`] names the file, device or option, the field in it, what was found and what was expected. Input of any
//! kind gives an error or a counted loss, never a panic.
//!
//! # What is stable
//! The modules listed here, by [Semantic Versioning](https://semver.org/): `tests/interface` of the repository has every item.
//! What is hidden here is public for the `wstac` command and for tests alone, such as the machinery of single commands, and may
//! change at any time.

#[doc(hidden)]
pub mod calibrate;
pub mod camera;
#[doc(hidden)]
pub mod cli;
pub mod config;
#[doc(hidden)]
pub mod dataset;
#[doc(hidden)]
pub mod doctor;
pub mod error;
#[cfg(feature = "capi")]
#[doc(hidden)]
pub mod ffi;
#[doc(hidden)]
pub mod fit;
pub mod model;
#[doc(hidden)]
pub mod monitor;
#[doc(hidden)]
pub mod plot;
mod protobuf;
mod rate;
pub mod reading;
pub mod record;
pub mod scene;
pub mod source;
mod svg;
pub mod texture;
#[doc(hidden)]
pub mod trade;
#[doc(hidden)]
pub mod view;
mod whole_file;
