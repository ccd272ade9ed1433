//! Measures how far fixed point is from real numbers, for every step from sums to answers.
//!
//! Each printed line has a bound and the largest error that was found. The code of the step derives the bound. The
//! other side of every comparison is 64-bit floating point, written from the specification. It works on the exact sums
//! and shares no code with the core.

use std::fmt::Arguments;

mod decisions;
mod directions;
mod features;
mod scores;
mod speeds;

/// The number of feature units in 1.
const ONE: f64 = 2048.0;
/// The largest error of a feature with the default kernel, in units: half a unit of rounding, and the errors of two
/// logarithms.
const FEATURE: f64 = 0.5 + 2.0 * 1.7e-6 * ONE;

/// Collects numbers, each with a bound of its own.
#[derive(Default)]
struct Largest {
    count: u32,
    found: f64,
    bound: f64,
    /// The largest ratio of a number to its own bound.
    share: f64,
}

impl Largest {
    /// Adds a number. Panics with the description `of` if the number is above its bound.
    fn see(&mut self, found: f64, bound: f64, of: Arguments<'_>) {
        assert!(found <= bound, "{of}: {found} is above the bound {bound}");
        self.count += 1;
        self.found = self.found.max(found);
        self.bound = self.bound.max(bound);
        self.share = self.share.max(found / bound);
    }

    /// Prints a line of the table. Numbers are multiplied by `scale`.
    fn print(&self, what: &str, scale: f64, unit: &str) {
        let (found, bound, share) = (scale * self.found, scale * self.bound, 100.0 * self.share);
        println!(
            "{what}: at most {found:.6} {unit} in {}, bounds up to {bound:.6}, at most {share:.1} % of its own bound",
            self.count
        );
    }
}

/// Prints a line of the table, and panics if the number is above its bound.
fn within(what: &str, found: f64, bound: f64, unit: &str) {
    println!("{what}: at most {found:.6} {unit}, bound {bound:.6}");
    assert!(found <= bound, "{what}: {found} {unit} is above the bound {bound}");
}
