//! The factor of scores that makes honest probabilities of them.

/// The range of the factor times the median distance of an answer from the second best.
const RANGE: [f64; 2] = [1e-4, 1e4];
/// The steps over the range, and the iterations between two of them.
const STEPS: u32 = 64;
const ITERATIONS: u32 = 60;

/// Scores of samples, and the number of the true class of each.
#[derive(Clone, Debug, Default)]
pub(in crate::model) struct Scored {
    pub(in crate::model) scores: Vec<Vec<i64>>,
    pub(in crate::model) truth: Vec<usize>,
}

impl Scored {
    /// Returns the factor by which a softmax of the scores is most likely.
    ///
    /// One more sample, whose answer is wrong by the median distance, keeps the factor finite if all answers are right.
    pub(in crate::model) fn factor(&self) -> Result<f64, String> {
        let mut distances: Vec<f64> =
            self.scores.iter().map(|scores| lead(scores)).filter(|lead| *lead > 0.0).collect();
        if distances.is_empty() {
            return Err("all scores of every sample are equal, expected a model that tells classes apart".into());
        }
        distances.sort_by(f64::total_cmp);
        let median = distances[distances.len() / 2];
        let loss = |log: f64| {
            let factor = log.exp() / median;
            let of = |(scores, &truth): (&Vec<i64>, &usize)| {
                let scaled = scores.iter().map(|&score| factor * (score as f64 - scores[truth] as f64));
                let most = scaled.clone().fold(0.0, f64::max);
                most + scaled.map(|x| (x - most).exp()).sum::<f64>().ln()
            };
            let wrong = factor * median;
            self.scores.iter().zip(&self.truth).map(of).sum::<f64>() + wrong + (-wrong).exp().ln_1p()
        };
        let [from, to] = RANGE.map(f64::ln);
        let step = (to - from) / f64::from(STEPS);
        let at = |k: u32| from + step * f64::from(k);
        let best = (0..=STEPS).min_by(|&a, &b| loss(at(a)).total_cmp(&loss(at(b)))).unwrap_or(0);
        // Golden sections.
        let (mut low, mut high) = (at(best) - step, at(best) + step);
        let golden = (5_f64.sqrt() - 1.0) / 2.0;
        for _ in 0..ITERATIONS {
            let (one, other) = (high - golden * (high - low), low + golden * (high - low));
            if loss(one) < loss(other) { high = other } else { low = one }
        }
        Ok((f64::midpoint(low, high)).exp() / median)
    }
}

/// Returns by how much the highest score leads.
fn lead(scores: &[i64]) -> f64 {
    let mut sorted = scores.to_vec();
    sorted.sort_unstable();
    if let [.., second, first] = sorted[..] { first as f64 - second as f64 } else { 0.0 }
}

/// Returns the halves of a file for a factor of raw scores: the factor and the two shifts.
pub(super) fn halves(factor: f64) -> [u16; 3] {
    /// Units of the exponent, and the exponent from which a weight is 0.
    const ONE: f64 = 1_048_576.0;
    const LAST: f64 = 19.0;
    let before = ((LAST / factor).log2().ceil() - 32.0).clamp(0.0, 31.0);
    let whole = factor * ONE * before.exp2();
    // Products of 32 bits and 32 bits are below 64 bits.
    let behind = (31.0 - whole.log2().floor()).clamp(0.0, 63.0);
    let number = (whole * behind.exp2()).round().clamp(1.0, f64::from(u32::MAX)) as u32;
    [number as u16, (number >> 16) as u16, before as u16 | (behind as u16) << 8]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_that_of_the_samples() {
        // Class 1 leads by 100 in 1000 samples and is right in 9 of 10; so e^(-100 f) = 1/9.
        let mut scored = Scored::default();
        for k in 0..1000 {
            scored.scores.push(vec![0, 100]);
            scored.truth.push(usize::from(k % 10 != 0));
        }
        let factor = scored.factor().unwrap();
        assert!((factor / (9_f64.ln() / 100.0) - 1.0).abs() < 0.01, "{factor}");
        // All right: 1 of 1001 is wrong.
        scored.truth.fill(1);
        let factor = scored.factor().unwrap();
        assert!((factor / (1000_f64.ln() / 100.0) - 1.0).abs() < 0.01, "{factor}");
        scored.scores.fill(vec![7, 7]);
        assert!(scored.factor().is_err());
    }

    #[test]
    fn factors_of_any_size_are_kept_to_nine_digits() {
        for exponent in -40..30 {
            let factor = 1.234_567_89 * f64::from(exponent).exp2();
            let [low, high, shifts] = halves(factor);
            let number = f64::from(u32::from(low) | u32::from(high) << 16);
            let (before, behind) = (i32::from(shifts & 0xFF), i32::from(shifts >> 8));
            let found = number * f64::from(-before - behind - 20).exp2();
            assert!(exponent > 11 || (found / factor - 1.0).abs() < 1e-9, "{exponent}: {found} {factor}");
            // A distance that still has a weight is not cut off.
            assert!((18.1 / factor) / f64::from(before).exp2() < f64::from(u32::MAX));
        }
    }
}
