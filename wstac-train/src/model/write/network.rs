//! Networks: each layer has one scale of weights, and its values have the finest units in which they fit int16.

use wstac_core::model::network::MOST_WIDTH;
use wstac_core::params::FEATURES;

use super::super::trained::{Network, file_order};
use super::linear::{USUAL, corrected, largest, number_of, push_rows, rounded, scale};
use super::{Body, ONE, Weights};

/// Largest value of a hidden layer.
const MOST: f64 = i16::MAX as f64;

pub(super) fn body(
    network: &Network,
    classes: usize,
    frames: usize,
    weights: Option<Weights>,
    mean: Option<&[f64]>,
) -> Result<Body, String> {
    let width = weights.unwrap_or(Weights::Int16);
    let (number, full) = (number_of(width), largest(width));
    check(network, classes, frames)?;
    let last = network.layers.len() - 1;
    let mut halves = vec![network.layers.len() as u16, 0];
    // The units of a layer's inputs, and the range of each of them.
    let (mut unit, mut ranges) = (ONE, vec![[USUAL.0 / ONE, USUAL.1 / ONE]; frames * FEATURES]);
    for (at, layer) in network.layers.iter().enumerate() {
        // What rounds is added to biases.
        let scale = scale(layer, full, 2.0_f64.powi(60) / unit);
        let tops: Vec<f64> = match &network.tops {
            // Without a value above 0 the samples say nothing of the range.
            Some(tops) if at < last && tops[at].iter().any(|top| *top > 0.0) => tops[at].clone(),
            _ => layer.iter().map(|row| row.ends(&ranges).1).collect(),
        };
        let top = tops.iter().fold(0.0_f64, |most, top| most.max(*top));
        let shift = if at == last { 0.0 } else { (top * scale * unit / MOST).log2().ceil().clamp(0.0, 47.0) };
        let rounding = if shift > 0.0 { (shift - 1.0).exp2() } else { 0.0 };
        let inputs = if at == 0 { frames * FEATURES } else { ranges.len().next_multiple_of(FEATURES) };
        let rows = layer.iter().map(|row| {
            let mean = mean.filter(|_| at == 0);
            let integers = rounded(row, scale, full, if at == 0 { frames } else { 1 }, mean.is_some());
            let mut weights = vec![0; inputs];
            for (input, integer) in integers.iter().enumerate() {
                weights[if at == 0 { file_order(input, frames) } else { input }] = *integer as i32;
            }
            (weights, (corrected(row, &integers, scale, mean) * scale * unit + rounding).round() as i64)
        });
        let rows: Vec<_> = rows.collect();
        halves.extend([layer.len() as u16, shift as u16]);
        push_rows(&mut halves, &rows, width);
        unit *= scale / shift.exp2();
        ranges = tops.iter().map(|top| [0.0, top.max(0.0)]).collect();
    }
    let widths: Vec<String> = network.layers.iter().map(|layer| layer.len().to_string()).collect();
    let exactness = format!(
        "a network of {} sums; scores are in units of {:.2e}, without a bound of their error",
        widths.join(", "),
        1.0 / unit
    );
    Ok(Body { kind: 5, number, halves, exactness, ..Body::default() })
}

fn check(network: &Network, classes: usize, frames: usize) -> Result<(), String> {
    let layers = network.layers.len();
    if !(2..=3).contains(&layers) {
        return Err(format!("a network of {layers} layers, expected one or two hidden ones and one of scores"));
    }
    let mut inputs = frames * FEATURES;
    for (at, layer) in network.layers.iter().enumerate() {
        let sums = layer.len();
        if at + 1 < layers && (sums == 0 || sums > MOST_WIDTH) {
            return Err(format!("hidden layer {} has {sums} sums, expected 1 to {MOST_WIDTH}", at + 1));
        }
        if at + 1 == layers && sums != classes && !(sums == 1 && classes == 2) {
            return Err(format!("{sums} scores of {classes} classes, expected {classes}"));
        }
        if let Some(row) = layer.iter().find(|row| row.weights.len() != inputs) {
            return Err(format!("layer {at} has {} weights a sum, expected {inputs}", row.weights.len()));
        }
        let mut all = layer.iter().flat_map(|row| row.weights.iter().chain([&row.bias]));
        if let Some(weight) = all.find(|weight| !weight.is_finite()) {
            return Err(format!("layer {at}: weight {weight}, expected a finite number"));
        }
        inputs = sums;
    }
    Ok(())
}
