//! Figures of WSTac as SVG, PNG or PDF: a tactile event, fits of the speed law, and panels for other data.
//!
//! [`find`] gathers the data of an event, and [`draw`] puts them on a page with a caption. [`SpeedFits`] does the same
//! for fits of the speed law, and [`Confusion`] for the answers of a texture model. Other figures are made of [`axes`]
//! on a [`page`]; all have the sizes and colors of [`style`]. [`Format`] makes a file of a figure.

mod along;
mod arrival;
pub mod axes;
mod caption;
mod confusion;
mod event;
mod features;
mod figure;
mod law;
mod output;
pub mod page;
mod speed_fits;
pub mod style;
pub mod svg;
pub mod text;

pub use self::confusion::Confusion;
pub use self::event::{Found, find};
pub use self::figure::draw;
pub use self::output::Format;
pub use self::speed_fits::{SpeedFit, SpeedFits};

#[cfg(test)]
mod tests;
