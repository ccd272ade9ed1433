//! Tests that every command that reads data sets reads them alike: their scale, their labels, and what has no answer.

use std::fs;
use std::path::{Path, PathBuf};

use wstac_tests::command::{assert_has, ends, good, records, refusal, refused, run, says};
use wstac_tests::folder::{Folder, text};
use wstac_tests::npz::{header, npz};

/// An array: its name, its header and its data.
type Array = (&'static str, String, Vec<u8>);

/// Returns an array of text.
fn texts(name: &'static str, texts: &[&[u32]]) -> Array {
    let width = texts.iter().map(|text| text.len()).max().unwrap();
    let padded = texts.iter().flat_map(|text| text.iter().copied().chain([0; 32]).take(width));
    (name, header(&format!("<U{width}"), &format!("({},)", texts.len())), padded.flat_map(u32::to_le_bytes).collect())
}

fn points(text: &str) -> Vec<u32> {
    text.chars().map(u32::from).collect()
}

/// Returns samples of every input: the rows of one label are near each other, and no row is zero but those said.
fn samples(rows: usize, zeros: &[usize]) -> Vec<Array> {
    let mut noise = 1_u32;
    let mut next = || {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (noise >> 24) as i16
    };
    let number = |row: usize, at: usize, noise: i16| match at {
        _ if zeros.contains(&row) => 0,
        at if at < 350 => noise + if row.is_multiple_of(2) { 600 } else { -600 },
        _ => noise,
    };
    let numbers: Vec<i16> =
        (0..rows).flat_map(|row| (0..700).map(move |at| (row, at))).map(|(row, at)| number(row, at, next())).collect();
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    ["X", "X_path", "X_taxel_path"]
        .map(|name| (name, header("<i2", &format!("({rows}, 10, 70)")), bytes.clone()))
        .to_vec()
}

/// Returns a data set of two labels that take turns, with these arrays in addition.
fn set(folder: &Folder, name: &str, rows: usize, labels: [&str; 2], zeros: &[usize], more: Vec<Array>) -> PathBuf {
    let mut all = samples(rows, zeros);
    let both = labels.map(points);
    all.push(texts("y", &(0..rows).map(|row| both[row % 2].as_slice()).collect::<Vec<_>>()));
    all.extend(more);
    folder.file(name, npz(&all))
}

/// Returns the array `sensor` of a sensor for every four rows.
fn sensors(rows: usize) -> Array {
    let numbers = (0..rows).map(|row| (row / 4) as i64);
    ("sensor", header("<i8", &format!("({rows},)")), numbers.flat_map(i64::to_le_bytes).collect())
}

/// The commands that read a data set; `SET` stands for it.
const READING: [&[&str]; 4] = [
    &["train", "SET", "--task", "other", "-o"],
    &["model", "learn", "builtin:embedding", "SET", "-o"],
    &["model", "calibrate", "builtin:path-svm", "SET", "SET2", "-o"],
    &["model", "eval", "builtin:path-svm", "SET"],
];

/// Runs each command, which must refuse the set in these words.
fn all_refuse(folder: &Folder, path: &Path, words: &str, commands: &[&[&str]]) {
    let (second, new) = (folder.0.join("second.npz"), folder.0.join("new.wsm"));
    fs::copy(path, &second).unwrap();
    for command in commands {
        let with = |word: &&str| match *word {
            "SET" => text(path).to_owned(),
            "SET2" => text(&second).to_owned(),
            "-o" => format!("-o{}", text(&new)),
            other => other.to_owned(),
        };
        let command: Vec<String> = command.iter().map(with).collect();
        refused(&command.iter().map(String::as_str).collect::<Vec<_>>(), &[words, ".npz"]);
        assert!(!new.exists(), "{command:?}");
    }
}

#[test]
fn samples_of_another_scale_and_arrays_of_another_length_are_refused() {
    let folder = Folder::new("sets-scale");
    let scale = |scale: f64| ("scale", header("<f8", "()"), scale.to_le_bytes().to_vec());
    let wrong = set(&folder, "a.npz", 16, ["a", "b"], &[], vec![scale(0.001), sensors(16)]);
    let words = "a.npz: array scale: 0.001, expected 0.00048828125 (1/2048)";
    all_refuse(&folder, &wrong, words, &READING);
    let flags = ("scale", header("|b1", "(16,)"), vec![1; 16]);
    let wrong = set(&folder, "b.npz", 16, ["a", "b"], &[], vec![flags, sensors(16)]);
    all_refuse(&folder, &wrong, "b.npz: array scale: type |b1 and shape [16], expected one float64", &READING);
    let wrong = set(&folder, "c.npz", 16, ["a", "b"], &[], vec![sensors(12)]);
    all_refuse(&folder, &wrong, "c.npz: array sensor: shape [12], expected (16,)", &READING);
    let right = set(&folder, "d.npz", 16, ["a", "b"], &[], vec![scale(1.0 / 2048.0), sensors(16)]);
    good(&["train", text(&right), "--task", "other", "-o", text(&folder.0.join("d.wsm"))]);
    good(&["model", "eval", "builtin:path-svm", text(&right)]);
}

#[test]
fn labels_that_are_no_text_or_no_names_are_refused() {
    let folder = Folder::new("sets-labels");
    let lone: Vec<&[u32]> = (0..16).map(|row| if row % 2 == 0 { &[0xD800][..] } else { &[98][..] }).collect();
    let mut all = samples(16, &[]);
    all.extend([texts("y", &lone), sensors(16)]);
    let path = folder.file("lone.npz", npz(&all));
    all_refuse(&folder, &path, "lone.npz: array y: is no text: it has U+D800", &READING);
    let forged = set(&folder, "forged.npz", 16, ["Saw3\n\x1b[31mred", "b"], &[], vec![sensors(16)]);
    all_refuse(&folder, &forged, "has a control character, expected a name in one line", &READING[..2]);
    // The base is named, not the slides.
    let base = refusal(&["model", "learn", "builtin:svm", text(&forged), "-o", text(&folder.0.join("a.wsm"))]);
    assert!(base.contains("builtin:svm: has no projection") && !base.contains("forged"), "{base}");
    let one = set(&folder, "one.npz", 16, ["a", "a"], &[], vec![sensors(16)]);
    all_refuse(&folder, &one, "slides of 1 texture (\"a\"), expected at least 2", &READING[1..2]);
    all_refuse(&folder, &one, "1 label (a), expected 2 to 64", &READING[..1]);
}

/// Two characters are not part of XML, whatever stands for them.
#[test]
fn a_figure_of_any_label_is_drawn() {
    let folder = Folder::new("sets-figure");
    let path = set(&folder, "y.npz", 32, ["a\u{fffe}", "b\u{ffff}"], &[], vec![sensors(32)]);
    let (model, figure) = (folder.path("e.wsm"), folder.path("e.svg"));
    good(&["train", text(&path), "--task", "other", "-o", &model, "--confusion", &figure]);
    assert!(Path::new(&model).exists());
    let drawn = fs::read_to_string(figure).unwrap();
    assert!(drawn.len() > 1000 && !drawn.contains(['\u{fffe}', '\u{ffff}']));
}

#[test]
fn what_has_no_answer_counts_as_wrong_in_training_and_evaluation() {
    let folder = Folder::new("sets-answers");
    // Rows 28 to 31 are the test; one of them is zero.
    let split: Vec<Vec<u32>> = (0..32).map(|row| points(if row < 28 { "train" } else { "test" })).collect();
    let split = texts("split", &split.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let path = set(&folder, "a.npz", 32, ["a", "b"], &[31], vec![sensors(32), split]);
    let model = folder.0.join("a.wsm");
    let report = records(&["train", text(&path), "--task", "other", "-o", text(&model), "--json"]).remove(0);
    let test = &report["test"];
    assert_eq!((&test["slides"], &test["right"], &test["answered"]), (&4.into(), &3.into(), &3.into()), "{test}");
    assert_eq!((&test["accuracy"], &test["accuracy_of_answered"]), (&0.75.into(), &1.0.into()));
    let found = records(&["model", "eval", text(&model), text(&path), "--json"]).remove(0);
    assert_eq!((&found["n"], &found["right"], &found["answered"]), (&32.into(), &31.into(), &31.into()), "{found}");
    assert_eq!((&found["accuracy"], &found["accuracy_of_answered"]), (&(31.0 / 32.0).into(), &1.0.into()));
    let printed = good(&["model", "eval", text(&model), text(&path)]);
    let of_all = "96.88 % right: 31 of 32 samples, by y";
    assert_has(&printed, &[of_all, "100.00 % right of those with an answer: 31 of 31"]);
    assert!(printed.lines().any(|line| line.ends_with("none")), "{printed}");
    // The shipped models say of such noise that it is unknown: no label is right, whatever it is.
    let unknown = records(&["model", "eval", "builtin:path-svm", text(&path), "--json"]).remove(0);
    let known = unknown["known"].as_array().unwrap();
    assert_eq!(known.iter().filter(|known| **known == true).count() as u64, unknown["answered"].as_u64().unwrap());
    assert!(known[31] == false && unknown["answered"].as_u64() < Some(32), "{unknown}");
    // A split with one side is named as the cause.
    let side: Vec<Vec<u32>> = (0..32).map(|_| points("test")).collect();
    let side = texts("split", &side.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let path = set(&folder, "b.npz", 32, ["a", "b"], &[], vec![sensors(32), side]);
    let sweep = folder.file("s.toml", "specimens = [\"Fla0\", \"Saw4\"]\nslides = 20\nsensors = 4\ntest = 0\n");
    for (slides, more, why) in [
        (path, &["--task", "other"][..], "the array split has all slides for tests, expected train and test"),
        (sweep, &[], "the sweep has all slides for training"),
    ] {
        refused(&[&["train", text(&slides), "-o", &folder.path("b.wsm")], more].concat(), &[why]);
    }
}

#[test]
fn slides_of_five_rows_are_learned_and_counted() {
    let folder = Folder::new("sets-learn");
    let path = set(&folder, "a.npz", 10, ["a", "b"], &[], vec![]);
    let learn = ["model", "learn", "builtin:embedding"];
    ends(&[&learn[..], &[text(&path), "-o", &folder.path("a.wsm")]].concat(), 0, &[" 2 textures, 5 slides each"]);
    let path = set(&folder, "b.npz", 2, ["a", "b"], &[], vec![]);
    ends(&[&learn[..], &[text(&path), "-o", &folder.path("b.wsm")]].concat(), 0, &[" 2 textures, 1 slide each"]);
}

#[test]
fn a_model_is_calibrated_by_slides_that_were_held_out() {
    let folder = Folder::new("sets-calibrate");
    let path = |name: &str| folder.0.join(name);
    let sweep = |name: &str, more: &str| {
        let text_of = format!("specimens = [\"Fla0\", \"Saw4\"]\nslides = 80\nsensors = 10\n{more}");
        let (file, set) = (folder.file("s.toml", text_of), path(name));
        good(&["dataset", "--input", "path", text(&file), "-o", text(&set)]);
        set
    };
    let (train, held) = (sweep("train.npz", ""), sweep("held.npz", "first_sensor = 500\nseed = 2\n"));
    let model = path("my.wsm");
    good(&["train", text(&train), "-o", text(&model)]);
    let calibrate = |sets: &[&Path], name: &str| {
        let sets: Vec<&str> = sets.iter().map(|set| text(set)).collect();
        run(&[&["model", "calibrate", text(&model)], &sets[..], &["-o", text(&path(name))]].concat())
    };
    let by_held = says(&calibrate(&[&train, &held], "a.wsm"), 0, &[" held out: "]);
    assert!(!by_held.contains("sensors of"), "{by_held}");
    // The tests of a set's own split are held out, too.
    let common = "with one limit of all classes, as 0.02 of a class's right answers is less than a sample";
    says(&calibrate(&[&train], "b.wsm"), 0, &[" samples held out: ", common]);
    let own = ["model", "calibrate", text(&model), text(&train), "-o", &folder.path("own.wsm"), "--rejected", "0.3"];
    ends(&own, 0, &[" dimension, with a limit of each class"]);
    let same = "train.npz: is TRAIN and HELD, expected slides that were held out";
    says(&calibrate(&[&train, &train], "c.wsm"), 2, &[same]);
    assert!(!path("c.wsm").exists());
    let again = path("again.npz");
    fs::copy(&train, &again).unwrap();
    says(&calibrate(&[&train, &again], "d.wsm"), 0, &["again.npz has 10 sensors of "]);
    let plain = set(&folder, "plain.npz", 16, ["Fla0", "Saw4"], &[], vec![]);
    says(&calibrate(&[&plain], "e.wsm"), 1, &["plain.npz: has no array split"]);
}
