//! Scaling of inputs before the classifier: (x − offset) · scale, in float32.

use crate::model::trained::Row;

/// Units in a feature value of 1.
const ONE: f64 = 2048.0;

/// Offsets and scales; a list of one is for all inputs, and an empty list changes no input.
pub(super) struct Scaler {
    offset: Vec<f32>,
    scale: Vec<f32>,
}

impl Scaler {
    pub(super) fn new(offset: &[f32], scale: &[f32]) -> Self {
        Self { offset: offset.to_vec(), scale: scale.to_vec() }
    }

    /// Rejects lists that hold neither one number nor one for each input.
    pub(super) fn check(&self, inputs: usize) -> Result<(), String> {
        for (name, list) in [("offset", &self.offset), ("scale", &self.scale)] {
            if ![0, 1, inputs].contains(&list.len()) {
                return Err(format!("Scaler.{name} has {} numbers, expected 1 or {inputs}", list.len()));
            }
        }
        Ok(())
    }

    /// Returns the offsets of all inputs, which a StandardScaler sets to their means; `None` if all of them are 0.
    pub(super) fn mean(&self, inputs: usize) -> Option<Vec<f64>> {
        let offset = |input| self.of(input).ok().map(|(offset, _)| f64::from(offset));
        (0..inputs).map(offset).collect::<Option<Vec<f64>>>().filter(|all| {
            // Others are no means of features.
            all.iter().any(|&offset| offset != 0.0) && all.iter().all(|offset| offset.abs() <= 16.0)
        })
    }

    /// Returns the offset and scale of an input.
    fn of(&self, input: usize) -> Result<(f32, f32), String> {
        let get = |list: &[f32], none: f32| match list {
            [] => Some(none),
            [one] => Some(*one),
            _ => list.get(input).copied(),
        };
        let (offset, scale) = (get(&self.offset, 0.0), get(&self.scale, 1.0));
        offset.zip(scale).ok_or_else(|| format!("Scaler: offset or scale of input {input} is missing"))
    }
}

/// Converts rows to weights of unscaled inputs.
pub(super) fn fold(rows: &mut [Row], scalers: &[Scaler]) -> Result<(), String> {
    for scaler in scalers.iter().rev() {
        for row in &mut *rows {
            for (input, weight) in row.weights.iter_mut().enumerate() {
                let (offset, scale) = scaler.of(input)?;
                *weight *= f64::from(scale);
                row.bias -= *weight * f64::from(offset);
            }
        }
    }
    Ok(())
}

/// Returns the threshold of an unscaled input that decides for every integer as the scaled one does.
///
/// The result is "at most" or "above" the threshold. The scaled comparison is in float32, as ONNX computes it.
pub(super) fn unscaled(threshold: f64, strict: bool, input: usize, scalers: &[Scaler]) -> Result<f64, String> {
    let steps: Vec<(f32, f32)> = scalers.iter().map(|scaler| scaler.of(input)).collect::<Result<_, _>>()?;
    if let Some((_, scale)) = steps.iter().find(|step| step.1 <= 0.0) {
        return Err(format!("input {input} is scaled by {scale}, expected above 0"));
    }
    let left = |x: i32| {
        let scaled = steps.iter().fold((f64::from(x) / ONE) as f32, |x, (offset, scale)| (x - offset) * scale);
        let scaled = f64::from(scaled);
        if strict { scaled < threshold } else { scaled <= threshold }
    };
    // The left side is a range from the lowest integer on, because scales are above 0.
    let (mut from, mut to) = (i32::from(i16::MIN), i32::from(i16::MAX) + 1);
    while from < to {
        // Rounded down, unlike i32::midpoint: otherwise a range of two negative numbers would never end.
        let middle = (from + to) >> 1;
        if left(middle) { from = middle + 1 } else { to = middle }
    }
    Ok(f64::from(from - 1) / ONE)
}
