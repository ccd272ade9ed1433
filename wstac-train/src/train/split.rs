//! The split into slides for training and slides for tests: by group, never by slide.

use std::collections::{BTreeMap, BTreeSet};

use wstac_host::plural::counted;

use super::{LabeledSlide, TrainingSet};
use crate::dataset::recordings::share_of;

/// Returns the number of different groups.
pub(super) fn groups(slides: &[&LabeledSlide]) -> usize {
    slides.iter().map(|slide| slide.group.as_str()).collect::<BTreeSet<_>>().len()
}

/// Returns the groups that give this fraction of every label's groups, at least one of a label with two.
fn chosen(of_label: &BTreeMap<&str, BTreeSet<&str>>, fraction: f64) -> BTreeSet<String> {
    let mut chosen: BTreeSet<String> = BTreeSet::new();
    for groups in of_label.values() {
        // Sorted by a number from the name: it has no order of time, and does not depend on other groups.
        let mut sorted: Vec<&str> = groups.iter().copied().collect();
        sorted.sort_by_key(|group| crc32fast::hash(group.as_bytes()));
        let there = sorted.iter().filter(|group| chosen.contains(**group)).count();
        let wanted = share_of(sorted.len(), fraction);
        let new = sorted.into_iter().filter(|group| !chosen.contains(*group)).take(wanted.saturating_sub(there));
        let new: Vec<String> = new.map(str::to_owned).collect();
        chosen.extend(new);
    }
    chosen
}

/// Slides of each label, on average, without which nothing is calibrated.
const LEAST_ASIDE: usize = 5;

/// Groups of each label without which nothing is calibrated.
const LEAST_GROUPS: usize = 3;

/// Returns the groups that are kept aside for the calibration.
///
/// # Errors
/// A label has fewer than three groups for training, or those that would be kept aside have too few slides.
pub(super) fn aside(slides: &[&LabeledSlide], fraction: f64) -> Result<BTreeSet<String>, String> {
    let mut of_label: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for slide in slides.iter().filter(|slide| slide.numbers.is_some()) {
        of_label.entry(&slide.label).or_default().insert(&slide.group);
    }
    if let Some((label, groups)) = of_label.iter().find(|(_, groups)| groups.len() < LEAST_GROUPS) {
        let found = groups.len();
        return Err(format!(
            "{label} has {found} sensors or recordings to train on, expected at least {LEAST_GROUPS} of each texture"
        ));
    }
    let chosen = chosen(&of_label, fraction);
    // Groups that were chosen for one label may be all of another.
    let all_train = of_label.values().all(|groups| groups.iter().any(|group| !chosen.contains(*group)));
    if !all_train {
        return Err("too few sensors to keep some of each texture aside, expected each texture on more of them".into());
    }
    let kept = slides.iter().filter(|slide| chosen.contains(&slide.group)).count();
    let least = LEAST_ASIDE * of_label.len();
    if kept < least {
        return Err(format!(
            "{} can be kept aside for it, expected at least {least}: about 50 slides of each texture",
            counted(kept, "slide")
        ));
    }
    Ok(chosen)
}

/// Decides for every slide whether it is for tests.
///
/// Slides for which a set decided stay as they are. Of the other groups, every label gives this fraction to the test,
/// at least one if it has two.
pub(super) fn split(set: &mut TrainingSet, test: f64) -> Result<(), String> {
    if set.slides.is_empty() {
        return Err("has no slide, expected at least 1 of each texture".into());
    }
    if test <= 0.0 {
        set.slides.iter_mut().for_each(|slide| slide.is_test = Some(false));
        return Ok(());
    }
    let is_decided = set.slides.iter().all(|slide| slide.is_test.is_some());
    let mut of_label: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for slide in set.slides.iter().filter(|slide| slide.is_test.is_none()) {
        of_label.entry(&slide.label).or_default().insert(&slide.group);
    }
    let tests = chosen(&of_label, test);
    for slide in &mut set.slides {
        slide.is_test.get_or_insert_with(|| tests.contains(&slide.group));
    }
    let of = |is_test| set.slides.iter().filter(move |slide| slide.is_test == Some(is_test)).map(|slide| &slide.group);
    let (tests, trains): (BTreeSet<_>, BTreeSet<_>) = (of(true).collect(), of(false).collect());
    if let Some(group) = tests.intersection(&trains).next() {
        return Err(format!(
            "{group} has slides for training and for tests, expected a group in one of them: slides of one sensor or \
             recording are too much alike"
        ));
    }
    let all: BTreeSet<_> = tests.union(&trains).collect();
    if is_decided && (tests.is_empty() || trains.is_empty()) {
        let side = if tests.is_empty() { "training" } else { "tests" };
        let cause = if set.is_simulated() {
            format!(
                "the sweep has all slides for {side}, expected some for each: let it have more sensors, and test above 0"
            )
        } else {
            format!("the array split has all slides for {side}, expected train and test")
        };
        return Err(format!("{cause}; or train without a test by --test 0"));
    }
    if tests.is_empty() || trains.is_empty() {
        let found = all.first().map_or_else(String::new, |group| format!(" ({group})"));
        let what = if all.len() == 1 {
            format!("all slides are of one group{found}")
        } else {
            "no texture is in two groups".into()
        };
        return Err(format!(
            "{what}, expected at least 2 groups of each texture: record each texture in more recordings (wstac record \
             --label specimen=…), better with more than one sensor (--label sensor=…), or train without a test by \
             --test 0"
        ));
    }
    Ok(())
}
