//! What holds for every input: proptest over formats, layouts, stripes, losses and configurations. The seed is fixed;
//! what once failed is kept in `properties.regressions` and tried first.

mod choice;
mod events;
mod sums;
mod whole;
