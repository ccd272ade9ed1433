//! Tests what the command says after common mistakes: it names what was probably meant.

use wstac_tests::command::{ends, run, says};
use wstac_tests::folder::Folder;

#[test]
fn a_command_with_a_typo_is_suggested() {
    for (given, meant) in [("rnu", "run"), ("tarin", "train"), ("mnoitor", "monitor")] {
        ends(&[given], 2, &[&format!("'{meant}'")]);
    }
    for given in ["zzz", "xy"] {
        assert!(!says(&run(&[given]), 2, &[]).contains("similar"), "{given}");
    }
}

#[test]
fn options_of_other_programs_are_explained() {
    for (given, expected) in [
        (&["serve", "--port", "8080", "a"][..], "--port: no such option; help: --listen takes a port"),
        (&["run", "--csv", "a"], "--csv: no such option; help: -o FILE.csv"),
        (&["record", "-q", "a"], "-q: no such option; help: wstac run has -q"),
        (&["run", "--zzz", "a"], "unexpected argument '--zzz' found\n\nUsage"),
    ] {
        ends(given, 2, &[expected]);
    }
}

#[test]
fn help_about_what_there_is_not_lists_the_topics() {
    for (given, expected) in [("nothing", "a topic: sources, answers, config, json\n"), ("rnu", "; did you mean run?")]
    {
        ends(&["help", given], 2, &[expected]);
    }
}

#[test]
fn help_about_a_word_names_what_has_it() {
    for (given, expected) in [
        ("readout", "help about \"readout\" (the word is in wstac help doctor, "),
        ("record-to", "(the word is in wstac help serve), expected a command"),
        ("floor_levels", "(the word is in wstac help config, "),
        ("learn", "(the word is in wstac help board, model learn, "),
        ("rejected", "(the word is in wstac help model calibrate), expected a command"),
    ] {
        ends(&["help", given], 2, &[expected, "a topic: sources, answers, config, json"]);
    }
}

#[test]
fn files_of_another_kind_say_what_to_do_with_them() {
    let folder = Folder::new("files-of-another-kind");
    let path = |file: &std::path::Path| file.to_str().unwrap().to_owned();
    let other = path(&folder.file("notes.txt", "not a source"));
    let onnx = path(&folder.file("forest.onnx", "not a model file"));
    let board = concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/examples/board.bin");
    let [video, recording] =
        ["board.mp4", "board.mcap"].map(|name| path(&folder.file(name, std::fs::read(board).unwrap())));
    let sent = std::fs::read(board).unwrap();
    let [twice, cut] = [("twice", [&sent[..], &sent].concat()), ("cut", sent[60..].to_vec())]
        .map(|(name, bytes)| format!("board:{}", path(&folder.file(name, bytes))));
    ends(&["run", &twice], 0, &["bytes after the end of the board's stream are not read"]);
    ends(&["run", &cut], 0, &["cut has lost its start: without the board's description there are no times"]);
    let unnamed = path(&folder.file("unnamed", b"\0\0\0\x18ftypmp42"));
    let frames = "board.bin: is a board or its bytes, expected frames: wstac run, view and calibrate read a board";
    let bytes = "has a board's bytes, expected frames: wstac run, view and calibrate read them as board:FILE";
    for (arguments, expected) in [
        (&["record", board, "-o", &path(&folder.0.join("none.mcap"))][..], frames),
        (&["plot", board, "-o", &path(&folder.0.join("none.svg"))], frames),
        (&["doctor", board], frames),
        (&["serve", board, "--listen", "127.0.0.1:0"], frames),
        (&["run", &video], &format!("board.mp4: {bytes}")),
        (&["run", &recording], &format!("board.mcap: {bytes}")),
        (&["run", &unnamed], "unnamed: ffmpeg "),
        (&["run", &other], "notes.txt\": its name and first bytes are not of a known kind (wstac run board:FILE "),
        (&["run", "scene:Saw3@150", "--model", &onnx], &*format!("; help: wstac model import {onnx} -o ")),
    ] {
        ends(arguments, 1, &[expected]);
    }
}

#[test]
fn a_readout_that_is_not_the_sources_is_noted() {
    let with = |ms| ["run", "scene:Saw3@150", "--size", "320x180", "--readout", ms];
    ends(&with("20"), 0, &["the source states another readout than [sensor] readout_ms or --readout, which holds"]);
}

#[test]
fn doubts_about_a_configuration_are_noted() {
    let folder = Folder::new("doubts");
    for (text, said) in [
        (
            "[trigger]\nrule = \"literal\"\n",
            "[trigger] rule = \"literal\" with a multiplier of 1 or more takes dark frames",
        ),
        (
            &format!("[layout]\ntaxel = [9, 9]\ncorners = {:?}\n", [[0; 2]; 25]),
            "[layout] corners has two taxels at one place",
        ),
    ] {
        let config = folder.file("doubts.toml", text);
        for command in ["run", "doctor"] {
            ends(&[command, "scene:Saw3@150", "--size", "320x180", "--config", config.to_str().unwrap()], 0, &[said]);
        }
    }
}

#[test]
fn names_without_their_prefix_are_explained() {
    for (arguments, meant) in [
        (&["run", "Saw3@150"][..], "a simulated slide is scene:Saw3@150"),
        (&["run", "scene:Saw3@150", "--model", "path-svm"], "did you mean builtin:path-svm?"),
        (&["run", "scene:Saw3@150", "--model", "builtin:path-smv"], "did you mean builtin:path-svm?"),
        (&["run", "scene:Saw3@150", "--model", "bultin"], "bultin: no such file; did you mean builtin?"),
        (&["run", "scene:Saw3@150", "--model", "bultin:svm"], "no such file; did you mean builtin:svm?"),
        (
            &["run", "scene:Saw3@150", "--model", "none.wsm"],
            "no such file; wstac model list --all lists built-in models",
        ),
        (&["trade", "--map", "none.csv"], "none.csv: no such file or folder"),
        (&["run", "/dev/null/a.y4m"], "a part of the path is no folder"),
        (&["run", "scene:Saw3@150", "--config", "none.toml"], "none.toml: no such file or folder"),
    ] {
        ends(arguments, 1, &[meant]);
    }
}

#[test]
fn a_study_without_arguments_explains_itself() {
    ends(&["trade"], 2, &["Usage: wstac trade"]);
}
