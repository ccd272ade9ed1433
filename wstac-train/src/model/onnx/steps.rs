//! Steps from the input to the classifier: scaling, a selection of inputs, weighted sums, and rectifiers.

use wstac_core::model::network::MOST_WIDTH;

use crate::model::trained::{Row, frames};

/// Units in a feature value of 1.
const ONE: f64 = 2048.0;

/// One step; a list of one number is for all inputs.
pub(super) enum Step {
    Add(Vec<f64>),
    Subtract(Vec<f64>),
    Multiply(Vec<f64>),
    Divide(Vec<f64>),
    /// Numbers of the inputs that stay, in their order.
    Pick(Vec<usize>),
    /// A weighted sum for each output.
    Sums(Vec<Row>),
    /// A rectifier: numbers below 0 become 0.
    Rectify,
}

/// The operators before a classifier.
pub(super) struct Before {
    /// The last dimension of the input, if it is stated.
    pub(super) width: Option<usize>,
    /// `true` if steps may be computed in float64 instead of float32.
    pub(super) is_double: bool,
    /// Steps, in their order.
    pub(super) steps: Vec<Step>,
    /// How far float32 numbers move each sum of the classifier for usual features: standard deviations, if they are
    /// known.
    pub(super) spreads: Vec<f64>,
}

impl Before {
    /// Returns the number of the model's inputs, and checks that every step and a classifier of `taken` inputs fit.
    pub(super) fn inputs(&self, taken: Option<usize>) -> Result<usize, String> {
        let is_wide = self.steps.iter().all(|step| !matches!(step, Step::Pick(_) | Step::Sums(_)));
        let inputs = self.width.or(taken.filter(|_| is_wide));
        let inputs = inputs.ok_or("the ONNX input's shape does not say how many inputs there are, expected 700")?;
        frames(inputs)?;
        match (taken, self.given(inputs)?) {
            (Some(taken), given) if taken != given => {
                Err(format!("the ONNX input gives the classifier {given} numbers, expected {taken}"))
            }
            _ => Ok(inputs),
        }
    }

    /// Returns the number of inputs of the classifier.
    pub(super) fn given(&self, inputs: usize) -> Result<usize, String> {
        self.steps.iter().try_fold(inputs, |inputs, step| step.outputs(inputs))
    }

    /// Returns what the first step subtracts, which StandardScaler and PCA set to the means of inputs.
    pub(super) fn mean(&self, inputs: usize) -> Option<Vec<f64>> {
        let Some(Step::Subtract(list)) = self.steps.first() else { return None };
        let all: Vec<f64> = (0..inputs).map(|input| of(list, input)).collect();
        // Others are no means of features.
        (all.iter().any(|&mean| mean != 0.0) && all.iter().all(|mean| mean.abs() <= 16.0)).then_some(all)
    }

    /// Returns `true` if a step changes numbers.
    pub(super) fn scales(&self) -> bool {
        !self.steps.iter().all(|step| matches!(step, Step::Pick(_)))
    }

    /// Returns what the classifier gets for these inputs.
    pub(super) fn applied(&self, inputs: Vec<f64>) -> Vec<f64> {
        self.steps.iter().fold(inputs, |x, step| step.applied(&x))
    }

    /// Converts rows of the classifier to weights of the model's inputs.
    pub(super) fn fold(&self, rows: &mut [Row], inputs: usize) -> Result<(), String> {
        if self.steps.iter().any(|step| matches!(step, Step::Rectify)) {
            return Err("ONNX node Relu before a linear classifier, expected MatMul or Gemm behind it".into());
        }
        fold(&self.steps, rows, inputs)
    }

    /// Returns the layers of a network with these scores, and in each the weights of what it gets from the one before;
    /// without a rectifier there is one.
    pub(super) fn layers(&self, mut scores: Vec<Row>, mut inputs: usize) -> Result<Vec<Vec<Row>>, String> {
        let parts: Vec<&[Step]> = self.steps.split(|step| matches!(step, Step::Rectify)).collect();
        let Some((last, hidden)) = parts.split_last() else { return Ok(vec![scores]) };
        let mut layers = Vec::with_capacity(parts.len());
        for part in hidden {
            let sums = part.iter().try_fold(inputs, |inputs, step| step.outputs(inputs))?;
            if sums > MOST_WIDTH {
                return Err(format!("a hidden layer has {sums} sums, expected 1 to {MOST_WIDTH}"));
            }
            let single = |sum| (0..sums).map(|at| f64::from(u8::from(at == sum))).collect();
            let mut rows: Vec<Row> = (0..sums).map(|sum| Row { weights: single(sum), bias: 0.0 }).collect();
            fold(part, &mut rows, inputs)?;
            layers.push(rows);
            inputs = sums;
        }
        fold(last, &mut scores, inputs)?;
        layers.push(scores);
        Ok(layers)
    }

    /// Returns the model's input that a split compares, and the split's threshold for it.
    ///
    /// For every integer the result decides as the scaled one does. If inputs are scaled, it is "at most" or "above"
    /// the threshold. The scaled comparison is in float32, as ONNX computes it.
    pub(super) fn split(&self, mut input: usize, threshold: f64, strict: bool) -> Result<(usize, f64, bool), String> {
        let mut scaling = Vec::new();
        for step in self.steps.iter().rev() {
            let (is_factor, number) = match step {
                Step::Add(list) | Step::Subtract(list) => (false, of(list, input)),
                Step::Multiply(list) | Step::Divide(list) => (true, of(list, input)),
                Step::Pick(list) => {
                    input = *list.get(input).ok_or_else(|| format!("input {input}, expected below {}", list.len()))?;
                    continue;
                }
                Step::Sums(_) | Step::Rectify => {
                    return Err("its input is a weighted sum, expected trees of single features".into());
                }
            };
            if !number.is_finite() || is_factor && number <= 0.0 {
                return Err(format!("input {input} is scaled by {number}, expected above 0"));
            }
            scaling.push((step, number as f32));
        }
        if scaling.is_empty() {
            return Ok((input, threshold, strict));
        }
        if self.is_double {
            return Err("its input is scaled in double (11), expected float (1)".into());
        }
        let left = |x: i32| {
            let scaled = scaling.iter().rev().fold((f64::from(x) / ONE) as f32, |x, (step, number)| match step {
                Step::Add(_) => x + number,
                Step::Subtract(_) => x - number,
                Step::Divide(_) => x / number,
                _ => x * number,
            });
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
        Ok((input, f64::from(from - 1) / ONE, false))
    }
}

/// Converts rows of what steps give to weights of what they get.
fn fold(steps: &[Step], rows: &mut [Row], inputs: usize) -> Result<(), String> {
    let mut widths = vec![inputs];
    for step in steps {
        widths.push(step.outputs(widths[widths.len() - 1])?);
    }
    for (step, &width) in steps.iter().zip(&widths).rev() {
        for row in &mut *rows {
            step.fold(row, width);
        }
    }
    let is_finite = |row: &Row| row.bias.is_finite() && row.weights.iter().all(|weight| weight.is_finite());
    if rows.iter().all(is_finite) { Ok(()) } else { Err("a scaled weight is not finite".into()) }
}

impl Step {
    /// Returns the number of weights.
    pub(super) fn weights(&self) -> usize {
        if let Self::Sums(rows) = self { rows.iter().map(|row| row.weights.len()).sum() } else { 0 }
    }

    /// Returns the number of outputs for a number of inputs.
    fn outputs(&self, inputs: usize) -> Result<usize, String> {
        match self {
            Self::Rectify => Ok(inputs),
            Self::Add(list) | Self::Subtract(list) | Self::Multiply(list) | Self::Divide(list) => {
                if ![1, inputs].contains(&list.len()) {
                    return Err(format!("scaling has {} numbers, expected 1 or {inputs}", list.len()));
                }
                Ok(inputs)
            }
            Self::Pick(list) => match list.iter().find(|&&picked| picked >= inputs) {
                Some(picked) => Err(format!("input {picked} is selected, expected below {inputs}")),
                None => Ok(list.len()),
            },
            Self::Sums(rows) => match rows.iter().find(|row| row.weights.len() != inputs) {
                Some(row) => Err(format!("weighted sums are of {} inputs, expected {inputs}", row.weights.len())),
                None => Ok(rows.len()),
            },
        }
    }

    /// Returns the outputs for inputs.
    fn applied(&self, x: &[f64]) -> Vec<f64> {
        let each = |change: &dyn Fn(f64, usize) -> f64| x.iter().enumerate().map(|(at, &x)| change(x, at)).collect();
        match self {
            Self::Add(list) => each(&|x, at| x + of(list, at)),
            Self::Subtract(list) => each(&|x, at| x - of(list, at)),
            Self::Multiply(list) => each(&|x, at| x * of(list, at)),
            Self::Divide(list) => each(&|x, at| x / of(list, at)),
            Self::Pick(list) => list.iter().filter_map(|&at| x.get(at).copied()).collect(),
            Self::Sums(rows) => rows.iter().map(|row| row.sum(x)).collect(),
            Self::Rectify => each(&|x, _| x.max(0.0)),
        }
    }

    /// Converts a row of the outputs to one of the inputs.
    fn fold(&self, row: &mut Row, inputs: usize) {
        let before = match self {
            Self::Pick(_) | Self::Sums(_) => std::mem::replace(&mut row.weights, vec![0.0; inputs]),
            _ => Vec::new(),
        };
        match self {
            // Steps are folded from one rectifier to the next.
            Self::Rectify => {}
            Self::Add(list) => row.bias += row.weights.iter().enumerate().map(|(at, w)| w * of(list, at)).sum::<f64>(),
            Self::Subtract(list) => {
                row.bias -= row.weights.iter().enumerate().map(|(at, w)| w * of(list, at)).sum::<f64>();
            }
            Self::Multiply(list) => row.weights.iter_mut().enumerate().for_each(|(at, w)| *w *= of(list, at)),
            Self::Divide(list) => row.weights.iter_mut().enumerate().for_each(|(at, w)| *w /= of(list, at)),
            Self::Pick(list) => list.iter().zip(before).for_each(|(&picked, w)| row.weights[picked] += w),
            Self::Sums(rows) => {
                for (sum, factor) in rows.iter().zip(before) {
                    row.weights.iter_mut().zip(&sum.weights).for_each(|(w, of)| *w += factor * of);
                    row.bias += factor * sum.bias;
                }
            }
        }
    }
}

/// Returns the number of a list for an input.
fn of(list: &[f64], input: usize) -> f64 {
    if let [one] = list { *one } else { list.get(input).copied().unwrap_or(f64::NAN) }
}
