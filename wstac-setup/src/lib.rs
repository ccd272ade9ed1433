#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | content |
//! | --- | --- |
//! | [`calibrate`] | the places of the whiskers in the picture |
//! | [`crosstalk`] | the light of a whisker that other taxels see |
//! | [`gains`] | how bright each whisker is |
//! | [`characterize`] | the answers to slides beside their truth |
//! | [`light`] | light above that of untouched frames |
//! | [`doctor`] | a camera's rate, levels, noise and drift |

pub mod calibrate;
mod canvas;
pub mod characterize;
pub mod crosstalk;
pub mod doctor;
pub mod gains;
pub mod light;
