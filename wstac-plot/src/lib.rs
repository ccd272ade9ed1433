//! Figures of WSTac as SVG: a tactile event, and panels for other data.
//!
//! [`find`] gathers the data of an event, and [`draw`] puts them on a page with a caption. [`Confusion`] does the same
//! for the answers of a texture model. Other figures are made of [`axes`] on a [`page`]; all have the sizes and colors
//! of [`style`].

mod along;
mod arrival;
pub mod axes;
mod caption;
mod confusion;
mod event;
mod features;
mod figure;
pub mod page;
pub mod style;
pub mod svg;
pub mod text;

pub use self::confusion::Confusion;
pub use self::event::{Found, find};
pub use self::figure::draw;

#[cfg(test)]
mod tests;
