//! How far fixed point is from real numbers on the whole way from sums to answers: each line is a bound that is derived where the
//! code is, and the largest that was found beside it. The other side of every comparison is 64-bit floating point written
//! from the specification, on the real sums, which shares nothing with the core.

use std::fmt::Arguments;

mod decisions;
mod directions;
mod features;
mod scores;
mod speeds;

/// Units of a feature in 1.
const ONE: f64 = 2048.0;
/// A feature is off by this much at most, in units, with the default kernel: half a unit of rounding and two logarithms' errors.
const FEATURE: f64 = 0.5 + 2.0 * 1.7e-6 * ONE;

/// Many numbers, each with a bound of its own.
#[derive(Default)]
struct Largest {
    count: u32,
    found: f64,
    bound: f64,
    /// The largest share of its own bound that one had.
    share: f64,
}

impl Largest {
    /// Takes one in; fails where it is above its bound, and says what it is `of`.
    fn see(&mut self, found: f64, bound: f64, of: Arguments<'_>) {
        assert!(found <= bound, "{of}: {found} is above the bound {bound}");
        self.count += 1;
        self.found = self.found.max(found);
        self.bound = self.bound.max(bound);
        self.share = self.share.max(found / bound);
    }

    /// Prints a line of the table, of numbers times `scale`.
    fn print(&self, what: &str, scale: f64, unit: &str) {
        let (found, bound, share) = (scale * self.found, scale * self.bound, 100.0 * self.share);
        println!(
            "{what}: at most {found:.6} {unit} in {}, bounds up to {bound:.6}, at most {share:.1} % of its own bound",
            self.count
        );
    }
}

/// Prints a line of the table, and fails where what was found is above the bound.
fn within(what: &str, found: f64, bound: f64, unit: &str) {
    println!("{what}: at most {found:.6} {unit}, bound {bound:.6}");
    assert!(found <= bound, "{what}: {found} {unit} is above the bound {bound}");
}
