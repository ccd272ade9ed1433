//! One event as a figure for a paper.
//!
//! `event` gathers all that was seen of it, `figure` puts the panels on a page: `features` over time, `arrival` of the light at
//! each taxel, the speed `law`; `caption` says it in words.

mod arrival;
mod caption;
mod event;
mod features;
mod figure;
mod law;
mod panel;
pub mod svg;

pub use self::event::{Found, find};
pub use self::figure::draw;

#[cfg(test)]
mod tests;
