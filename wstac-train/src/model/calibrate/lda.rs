//! Linear discriminant analysis: the projection in which samples of one texture lie close together.

use wstac_core::params::FEATURE_ONE;
use wstac_host::plural::counted;

use super::LabeledSamples;

/// The ridge of the covariance within classes, as a fraction of its mean variance.
const RIDGE: f64 = 3e-4;
/// The least variance of the means along a direction, in units of that within classes. Less is rounding.
const LEAST_VARIANCE: f64 = 1e-12;
/// The largest number of iterations over all pairs of the eigenvalue problem.
const MOST_TURNS: usize = 60;

/// A projection of samples in which their covariance within classes is the identity.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// For each dimension a weight of each input, in the order of a model file; inputs are in units of 1.
    pub weights: Vec<Vec<f64>>,
    /// For each dimension what is added to the sum.
    pub biases: Vec<f64>,
}

impl Projection {
    /// Returns the place of a sample.
    pub fn place(&self, sample: &[i16]) -> Vec<f64> {
        let one = f64::from(FEATURE_ONE);
        let of = |(weights, bias): (&Vec<f64>, &f64)| {
            bias + weights.iter().zip(sample).map(|(weight, &x)| weight * f64::from(x) / one).sum::<f64>()
        };
        self.weights.iter().zip(&self.biases).map(of).collect()
    }

    /// Returns the projection that separates the labels of samples best, of at most so many dimensions.
    ///
    /// # Errors
    /// There are fewer than two labels, no more samples than labels, or samples or labels that do not differ.
    pub fn of(samples: &LabeledSamples, inputs: usize, most_dimensions: usize) -> Result<Self, String> {
        let labels = samples.labels.iter().max().map_or(0, |&most| usize::from(most) + 1);
        let labeled = samples.numbers.iter().zip(&samples.labels);
        let (means, counts) = means(labeled.map(|(sample, &label)| (reals(sample, inputs), label)), labels, inputs);
        let found = counts.iter().filter(|&&count| count > 0).count();
        let n = samples.numbers.len();
        if found < 2 || n <= found {
            let (samples, labels) = (counted(n, "sample"), counted(found, "label"));
            return Err(format!("{samples} of {labels}, expected several samples of at least two labels"));
        }
        let within = within(samples, &means, inputs, n - found).ok_or(
            "the samples of each label are all equal, expected those of different slides: nothing tells how much slides of a texture differ",
        )?;
        let lower = cholesky(within);
        let mut middle = vec![0.0; inputs];
        for (mean, &count) in means.iter().zip(&counts) {
            mean.iter().zip(&mut middle).for_each(|(value, middle)| *middle += value * count as f64 / n as f64);
        }
        // The means in the space where the covariance is the identity, weighted by their samples.
        let whitened: Vec<Vec<f64>> = means
            .iter()
            .zip(&counts)
            .filter(|(_, count)| **count > 0)
            .map(|(mean, &count)| {
                let weight = (count as f64 / n as f64).sqrt();
                let centered = mean.iter().zip(&middle).map(|(value, middle)| (value - middle) * weight);
                forward(&lower, centered.collect())
            })
            .collect();
        let directions = directions(&whitened, most_dimensions.min(found - 1));
        if directions.is_empty() {
            return Err("the labels' means are all equal, expected textures that differ".into());
        }
        let weights: Vec<Vec<f64>> = directions.into_iter().map(|direction| backward(&lower, direction)).collect();
        let biases = weights.iter().map(|row| -row.iter().zip(&middle).map(|(a, b)| a * b).sum::<f64>()).collect();
        Ok(Self { weights, biases })
    }
}

/// Returns a sample's inputs in units of 1.
fn reals(sample: &[i16], inputs: usize) -> impl Iterator<Item = f64> {
    sample.iter().take(inputs).map(|&x| f64::from(x) / f64::from(FEATURE_ONE))
}

/// Returns the mean of every label's samples, and their number; zeros for a label without samples.
pub(super) fn means<S: Iterator<Item = f64>>(
    samples: impl Iterator<Item = (S, impl Into<usize>)>,
    labels: usize,
    inputs: usize,
) -> (Vec<Vec<f64>>, Vec<usize>) {
    let (mut means, mut counts) = (vec![vec![0.0; inputs]; labels], vec![0_usize; labels]);
    for (sample, label) in samples {
        let label: usize = label.into();
        counts[label] += 1;
        sample.zip(&mut means[label]).for_each(|(x, mean)| *mean += x);
    }
    for (mean, &count) in means.iter_mut().zip(&counts) {
        for value in mean {
            *value /= count.max(1) as f64;
        }
    }
    (means, counts)
}

/// Returns the covariance within labels and its ridge, a lower triangle; `None` if all samples of each label are equal.
fn within(samples: &LabeledSamples, means: &[Vec<f64>], inputs: usize, freedom: usize) -> Option<Vec<Vec<f64>>> {
    let mut sums: Vec<Vec<f64>> = (1..=inputs).map(|length| vec![0.0; length]).collect();
    let mut residual = vec![0.0; inputs];
    for (sample, &label) in samples.numbers.iter().zip(&samples.labels) {
        let mean = &means[usize::from(label)];
        for ((residual, x), mean) in residual.iter_mut().zip(reals(sample, inputs)).zip(mean) {
            *residual = x - mean;
        }
        for (row, &value) in sums.iter_mut().zip(&residual) {
            row.iter_mut().zip(&residual).for_each(|(sum, other)| *sum += value * other);
        }
    }
    for sum in sums.iter_mut().flatten() {
        *sum /= freedom as f64;
    }
    let mean_variance = (0..inputs).map(|k| sums[k][k]).sum::<f64>() / inputs as f64;
    if mean_variance <= 0.0 {
        return None;
    }
    let ridge = (RIDGE * mean_variance).max(f64::MIN_POSITIVE.sqrt());
    for row in &mut sums {
        if let Some(last) = row.last_mut() {
            *last += ridge;
        }
    }
    Some(sums)
}

/// Returns the Cholesky factor of a lower triangle.
fn cholesky(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for i in 0..rows.len() {
        let (above, rest) = rows.split_at_mut(i);
        let row = &mut rest[0];
        for j in 0..=i {
            let (done, this) = row.split_at_mut(j);
            let other = if j < i { &above[j][..j] } else { &*done };
            let rest = this[0] - done.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            // The ridge makes every pivot positive.
            this[0] = if j < i { rest / above[j][j] } else { rest.max(f64::MIN_POSITIVE).sqrt() };
        }
    }
    rows
}

/// Solves L x = b.
fn forward(lower: &[Vec<f64>], mut b: Vec<f64>) -> Vec<f64> {
    for i in 0..b.len() {
        let sum: f64 = lower[i][..i].iter().zip(&b).map(|(a, x)| a * x).sum();
        b[i] = (b[i] - sum) / lower[i][i];
    }
    b
}

/// Solves Lᵀ x = b.
fn backward(lower: &[Vec<f64>], mut b: Vec<f64>) -> Vec<f64> {
    for i in (0..b.len()).rev() {
        b[i] /= lower[i][i];
        let x = b[i];
        b.iter_mut().zip(&lower[i][..i]).for_each(|(b, a)| *b -= a * x);
    }
    b
}

/// Returns the orthonormal directions in which rows vary most, the strongest first.
fn directions(rows: &[Vec<f64>], most: usize) -> Vec<Vec<f64>> {
    let inputs = rows[0].len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let by_rows = rows.len() <= inputs;
    // The smaller of the two products has the same eigenvalues above 0.
    let product: Vec<Vec<f64>> = if by_rows {
        rows.iter().map(|a| rows.iter().map(|b| dot(a, b)).collect()).collect()
    } else {
        let mut product = vec![vec![0.0; inputs]; inputs];
        for row in rows {
            for (sums, &a) in product.iter_mut().zip(row) {
                sums.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
            }
        }
        product
    };
    let (values, vectors) = eigen(product);
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let strongest = order.first().map_or(0.0, |&first| values[first]);
    let strong = order.into_iter().take(most).filter(|&k| values[k] > (1e-9 * strongest).max(LEAST_VARIANCE));
    let direction = |k: usize| {
        let vector = &vectors[k];
        if !by_rows {
            return vector.clone();
        }
        let mut direction = vec![0.0; inputs];
        for (row, weight) in rows.iter().zip(vector) {
            direction.iter_mut().zip(row).for_each(|(sum, x)| *sum += weight * x / values[k].sqrt());
        }
        direction
    };
    strong.map(direction).collect()
}

/// Returns the eigenvalues and eigenvectors of a symmetric matrix, by Jacobi's rotations.
fn eigen(mut matrix: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = matrix.len();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let whole: f64 = matrix.iter().flatten().map(|x| x * x).sum();
    for _ in 0..MOST_TURNS {
        let off: f64 = (0..n).map(|i| matrix[i][..i].iter().map(|x| x * x).sum::<f64>()).sum();
        if off <= 1e-26 * whole {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let apq = matrix[p][q];
                if apq * apq <= 1e-34 * whole / n as f64 {
                    continue;
                }
                let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * apq);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                rotate(&mut matrix, p, q, c, s);
                for row in &mut matrix {
                    let (a, b) = (row[p], row[q]);
                    (row[p], row[q]) = (c * a - s * b, s * a + c * b);
                }
                rotate(&mut vectors, p, q, c, s);
            }
        }
    }
    ((0..n).map(|k| matrix[k][k]).collect(), vectors)
}

/// Rotates two rows of a matrix.
fn rotate(matrix: &mut [Vec<f64>], p: usize, q: usize, c: f64, s: f64) {
    let (front, back) = matrix.split_at_mut(q);
    for (a, b) in front[p].iter_mut().zip(&mut back[0]) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

#[cfg(test)]
mod tests {
    use wstac_core::model::file::INPUTS;

    use super::*;

    /// Returns samples of three labels. Input 1 is noise of all, twice as large in input 2; labels differ in inputs 0
    /// and 2.
    fn samples() -> LabeledSamples {
        let mut samples = LabeledSamples::default();
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as i32 % 2001 - 1000
        };
        for k in 0..600_u16 {
            let label = k % 3;
            let mut sample = vec![0; INPUTS];
            let shared = noise();
            sample[0] = (noise() / 4 + 900 * i32::from(label == 1)) as i16;
            sample[1] = shared as i16;
            sample[2] = (2 * shared + noise() / 8 + 500 * i32::from(label == 2)) as i16;
            samples.numbers.push(sample);
            samples.labels.push(label);
        }
        samples
    }

    #[test]
    fn labels_are_apart_and_their_covariance_is_the_identity() {
        let samples = samples();
        let projection = Projection::of(&samples, 10, 9).unwrap();
        assert_eq!(projection.weights.len(), 2, "three labels have two dimensions");
        let places: Vec<Vec<f64>> = samples.numbers.iter().map(|sample| projection.place(sample)).collect();
        let mean = |label: u16, dimension: usize| {
            let of = places.iter().zip(&samples.labels).filter(|(_, other)| **other == label);
            of.map(|(place, _)| place[dimension]).sum::<f64>() / 200.0
        };
        let mut covariance = [[0.0; 2]; 2];
        for (place, &label) in places.iter().zip(&samples.labels) {
            for (a, row) in covariance.iter_mut().enumerate() {
                for (b, sum) in row.iter_mut().enumerate() {
                    *sum += (place[a] - mean(label, a)) * (place[b] - mean(label, b)) / 597.0;
                }
            }
        }
        for (a, row) in covariance.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                // The ridge takes a little.
                assert!((value - f64::from(u8::from(a == b))).abs() < 0.05, "{covariance:?}");
            }
        }
        let distance = |a: u16, b: u16| (0..2).map(|d| (mean(a, d) - mean(b, d)).powi(2)).sum::<f64>().sqrt();
        // 900 of a noise of 144; 500 of a noise of 72, as the shared part cancels.
        assert!(
            (distance(0, 1) - 6.2).abs() < 0.7 && (distance(0, 2) - 6.8).abs() < 0.8,
            "{} {}",
            distance(0, 1),
            distance(0, 2)
        );
    }

    #[test]
    fn more_labels_than_inputs_give_the_same_directions() {
        let mut samples = samples();
        let few = Projection::of(&samples, 10, 2).unwrap();
        // Each label is split into five by chance.
        for (k, label) in samples.labels.iter_mut().enumerate() {
            *label += 3 * ((k / 3) % 5) as u16;
        }
        let many = Projection::of(&samples, 10, 2).unwrap();
        // The two planes are the same, whatever the directions are in them.
        let length = |place: Vec<f64>| place.iter().map(|x| x * x).sum::<f64>().sqrt();
        for sample in samples.numbers.iter().take(20) {
            let (one, other) = (length(few.place(sample)), length(many.place(sample)));
            assert!((one - other).abs() < 0.1 * one.max(1.0), "{one} {other}");
        }
    }

    #[test]
    fn too_little_is_refused() {
        let one =
            LabeledSamples { numbers: vec![vec![0; INPUTS]; 3], labels: vec![0, 0, 0], ..LabeledSamples::default() };
        assert!(Projection::of(&one, 10, 2).unwrap_err().contains("3 samples of 1 label,"));
        let each =
            LabeledSamples { numbers: vec![vec![0; INPUTS]; 2], labels: vec![0, 1], ..LabeledSamples::default() };
        assert!(Projection::of(&each, 10, 2).is_err());
        // Constant inputs have no covariance, and equal means no direction.
        let labels = vec![0, 0, 1, 1];
        let constant = LabeledSamples { numbers: vec![vec![7; INPUTS]; 4], labels, ..LabeledSamples::default() };
        assert!(Projection::of(&constant, 10, 2).unwrap_err().contains("samples of each label are all equal"));
        let numbers = [0, 2, 0, 2].map(|x| vec![x; INPUTS]).to_vec();
        let same = LabeledSamples { numbers, ..constant };
        assert!(Projection::of(&same, 10, 2).unwrap_err().contains("means are all equal"));
    }
}
