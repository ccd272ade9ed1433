//! Setting up a sensor: calibration of the whiskers' places, and a check of a camera.

pub mod calibrate;
pub mod doctor;
