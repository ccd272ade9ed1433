//! Tests that no command destroys a file: not one that it reads, not one that somebody else writes or has planted.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::symlink;
use std::process::Stdio;

use wstac_tests::command::{Signal, assert_has, ends, good, prints, program, run_in, said, says, send, start, wstac};
use wstac_tests::folder::{Folder, GRAY, SMALL, frames, text};

/// Returns a recording, a sweep, a data set, a trained model, a configuration, a plan and a map in a folder.
fn inputs(folder: &Folder) {
    let path = |name: &str| folder.path(name);
    folder.file("a.toml", "specimens = [\"Saw3\"]\nslides = 2\n");
    folder.file("scene.toml", SMALL);
    folder.file("wstac.toml", "[trigger]\nwindow = 5\n");
    folder.file("plan.toml", "specimens = [\"Saw3\"]\ncount = 1\n");
    folder.file("base.toml", "");
    folder.file("prices.json", include_str!("../../wstac-tradeoff/data/prices.json"));
    folder.file("map.csv", include_str!("../../wstac-tradeoff/data/map.csv"));
    let trained = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/seeds/model_import/forest.onnx");
    fs::copy(trained, folder.0.join("forest.onnx")).unwrap();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/models/svm.wsm");
    fs::copy(model, folder.0.join("svm.wsm")).unwrap();
    fs::copy(model, folder.0.join("base.wsm")).unwrap();
    let label = ["--label", "specimen=Saw3", "--label", "speed=150"];
    good(&[&["record", "scene:Saw3@150", "--size", "40x40", "-o", &path("a.mcap")][..], &label].concat());
    good(&["scene", "render", &path("scene.toml"), "-o", &path("a.y4m")]);
    good(&["dataset", &path("a.toml"), "-o", &path("a.npz")]);
    for name in ["held.npz", "more.npz"] {
        fs::copy(path("a.npz"), path(name)).unwrap();
    }
}

/// Commands, and the inputs of each. `OUT` stands for an input as the output, whatever its name ends in.
const COMMANDS: &[(&[&str], &[&str])] = &[
    (
        &["record", "a.mcap", "--config", "wstac.toml", "--model", "svm.wsm", "-o", "OUT"],
        &["a.mcap", "wstac.toml", "svm.wsm"],
    ),
    (&["record", "scene:scene.toml", "-o", "OUT"], &["scene.toml"]),
    (&["record", "a.y4m", "-o", "OUT"], &["a.y4m"]),
    (&["recover", "a.mcap", "-o", "OUT"], &["a.mcap"]),
    (&["dataset", "a.mcap", "--config", "wstac.toml", "-o", "OUT"], &["a.mcap", "wstac.toml"]),
    (&["dataset", ".", "-o", "OUT"], &["a.mcap"]),
    (&["dataset", "a.toml", "--config", "wstac.toml", "-o", "OUT"], &["a.toml", "wstac.toml"]),
    (&["model", "import", "forest.onnx", "-o", "OUT"], &["forest.onnx"]),
    (&["model", "learn", "base.wsm", "a.npz", "a.mcap", "-o", "OUT"], &["base.wsm", "a.npz", "a.mcap"]),
    (
        &["model", "calibrate", "base.wsm", "a.npz", "held.npz", "--projection", "more.npz", "-o", "OUT"],
        &["base.wsm", "a.npz", "held.npz", "more.npz"],
    ),
    (&["train", "a.npz", "--input", "frames", "-o", "OUT"], &["a.npz"]),
    (
        &["train", "a.mcap", "--config", "wstac.toml", "-o", "new.wsm", "--confusion", "OUT.svg"],
        &["a.mcap", "wstac.toml"],
    ),
    (
        &["plot", "a.mcap", "--config", "wstac.toml", "--model", "svm.wsm", "-o", "OUT.svg"],
        &["a.mcap", "wstac.toml", "svm.wsm"],
    ),
    (&["calibrate", "a.mcap", "-o", "OUT"], &["a.mcap"]),
    (&["calibrate", "a.mcap", "-o", "new.toml", "--overlay", "OUT"], &["a.mcap"]),
    (&["scene", "render", "scene.toml", "-o", "OUT.y4m"], &["scene.toml"]),
    (
        &["trade", "--map", "map.csv", "--prices", "prices.json", "-o", "OUT.svg"],
        &["map.csv", "prices.json", "base.toml"],
    ),
    (&["trade", "--map", "map.csv", "-o", "."], &["map.csv", "base.toml"]),
    (&["trade", "--budget", "M4F<60k", "--map", "map.csv", "-o", "OUT.folder"], &["map.csv"]),
];

/// Every command that writes is given each of its inputs as the output: by its name, and by a hard link.
#[test]
fn no_command_overwrites_an_input_by_any_name() {
    let folder = Folder::new("outputs-inputs");
    inputs(&folder);
    let mut wrong = Vec::new();
    let mut tried = 0;
    for (command, inputs) in COMMANDS {
        for input in *inputs {
            let before = fs::read(folder.0.join(input)).unwrap();
            let mut outputs = vec![(*input).to_owned()];
            let linked = |name: String| {
                let path = folder.0.join(&name);
                let _ = fs::remove_file(&path);
                fs::hard_link(folder.0.join(input), &path).unwrap();
                name
            };
            let ending = command.iter().find_map(|word| word.strip_prefix("OUT"));
            if ending == Some(".folder") {
                fs::create_dir_all(folder.0.join("chosen")).unwrap();
                linked("chosen/claim.csv".to_owned());
                outputs = vec!["chosen".to_owned()];
            } else if let Some(ending) = ending {
                if !ending.is_empty() {
                    outputs.clear();
                }
                outputs.push(linked(format!("link{ending}")));
            }
            for output in outputs {
                let arguments: Vec<&str> =
                    command.iter().map(|word| if word.starts_with("OUT") { &*output } else { word }).collect();
                let done = run_in(&folder, arguments.iter().chain(&["--force"]));
                tried += 1;
                println!("| `wstac {}` | {input} | {:?} |", arguments.join(" "), done.status.code().unwrap_or(-1));
                let is_same = fs::read(folder.0.join(input)).unwrap() == before;
                if done.status.code() != Some(2) || !is_same || !said(&done).contains("expected a new file") {
                    wrong.push(format!("{arguments:?}: {:?}, same: {is_same}: {}", done.status.code(), said(&done)));
                    fs::write(folder.0.join(input), &before).unwrap();
                }
            }
            let _ = fs::remove_dir_all(folder.0.join("chosen"));
        }
    }
    assert!(wrong.is_empty(), "{} of {tried}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(tried >= 30, "{tried}");
}

#[test]
fn standard_input_is_an_input_too() {
    let folder = Folder::new("outputs-stdin");
    let path = folder.0.join("a.y4m");
    good(&["scene", "render", text(&folder.file("s.toml", SMALL)), "-o", text(&path)]);
    let before = fs::read(&path).unwrap();
    for command in ["record", "calibrate"] {
        let mut process = program(wstac());
        process.args([command, "-", "--force", "-o"]).arg(&path).stdin(fs::File::open(&path).unwrap());
        assert_has(&said(&process.output().unwrap()), &["expected a new file"]);
        assert_eq!(fs::read(&path).unwrap(), before);
    }
}

#[test]
fn two_outputs_have_two_names() {
    let folder = Folder::new("outputs-two");
    inputs(&folder);
    let done = run_in(&folder, ["run", "a.mcap", "-o", "a.jsonl", "--save-raw", "./a.jsonl"]);
    assert!(said(&done).contains("is the name of two outputs"), "{}", said(&done));
}

/// Temporary files have random names: files and links of the names that they had once are neither followed nor removed.
#[test]
fn planted_names_are_not_touched() {
    let folder = Folder::new("outputs-planted");
    inputs(&folder);
    let victim = folder.file("victim", "theirs");
    let outputs: &[(&[&str], &str)] = &[
        (&["record", "scene:scene.toml", "-o", "new.mcap"], "new.mcap"),
        (&["recover", "a.mcap", "-o", "new.mcap"], "new.mcap"),
        (&["dataset", "a.mcap", "-o", "new.npz"], "new.npz"),
        (&["model", "import", "forest.onnx", "-o", "new.wsm"], "new.wsm"),
        (&["plot", "a.mcap", "-o", "new.svg"], "new.svg"),
        (&["scene", "render", "scene.toml", "-o", "new.y4m"], "new.y4m"),
        (&["man", "pages"], "pages/wstac-run.1"),
    ];
    fs::create_dir(folder.0.join("pages")).unwrap();
    for (command, output) in outputs {
        let names = [".part", ".tmp", ".new", "~"].map(|ending| folder.0.join(format!("{output}{ending}")));
        for name in &names {
            symlink(&victim, name).unwrap();
        }
        for force in [false, true] {
            let force = force.then_some(&"--force").filter(|_| command[0] != "man");
            let done = run_in(&folder, command.iter().chain(force));
            assert_eq!(done.status.code(), Some(0), "{command:?}: {}", said(&done));
            assert_eq!(fs::read(&victim).unwrap(), b"theirs", "{command:?}");
        }
        for name in &names {
            assert_eq!(fs::read_link(name).unwrap(), victim, "{command:?}");
            fs::remove_file(name).unwrap();
        }
        if output.starts_with("new") {
            fs::remove_file(folder.0.join(output)).unwrap();
        }
    }
}

/// While a recorder writes a file, no command takes its place.
#[test]
fn a_recording_under_way_is_not_replaced() {
    let folder = Folder::new("outputs-locked");
    inputs(&folder);
    let output = folder.0.join("b.mcap");
    let name = output.to_str().unwrap();
    let mut child = start(&["record", "-", "-o", name]);
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&[GRAY, &frames(3, 40)].concat()).unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().contains("Y4M"));
    while !output.exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let a = |name: &str| folder.path(name);
    for command in [
        &["record", "scene:Saw3@150", "--size", "40x40", "-o", name][..],
        &["recover", &a("a.mcap"), "-o", name],
        &["dataset", &a("a.mcap"), "-o", name],
        &["dataset", &a("a.toml"), "-o", name],
        &["model", "import", &a("forest.onnx"), "-o", name],
        &["calibrate", "scene:Fla0@100", "--size", "160x120", "-o", &a("new.toml"), "--overlay", name],
    ] {
        ends(&[command, &["--force"]].concat(), 1, &["b.mcap: another wstac is writing it"]);
    }
    send(&child, Signal::INT);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    prints(&["run", name, "--json"], &[r#""kind":"end","frames":40,"#]);
}

/// A file that `record --force` replaces keeps its content under its other names.
#[test]
fn other_names_of_a_replaced_recording_keep_its_content() {
    let folder = Folder::new("outputs-names");
    inputs(&folder);
    let (name, kept) = (folder.0.join("a.mcap"), folder.0.join("kept.mcap"));
    fs::hard_link(&name, &kept).unwrap();
    let before = fs::read(&kept).unwrap();
    good(&["record", "scene:Fla0@100", "--size", "40x40", "-o", text(&name), "--force", "--frames", "5"]);
    assert!(fs::read(&kept).unwrap() == before);
    prints(&["run", name.to_str().unwrap(), "--json"], &[r#""frames":5,"#]);
}

/// The unfinished file of a guided session that was killed is left to `wstac recover`.
#[test]
fn a_killed_guided_session_keeps_its_unfinished_file() {
    let folder = Folder::new("outputs-guide");
    let plan = folder.file("plan.toml", "specimens = [\"Saw3\"]\ncount = 1\n");
    let files = folder.0.join("files");
    fs::create_dir(&files).unwrap();
    let part = folder.file("files/Saw3-1.mcap.part", "recoverable");
    let mut process = program(wstac());
    process.args(["record", "scene:Saw3@150", "--size", "40x40", "--guide", text(&plan), "-o", text(&files)]);
    process.stdin(Stdio::null());
    says(&process.output().unwrap(), 0, &["Saw3-1.mcap.part -o "]);
    assert_eq!(fs::read(&part).unwrap(), b"recoverable");
    assert!(files.join("Saw3-1.mcap").exists());
    assert_eq!(fs::read_dir(&files).unwrap().count(), 2);
}
