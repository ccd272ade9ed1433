//! Tests models of textures with names of one's own, such as denim: from recordings to a model, and its evaluation.

use std::fs;
use std::path::PathBuf;

use wstac_tests::command::{good, printed, prints, refused, run, said};
use wstac_tests::folder::{Folder, text};

/// Records slides of textures to a folder: the name of each, and the scene's specimen.
fn recorded(folder: &Folder, name: &str, textures: &[(&str, &str)], slides: u32) -> PathBuf {
    let recordings = folder.0.join(name);
    fs::create_dir(&recordings).unwrap();
    for (texture, specimen) in textures {
        for slide in 1..=slides {
            let scene = format!("scene:{specimen}@{},{}deg,seed={slide}", 80 + 30 * slide, 50 * slide);
            let path = recordings.join(format!("{texture}-{slide}.mcap"));
            let label = format!("specimen={texture}");
            good(&["record", &scene, "-o", text(&path), "--label", &label, "--features-only", "--size", "320x180"]);
        }
    }
    recordings
}

const TEXTURES: [(&str, &str); 3] = [("denim", "Saw3"), ("cork", "Sin4"), ("felt", "Tri2")];

#[test]
fn a_model_of_own_names_is_evaluated_on_recordings_and_on_their_data_set() {
    let folder = Folder::new("own-names");
    let recordings = recorded(&folder, "den", &TEXTURES, 3);
    let (recordings, model) = (text(&recordings), folder.0.join("den.wsm"));
    let done = run(&["model", "learn", "builtin:taxel-embedding", recordings, "-o", text(&model)]);
    printed(&done);
    let learned = said(&done);
    assert!(learned.contains("3 textures, 3 slides each"), "{learned}");
    assert!(learned.contains("without its own texture, ") && learned.contains(" are called unknown"), "{learned}");
    let set = folder.0.join("den.npz");
    good(&["dataset", recordings, "--input", "taxel-path", "-o", text(&set)]);
    for (source, from) in [(recordings, "the label specimen"), (text(&set), "y_specimen")] {
        prints(&["model", "eval", text(&model), source], &[&format!(" right: 9 of 9 samples, by {from}")]);
        prints(&["model", "eval", text(&model), source, "--json"], &["\"right\":9", "\"predictions\":[\"cork\""]);
    }
    // Names that are none of the model's are no truth about its answers.
    let others = recorded(&folder, "others", &[("Saw3", "Saw3")], 1);
    let other = folder.0.join("other.npz");
    good(&["dataset", text(&others), "--input", "taxel-path", "-o", text(&other)]);
    let no_truth = "1 sample, without truth: array y_specimen has none of the model's labels";
    prints(&["model", "eval", text(&model), text(&other)], &[no_truth]);
    let missing =
        ["array X_path: is missing, found X_taxel_path", "help: wstac dataset --input path makes a set with it"];
    refused(&["model", "eval", "builtin:path-svm", text(&set)], &missing);
    // Few slides of own names lead to learning.
    let no_specimen = "label \"cork\" of class 0 is no specimen, expected a name such as Saw3, or --task other";
    refused(&["train", recordings, "-o", text(&model), "--force"], &[no_specimen]);
    for source in [recordings, text(&set)] {
        let train = ["train", source, "-o", text(&model), "--task", "other", "--input", "taxel-path", "--force"];
        let done = run(&train);
        printed(&done);
        let notes = said(&done);
        let why = "cork has 2 sensors or recordings to train on, expected at least 3 of each texture";
        assert!(notes.contains(why), "{notes}");
        let help = format!("help: few slides are enough for wstac model learn builtin:taxel-embedding {source} -o ");
        assert!(notes.contains(&help), "{notes}");
        assert!(!notes.contains("no better than guessing"), "{notes}");
    }
    // Two names of one texture cannot be told apart.
    let alike = recorded(&folder, "alike", &[("left", "Saw3"), ("right", "Saw3")], 3);
    let done = run(&["train", text(&alike), "-o", text(&folder.0.join("alike.wsm")), "--task", "other"]);
    printed(&done);
    let notes = said(&done);
    assert!(notes.contains("right is no better than guessing one of 2 textures: do not use "), "{notes}");
}

#[test]
fn what_is_no_source_of_slides_is_named() {
    let folder = Folder::new("own-sources");
    let video = folder.file("robot.mp4", b"none");
    let (missing, set, model) = (folder.0.join("recc"), folder.0.join("a.npz"), folder.0.join("a.wsm"));
    for (command, output) in [("train", &model), ("dataset", &set)] {
        refused(&[command, text(&missing), "-o", text(output)], &["recc: no such file or folder"]);
        let done = run(&[command, text(&video), "-o", text(output)]);
        let refused = said(&done);
        assert!(done.status.code() == Some(2) && refused.contains("robot.mp4: is a video, expected "), "{refused}");
        let help = format!("wstac record {} -o {}", video.display(), folder.0.join("robot.mcap").display());
        assert!(refused.contains(&help) && refused.contains("--label specimen=NAME"), "{refused}");
    }
    // The ending of a model's name is not that of another format.
    for command in [&["train"][..], &["model", "learn", "builtin:embedding", text(&missing)]] {
        let done = run(&[command, &["-o", text(&folder.0.join("a.mcap"))]].concat());
        let refused = said(&done);
        assert!(done.status.code() == Some(2) && refused.contains("ends in .mcap, expected .wsm"), "{refused}");
    }
}
