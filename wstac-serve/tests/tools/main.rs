//! What a page can ask of a sensor, over the same WebSocket as the page: recordings, calibration, the doctor.
//!
//! The sensor is a scene whose frames come when the test lets them.

mod calibration;
mod examination;
mod page;
mod recording;
mod refusals;
mod slow;
