//! The long run: counters that pass 2^32 and 2^33, and a day of frames. Short forms run with every other test; `ci/long` sets
//! the variables that make them long.

mod counters;
mod day;

/// A whole number from the environment, for a run that is longer than a test.
fn how_many(variable: &str, usual: u64) -> u64 {
    let Ok(text) = std::env::var(variable) else { return usual };
    text.parse().unwrap_or_else(|_| panic!("{variable} is {text:?}, expected a whole number"))
}
