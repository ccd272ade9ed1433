//! Proof that sums of float32 are sums of integers: leaves that int16 can hold without changing any answer.

use super::trained::{Boosted, Score};

/// Integers up to this value, and all their sums that stay below it, are exact in float32.
const MOST: f64 = 16_777_216.0;

/// Returns the number of units in 1, a power of two, if int16 leaves and int32 sums provably give the answers of
/// float32 sums.
///
/// All leaves and starts are then whole numbers of units, and leaves are int16. No sum of starts and leaves, in any
/// order, is above 2^24 units, so that float32 does not round. The bound of two classes need not be a whole number,
/// because sums are.
pub(super) fn units(model: &Boosted) -> Option<f64> {
    let of_score = |score| leaves_of(score).flatten().chain([score.start]);
    let numbers = || model.scores.iter().flat_map(of_score);
    if !model.bound.is_finite() || numbers().any(|number| !number.is_finite()) {
        return None;
    }
    // The coarsest unit; if everything is 0, any unit is suitable.
    let places = numbers().filter(|&number| number != 0.0).map(places).max().unwrap_or(0);
    // Beyond this, whole numbers are too large or bounds no longer fit.
    if !(-64..=64).contains(&places) {
        return None;
    }
    let units = 2.0_f64.powi(places);
    let fits = |leaf: f32| (f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&(f64::from(leaf) * units));
    for score in &model.scores {
        let mut most = f64::from(score.start.abs()) * units;
        for mut leaves in leaves_of(score) {
            let largest = leaves.try_fold(0.0_f32, |most, leaf| fits(leaf).then(|| most.max(leaf.abs())))?;
            most += f64::from(largest) * units;
        }
        // The second is the core's requirement for a start and any int16 values of that many leaves.
        let any = f64::from(score.start.abs()) * units + 32_768.0 * score.trees.len() as f64;
        if most > MOST || any > f64::from(i32::MAX) {
            return None;
        }
    }
    // The bound's integer part is an int32 too.
    (f64::from(model.bound.abs()) * units < f64::from(i32::MAX)).then_some(units)
}

/// Iterates over the leaves of each tree.
fn leaves_of(score: &Score) -> impl Iterator<Item = impl Iterator<Item = f32>> {
    score.trees.iter().map(|tree| tree.leaves().copied())
}

/// Returns the number of binary places after the point in a nonzero number; negative values count zeros before the
/// point.
fn places(number: f32) -> i32 {
    let bits = number.to_bits();
    let exponent = (bits >> 23 & 0xFF) as i32;
    let fraction = bits & 0x7F_FFFF;
    // Subnormal numbers have no hidden one.
    let (mantissa, exponent) = if exponent == 0 { (fraction, 1) } else { (fraction | 0x80_0000, exponent) };
    150 - exponent - mantissa.trailing_zeros() as i32
}

#[cfg(test)]
mod tests {
    use super::super::trained::{Node, Tree};
    use super::*;

    fn model(start: f32, trees: &[&[f32]], bound: f32) -> Boosted {
        let tree = |leaves: &&[f32]| Tree { nodes: leaves.iter().map(|&leaf| Node::Leaf(leaf)).collect() };
        Boosted { scores: vec![Score { start, trees: trees.iter().map(tree).collect() }], bound }
    }

    #[test]
    fn places_of_numbers() {
        let is_whole = |number: f64| number.trunc().total_cmp(&number).is_eq();
        for (number, expected) in
            [(1.0, 0), (-0.5, 1), (0.75, 2), (6.0, -1), (0.1, 27), (f32::MIN_POSITIVE, 126), (f32::from_bits(1), 149)]
        {
            assert_eq!(places(number), expected, "{number}");
            assert!(is_whole(f64::from(number) * 2.0_f64.powi(expected)), "{number}");
            assert!(!is_whole(f64::from(number) * 2.0_f64.powi(expected - 1)), "{number}");
        }
    }

    #[test]
    fn leaves_of_a_coarse_unit_are_proven() {
        let unit = 1.0 / 1024.0;
        assert_eq!(units(&model(0.5, &[&[3.0 * unit, -7.0 * unit], &[0.25]], 0.0)), Some(1024.0));
        // The start counts; the bound need not be a whole number.
        assert_eq!(units(&model(0.5 * unit, &[&[0.25]], 1.5 / 16_777_216.0)), Some(2048.0));
        assert_eq!(units(&model(0.0, &[&[0.0]], 0.0)), Some(1.0));
        assert_eq!(units(&model(8.0, &[&[16.0]], 0.0)), Some(0.125));
    }

    #[test]
    fn what_float32_may_round_is_not() {
        let ok: &[f32] = &[0.5];
        // One leaf of 24 bits.
        assert_eq!(units(&model(0.0, &[ok, &[0.1]], 0.0)), None);
        // A leaf or a start that is too large for the unit of the others.
        assert_eq!(units(&model(0.0, &[&[1.0 / 1024.0, 32.0]], 0.0)), None);
        assert_eq!(units(&model(0.0, &[&[1.0 / 1024.0, -32.0]], 0.0)), Some(1024.0));
        assert_eq!(units(&model(16_385.0, &[&[1.0 / 1024.0]], 0.0)), None);
        // Sums up to 2^24 units are exact, but not beyond.
        let leaves: &[f32] = &[32_767.0, 1.0];
        let trees = vec![leaves; 512];
        assert_eq!(units(&model(512.0, &trees, 0.0)), Some(1.0));
        assert_eq!(units(&model(513.0, &trees, 0.0)), None);
        for number in [f32::NAN, f32::INFINITY, f32::from_bits(1), 2.0_f32.powi(70)] {
            assert_eq!(units(&model(0.0, &[&[number]], 0.0)), None);
            assert_eq!(units(&model(number, &[ok], 0.0)), None);
        }
        assert_eq!(units(&model(0.0, &[ok], f32::NAN)), None);
    }
}
