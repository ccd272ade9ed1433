//! Tests what `wstac dataset` refuses. The reference's tests read its files with NumPy.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Output;

use wstac_tests::command::{assert_has, program, said, says, wstac};
use wstac_tests::folder::{Folder, text};

const SWEEP: &str =
    "specimens = [\"Fla0\", \"Saw3\"]\nspeeds = [100, 150.5]\ndirections = [0, 270]\nslides = 5\nseed = 7\n";

fn dataset(sweep: &Path, output: &Path, more: &[&str]) -> Output {
    program(wstac()).arg("dataset").arg(sweep).arg("-o").arg(output).args(more).output().unwrap()
}

/// Returns the messages of a run that must succeed.
fn good(sweep: &Path, output: &Path, more: &[&str]) -> String {
    let done = dataset(sweep, output, more);
    assert!(done.stdout.is_empty());
    says(&done, 0, &[])
}

/// Checks the messages of a run that must fail.
fn bad(sweep: &Path, output: &Path, more: &[&str], parts: &[&str]) {
    let done = dataset(sweep, output, more);
    assert!(matches!(done.status.code(), Some(1 | 2)), "{}", said(&done));
    assert_has(&said(&done), parts);
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
    bad(&unknown, &new, &[], &["u.toml", "unknown key specimen", "specimens"]);
    let none = folder.file("n.toml", "slides = 1\n[scene.whisker]\noverlap_mm = 0\n");
    bad(&none, &new, &[], &["10 of 10 slides had no event", "n.toml: none of 10 slides became a sample"]);
    assert_eq!(folder.names(), ["a.npz", "c.toml", "n.toml", "s.toml", "u.toml", "y.toml"]);
    for (arguments, said) in [(&["--threads", "0"][..], "1..=1024"), (&["--speed"], "--speed")] {
        says(&dataset(&sweep, &new, arguments), 2, &[said]);
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

#[test]
fn a_set_of_lerobot_needs_the_python_package_and_recordings() {
    let folder = Folder::new("lerobot");
    let set = folder.0.join("set");
    let ends = |python: &str, arguments: &[&str], code: i32, parts: &[&str]| {
        let mut command = program(wstac());
        command.env("WSTAC_PYTHON", python).args(["dataset", "--lerobot"]).arg(&set).args(arguments);
        says(&command.output().unwrap(), code, parts)
    };
    let python = folder.file("python", "#!/bin/sh\necho 'ModuleNotFoundError: No module named wstac' >&2\nexit 1\n");
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
    for (name, why) in [(text(&python), "No module named wstac"), ("/nowhere/python3", "No such file")] {
        ends(name, &["a.mcap"], 2, &[why, "help: install the wheel with [lerobot]"]);
    }
    ends("/nowhere/python3", &[], 2, &["has no recordings"]);
    ends("/nowhere/python3", &["a.mcap", "--units", "0..1"], 2, &["--units"]);
    // It becomes the package's program, with every option as one word.
    let script = "#!/bin/sh\n[ \"$1\" = -c ] && exit 0\nprintf '%s|' \"$@\" > \"$0.said\"\nexit 7\n";
    let python = folder.file("package", script);
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).unwrap();
    // A source that begins with a hyphen is no option.
    for (source, code) in [("-b.mcap", 2), ("a.mcap", 7)] {
        ends(text(&python), &[source, "scene:Saw3@150", "--task=-t", "--arm", "arm.toml"], code, &[]);
    }
    let said = fs::read_to_string(folder.0.join("package.said")).unwrap();
    let expected = format!("-m|wstac.lerobot|--arm=arm.toml|--task=-t|--|{}|a.mcap|scene:Saw3@150|", set.display());
    assert_eq!(said, expected);
    assert!(!set.exists());
}
