//! New textures from a few slides each: a model file of the textures' means in the projection of another model.
//!
//! The projection was trained on many textures, so that a sample's place depends on its texture and on little else. The
//! new model names the texture whose mean is nearest. The distance from a mean is linear in the sample, except for a
//! term that all textures share, so the result is an ordinary linear model.
//!
//! Places, means and distances are those of [`wstac_core::learned`], with which a board learns.

use wstac_core::learned::{Center, expected_far, nearest};
use wstac_core::model::Model;
use wstac_core::model::place::{PLACE_ONE, Place};

use super::calibrate::{self, KnownRegion, LabeledSamples, Limits, Projection, Scored};
use super::trained::{Kind, Linear, Row, Trained, file_order, guess_task, padded};
use super::write::{Options, write};
use wstac_host::plural::counted;

/// The fewest slides of each texture that tell how sure an answer is.
const FEWEST_SLIDES: usize = 3;

/// A model of new textures.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The file's words.
    pub words: Vec<u32>,
    /// The number of slides of each label.
    pub slides: Vec<usize>,
    /// The fraction of slides that are named correctly by the other slides; `None` if a texture has only one.
    pub left_out: Option<f64>,
    /// The fraction of slides that are called unknown by a model of all textures but their own; `None` if the model
    /// does not tell. It is that of these textures: unknown ones that are more alike are found less often.
    pub found_unknown: Option<f64>,
    /// Whether the model says how sure an answer is.
    pub is_calibrated: bool,
}

/// Makes a model of new textures from slides of each; `base` is the file of a calibrated model, such as
/// `builtin:embedding`, and `facts` text about the training.
///
/// Labels of the slides are numbers of their names. A name without slides is left out.
///
/// # Errors
/// The base has no projection, there are fewer than two textures, or a label cannot be written.
pub fn learn(base: &[u32], slides: &LabeledSamples, facts: &str) -> Result<Learned, String> {
    let projection = calibrate::projection_of(base)?;
    let base = Model::from_words(base).map_err(|error| error.to_string())?;
    let mut names: Vec<(String, Vec<Place>)> = slides.names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for (numbers, &label) in slides.numbers.iter().zip(&slides.labels) {
        if let Some((_, places)) = names.get_mut(usize::from(label)) {
            places.extend(base.place(&padded(numbers)));
        }
    }
    names.retain(|(_, places)| !places.is_empty());
    names.sort_by(|(one, _), (other, _)| one.cmp(other));
    if names.len() < 2 {
        let only = names.first().map_or_else(String::new, |(name, _)| format!(" ({name:?})"));
        return Err(format!("slides of {}{only}, expected at least 2", counted(names.len(), "texture")));
    }
    let labels: Vec<String> = names.iter().map(|(name, _)| name.clone()).collect();
    let places: Vec<Vec<Place>> = names.into_iter().map(|(_, places)| places).collect();
    let means: Vec<Vec<f64>> = places.iter().map(|places| reals(&Place::mean(places, None))).collect();
    let frames = usize::from(base.frames());
    let trained = Trained {
        task: guess_task(&labels),
        labels,
        input: base.input(),
        inputs: calibrate::inputs_of(&base),
        speeds: base.known_speeds(),
        kind: Kind::Linear(Linear {
            pairs: false,
            rows: means.iter().map(|mean| row(&projection, mean, frames)).collect(),
        }),
        remarks: Vec::new(),
        mean: None,
    };
    super::check_names(&trained)?;
    let plain = write(&trained, facts, Options::default())?.words;
    let counts: Vec<usize> = places.iter().map(Vec::len).collect();
    let fewest = counts.iter().copied().min().unwrap_or(0);
    let left = LeftOut::of(&places, &means);
    let left_out = (fewest > 1).then(|| left.right as f64 / left.scored.truth.len() as f64);
    if fewest < FEWEST_SLIDES {
        return Ok(Learned { words: plain, slides: counts, left_out, found_unknown: None, is_calibrated: false });
    }
    let limits: Vec<u32> = left.distances.iter().map(|own| limit(own, projection.biases.len())).collect();
    let found_unknown = Some(found_unknown(&places, &limits));
    let factor = left.scored.factor()? * unit(&plain, &base, &means, &slides.numbers)?;
    // A texture whose slides differ much must not widen what is known of the others.
    let known = KnownRegion { projection: &projection, means: &means, limits: Limits::Own(limits) };
    let part = calibrate::part(factor, Some(&known));
    let words = calibrate::with_part(&plain, &part)?;
    Ok(Learned { words, slides: counts, left_out, found_unknown, is_calibrated: true })
}

/// Returns the numbers of a place in standard deviations.
fn reals(place: &Place) -> Vec<f64> {
    place.numbers().iter().map(|&number| f64::from(number) / f64::from(PLACE_ONE)).collect()
}

/// Returns the score of a place for a mean: minus half the squared distance, without the term that all means share.
fn score(place: &[f64], mean: &[f64]) -> f64 {
    place.iter().zip(mean).map(|(x, m)| x * m - 0.5 * m * m).sum()
}

/// Returns the row of a linear model that computes [`score`] from a sample.
fn row(projection: &Projection, mean: &[f64], frames: usize) -> Row {
    let inputs = projection.weights.first().map_or(0, Vec::len);
    // A trained model's inputs are in the order of data sets.
    let weight = |input: usize| {
        let input = file_order(input, frames);
        projection.weights.iter().zip(mean).map(|(row, m)| row[input] * m).sum()
    };
    let bias = projection.biases.iter().zip(mean).map(|(bias, m)| bias * m - 0.5 * m * m).sum();
    Row { weights: (0..inputs).map(weight).collect(), bias }
}

/// Units of a score that is left out, so that scores are integers.
const UNITS: f64 = 65_536.0;

/// The answers of a model of all other slides about each slide.
struct LeftOut {
    scored: Scored,
    right: usize,
    /// For each texture, the squared distances of its slides from the mean of its others.
    distances: Vec<Vec<u32>>,
}

impl LeftOut {
    fn of(places: &[Vec<Place>], means: &[Vec<f64>]) -> Self {
        let mut all = Self { scored: Scored::default(), right: 0, distances: vec![Vec::new(); places.len()] };
        for (truth, own) in places.iter().enumerate() {
            for (number, place) in own.iter().enumerate().filter(|_| own.len() > 1) {
                let mean_of_others = Place::mean(own, Some(number));
                all.distances[truth].push(place.squared_distance(&mean_of_others));
                let (place, others) = (reals(place), reals(&mean_of_others));
                let scores: Vec<f64> = means
                    .iter()
                    .enumerate()
                    .map(|(class, mean)| score(&place, if class == truth { &others } else { mean }))
                    .collect();
                let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]));
                all.right += usize::from(best == Some(truth));
                all.scored.scores.push(scores.iter().map(|score| (score * UNITS) as i64).collect());
                all.scored.truth.push(truth);
            }
        }
        all
    }
}

/// Returns the largest squared distance of a known slide of a texture: that within which 49 of 50 of its slides are, or
/// should be. Of fewer than 50 slides it is that of [`wstac_core::learned::Center::of`].
fn limit(distances: &[u32], dimensions: usize) -> u32 {
    let expected = expected_far(dimensions, distances.len());
    let mut sorted = distances.to_vec();
    sorted.sort_unstable();
    let place = (0.98 * sorted.len() as f64).ceil() as usize;
    sorted.get(place.saturating_sub(1)).map_or(expected, |&far| far.max(expected))
}

/// Returns the fraction of slides that the textures other than their own do not know.
fn found_unknown(places: &[Vec<Place>], limits: &[u32]) -> f64 {
    let centers = places.iter().zip(limits).map(|(own, &limit)| Center::new(Place::mean(own, None), limit));
    let centers: Vec<(usize, Center)> = centers.enumerate().collect();
    let (mut found, mut all) = (0, 0);
    for (texture, own) in places.iter().enumerate() {
        for place in own {
            let others = centers.iter().filter(|(number, _)| *number != texture);
            found += usize::from(nearest(place, None, others.map(|(number, center)| (number, center))).is_none());
            all += 1;
        }
    }
    found as f64 / all.max(1) as f64
}

/// Returns the size of a unit of the model's scores in units of those that are left out.
fn unit(words: &[u32], base: &Model, means: &[Vec<f64>], samples: &[Vec<i16>]) -> Result<f64, String> {
    let model = Model::from_words(words).map_err(|error| error.to_string())?;
    let (mut real, mut raw) = (0.0, 0.0);
    for numbers in samples {
        let place = base.place(&padded(numbers)).map_or_else(Vec::new, |place| reals(&place));
        let mut scores = Vec::new();
        model.each_score(&padded(numbers), |_, score| scores.push(score as f64));
        for (mean, found) in means.iter().zip(&scores).skip(1) {
            real += ((score(&place, mean) - score(&place, &means[0])) * UNITS).abs();
            raw += (found - scores[0]).abs();
        }
    }
    if raw > 0.0 { Ok(real / raw) } else { Err("all slides are alike, expected textures that differ".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_one_name_are_one_texture() {
        let of = |name: &str, number| LabeledSamples {
            numbers: vec![vec![number; 700]; 2],
            labels: vec![0, 0],
            names: vec![name.into()],
        };
        let mut all = LabeledSamples::default();
        for (name, number) in [("b", 1), ("a", 2), ("b", 3)] {
            all.append(of(name, number));
        }
        assert_eq!((all.names, all.labels), (vec!["b".to_owned(), "a".into()], vec![0, 0, 1, 1, 0, 0]));
    }
}
