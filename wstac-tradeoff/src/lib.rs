#![doc = include_str!("../README.md")]
//! ## Modules
//! | module | content |
//! | --- | --- |
//! | [`slides`] | the simulated slides of the study |
//! | [`parameters`], [`candidate`] | the settings and models to choose among |
//! | [`sweep`], [`row`] | their evaluation, and the results of each |
//! | [`map`], [`table`], [`plot`] | all rows: stored, as a table, as a figure |
//! | [`prices`] | the cost of a setting on a board |
//! | [`budget`], [`pareto`], [`chosen`] | the best row within a budget, the unbeaten rows, and their files |
//! | [`float64`], [`statistics`] | the basis of the results |

pub mod budget;
pub mod candidate;
pub mod chosen;
pub mod float64;
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
