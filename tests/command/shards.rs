//! Tests of shards of every kind: random slides, recordings and `wstac trade`. Merged, they equal what one process makes,
//! byte for byte, and what is no whole set is refused.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use wstac_tests::command::wstac;
use wstac_tests::folder::Folder;

fn run(arguments: &[&str]) -> Output {
    Command::new(wstac()).args(arguments).output().unwrap()
}

/// Returns what a command that must succeed says.
fn good(arguments: &[&str]) -> String {
    let done = run(arguments);
    let said = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(0), "{arguments:?}: {said}");
    said
}

/// Checks what a command that must fail says.
fn bad(arguments: &[&str], parts: &[&str]) {
    let done = run(arguments);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(matches!(done.status.code(), Some(1 | 2)), "{arguments:?}: {said}");
    for part in parts {
        assert!(said.contains(part), "{said:?}, expected {part:?}");
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Makes all shards of a command, and returns their files.
fn shards(folder: &Folder, name: &str, command: &[&str], of: u32) -> Vec<PathBuf> {
    let file = |k| folder.0.join(format!("{name}-{k}-of-{of}.shard"));
    let make = |k| {
        let (file, numbers) = (file(k), format!("{k}/{of}"));
        good(&[command, &["--shard", &numbers, "-o", text(&file)]].concat());
        file
    };
    (1..=of).map(make).collect()
}

/// Checks that shards of a data set, merged in another order, are the file of one process, and say the same.
fn is_whole(folder: &Folder, command: &[&str], counts: &[u32]) {
    let whole = folder.0.join("whole.npz");
    let said = good(&[command, &["-o", text(&whole), "--force"]].concat());
    for of in counts {
        let mut files = shards(folder, "s", command, *of);
        files.reverse();
        let merged = folder.0.join("merged.npz");
        let names: Vec<&str> = files.iter().map(|file| text(file)).collect();
        let again = good(&[&["dataset", "merge", "-o", text(&merged), "--force"], &names[..]].concat());
        assert!(fs::read(&whole).unwrap() == fs::read(&merged).unwrap(), "{command:?}: {of} shards");
        // A merge computes nothing, so it has no progress.
        let done: String = said.split_inclusive('\n').filter(|line| !line.ends_with(" done\n")).collect();
        assert_eq!(done.replace("whole.npz", "merged.npz"), again);
        for file in &files {
            fs::remove_file(file).unwrap();
        }
    }
}

#[test]
fn shards_of_random_slides_give_the_set_of_one_process() {
    let folder = Folder::new("shards random");
    // Of short slides at an end of the range some have no sample.
    let sweep = folder.file("s.toml", "slides = 23\nsensors = 7\nspeeds = [10, 600]\nlengths = [20, 60]\n");
    for input in ["path", "taxel-path"] {
        is_whole(&folder, &["dataset", text(&sweep), "--input", input], &[1, 4, 23]);
    }
    bad(
        &["dataset", text(&sweep), "--input", "path", "--shard", "1/24", "-o", text(&folder.0.join("x"))],
        &["--shard: is 1/24, expected at most 23 shards"],
    );
}

/// Records slides, of which one ends within its event.
fn recordings(folder: &Folder) -> PathBuf {
    let recordings = folder.0.join("recordings");
    fs::create_dir(&recordings).unwrap();
    let scenes = [("Saw3@150,30deg", "Saw3"), ("Fla0@100", "Fla0"), ("Saw3@220", "Saw3"), ("Tri2@90,180deg", "denim")];
    for (k, (scene, specimen)) in scenes.into_iter().enumerate() {
        let file = recordings.join(format!("{k}.mcap"));
        let label = format!("specimen={specimen}");
        let labels = ["--label", &label, "--label", "sensor=a", "--features-only"];
        good(&[&["record", &format!("scene:{scene},seed={k}"), "-o", text(&file)][..], &labels].concat());
    }
    recordings
}

#[test]
fn shards_of_recordings_give_the_set_of_one_process() {
    let folder = Folder::new("shards recordings");
    let recordings = recordings(&folder);
    let config = folder.file("c.toml", "[trigger]\nwindow = 6\n");
    for more in [&[][..], &["--input", "path", "--test", "0.3"], &["--input", "taxel-path", "--config", text(&config)]]
    {
        is_whole(&folder, &[&["dataset", text(&recordings)], more].concat(), &[1, 3, 4]);
    }
    // Another recording, other shares or another configuration are another set.
    let command = ["dataset", text(&recordings)];
    let files = shards(&folder, "a", &command, 2);
    let output = folder.0.join("set.npz");
    let other = shards(&folder, "b", &["dataset", text(&recordings), "--test", "0.5"], 2);
    let merge = ["dataset", "merge", "-o", text(&output), text(&files[0])];
    bad(&[&merge[..], &[text(&other[1])]].concat(), &["b-2-of-2.shard: is shard 2/2", "a-1-of-2.shard"]);
    fs::copy(recordings.join("0.mcap"), recordings.join("5.mcap")).unwrap();
    let later = shards(&folder, "c", &command, 2);
    bad(&[&merge[..], &[text(&later[1])]].concat(), &["c-2-of-2.shard: is shard 2/2 of 5 items", "a-1-of-2.shard"]);
    bad(&merge, &["1 of 2 shards are missing", "2/2"]);
    // Recordings that cannot be compared are found by the shard that has both, or by the merge.
    let fast = folder.file("fast.toml", "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nfps = 40\n");
    let scene = format!("scene:{}", text(&fast));
    let file = recordings.join("6.mcap");
    good(&["record", &scene, "-o", text(&file), "--label", "specimen=Saw3", "--features-only"]);
    let apart = shards(&folder, "d", &command, 6);
    let names: Vec<&str> = apart.iter().map(|file| text(file)).collect();
    bad(&[&["dataset", "merge", "-o", text(&output)], &names[..]].concat(), &["6.mcap: its rate of frames differs"]);
    assert!(!output.exists());
}

#[test]
fn shards_of_different_kinds_do_not_go_together() {
    let folder = Folder::new("shards kinds");
    let sweep = folder.file("s.toml", "slides = 4\n");
    let over_time = shards(&folder, "f", &["dataset", text(&sweep)], 2);
    let path = shards(&folder, "p", &["dataset", text(&sweep), "--input", "path"], 2);
    let taxels = shards(&folder, "t", &["dataset", text(&sweep), "--input", "taxel-path"], 2);
    let output = folder.0.join("set.npz");
    let merge = |one: &Path, other: &Path, parts: &[&str]| {
        bad(&["dataset", "merge", "-o", text(&output), text(one), text(other)], parts);
    };
    merge(&over_time[0], &path[1], &["p-2-of-2.shard: is a shard of wstac dataset (RandomSlides)", "(Frames)"]);
    merge(&path[0], &taxels[1], &["t-2-of-2.shard: is shard 2/2 of 4 items", "digest"]);
    merge(&path[0], &path[0], &["is shard 1/2, as is", "expected each once"]);
    // A record whose content is of another kind, with right checksums, cannot come from a disk; a cut one can.
    let whole = fs::read(&path[1]).unwrap();
    for length in [0, 11, 40, whole.len() / 2, whole.len() - 1] {
        fs::write(&path[1], &whole[..length]).unwrap();
        merge(&path[0], &path[1], &["p-2-of-2.shard: "]);
    }
    for at in (0..whole.len()).step_by(97) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        fs::write(&path[1], bytes).unwrap();
        merge(&path[0], &path[1], &["p-2-of-2.shard: "]);
    }
    assert!(!output.exists());
}

#[test]
fn shards_of_a_study_give_its_results() {
    let folder = Folder::new("shards trade");
    let config = folder.file("c.toml", "[trigger]\nwindow = 6\n");
    let study = ["trade", "--slides", "1", "--model", "builtin:svm", "--config", text(&config)];
    let whole = folder.0.join("whole");
    good(&[&study[..], &["--no-times", "-o", text(&whole)]].concat());
    let files = shards(&folder, "s", &study, 3);
    let names = |order: &[usize]| order.iter().map(|k| text(&files[*k])).collect::<Vec<_>>();
    let merged = folder.0.join("merged");
    let merge = ["trade", "--no-times", "-o", text(&merged), "--merge"];
    good(&[&merge[..], &names(&[2, 0, 1])].concat());
    for name in ["trade.csv", "trade.md", "trade.svg", "map.csv", "base.toml"] {
        let read = |folder: &Path| fs::read(folder.join(name)).unwrap();
        assert!(read(&whole) == read(&merged), "{name}");
    }
    // A shard that is there stays, another file too.
    let again = [&study[..], &["--shard", "1/3", "-o", text(&files[0])]].concat();
    assert!(good(&again).contains("shard 1/3 is already there"));
    bad(&[&study[..], &["--shard", "2/3", "-o", text(&files[0])]].concat(), &["s-1-of-3.shard", "exists"]);
    let none = folder.0.join("no");
    let merge = ["trade", "--no-times", "-o", text(&none), "--merge"];
    bad(&[&merge[..], &names(&[0, 2])].concat(), &["1 of 3 shards are missing", "2/3"]);
    bad(
        &["dataset", "merge", text(&files[0]), text(&files[1]), text(&files[2]), "-o", "x.npz"],
        &["wstac trade --merge"],
    );
    bad(&[&study[..], &["--shard", "1/21", "-o", "x"]].concat(), &["at most 20 shards"]);
    bad(&["trade", "--shard", "1/2"], &["-o"]);
}
