//! The long run: counters that pass 2^32 and 2^33, and a day of frames. Short forms run with every other test.
//! `ci/long` sets the variables that make them long.

mod counters;
mod day;
