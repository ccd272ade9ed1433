//! How far fixed point is from real numbers on the whole way from sums to answers: each line is a bound that is derived where the
//! code is, and the largest that was found beside it. The other side of every comparison is 64-bit floating point written
//! from the specification, on the real sums, which shares nothing with the core.

mod decisions;
mod directions;
mod features;
mod scores;
mod speeds;

/// Units of a feature in 1.
const ONE: f64 = 2048.0;
/// A feature is off by this much at most, in units, with the default kernel: half a unit of rounding and two logarithms' errors.
const FEATURE: f64 = 0.5 + 2.0 * 1.7e-6 * ONE;

/// Prints a line of the table, and fails where what was found is above the bound.
fn within(what: &str, found: f64, bound: f64, unit: &str) {
    println!("{what}: at most {found:.6} {unit}, bound {bound:.6}");
    assert!(found <= bound, "{what}: {found} {unit} is above the bound {bound}");
}
