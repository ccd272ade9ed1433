//! Tests `wstac run --model`: textures in events, and before them.

use std::fs;

use serde_json::{Value, json};
use wstac_tests::command::{assert_has, good, records, refusal, run, says};
use wstac_tests::folder::Folder;
use wstac_tests::trained::model;

const SCENE: &str = "scene:Saw3@150";

#[test]
fn models_that_come_with_the_program_name_specimens() {
    for model in ["svm", "forest", "boosted"] {
        let found = records(&["run", SCENE, "--json", "--model", &format!("builtin:{model}")]);
        let [event, _, end] = &found[..] else { panic!("{model}: {found:?}") };
        assert_eq!(end["kind"], "end");
        let texture = &event["texture"];
        let specimen = texture["specimen"].as_str().unwrap();
        assert_eq!(texture["pattern"], specimen[..3], "{texture}");
        assert_eq!(texture["depth_mm"], specimen[3..].parse::<f64>().unwrap(), "{texture}");
        assert!(event.get("why").is_none(), "{event}");
        let text = String::from_utf8(run(&["run", SCENE, "--model", &format!("builtin:{model}")]).stdout).unwrap();
        assert!(text.contains(&format!(", texture {specimen}")), "{text}");
    }
}

#[test]
fn a_scene_that_the_wave_answers_has_the_best_model() {
    let folder = Folder::new("best");
    let of = |arguments: &[&str]| records(&[&["run", SCENE, "--json"], arguments].concat());
    let best = of(&["--model", "builtin"]);
    assert_eq!(best[0]["texture"]["specimen"], "Saw3", "{best:?}");
    assert_eq!((of(&[]), of(&["--model", "builtin:taxel-path-svm"])), (best.clone(), best));
    let mut without = vec![vec!["--model", "none"], vec!["--fps", "15"]];
    let laws = ["law = \"published\"", "estimator = \"edges\"", "estimator = \"coherence\""].map(|key| {
        let name = format!("{}.toml", key.len());
        folder.file(&name, format!("[speed]\n{key}\n")).display().to_string()
    });
    without.extend(laws.iter().map(|law| vec!["--config", law]));
    for arguments in without {
        assert_eq!(of(&arguments)[0]["why"]["texture"], "no model was given", "{arguments:?}");
    }
    // Too slow for an answer before 70 frames have shown the path.
    let slow = records(&["run", "scene:Saw3@55,90deg", "--json"]);
    assert_eq!((&slow[0]["kind"], &slow[0]["texture"]["specimen"]), (&"event".into(), &"Saw3".into()));
}

#[test]
fn a_source_without_a_model_is_told_of_one_once() {
    let folder = Folder::new("hint");
    let two = "[[slide]]\nspecimen = \"Saw3\"\nspeed = 150\n[[slide]]\nspecimen = \"Sin3\"\nspeed = 150\n";
    let (scene, recording) = (folder.scene("two.toml", two), folder.path("two.mcap"));
    good(&["record", &scene, "--size", "160x160", "-o", &recording, "--features-only"]);
    let hints = |arguments: &[&str]| {
        let done = run(&[&["run"], arguments].concat());
        let printed = String::from_utf8_lossy(&done.stdout).into_owned();
        assert_eq!(printed.lines().filter(|line| line.starts_with("event at")).count(), 2, "{printed}");
        String::from_utf8_lossy(&done.stderr).matches("no model was given: --model builtin names textures").count()
    };
    assert_eq!(hints(&[&recording]), 1);
    for arguments in
        [[&recording, "--model", "none"], [&recording, "--model", "builtin"], [&scene, "--size", "160x160"]]
    {
        assert_eq!(hints(&arguments), 0, "{arguments:?}");
    }
}

#[test]
fn the_list_has_every_model_and_the_best_is_the_smallest_of_its_equals() {
    let usual = good(&["model", "list"]);
    let list = good(&["model", "list", "--all"]);
    assert!(usual.lines().count() == 16 && usual.lines().all(|line| list.contains(line)), "{usual}");
    let unknown = refusal(&["run", "scene:Saw3@150", "--model", "builtin:x"]);
    assert_has(&unknown, &["expected builtin, builtin:path-svm", "wstac model list --all has all"]);
    assert!(!unknown.contains("svm-20f"), "{unknown}");
    let map = include_str!("../../wstac-tradeoff/data/map.csv");
    let measured = |name: &str| {
        let is_it = |line: &&str| {
            let ["GREY", "1", "fixed", "wave" | "published", model, ..] = line.split(',').collect::<Vec<_>>()[..]
            else {
                return false;
            };
            model == name
        };
        let line = map.lines().find(is_it)?;
        Some([7, 8].map(|column| line.split(',').nth(column).unwrap().parse::<f64>().unwrap()))
    };
    let mut all = Vec::new();
    for line in list.lines().filter(|line| line.starts_with("builtin:")) {
        let name = line.split_whitespace().next().unwrap();
        let numbers: Vec<&str> = line[38..].split_whitespace().collect();
        let inspected = records(&["model", "inspect", name, "--json"]).remove(0);
        assert_eq!(inspected["bytes"].to_string(), numbers[1], "{line}");
        let accuracy = measured(name).map_or("–".to_owned(), |[mean, _]| format!("{mean:.1}"));
        assert_eq!((accuracy.as_str(), numbers.len()), (numbers[0], 4), "{line}");
        all.extend(measured(name).map(|found| (name.to_owned(), found, numbers[1].parse::<u32>().unwrap())));
    }
    assert_eq!(all.len() + 2, wstac_host::model_file::ModelFile::names().count(), "all but the embeddings: {list}");
    let [_, low] = all.iter().map(|(_, found, _)| *found).max_by(|one, other| one[0].total_cmp(&other[0])).unwrap();
    let equals = all.iter().filter(|(_, [mean, _], _)| *mean >= low);
    let best = &equals.min_by_key(|(_, _, bytes)| *bytes).unwrap().0;
    assert!(list.ends_with(&format!("builtin is {best}\n")), "{best}: {list}");
}

#[test]
fn an_unknown_texture_has_no_names() {
    let folder = Folder::new("unknown");
    let texts = ["period = 16.0\n", ""].map(|period| format!("specimen = \"Saw3\"\nspeed = 150\n{period}"));
    let mut found = Vec::new();
    for text in texts {
        let source = folder.scene("long.toml", text);
        let asked = ["run", &source, "--size", "320x180", "--model", "builtin:taxel-path-svm"];
        found.push(records(&[&asked[..], &["--json"]].concat())[0]["texture"].clone());
        let text = String::from_utf8(run(&asked).stdout).unwrap();
        let expected = if found.len() == 1 { ", texture unknown" } else { ", texture Saw3 (confidence 0." };
        assert!(text.contains(expected), "{text}");
    }
    assert_eq!(found[0], texture(None, None, Some(false)));
    assert_eq!((&found[1]["specimen"], &found[1]["known"]), (&"Saw3".into(), &true.into()));
    let confidence = found[1]["confidence"].as_f64().unwrap();
    assert!(confidence > 0.9 && confidence < 1.0, "{confidence}");
}

/// Returns the record of a texture of a model without confidences.
fn texture(pattern: Option<&str>, depth_mm: Option<f64>, known: Option<bool>) -> Value {
    json!({"specimen": null, "pattern": pattern, "depth_mm": depth_mm, "confidence": null, "known": known})
}

#[test]
fn a_model_of_the_first_frames_answers_when_they_have_arrived() {
    let folder = Folder::new("early");
    let early = model(&folder, "early", 30, 29, "Fla,Saw");
    let late = model(&folder, "late", 70, 69, "2,3");
    let (first_30, late) = (early.to_str().unwrap(), late.to_str().unwrap());
    let found = records(&["run", SCENE, "--json", "--features", "--samples", "--model", late, "--model", first_30]);
    let place = |kind: &str| found.iter().position(|record| record["kind"] == kind).unwrap();
    let (early, event) = (&found[place("texture")], &found[place("event")]);
    let first = event["frame"].as_u64().unwrap();
    assert_eq!((&early["frame"], &early["frames"]), (&event["frame"], &30.into()));
    let sees_light = |frame: usize| event["sample"][0][frame].as_f64().unwrap() >= -1.5;
    let pattern = if sees_light(29) { "Saw" } else { "Fla" };
    let depth = if sees_light(69) { 3.0 } else { 2.0 };
    assert_eq!(early["texture"], texture(Some(pattern), None, None));
    assert_eq!(event["texture"], texture(Some(pattern), Some(depth), None));
    // Frame number 29 of the sample is the last before it, and the one after comes later.
    let before = &found[place("texture") - 1];
    assert_eq!((&before["kind"], &before["frame"]), (&"features".into(), &(first + 29).into()));
    let text = String::from_utf8(run(&["run", SCENE, "--model", first_30]).stdout).unwrap();
    let end = format!("from the first 30 frames of the event at frame {first}");
    let line = format!("at frame {}: texture {pattern} (no confidence), {end}", first + 30);
    assert!(text.starts_with(&line), "{text}");
}

#[test]
fn models_that_cannot_be_used_are_refused_by_name() {
    let folder = Folder::new("refused");
    let one = model(&folder, "one", 70, 0, "Fla,Saw");
    let two = model(&folder, "two", 70, 1, "Sin,Saw");
    let (one, two) = (one.to_str().unwrap(), two.to_str().unwrap());
    let damaged = folder.0.join("damaged.wsm");
    let mut bytes = fs::read(one).unwrap();
    bytes[40] ^= 1;
    fs::write(&damaged, bytes).unwrap();
    for (models, code, parts) in [
        (vec![one, two], 2, &["two.wsm", "one.wsm", "pattern"][..]),
        (vec![damaged.to_str().unwrap()], 1, &["damaged.wsm", "checksum"]),
        (vec!["builtin:trees"], 1, &["builtin:trees", "builtin:forest"]),
        (vec!["none.wsm"], 1, &["none.wsm", "no such file"]),
    ] {
        let mut arguments = vec!["run", SCENE];
        arguments.extend(models.iter().flat_map(|model| ["--model", model]));
        let done = run(&arguments);
        says(&done, code, parts);
        assert!(done.stdout.is_empty());
    }
}
