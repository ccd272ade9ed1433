//! Tests `wstac train`: from nothing and from data sets to a model that names textures.

use std::fs;

use wstac_tests::command::{event, printed, prints, records, refused, run, said};
use wstac_tests::folder::{Folder, text};

/// A sweep that takes seconds.
const SMALL: &str = "specimens = [\"Fla0\", \"Saw4\", \"Sin3\"]\nslides = 360\nsensors = 40\n";

#[test]
fn a_sweep_becomes_a_model_that_names_slides_of_an_unseen_sensor() {
    let folder = Folder::new("train");
    let (sweep, model) = (folder.0.join("sweep.toml"), folder.0.join("my.wsm"));
    fs::write(&sweep, SMALL).unwrap();
    let done = run(&["train", text(&sweep), "-o", text(&model)]);
    let (out, messages) = (printed(&done), said(&done));
    let first = out.lines().next().unwrap();
    assert!(first.contains(" slides of 8 groups that were not trained on"), "{out}");
    assert!(first.split(" %").next().unwrap().parse::<f64>().unwrap() >= 90.0, "{out}");
    assert!(out.lines().any(|line| line.starts_with("  Saw4 ") && line.contains(" … ")), "{out}");
    assert!(messages.contains("3 classes, trained on") && messages.contains("of 32 groups"), "{messages}");
    let figure = fs::read_to_string(folder.0.join("my.confusion.svg")).unwrap();
    assert!(figure.starts_with("<svg") && figure.contains(">Saw4<") && figure.contains("answer"));
    // Sensor 900000 is none of the sweep's.
    let mut right = 0;
    for (specimen, slide) in [("Saw4", "75,200deg,90mm"), ("Sin3", "240,10deg,70mm"), ("Fla0", "120,135deg,110mm")] {
        let scene = folder.0.join(format!("{specimen}.toml"));
        let [mm_s, degrees, length] = slide.split(',').collect::<Vec<_>>()[..] else { unreachable!() };
        let (degrees, length) = (degrees.trim_end_matches("deg"), length.trim_end_matches("mm"));
        let lines = format!(
            "specimen = \"{specimen}\"\nspeed = {mm_s}\ndirection = {degrees}\nlength = {length}\n\
             fidelity = \"taxel\"\n[light]\nunit = 900000\n"
        );
        fs::write(&scene, lines).unwrap();
        let event = event(&["run", &format!("scene:{}", text(&scene)), "--model", text(&model)]);
        right += usize::from(event["texture"]["specimen"] == specimen);
        assert!(event["texture"]["known"].is_boolean(), "{event}");
    }
    assert!(right >= 2, "{right} of 3");
    prints(&["model", "inspect", text(&model)], &["multinomial logistic regression"]);
}

#[test]
fn a_data_set_along_the_path_says_which_sensors_test() {
    let folder = Folder::new("train-set");
    let (sweep, set, model) = (folder.0.join("sweep.toml"), folder.0.join("set.npz"), folder.0.join("my.wsm"));
    fs::write(&sweep, SMALL).unwrap();
    let done = run(&["dataset", "--input", "path", text(&sweep), "-o", text(&set)]);
    printed(&done);
    assert!(said(&done).contains("360 slides, "), "{}", said(&done));
    let figure = folder.path("figure.svg");
    let train = ["train", text(&set), "-o", text(&model), "--confusion", &figure, "--json"];
    let report = records(&train).remove(0);
    assert_eq!(report["labels"], serde_json::json!(["Fla0", "Saw4", "Sin3"]));
    assert_eq!((&report["groups"], &report["test"]["groups"]), (&32.into(), &8.into()));
    assert!(report["test"]["accuracy"].as_f64().unwrap() >= 0.9, "{report}");
    assert!(report["calibration"]["slides"].as_u64().unwrap() > 20, "{report}");
    // model eval reads the same file, and its answers to all slides are as good.
    let all = records(&["model", "eval", text(&model), text(&set), "--json"]).remove(0);
    assert!(all["accuracy"].as_f64().unwrap() >= 0.9, "{all}");
    let frames = ["train", text(&set), "-o", &folder.path("b.wsm"), "--input", "frames"];
    refused(&frames, &["array X: is missing", "--input path"]);
}
