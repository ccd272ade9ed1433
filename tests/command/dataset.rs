//! Tests `wstac dataset`: the content of its file, how it ends after a signal, and what it refuses.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Output, Stdio};

use wstac_tests::command::{Signal, program, run, send, wstac};
use wstac_tests::folder::Folder;

const SWEEP: &str =
    "specimens = [\"Fla0\", \"Saw3\"]\nspeeds = [100, 150.5]\ndirections = [0, 270]\nslides = 5\nseed = 7\n";

fn dataset(sweep: &Path, output: &Path, more: &[&str]) -> Output {
    program(wstac()).arg("dataset").arg(sweep).arg("-o").arg(output).args(more).output().unwrap()
}

/// Returns the messages of a run that must succeed.
fn good(sweep: &Path, output: &Path, more: &[&str]) -> String {
    let done = dataset(sweep, output, more);
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(done.stdout.is_empty());
    said
}

/// Checks the messages of a run that must fail.
fn bad(sweep: &Path, output: &Path, more: &[&str], parts: &[&str]) {
    let done = dataset(sweep, output, more);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(matches!(done.status.code(), Some(1 | 2)), "{said}");
    for part in parts {
        assert!(said.contains(part), "{said:?}, expected {part:?}");
    }
}

fn number(bytes: &[u8], at: usize, length: usize) -> usize {
    bytes[at..at + length].iter().rev().fold(0, |sum, &byte| (sum << 8) | usize::from(byte))
}

/// Returns the name, header and data of every array, by the directory of the archive.
pub(crate) fn arrays(npz: &[u8]) -> Vec<(String, String, Vec<u8>)> {
    let end = npz.len() - 22;
    assert_eq!(npz[end..end + 4], *b"PK\x05\x06");
    let (count, mut at) = (number(npz, end + 10, 2), number(npz, end + 16, 4));
    let mut arrays = Vec::new();
    for _ in 0..count {
        assert_eq!(npz[at..at + 4], *b"PK\x01\x02");
        assert_eq!(npz[at + 10..at + 16], [0, 0, 0, 0, 0x21, 0], "stored, 1 January 1980");
        let (bytes, length, local) = (number(npz, at + 24, 4), number(npz, at + 28, 2), number(npz, at + 42, 4));
        let name = String::from_utf8(npz[at + 46..at + 46 + length].to_vec()).unwrap();
        assert_eq!(npz[local..local + 4], *b"PK\x03\x04");
        assert_eq!(npz[local + 4..local + 30], npz[at + 6..at + 32]);
        let npy = &npz[local + 30 + length..][..bytes];
        assert_eq!(npy[..8], *b"\x93NUMPY\x01\0");
        let start = 10 + number(npy, 8, 2);
        assert_eq!(start % 64, 0);
        let header = String::from_utf8(npy[10..start].to_vec()).unwrap();
        arrays.push((name, header.trim_end().to_owned(), npy[start..].to_vec()));
        at += 46 + length;
    }
    assert_eq!(at, end);
    arrays
}

fn strings(data: &[u8], count: usize) -> Vec<String> {
    let points = |string: &[u8]| -> String {
        let points = string.chunks(4).map(|point| char::from_u32(number(point, 0, 4) as u32).unwrap());
        points.take_while(|&point| point != '\0').collect()
    };
    data.chunks(data.len() / count).map(points).collect()
}

#[test]
fn the_arrays_are_as_documented_whatever_the_number_of_threads() {
    let folder = Folder::new("arrays");
    let sweep = folder.file("s.toml", SWEEP);
    let output = folder.0.join("2.npz");
    let said = good(&sweep, &output, &["--threads", "2"]);
    assert_eq!(said.lines().count(), 2, "{said}");
    assert!(said.starts_with("wstac: 0 of 10 slides done\n"), "{said}");
    assert!(said.ends_with("2.npz: 10 samples\n"), "{said}");
    let bytes = fs::read(&output).unwrap();
    for threads in ["1", "5"] {
        let other = folder.0.join(format!("{threads}.npz"));
        good(&sweep, &other, &["--threads", threads]);
        assert!(fs::read(&other).unwrap() == bytes, "{threads} threads");
    }
    assert_eq!(folder.names(), ["1.npz", "2.npz", "5.npz", "s.toml"]);
    let arrays = arrays(&bytes);
    let shapes = [
        ("X", "<i2", "(10, 10, 70)"),
        ("scale", "<f8", "()"),
        ("y_specimen", "<U4", "(10,)"),
        ("y_pattern", "<U3", "(10,)"),
        ("y_depth", "<i8", "(10,)"),
        ("speed", "<f8", "(10,)"),
        ("direction", "<i8", "(10,)"),
        ("seed", "<u8", "(10,)"),
        ("reliable", "|b1", "(10,)"),
        ("duration", "<i8", "(10,)"),
    ];
    for ((name, descr, shape), array) in shapes.into_iter().zip(&arrays) {
        assert_eq!(array.0, format!("{name}.npy"));
        assert_eq!(array.1, format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"));
    }
    assert_eq!((arrays.len(), arrays[0].2.len()), (12, 10 * 10 * 70 * 2));
    assert_eq!((&*arrays[11].0, &arrays[11].2[..]), ("fps.npy", &30.0_f64.to_le_bytes()[..]));
    assert!(arrays[11].1.contains("'<f8'") && arrays[11].1.contains("'shape': ()"), "{}", arrays[11].1);
    let source = strings(&arrays[10].2, 10);
    assert_eq!(source[0], "scene: Fla0 at 100 mm/s, 0 degrees, seed 7");
    assert_eq!(source[8], "scene: Saw3 at 150.5 mm/s, 270 degrees, seed 15");
    let specimens = strings(&arrays[2].2, 10);
    assert_eq!((&specimens[4][..], &specimens[5][..]), ("Fla0", "Saw3"));
    let numbers = |array: usize| arrays[array].2.chunks(8).map(|bytes| number(bytes, 0, 8)).collect::<Vec<_>>();
    assert_eq!(numbers(4), [0, 0, 0, 0, 0, 3, 3, 3, 3, 3]);
    assert_eq!(numbers(6), [0, 0, 270, 270, 0, 0, 0, 270, 270, 0]);
    assert_eq!(arrays[8].2, [1; 10]);
    assert!(numbers(9).iter().all(|frames| (15..45).contains(frames)), "{:?}", numbers(9));
    assert_eq!(numbers(7), (7..17).collect::<Vec<_>>());
    assert_eq!(numbers(1), [(1.0_f64 / 2048.0).to_bits() as usize]);
}

/// The sample of a slide is the one that `wstac run` prints.
#[test]
fn samples_are_those_of_run() {
    let folder = Folder::new("run");
    let sweep = "specimens = [\"Tri4\"]\nslides = 1\ndirections = [90]\nseed = 3\n[scene]\nfidelity = \"rendered\"";
    let output = folder.0.join("a.npz");
    good(&folder.file("s.toml", sweep), &output, &[]);
    let run = run(["run", "scene:Tri4@150,90deg,seed=3", "--json", "--samples"]);
    let event = BufReader::new(&run.stdout[..]).lines().next().unwrap().unwrap();
    let event: serde_json::Value = serde_json::from_str(&event).unwrap();
    let features = event["sample"].as_array().unwrap().iter().flat_map(|feature| feature.as_array().unwrap());
    let expected: Vec<u8> =
        features.flat_map(|value| ((value.as_f64().unwrap() * 2048.0) as i16).to_le_bytes()).collect();
    assert_eq!(arrays(&fs::read(&output).unwrap())[0].2, expected);
}

#[test]
fn a_signal_ends_it_and_leaves_no_file() {
    // Rendered frames take long enough to be stopped on any machine.
    let folder = Folder::new("signal");
    let sweep = folder.file("s.toml", "slides = 1000\n[scene]\nfidelity = \"rendered\"\n");
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let mut command = program(wstac());
        command.arg("dataset").arg(&sweep).arg("-o").arg(folder.0.join("a.npz")).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut said = String::new();
        BufReader::new(child.stderr.take().unwrap()).read_line(&mut said).unwrap();
        assert_eq!(said, "wstac: 0 of 10000 slides done\n");
        send(&child, signal);
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert_eq!(folder.names(), ["s.toml"]);
    }
}

#[test]
fn what_cannot_be_used_is_refused_and_nothing_is_written_over() {
    let folder = Folder::new("refused");
    let sweep = folder.file("s.toml", SWEEP);
    let output = folder.file("a.npz", "mine");
    bad(&sweep, &output, &[], &["a.npz: exists already", "--force"]);
    assert_eq!(fs::read(&output).unwrap(), b"mine");
    assert!(good(&sweep, &output, &["--force"]).contains("10 samples"));
    assert!(fs::read(&output).unwrap().starts_with(b"PK"));
    let new = folder.0.join("b.npz");
    bad(&sweep, &folder.0, &["--force"], &["is a folder"]);
    bad(&sweep, &folder.0.join("no/b.npz"), &[], &["no/b.npz: is in a folder that does not exist"]);
    bad(&folder.0.join("no.toml"), &new, &[], &["no.toml: no such file"]);
    let config = folder.file("c.toml", "[green]\nstride = 2\n");
    bad(&sweep, &new, &["--config", config.to_str().unwrap()], &["c.toml", "taxel sums"]);
    let yuyv = folder.file("y.toml", "[scene.sensor]\nformat = \"YUYV\"\n");
    bad(&yuyv, &new, &[], &["y.toml", "YUYV", "fidelity"]);
    let unknown = folder.file("u.toml", "specimen = \"Saw3\"\n");
    bad(&unknown, &new, &[], &["u.toml", "unknown field `specimen`", "specimens"]);
    let none = folder.file("n.toml", "slides = 1\n[scene.whisker]\noverlap_mm = 0\n");
    bad(&none, &new, &[], &["10 of 10 slides had no event", "n.toml: none of 10 slides became a sample"]);
    assert_eq!(folder.names(), ["a.npz", "c.toml", "n.toml", "s.toml", "u.toml", "y.toml"]);
    for (arguments, said) in [(&["--threads", "0"][..], "1..=1024"), (&["--speed"], "--speed")] {
        let done = dataset(&sweep, &new, arguments);
        assert_eq!(done.status.code(), Some(2));
        assert!(String::from_utf8(done.stderr).unwrap().contains(said));
    }
}

#[test]
fn slides_without_a_whole_sample_are_left_out() {
    let folder = Folder::new("left-out");
    let sweep = "specimens = [\"Saw3\"]\nslides = 60\n[scene.sensor]\ndropped = 0.5\n";
    let output = folder.0.join("a.npz");
    let said = good(&folder.file("s.toml", sweep), &output, &[]);
    let count = |part: &str| -> usize {
        said.lines().find(|line| line.contains(part)).map_or(0, |line| line.split(' ').nth(3).unwrap().parse().unwrap())
    };
    let (none, incomplete) = (count("had no event"), count("had an incomplete sample"));
    assert!(incomplete > 0, "{said}");
    let shape = format!("'shape': ({}, 10, 70)", 60 - none - incomplete);
    assert!(arrays(&fs::read(&output).unwrap())[0].1.contains(&shape), "{said}");
}

#[test]
fn every_recording_that_cannot_be_used_is_named() {
    let folder = Folder::new("all-bad");
    for name in ["a.mcap", "b.mcap"] {
        folder.file(name, "no recording");
    }
    let output = folder.0.join("set.npz");
    bad(&folder.0, &output, &[], &["a.mcap: ", "b.mcap: "]);
    assert_eq!(folder.names(), ["a.mcap", "b.mcap"]);
}
