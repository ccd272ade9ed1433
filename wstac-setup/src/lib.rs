#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | content |
//! | --- | --- |
//! | [`calibrate`] | the places of the whiskers in the picture |
//! | [`crosstalk`] | the light of a whisker that other taxels see |
//! | [`gains`] | how bright each whisker is |
//! | [`doctor`] | a camera's rate, levels, noise and drift |

pub mod calibrate;
mod canvas;
pub mod crosstalk;
pub mod doctor;
pub mod gains;
mod light;
