//! From features to the trigger's decision.

use wstac_core::features::{FeatureScale, Floor};
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::trigger::{Rule, Trigger, TriggerConfig};
use wstac_tests::random::Random;

use super::{FEATURE, Largest, ONE};

/// The pixels of a taxel in the paper's layout at 400 × 400.
const PIXELS: u32 = 2500;
const FULL_SCALE: u32 = 255;
const MOST: f64 = PIXELS as f64 * FULL_SCALE as f64;

/// Converts sums of a taxel to features, and to real logarithms in units, which are floored.
struct Light {
    scale: FeatureScale<Fixed>,
    floor: f64,
}

impl Light {
    fn real(&self, sum: u32) -> f64 {
        ((f64::from(sum) / MOST).ln() * ONE).max(self.floor)
    }

    /// Returns the sum near a level whose feature is furthest above (or below) the real logarithm.
    fn worst(&self, units: f64, above: bool) -> u32 {
        let near = ((units / ONE).exp() * MOST) as u32;
        let range = near.saturating_sub(near / 1000).max(1)..=near + near / 1000 + 1;
        let off = |sum: u32| (f64::from(self.scale.feature(sum)) - self.real(sum)) * if above { 1.0 } else { -1.0 };
        range.max_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(near)
    }
}

/// Returns the threshold of a window sum in real numbers, in units: η + max((b − 1)|η|, m · margin), or b · η.
fn threshold(rule: Rule, eta: f64, b: f64, window: f64, margin: f64) -> f64 {
    match rule {
        Rule::Literal => b * eta,
        Rule::Signed => eta + ((b - 1.0) * eta.abs()).max(window * margin * ONE),
    }
}

/// Returns how far the edge of the trigger's decision can be from that of real numbers, in units of a window sum. The
/// documentation of [`Rule`] derives it.
fn bound(rule: Rule, eta: f64, b: f64, window: f64) -> f64 {
    let (sum, rounded) = (window * FEATURE, 1.0 / 131_072.0);
    match rule {
        Rule::Literal => sum + (b + rounded) * sum + eta.abs() * rounded,
        Rule::Signed => 2.0 * sum + ((b + rounded - 1.0) * sum + eta.abs() * rounded).max(window * ONE * rounded),
    }
}

/// Tests windows as close to the threshold as sums can be, with every feature rounded in the worst direction. If the
/// real numbers are further from the threshold than the bound, the decision must be theirs. The edge must not move
/// further than the bound.
#[test]
fn the_triggers_decision_is_within_its_bound() {
    let mut random = Random::new(3);
    let mut uniform = |from: f64, to: f64| from + (to - from) * random.below(1 << 30) as f64 / f64::from(1 << 30);
    let floor = Floor::new(0.5, FULL_SCALE).unwrap();
    let light = Light {
        scale: FeatureScale::new(PIXELS, FULL_SCALE, 1, floor).unwrap(),
        floor: (2.5 / f64::from(FULL_SCALE)).ln() * ONE,
    };
    let (mut edges, mut frames, mut other) = (Largest::default(), 0.0_f64, 0);
    for round in 0..3000 {
        let rule = if round % 4 == 0 { Rule::Literal } else { Rule::Signed };
        let (b, window, margin) = match round % 3 {
            0 if rule == Rule::Signed => (1.2, 5, 0.2),
            _ if rule == Rule::Signed => (uniform(1.0, 2.0), 1 + uniform(0.0, 35.0) as u32, uniform(0.0, 0.5)),
            _ => (uniform(0.3, 1.0), 1 + uniform(0.0, 35.0) as u32, 0.0),
        };
        let config = TriggerConfig::new(window, b, 0, rule, margin).unwrap();
        let m = f64::from(window);
        let quiet = uniform(light.floor, -1000.0);
        // Half of the rounds push the two sides of the comparison apart; the others push them together.
        let up = round % 2 == 0;
        let dark = light.worst(quiet, up);
        let eta = m * light.real(dark);
        let limit = threshold(rule, eta, b, m, margin);
        let at = limit / m;
        if !(light.floor + 20.0..3000.0).contains(&at) {
            continue;
        }
        for shift in [-2.0, -0.6, -0.3, 0.0, 0.3, 0.6, 2.0] {
            let lit = light.worst(at + shift, !up);
            let mut trigger = Trigger::new(config);
            (0..5 * window).for_each(|_| assert!(trigger.push([light.scale.feature(dark); 10], false).is_none()));
            for _ in 0..window {
                trigger.push([light.scale.feature(lit); 10], false);
            }
            let fired = trigger.end().incomplete.is_some();
            let (sum, real) = (m * f64::from(light.scale.feature(lit)), m * light.real(lit));
            // The edge that the trigger uses, in exact numbers.
            let own = f64::from(light.scale.feature(dark)) * m;
            let quantized = |x: f64| (x * 65_536.0).round() / 65_536.0;
            let edge = threshold(rule, own, quantized(b), m, quantized(margin));
            assert_eq!(fired, sum > edge, "{rule:?} b {b} m {window}: {sum} beside {edge}");
            let moved = ((sum - edge) - (real - limit)).abs();
            let most = bound(rule, eta, b, m);
            edges.see(moved, most, format_args!("{rule:?} b {b} m {window} η {eta}"));
            frames = frames.max(moved / m);
            if fired != (real > limit) {
                other += 1;
                assert!((real - limit).abs() <= most, "decided otherwise at {} of {most}", real - limit);
            }
        }
    }
    println!(
        "{} windows next to their thresholds, {other} decided otherwise than in real numbers, all within the bound",
        edges.count
    );
    assert!(edges.count > 15_000 && other > 1000, "too few are near enough to tell");
    edges.print("the decision's edge", 1.0, "units in a window sum");
    println!("  at most {frames:.3} units per frame: {:.4} % of light", 100.0 * ((frames / ONE).exp() - 1.0));
    let eta = 5.0 * light.floor;
    let default = bound(Rule::Signed, eta, 1.2, 5.0) / 5.0;
    println!(
        "  bound with default parameters {default:.3} units per frame: {:.4} % of light",
        100.0 * ((default / ONE).exp() - 1.0)
    );
}
