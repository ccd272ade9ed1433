//! Shards of random slides: what cannot be drawn again from their numbers.

use serde::{Deserialize, Serialize};
use wstac_core::model::file::Input;
use wstac_host::error::{Error, ErrorKind};

use super::{bytes_of, numbers_of};
use crate::dataset::path::{PathRow, PathSlide};
use crate::dataset::random::RandomSweep;
use crate::shard::{ShardKind, ShardSet, WholeSet, digest};

/// What the merge needs.
#[derive(Serialize, Deserialize)]
struct Plan {
    input: String,
    /// The sweep's file; empty for the defaults.
    sweep: String,
}

/// The inputs by their names.
const INPUTS: [Input; 3] = [Input::Frames, Input::Path, Input::TaxelPath];

/// Describes the set of a sweep's samples of one input. `text` is that of the sweep's file.
///
/// # Errors
/// This does not fail: every text can be written as JSON.
pub fn set(sweep: &RandomSweep, text: &str, input: Input) -> Result<ShardSet, Error> {
    let plan = Plan { input: input.name().into(), sweep: text.into() };
    let plan = serde_json::to_string(&plan).map_err(|error| Error::with_cause(ErrorKind::Config, "sweep", error))?;
    let digest = format!("{:016x}", digest(&format!("{sweep:?} {}", input.name())));
    Ok(ShardSet { kind: ShardKind::RandomSlides, items: sweep.slides.slides, digest, plan })
}

/// Returns what a shard stores of a slide.
///
/// A byte tells whether it is reliable (1), has a velocity (2) and a sample (4). Its speed, direction and sample follow.
pub fn content(slide: &PathSlide, input: Input) -> Vec<u8> {
    let sample = slide.sample(input);
    let flags = u8::from(slide.reliable) | u8::from(slide.measured.is_some()) << 1 | u8::from(sample.is_some()) << 2;
    let mut content = vec![flags];
    content.extend(slide.measured.iter().flatten().flat_map(|number| number.to_le_bytes()));
    content.extend(sample.into_iter().flat_map(|sample| bytes_of(sample)));
    content
}

/// The slides of a set of random slides.
#[derive(Debug)]
pub struct RandomSet {
    /// The sweep.
    pub sweep: RandomSweep,
    /// What the samples are of.
    pub input: Input,
    /// All slides, in order.
    pub rows: Vec<PathRow>,
}

/// Reads all slides of a set.
///
/// # Errors
/// A shard cannot be used.
pub fn read(set: &WholeSet) -> Result<RandomSet, Error> {
    let first = set.first();
    let plan: Plan = serde_json::from_str(&set.set().plan).map_err(|error| first.wrong_plan(&error))?;
    let sweep = RandomSweep::parse(&first.path().display().to_string(), &plan.sweep)?;
    let input = INPUTS.into_iter().find(|input| input.name() == plan.input);
    let input = input.ok_or_else(|| first.wrong_plan(&format_args!("input is {:?}", plan.input)))?;
    if sweep.slides.slides != set.set().items {
        let (found, expected) = (sweep.slides.slides, set.set().items);
        return Err(first.wrong_plan(&format_args!("has a sweep of {found} slides, expected {expected}")));
    }
    let rows = set.items(|number, content| row(&sweep, number, content))?;
    Ok(RandomSet { sweep, input, rows })
}

/// Reads a slide.
fn row(sweep: &RandomSweep, number: u32, content: &[u8]) -> Option<PathRow> {
    let (flags, mut rest) = content.split_first()?;
    if flags & !7 != 0 {
        return None;
    }
    let mut measured = None;
    if flags & 2 != 0 {
        let (bytes, samples) = rest.split_first_chunk::<8>()?;
        let [mm_s, degrees] = [[bytes[0], bytes[1], bytes[2], bytes[3]], [bytes[4], bytes[5], bytes[6], bytes[7]]];
        measured = Some([f32::from_le_bytes(mm_s), f32::from_le_bytes(degrees)]);
        rest = samples;
    }
    let sample = if flags & 4 == 0 { None } else { Some(numbers_of(&mut rest)?) };
    let (slide, sensor) = sweep.slides.slide_of(number);
    rest.is_empty().then_some(PathRow { slide, sensor, sample, measured, reliable: flags & 1 == 1 })
}
