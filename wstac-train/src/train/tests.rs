use super::*;
use crate::dataset::path::{PathRow, PathSlide, write_split};
use crate::dataset::random::RandomSweep;

fn slide(label: &str, group: &str, is_test: Option<bool>, number: i16) -> LabeledSlide {
    let mut numbers = vec![0; 700];
    numbers[..39].fill(if label == "Saw3" { 900 } else { -900 });
    numbers[70..100].fill(number);
    LabeledSlide { numbers: Some(numbers), label: label.into(), group: group.into(), speed_mm_s: None, is_test }
}

fn set(slides: Vec<LabeledSlide>) -> TrainingSet {
    TrainingSet { slides, sources: vec!["it".into()], simulated: 0 }
}

/// Returns two textures in recordings of their own, `recordings` of each.
fn recorded(recordings: i16) -> TrainingSet {
    let of = |label: &'static str| {
        let of_one =
            move |k: i16| (0..4).map(move |n| slide(label, &format!("recording {label}-{k}"), None, 9 * n + k));
        (0..recordings).flat_map(of_one)
    };
    set(of("Saw3").chain(of("Fla0")).collect())
}

#[test]
fn recordings_are_never_split() {
    let trained = train(recorded(5), &TrainOptions::default()).unwrap();
    let trial = trained.trial.clone().unwrap();
    assert_eq!(
        (trained.labels.as_slice(), trained.groups, trained.slides),
        (&["Fla0".into(), "Saw3".into()][..], 8, 32)
    );
    assert_eq!((trial.groups, trial.slides(), trial.right()), (2, 8, 8));
    assert_eq!((trial.of_class(0), trial.without_answer()), ([4, 4], 0));
    assert!(trained.calibration.is_none() && !trial.is_guessing());
    let why = trained.why_uncalibrated.unwrap();
    assert_eq!(why, "8 slides can be kept aside for it, expected at least 10: about 50 slides of each texture");
    let facts = Model::from_words(&trained.written.words).unwrap().labels().training().to_string();
    let facts: serde_json::Value = serde_json::from_str(&facts).unwrap();
    assert_eq!((facts["slides"].as_u64(), facts["test"]["right"].as_u64()), (Some(32), Some(8)));
    assert_eq!(facts["file"].as_str(), Some("it"));
}

#[test]
fn one_group_is_no_test() {
    let error = |set| train(set, &TrainOptions::default()).unwrap_err().to_string();
    let alone = || {
        let slides = [("Saw3", 1), ("Fla0", 2), ("Saw3", 3), ("Fla0", 4)];
        set(slides.into_iter().map(|(label, n)| slide(label, "recording a.mcap", None, n)).collect())
    };
    let message = error(alone());
    assert!(message.contains("all slides are of one group (recording a.mcap), expected at least 2"), "{message}");
    assert!(message.contains("--test 0"), "{message}");
    assert!(error(recorded(1)).contains("no texture is in two groups"), "{}", error(recorded(1)));
    let without = train(alone(), &TrainOptions { test: 0.0, ..TrainOptions::default() }).unwrap();
    assert!(without.trial.is_none() && without.slides == 4);
    let both = set(vec![slide("Saw3", "sensor 1", Some(true), 1), slide("Fla0", "sensor 1", Some(false), 1)]);
    assert!(error(both).contains("sensor 1 has slides for training and for tests"));
    assert!(error(set(Vec::new())).contains("has no slide"));
    for (is_test, side) in [(true, "tests"), (false, "training")] {
        let slides =
            [("Saw3", "sensor 1"), ("Fla0", "sensor 2")].map(|(label, group)| slide(label, group, Some(is_test), 1));
        let message = error(set(slides.to_vec()));
        assert!(message.contains(&format!("the array split has all slides for {side}, expected train")), "{message}");
        let message = error(TrainingSet { simulated: 2, ..set(slides.to_vec()) });
        assert!(message.contains(&format!("the sweep has all slides for {side}, expected some")), "{message}");
        assert!(message.contains("--test 0") && !message.contains("record"), "{message}");
    }
}

#[test]
fn labels_and_samples_are_checked() {
    let error = |set| train(set, &TrainOptions::default()).unwrap_err().to_string();
    let only = set((0..4).map(|n| slide("Saw3", &format!("sensor {n}"), None, n)).collect());
    assert!(error(only).contains("1 label (Saw3), expected 2 to 64"));
    let mut missing = recorded(3);
    missing.slides.iter_mut().filter(|slide| slide.label == "Fla0").for_each(|slide| slide.numbers = None);
    assert!(error(missing).contains("label Fla0 has no slide with a sample to train on"));
    let odd = set((0..6).map(|n| slide(["Saw3", "Wood"][n % 2], &format!("sensor {n}"), None, n as i16)).collect());
    assert!(error(odd.clone()).contains("\"Wood\""), "a task of specimens needs their names");
    let options = TrainOptions { task: Task::Other, ..TrainOptions::default() };
    assert!(train(odd, &options).is_ok());
}

#[test]
fn a_slide_without_a_sample_counts_as_wrong() {
    let mut slides = recorded(5);
    let group = "recording Saw3-0";
    let set_tests = |slide: &mut LabeledSlide| slide.is_test = Some(slide.group.ends_with("-0"));
    slides.slides.iter_mut().for_each(set_tests);
    slides.slides.iter_mut().find(|slide| slide.group == group).unwrap().numbers = None;
    let trial = train(slides, &TrainOptions::default()).unwrap().trial.unwrap();
    assert_eq!((trial.slides(), trial.right(), trial.without_answer()), (8, 7, 1));
    assert_eq!(trial.of_class(1), [3, 4]);
}

#[test]
fn slides_of_other_groups_calibrate() {
    // The two textures overlap, so that no answer is certain.
    let mut random = 5_u32;
    let mut next = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (random >> 16) as i16 / 40
    };
    let mut slides = Vec::new();
    for n in 0..960 {
        let (label, middle) = [("Saw3", 350), ("Fla0", -350)][n % 2];
        let mut slide = slide(label, &format!("sensor {}", n / 2 % 48), None, 1);
        slide.numbers.as_mut().unwrap().iter_mut().for_each(|number| *number = next());
        slide.numbers.as_mut().unwrap()[0] = middle + next() - 400;
        slides.push(slide);
    }
    let trained = train(set(slides), &TrainOptions::default()).unwrap();
    let quality = trained.calibration.unwrap();
    let model = Model::from_words(&trained.written.words).unwrap();
    assert!(model.is_calibrated() && model.tells_unknown() && quality.samples > 100, "{quality:?}");
    let facts: serde_json::Value = serde_json::from_str(&model.labels().training().to_string()).unwrap();
    assert_eq!(facts["calibrated"]["slides"].as_u64(), Some(quality.samples as u64));
    assert!(facts["calibrated"]["groups"].as_u64() < facts["groups"].as_u64(), "{facts}");
}

fn few() -> (RandomSweep, Vec<PathSlide>) {
    let text = "specimens = [\"Fla0\", \"Saw4\"]\nslides = 60\nsensors = 10\nseed = 3";
    let sweep = RandomSweep::parse("few", text).unwrap();
    let slides = sweep.slides.all().unwrap();
    (sweep, slides)
}

#[test]
fn a_data_set_gives_what_its_slides_give() {
    let (sweep, slides) = few();
    for input in [Input::Path, Input::TaxelPath, Input::Frames] {
        let options = TrainOptions { input, ..TrainOptions::default() };
        let at_once = train(TrainingSet::of_sweep(&sweep, &slides, &options), &options).unwrap();
        let path = std::env::temp_dir().join(format!("wstac-train-{}-{}.npz", std::process::id(), input.name()));
        let file = std::fs::File::create(&path).unwrap();
        let rows: Vec<PathRow> = slides.iter().map(|slide| PathRow::of(slide, input)).collect();
        write_split(file, &rows, input, |sensor| sweep.is_for_tests(sensor)).unwrap();
        let read = TrainingSet::read(&path, &options).unwrap();
        let read = train(read, &options).unwrap();
        assert!(at_once.calibration.is_none(), "too few slides");
        let (one, other) = (at_once.trial.unwrap(), read.trial.unwrap());
        assert_eq!((one.counts.clone(), one.groups), (other.counts, other.groups), "{input:?}");
        assert!(f64::from(one.right()) >= 0.9 * f64::from(one.slides()) && one.slides() > 5, "{input:?} {one:?}");
        // The weights are the same, too; only the name of the source differs.
        let labels = |words: &[u32]| words[6] as usize / 2;
        let words = |written: &Written| written.words[4..labels(&written.words)].to_vec();
        assert_eq!(words(&at_once.written), words(&read.written));
        let other = if input == Input::Path { Input::Frames } else { Input::Path };
        let wrong = TrainOptions { input: other, ..TrainOptions::default() };
        let error = TrainingSet::read(&path, &wrong).unwrap_err().to_string();
        assert!(error.contains(&format!("array {}: is missing", crate::model::eval::array_of(other))), "{error}");
        assert!(error.contains(&format!("--input {}", input.name().replace('_', "-"))), "{error}");
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn it_is_said_why_nothing_is_calibrated() {
    // Two of three recordings are to train on.
    let trained = train(recorded(3), &TrainOptions::default()).unwrap();
    let why = trained.why_uncalibrated.unwrap();
    assert_eq!(why, "Fla0 has 2 sensors or recordings to train on, expected at least 3 of each texture");
    // About 50 slides of each texture are enough, as the message says.
    let trained = train(recorded(13), &TrainOptions::default()).unwrap();
    assert_eq!((trained.why_uncalibrated, trained.calibration.unwrap().samples), (None, 8 * 2));
}

#[test]
fn a_test_that_guessing_would_pass_is_recognized() {
    let trial = |counts: [[u32; 3]; 2]| Trial {
        labels: vec!["a".into(), "b".into()],
        counts: counts.iter().map(|row| row.to_vec()).collect(),
        groups: 2,
    };
    assert!(trial([[0, 2, 0], [1, 0, 0]]).is_guessing());
    assert!(trial([[1, 1, 0], [1, 1, 0]]).is_guessing());
    assert!(!trial([[2, 0, 0], [1, 1, 0]]).is_guessing());
}
