//! The orders of a page to a sensor, over the same WebSocket as the page: recordings, calibration, the doctor, and a
//! way back and forth in a file.
//!
//! The sensor is a scene whose frames come when the test lets them.

mod calibration;
mod examination;
mod film;
mod page;
mod recording;
mod refusals;
mod slow;
