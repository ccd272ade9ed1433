//! Algorithm 1 over a whole stream at once, directly from SPEC §3: no ring, no states, fractions instead of shifts.

use wstac_core::features::Features;
use wstac_core::paper::trigger::{Rule, TriggerConfig};

use crate::OwnedEvent;

/// The thresholds as fractions: ten numerators over one denominator, in units of a feature.
fn thresholds(totals: &[i32; 10], config: &TriggerConfig) -> ([i128; 10], i128) {
    let (b, margin) = (i128::from(config.multiplier().bits()), i128::from(config.margin().bits()));
    let m = i128::from(config.window());
    // η = total / 5; b and margin are in units of 2^-16; a feature's unit is 2^-11.
    let numerators = totals.map(|total| {
        let total = i128::from(total);
        match config.rule() {
            Rule::Literal => b * total,
            Rule::Signed => total * 65_536 + ((b - 65_536) * total.abs()).max(5 * m * margin * 2048),
        }
    });
    (numerators, 5 * 65_536)
}

/// Returns the sums of each feature over these frames.
fn totals(frames: &[Features]) -> [i32; 10] {
    let mut totals = [0; 10];
    for frame in frames {
        for (total, feature) in totals.iter_mut().zip(frame) {
            *total += i32::from(*feature);
        }
    }
    totals
}

/// Returns the events of a stream of features, each with a flag for a lost frame, and the first frame and length of a
/// sample that the end cuts off.
pub fn events(stream: &[(Features, bool)], config: &TriggerConfig) -> (Vec<OwnedEvent>, Option<(u64, u8)>) {
    let (m, c) = (usize::from(config.window()), usize::from(config.backtrack()));
    let features: Vec<Features> = stream.iter().map(|frame| frame.0).collect();
    let mut found = Vec::new();
    let Some(quiet_part) = features.get(..5 * m) else { return (found, None) };
    let baseline = totals(quiet_part);
    let (numerators, denominator) = thresholds(&baseline, config);

    let windows: Vec<[i32; 10]> = quiet_part.chunks(m).map(totals).collect();
    let range = |k: usize| {
        let sums = windows.iter().map(|window| i128::from(window[k]));
        sums.clone().max().unwrap_or(0) - sums.min().unwrap_or(0)
    };
    let quiet = (0..10).all(|k| {
        let eta = i128::from(baseline[k]) * 65_536;
        let margin = match config.rule() {
            Rule::Signed => numerators[k] - eta,
            Rule::Literal => (numerators[k] - eta).abs(),
        };
        range(k) * denominator <= margin
    });

    let mut t = 5 * m;
    while let Some(window) = features.get(t..t + m) {
        let sums = totals(window);
        if !(0..10).any(|k| i128::from(sums[k]) * denominator > numerators[k]) {
            t += m;
            continue;
        }
        let Some(sample) = stream.get(t - c..t - c + 70) else {
            return (found, Some(((t - c) as u64, (stream.len() - (t - c)) as u8)));
        };
        let frames_filled = sample.iter().filter(|frame| frame.1).count() as u8;
        found.push(OwnedEvent {
            frame: (t - c) as u64,
            sample: sample.iter().map(|frame| frame.0).collect(),
            totals: baseline,
            frames_filled,
            reliable: quiet && frames_filled <= 7,
        });
        t += 70;
    }
    (found, None)
}
