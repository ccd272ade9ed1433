//! Tests that names of files need not be UTF-8: every command reads and writes them.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;

use wstac_tests::command::{program, run, run_in, said, says, wstac};
use wstac_tests::folder::{Folder, SMALL};

/// Returns a name with a byte that is no UTF-8: `caf\xe9` and an ending.
fn name(ending: &str) -> OsString {
    [OsStr::from_bytes(b"caf\xe9"), OsStr::new(ending)].concat_os()
}

trait Concat {
    fn concat_os(&self) -> OsString;
}

impl Concat for [&OsStr; 2] {
    fn concat_os(&self) -> OsString {
        let mut all = self[0].to_owned();
        all.push(self[1]);
        all
    }
}

/// Returns a word of a command: what follows `@` is the ending of such a name, and what is before it its start.
fn word(word: &str) -> OsString {
    match word.split_once('@') {
        Some((start, ending)) if !start.starts_with("Saw") => [OsStr::new(start), &name(ending)].concat_os(),
        _ => word.into(),
    }
}

#[test]
fn names_of_files_need_not_be_utf_8() {
    let folder = Folder::new("names");
    let put = |ending: &str, content: &[u8]| fs::write(folder.0.join(name(ending)), content).unwrap();
    put(".toml", b"[trigger]\nwindow = 5\n");
    put(".scene.toml", SMALL.replace("40, 40", "160, 120").as_bytes());
    put(".sweep.toml", b"specimens = [\"Saw3\", \"Fla0\"]\nspeeds = [100, 150, 200]\nslides = 6\n");
    put(".random.toml", b"specimens = [\"Saw3\", \"Fla0\"]\nslides = 40\nsensors = 8\n");
    put(".plan.toml", b"specimens = [\"Saw3\"]\ncount = 1\n");
    put(".onnx", include_bytes!("../fuzz/seeds/model_import/forest.onnx"));
    put(".wsm", include_bytes!("../../wstac-host/models/svm.wsm"));
    put(".bin", b"no board");
    let mut wrong = Vec::new();
    for (command, code) in [
        ("scene render @.scene.toml -o @.y4m", 0),
        ("run @.y4m --config @.toml --model @.wsm", 0),
        ("run scene:@.scene.toml --frames 3 --save-raw @.raw", 0),
        ("run cam:a=@.y4m cam:b=@.y4m", 0),
        ("record @.y4m -o @.mcap --label specimen=Saw3 --label speed=150 --config @.toml", 0),
        ("run @.mcap", 0),
        ("recover @.mcap -o @.new.mcap", 0),
        ("record scene:@.scene.toml --guide @.plan.toml -o @.files", 0),
        ("dataset @.mcap -o @.npz", 0),
        ("dataset @.sweep.toml -o @.slides.npz", 0),
        ("model import @.onnx -o @.forest.wsm", 0),
        ("model inspect @.wsm", 0),
        ("model eval @.wsm @.slides.npz", 0),
        ("dataset --input path @.random.toml -o @.path.npz", 0),
        ("train @.path.npz -o @.trained.wsm --confusion @.svg", 0),
        ("model learn builtin:embedding @.path.npz -o @.learned.wsm", 0),
        ("model calibrate @.trained.wsm @.path.npz -o @.again.wsm", 0),
        ("plot @.y4m -o @.event.svg", 0),
        ("calibrate @.y4m -o @.calibrated.toml", 0),
        ("doctor @.y4m", 0),
        ("scene explain @.scene.toml --no-cost", 0),
        ("scene strain @.scene.toml", 0),
        ("man @.man", 0),
        // The file is no board's stream, and the message says so.
        ("monitor @.bin", 1),
    ] {
        let done = run_in(&folder, command.split(' ').map(word));
        if done.status.code() != Some(code) || (code == 1 && !said(&done).contains("has no messages")) {
            wrong.push(format!("{command}: {:?} {}", done.status.code(), said(&done)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for ending in
        [".y4m", ".raw", ".mcap", ".npz", ".event.svg", ".forest.wsm", ".trained.wsm", ".svg", ".calibrated.toml"]
    {
        let found = fs::metadata(folder.0.join(name(ending)));
        assert!(found.is_ok_and(|found| found.len() > 0), "{ending}");
    }
    // A folder of pictures, and a missing file.
    fs::create_dir(folder.0.join(name(".pictures"))).unwrap();
    let empty = run([OsStr::new("run"), folder.0.join(name(".pictures")).as_os_str()]);
    assert!(said(&empty).contains("has no .png or .jpg file"), "{}", said(&empty));
    says(&run([OsStr::new("run"), &name(".none")]), 1, &["no such file"]);
}

#[test]
fn words_that_are_not_utf_8_are_wrong_arguments() {
    let not_utf_8 = OsStr::from_bytes(b"\xff\xfe");
    for (before, expected) in [
        (&[][..], "unrecognized subcommand"),
        (&["rnu"], "unrecognized subcommand"),
        (&["run", "--fps"], "invalid value"),
        (&["run", "scene:Saw3@150", "--config"], "no such file"),
        (&["record", "scene:Saw3@150", "-o", "a.mcap", "--label"], "expected NAME=VALUE"),
        (&["scene"], "unrecognized subcommand"),
        (&["board", "/dev/null", "--learn"], "not UTF-8"),
        (&["completions"], "invalid value"),
    ] {
        let done = program(wstac()).args(before).arg(not_utf_8).output().unwrap();
        let code = if expected == "no such file" { 1 } else { 2 };
        let said = said(&done);
        assert!(done.status.code() == Some(code) && said.contains(expected), "{before:?}: {:?} {said}", done.status);
        assert!(!said.contains("panicked"), "{before:?}: {said}");
    }
}
