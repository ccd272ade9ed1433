//! The touch itself: its onset and its end, its kind, its motion by arrival times, its texture along the path, and the
//! slip of what is held, from ten sums or from 25 taxels in a ring.

pub mod at_once;
pub mod crosstalk;
pub mod motion;
pub(crate) mod onset;
pub mod path_sample;
pub mod slip;
pub mod taxel_ring;
pub mod wave;
