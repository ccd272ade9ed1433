//! Tests what `wstac dataset` refuses. The reference's tests read its files with NumPy.

use std::fs;
use std::path::Path;
use std::process::Output;

use wstac_tests::command::{program, wstac};
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

#[test]
fn what_cannot_be_used_is_refused_and_nothing_is_written_over() {
    let folder = Folder::new("refused");
    let sweep = folder.file("s.toml", SWEEP);
    let output = folder.file("a.npz", "mine");
    assert!(good(&sweep, &output, &["--force"]).contains("10 samples"));
    assert!(fs::read(&output).unwrap().starts_with(b"PK"));
    let new = folder.0.join("b.npz");
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
fn every_recording_that_cannot_be_used_is_named() {
    let folder = Folder::new("all-bad");
    for name in ["a.mcap", "b.mcap"] {
        folder.file(name, "no recording");
    }
    let output = folder.0.join("set.npz");
    bad(&folder.0, &output, &[], &["a.mcap: ", "b.mcap: "]);
    assert_eq!(folder.names(), ["a.mcap", "b.mcap"]);
}
