//! Tests that every command whose output cannot be written ends with the code that docs/EXIT.md promises.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use wstac_tests::command::{good, program, run_in, said, says};
use wstac_tests::folder::{Folder, SMALL};

/// Commands and the ending of the output that stands for `OUT`.
const COMMANDS: [(&str, &str); 15] = [
    ("run scene:s.toml -o OUT", ".jsonl"),
    ("run scene:s.toml -o OUT", ".csv"),
    ("record scene:s.toml -o OUT", ".mcap"),
    ("record cam:a=scene:s.toml cam:b=scene:s.toml -o OUT", ".mcap"),
    ("recover a.mcap -o OUT", ".mcap"),
    ("dataset a.toml -o OUT", ".npz"),
    ("scene render s.toml -o OUT", ".y4m"),
    ("plot scene:s.toml -o OUT", ".svg"),
    ("calibrate scene:f.toml -o OUT", ".toml"),
    ("calibrate scene:f.toml -o new.toml --overlay OUT", ".png"),
    ("model import forest.onnx -o OUT", ".wsm"),
    ("trade --map map.csv -o OUT", ".svg"),
    ("trade --budget M4F<60k -o OUT", ""),
    ("doctor scene:s.toml --report OUT", ".html"),
    ("train a.npz --input frames -o OUT", ".wsm"),
];

/// Makes everything that is no file to write to, of this ending. Returns the names.
fn bad_outputs(folder: &Path, ending: &str) -> Vec<String> {
    let name = |kind: &str| format!("{kind}{ending}");
    let path = |kind: &str| folder.join(name(kind));
    if !path("pipe").exists() {
        fs::create_dir(path("folder")).unwrap();
        assert!(program("mkfifo").arg(path("pipe")).status().unwrap().success());
        symlink("/dev/full", path("full")).unwrap();
        symlink("nowhere", path("link")).unwrap();
        fs::write(path("kept"), "mine").unwrap();
    }
    vec![
        name("kept"),
        name("folder"),
        name("pipe"),
        name("full"),
        name("link"),
        format!("none/{}", name("a")),
        "/dev/full".into(),
    ]
}

#[test]
fn an_output_that_cannot_be_written_ends_every_command_with_1() {
    let folder = Folder::new("exit-outputs");
    let path = |name: &str| folder.path(name);
    folder.file("s.toml", SMALL);
    folder.file("f.toml", SMALL.replace("Saw3", "Fla0").replace("40, 40", "160, 120"));
    folder.file("a.toml", "specimens = [\"Saw3\"]\nslides = 2\n");
    folder.file("map.csv", include_str!("../../wstac-tradeoff/data/map.csv"));
    folder.file("forest.onnx", include_bytes!("../fuzz/seeds/model_import/forest.onnx"));
    good(&["record", "scene:Saw3@150", "--size", "40x40", "-o", &path("a.mcap")]);
    good(&["dataset", &path("a.toml"), "-o", &path("a.npz")]);
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (command, ending) in COMMANDS {
        for output in bad_outputs(&folder.0, ending) {
            // A figure and a choice go into a folder, too, which may be new; other endings are refused as arguments.
            let is_folder = output.starts_with("folder") || output.starts_with("none/");
            let needs_ending = [".jsonl", ".csv", ".svg", ".y4m"].contains(&ending) && output == "/dev/full";
            if (command.starts_with("trade") && is_folder) || needs_ending {
                continue;
            }
            for force in [&[][..], &["--force"]] {
                // A file that exists is replaced with --force, and stays as it is without.
                if output.starts_with("kept") && !force.is_empty() {
                    continue;
                }
                let words: Vec<&str> =
                    command.split(' ').map(|word| if word == "OUT" { &*output } else { word }).collect();
                let done = run_in(&folder, words.iter().chain(force));
                tried += 1;
                let is_named = said(&done).contains(&output) && !said(&done).contains("panicked");
                if done.status.code() != Some(1) || !is_named {
                    wrong.push(format!("{words:?} {force:?}: {:?}: {}", done.status.code(), said(&done)));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {tried}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(tried > 150, "{tried}");
    for (_, ending) in COMMANDS {
        assert_eq!(fs::read(folder.0.join(format!("kept{ending}"))).unwrap(), b"mine");
    }
    // Nothing was left behind.
    let names = folder.names();
    assert!(names.iter().all(|name| !name.contains(".part") && !name.starts_with("new")), "{names:?}");
}

/// A wrong argument about an output is not reported as an output that cannot be written.
#[test]
fn wrong_arguments_about_outputs_end_with_2() {
    let folder = Folder::new("exit-outputs-usage");
    good(&["record", "scene:Saw3@150", "--size", "40x40", "-o", &folder.path("a.mcap")]);
    for (command, expected) in [
        ("run scene:Saw3@150 -o a", "expected .jsonl, .json, .csv or .txt, or --output-format"),
        ("run scene:Saw3@150 -o a.csv --json", "its name ends in .csv, but --json is given"),
        ("record scene:Saw3@150 -o a.csv", "expected .mcap"),
        ("record cam:a=scene:Saw3@150 cam:b=scene:Saw3@150 -o a.csv", "expected .mcap"),
        ("record a.mcap --force -o a.mcap", "is an input of the command"),
        ("recover a.mcap --force -o a.mcap", "is the recording itself"),
        ("plot scene:Saw3@150 -o a.jsonl", "expected .svg"),
        ("scene render Saw3@150 -o a.svg", ".y4m, .raw or .mp4"),
        ("run scene:Saw3@150 -o a.txt --output-format csv", "its name ends in .txt, but --output-format csv is given"),
        ("run scene:Saw3@150 -o b.mcap --json", "its name ends in .mcap, expected .jsonl"),
        ("trade --budget M4F<60k -o b.svg", "only the figure of a map is a file"),
        ("trade --slides 1 -o b.pdf", "only the figure of a map is a file"),
        ("dataset -o set.csv", "expected .npz"),
        ("model import none.onnx -o forest.c", "expected .wsm or .rs"),
        ("record scene:Saw3@150 --label specimen=Saw\u{202e}3 -o b.mcap", "plain text"),
        ("record scene:Saw3@150 --compress zip -o b.mcap", "zip"),
        ("record cam:-a=scene:Saw3@150 cam:b=scene:Saw3@150 -o b.mcap", "-a"),
    ] {
        says(&run_in(&folder, command.split(' ')), 2, &[expected]);
    }
    assert_eq!(folder.names(), ["a.mcap"]);
}
