//! Figures of WSTac as SVG, PNG or PDF: a tactile event, and panels for other data.
//!
//! [`find`] gathers the data of an event, and [`draw`] puts them on a page with a caption. [`Confusion`] does the same
//! for the answers of a texture model. Other figures are made of [`axes`] on a [`page`]; all have the sizes and colors
//! of [`style`]. [`Format`] makes a file of a figure.

mod along;
mod arrival;
pub mod axes;
mod caption;
mod confusion;
mod event;
mod features;
mod figure;
mod output;
pub mod page;
pub mod style;
pub mod svg;
pub mod text;

pub use self::confusion::Confusion;
pub use self::event::{Found, find};
pub use self::figure::draw;
pub use self::output::Format;

#[cfg(test)]
mod tests;
