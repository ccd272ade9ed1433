//! Shards of a sweep: the outcomes of some of its slides, which one of several processes ran. [`wstac_train::shard`] has
//! the file.

use serde::{Deserialize, Serialize};
use wstac_host::error::{Error, ErrorKind};
use wstac_train::shard::{ShardKind, ShardSet, WholeSet, digest};

use super::candidate::{Candidate, Right};
use super::float64::{Deviation, FeatureError};
use super::parameters::Setting;
use super::slides::{SENSORS, TradeSlide, slides};
use super::sweep::{Answer, Outcome};

/// What a merge needs to know of a sweep.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SweepPlan {
    /// Number of slides of every sensor.
    pub of_each: u32,
    /// Names of the models.
    pub models: Vec<String>,
    /// The text of the configuration's file; empty for the defaults.
    pub config: String,
}

impl SweepPlan {
    /// Returns the set of this plan with these models, for a new shard.
    ///
    /// # Errors
    /// This does not fail: every plan can be written as JSON.
    pub fn set(&self, models: &[Candidate]) -> Result<ShardSet, Error> {
        let plan = serde_json::to_string(self).map_err(|error| Error::with_cause(ErrorKind::Config, "sweep", error))?;
        let digest = self.digest(models);
        Ok(ShardSet { kind: ShardKind::Trade, items: SENSORS * self.of_each, digest, plan })
    }

    /// Returns the plan of a set.
    ///
    /// # Errors
    /// The set is of another command, or has another number of slides.
    pub fn of(set: &WholeSet) -> Result<Self, Error> {
        let first = set.first();
        if set.set().kind != ShardKind::Trade {
            let message = "is a shard of wstac dataset, expected shards of wstac trade: use wstac dataset merge";
            return Err(Error::new(ErrorKind::Config, first.path().display(), message));
        }
        let plan: Self = serde_json::from_str(&set.set().plan).map_err(|error| first.wrong_plan(&error))?;
        let items = set.set().items;
        if plan.of_each.checked_mul(SENSORS) != Some(items) {
            return Err(
                first.wrong_plan(&format_args!("has {} slides of each sensor, and {items} in all", plan.of_each))
            );
        }
        Ok(plan)
    }

    /// Checks that the models are those that the shards were made with.
    ///
    /// # Errors
    /// They are others.
    pub fn check(&self, set: &WholeSet, models: &[Candidate]) -> Result<(), Error> {
        let (found, expected) = (self.digest(models), &set.set().digest);
        if found == *expected {
            return Ok(());
        }
        let models = self.models.join(", ");
        let message = format_args!(
            "is of a sweep with digest {expected}, but its models as they are here give {found}, expected the same \
             files on all machines: {models}"
        );
        Err(Error::new(ErrorKind::Config, set.first().path().display(), message))
    }

    fn digest(&self, models: &[Candidate]) -> String {
        let words = |model: &Candidate| format!("{} {:016x}", model.name, digest(&format!("{:?}", model.file.words())));
        let models: Vec<String> = models.iter().map(words).collect();
        format!("{:016x}", digest(&format!("{} {models:?} {:?} {:?}", self.of_each, Setting::all(), self.config)))
    }
}

/// Returns what a shard stores of a slide: the outcomes of all settings.
pub fn content(outcomes: &[Option<Outcome>]) -> Vec<u8> {
    let mut content = Vec::new();
    for outcome in outcomes {
        let Some(Outcome { event, error }) = outcome else {
            content.push(0);
            continue;
        };
        let code = |right: Option<bool>| right.map_or(2, u8::from);
        match event {
            None => content.push(1),
            Some(Answer { lead, speed, direction, right }) => {
                content.extend([2, u8::from(*direction), u8::from(speed.is_some())]);
                content.extend(lead.to_bits().to_le_bytes());
                content.extend(speed.unwrap_or(0.0).to_bits().to_le_bytes());
                content.extend(right.iter().flatten().map(|right| code(*right)));
            }
        }
        for Deviation { max, squares, count } in [&error.all, &error.lit] {
            content.extend([max.to_bits(), squares.to_bits(), *count].iter().flat_map(|word| word.to_le_bytes()));
        }
    }
    content
}

/// Reads the outcomes of all slides of a set, by slide, then by setting.
///
/// # Errors
/// A shard cannot be used.
pub fn outcomes(set: &WholeSet, settings: &[Setting], models: usize) -> Result<Vec<Vec<Option<Outcome>>>, Error> {
    set.items(|_, content| of_slide(content, settings.len(), models))
}

/// Returns the slides of these numbers among [`slides`].
pub fn slides_of(of_each: u32, numbers: &[u32]) -> Vec<TradeSlide> {
    let all = slides(of_each);
    numbers.iter().filter_map(|number| all.get(*number as usize).copied()).collect()
}

fn of_slide(mut content: &[u8], settings: usize, models: usize) -> Option<Vec<Option<Outcome>>> {
    let rest = &mut content;
    let outcomes = (0..settings).map(|_| outcome(rest, models)).collect::<Option<Vec<_>>>()?;
    rest.is_empty().then_some(outcomes)
}

/// Takes bytes off the start; `None` if there are fewer.
fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (found, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(*found)
}

/// Takes an outcome off the start of a slide; `None` if it is none.
#[expect(clippy::option_option, reason = "the inner one is a setting that was not run")]
fn outcome(rest: &mut &[u8], models: usize) -> Option<Option<Outcome>> {
    let event = match take::<1>(rest)? {
        [0] => return Some(None),
        [1] => None,
        [2] => Some(answer(rest, models)?),
        _ => return None,
    };
    let mut deviation = || {
        let mut word = || take(rest).map(u64::from_le_bytes);
        Some(Deviation { max: f64::from_bits(word()?), squares: f64::from_bits(word()?), count: word()? })
    };
    Some(Some(Outcome { event, error: FeatureError { all: deviation()?, lit: deviation()? } }))
}

fn answer(rest: &mut &[u8], models: usize) -> Option<Answer> {
    let flag = |byte| [Some(false), Some(true), None].get(usize::from(byte)).copied();
    let [direction, has_speed] = take::<2>(rest)?.map(|byte| byte == 1);
    let lead = f64::from_bits(u64::from_le_bytes(take(rest)?));
    let speed = f32::from_bits(u32::from_le_bytes(take(rest)?));
    let right = (0..models).map(|_| {
        let [specimen, pattern, depth] = take::<3>(rest)?.map(flag);
        Some::<Right>([specimen?, pattern?, depth?])
    });
    let right = right.collect::<Option<Vec<_>>>()?;
    Some(Answer { lead, speed: has_speed.then_some(speed), direction, right })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_come_out_as_they_went_in_and_no_part_of_them_does() {
        let error = FeatureError {
            all: Deviation { max: 0.1 + 0.2, squares: 1e-300, count: u64::MAX },
            lit: Deviation { max: -0.0, squares: f64::MAX, count: 0 },
        };
        let right = vec![[Some(true), None, Some(false)], [None; 3]];
        let answer = Answer { lead: -1.0 / 3.0, speed: Some(99.1), direction: true, right };
        let outcomes = vec![
            None,
            Some(Outcome { event: None, error }),
            Some(Outcome { event: Some(Answer { speed: None, ..answer.clone() }), error }),
            Some(Outcome { event: Some(answer), error }),
        ];
        let content = content(&outcomes);
        assert_eq!(of_slide(&content, 4, 2), Some(outcomes));
        for length in 0..content.len() {
            assert_eq!(of_slide(&content[..length], 4, 2), None, "{length}");
        }
        assert_eq!(of_slide(&content, 3, 2), None);
        assert_eq!(of_slide(&[3], 1, 2), None);
    }
}
