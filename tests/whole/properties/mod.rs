//! Tests what holds for every input, with proptest: formats, layouts, stripes, losses and configurations. The seed is
//! fixed. Cases that failed once are kept in `properties.regressions` and tried first.

mod choice;
mod events;
mod sums;
mod whole;
