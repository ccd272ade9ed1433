//! The long run: counters that pass 2^32 and 2^33. A short form runs with every other test; `ci/long` sets the variable
//! that makes it long.

mod counters;
