//! Tests `wstac characterize` as whoever builds a sensor runs it: slides of a simulated sensor, answers beside the
//! truth, and the scene that is this sensor.

use std::fs;

use wstac_tests::command::{assert_has, good, prints, refused, run, said, says};
use wstac_tests::folder::Folder;

/// A sensor that is not the default one: dimmer, with a weak whisker, a longer afterglow and more noise.
const SENSOR: &str = "lead_in = 45\nnoise = 1\n[light]\nflash_ms = 8\nafterglow_ms = 60\ngain_deviation = 0\n\
                      weak = [[2, 3, 0.5]]\n[sensor]\nsize = [240, 240]\nnoise = 1.5\n";
const PLAN: &str = "specimens = [\"Fla0\"]\nspeeds = [80, 100]\ndirections = [0, 90]\ncount = 2\n";

#[test]
fn a_sensor_is_characterized_and_becomes_a_scene() {
    let folder = Folder::new("characterize");
    let slides: String = [(80, 0), (80, 0), (80, 90), (80, 90), (100, 0), (100, 0), (100, 90), (100, 90)]
        .map(|(speed, degrees)| format!("[[slide]]\nspecimen = \"Fla0\"\nspeed = {speed}\ndirection = {degrees}\n"))
        .concat();
    let source = format!("scene:{}", folder.file("sensor.toml", format!("{SENSOR}{slides}")).display());
    let plan = folder.file("plan.toml", PLAN);
    let output = &*folder.path("out");
    let done = run(&["characterize", &folder.path("none.mp4"), "-o", output]);
    says(&done, 1, &["none.mp4"]);
    assert!(!said(&done).contains("do not touch") && !folder.0.join("out").exists(), "{}", said(&done));
    let with_plan = ["characterize", &source, "-o", output, "--plan", plan.to_str().unwrap()];
    let other = folder.written("other.csv", "recording,speed,direction\nFla0-80mm_s-0deg-3,80,0\n");
    refused(&[&with_plan[..], &["--truth", &other]].concat(), &["other.csv: no slide", "found \"Fla0-80mm_s-0deg-3\""]);
    assert!(!folder.0.join("out").exists());
    let table = good(&with_plan);
    assert!(table.contains("8 slides: 8 reliable; reliable, but off by more than 10 % or 10°: 0"), "{table}");
    let scene = fs::read_to_string(folder.0.join("out/scene.toml")).unwrap();
    let number = |key: &str| -> f64 {
        let line = scene.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_else(|| panic!("{key} in {scene}"));
        line.split_whitespace().next().unwrap().parse().unwrap()
    };
    for (key, expected, most) in
        [("flash_ms = ", 8.0, 0.12), ("rubbing_ms = ", 0.01, 0.15), ("afterglow_ms = ", 60.0, 0.04)]
    {
        assert!((number(key) / expected - 1.0).abs() < most, "{key}: {scene}");
    }
    assert!(scene.contains("[2, 3, 0.4") || scene.contains("[2, 3, 0.5"), "{scene}");
    prints(&["run", &format!("scene:{}", folder.path("out/scene.toml"))], &["slide, speed"]);
    let page = fs::read_to_string(folder.0.join("out/report.html")).unwrap();
    assert_has(&page, &["8 slides: 8 reliable", "data:image/png;base64,", "Fla0-80mm_s-90deg-2", "afterglow_ms"]);

    // Recordings of the folder stay, and a table may state the truth. A press has no answers.
    let press = folder.file("press.toml", "[[touch]]\nkind = \"press\"\n[sensor]\nsize = [240, 180]\n");
    good(&["record", &format!("scene:{}", press.display()), "-o", &folder.path("out/press.mcap")]);
    let recording = folder.0.join("out/Fla0-80mm_s-0deg-1.mcap");
    let before = fs::metadata(&recording).unwrap().modified().unwrap();
    let truth = &folder.written("arm.csv", "\u{feff}recording,speed,direction\r\nFla0-80mm_s-0deg-1,120,\r\n");
    let off = "9 slides: 8 reliable; reliable, but off by more than 10 % or 10°: 1";
    prints(&["characterize", &source, "-o", output, "--truth", truth], &[off, "120"]);
    assert_eq!(fs::metadata(&recording).unwrap().modified().unwrap(), before);
    good(&with_plan);
    for (text, says) in
        [("specimens = []\n", "plan.toml"), ("specimens = [\"Fla0\"]\n", "is another plan than that of --plan")]
    {
        folder.file("plan.toml", text);
        refused(&with_plan, &[says]);
    }
    let no_slide = "no slide of the plan and no recording has this name (found \"a\", expected one such as \"";
    for (text, says) in [
        ("speed\n", "arm.csv: line 1: wrong names of columns (found \"speed\", expected recording,speed,direction)"),
        ("recording,speed,direction\na,1\n", "line 2: wrong number of fields (found 2, expected 3)"),
        ("recording,speed,direction\na,-1,0\n", "line 2: wrong number (found \"-1\", expected a speed in mm/s above 0"),
        ("recording,speed,direction\na,1,up\n", "line 2: wrong number (found \"up\", expected a direction in degrees"),
        ("recording,speed,direction\na,1,0\na,1,0\n", "line 3: recording \"a\" is there twice"),
        ("recording,speed,direction\na,1,0\n", no_slide),
    ] {
        folder.file("arm.csv", text);
        refused(&["characterize", &source, "-o", output, "--truth", truth], &[says]);
    }
}
