#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | content |
//! | --- | --- |
//! | [`calibrate`] | the places of the whiskers in the picture |
//! | [`doctor`] | a camera's rate, levels, noise and drift |

pub mod calibrate;
mod canvas;
pub mod doctor;
