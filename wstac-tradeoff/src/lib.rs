//! What speed costs in accuracy: every setting and model on one set of simulated slides, beside its price on boards.
//!
//! [`slides`] is the scene set, [`parameters`] and [`candidate`] what is chosen among, [`sweep`] runs it and [`row`] sums it up.

pub mod ablation;
pub mod budget;
pub mod candidate;
pub mod chosen;
pub mod fade;
pub mod float64;
pub mod host;

pub mod map;
pub mod parameters;
pub mod pareto;
pub mod plot;
pub mod prices;
pub mod row;
pub mod slides;
pub mod statistics;
mod streams;
pub mod sweep;
pub mod table;

#[cfg(test)]
mod tests;
