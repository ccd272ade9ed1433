//! Tests the `wstac` command as people use it: its exact records, and its end after signals.

use std::io::Write;

use wstac_tests::command::{
    assert_has, ends, event, good, printed, program, records, refused, run, said, says, start, wstac,
};
use wstac_tests::folder::{Folder, GRAY, frames};

fn output(arguments: &[&str]) -> Vec<String> {
    good(arguments).lines().map(str::to_owned).collect()
}

#[test]
fn records_are_as_documented_to_the_letter() {
    let lines = output(&["run", "scene:Saw3@150,90deg", "--json", "--features"]);
    assert_eq!(lines.len(), 140 + 3);
    assert!(lines[0].starts_with(r#"{"kind":"features","frame":0,"time_ns":0,"f":[-"#), "{}", lines[0]);
    assert_eq!(lines[0].matches(',').count(), 3 + 9);
    let event = concat!(
        r#"{"kind":"event","frame":35,"frames":70,"time_ns":1533333333,"completed_ns":2100000000,"#,
        r#""touch_frame":46,"end_frame":null,"#,
        r#""time_s":1.5333,"completed_s":2.1,"stamp":null,"contact":"slide","duration_frames":null,"#,
        r#""speed":{"mm_s":150.2,"sd":1.603},"direction":{"deg":90.05,"sd":0.08},"#,
        r#""basis":"edge","contacts":1,"acceleration":{"mm_s2":-86.19,"sd":37.32},"#,
        r#""texture":{"specimen":"Saw3","pattern":"Saw","depth_mm":3.0,"confidence":0.9967,"known":true},"#,
        r#""frames_filled":0,"reliable":true}"#
    );
    let contact_end = r#"{"kind":"contact_end","frame":74,"event_frame":35,"time_ns":2466666666,"time_s":2.4667}"#;
    for line in [event, contact_end] {
        assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{line} {lines:#?}");
    }
    let end = concat!(
        r#"{"kind":"end","frames":140,"dropped":0,"baseline":"complete","incomplete":null,"#,
        r#""time_ns":4633333333,"clock":"frames"}"#
    );
    assert_eq!(lines.last().unwrap(), end);
}

/// Returns the path of a configuration with the published law.
fn published(folder: &Folder) -> String {
    folder.written("published.toml", "[speed]\nlaw = \"published\"\n")
}

#[test]
fn the_published_law_keeps_its_records_to_the_letter() {
    let folder = Folder::new("published");
    let lines = output(&["run", "scene:Saw3@150,90deg", "--json", "--config", &published(&folder)]);
    let event = concat!(
        r#"{"kind":"event","frame":35,"frames":70,"time_ns":1166666666,"completed_ns":3466666666,"#,
        r#""duration_frames":27,"#,
        r#""speed":{"mm_s":159.9,"extrapolated":false},"direction":{"deg":90,"confidence":0.9831},"#,
        r#""texture":null,"frames_filled":0,"reliable":true,"why":{"texture":"no model was given"}}"#
    );
    let end = concat!(
        r#"{"kind":"end","frames":140,"dropped":0,"baseline":"complete","incomplete":null,"#,
        r#""time_ns":4633333333,"clock":"frames"}"#
    );
    assert_eq!(lines, [event, end]);
}

#[test]
fn a_terminal_of_lines_has_no_screen() {
    let spawn = "import os, pty, sys; sys.exit(os.waitstatus_to_exitcode(pty.spawn(sys.argv[1:])))";
    let view = ["view", "scene:Saw3@150"];
    let done = program("python3").args(["-c", spawn]).arg(wstac()).args(view).env("TERM", "dumb").output().unwrap();
    let shown = String::from_utf8_lossy(&done.stdout);
    assert!(shown.contains("TERM: is dumb") && shown.contains("wstac run prints events as lines"), "{shown}");
    assert!(done.status.code() == Some(1) && !shown.contains('\x1b'), "{shown}");
}

#[test]
fn a_press_has_no_speed_and_says_why() {
    let folder = Folder::new("press");
    let scene = folder.scene("press.toml", "fidelity = \"taxel\"\n[[touch]]\nkind = \"press\"\n");
    let event = event(&["run", &scene, "--model", "builtin:svm"]);
    assert_eq!((&event["contact"], &event["speed"]), (&"press".into(), &serde_json::Value::Null), "{event}");
    assert!(event["direction"].is_null() && event["texture"].is_null(), "{event}");
    let reason = "the touch is a press, which does not slide";
    let why = serde_json::json!({"speed": reason, "direction": reason, "texture": "the touch is not a slide"});
    assert_eq!(event["why"], why);
}

#[test]
fn a_slide_that_is_longer_than_a_sample_is_one_event() {
    let lines = output(&["run", "scene:Saw3@30", "--json", "--size", "320x180"]);
    let kinds = |kind: &str| lines.iter().filter(|line| line.contains(&format!("\"kind\":\"{kind}\""))).count();
    assert_eq!((kinds("event"), kinds("contact_end")), (1, 1), "{lines:#?}");
    assert!(lines[0].contains("\"end_frame\":null"), "{}", lines[0]);
}

#[test]
fn a_slow_slide_that_lights_whiskers_one_by_one_is_one_event_and_no_press() {
    let lines = output(&["run", "scene:Saw2@5,90deg,105mm", "--json", "--size", "320x180"]);
    let events: Vec<_> = lines.iter().filter(|line| line.contains("\"kind\":\"event\"")).collect();
    assert!(matches!(events[..], [event] if event.contains("\"reliable\":false")), "{lines:#?}");
}

#[test]
fn every_event_of_slow_slides_has_one_end() {
    let folder = Folder::new("slow-ends");
    let specimens = ["Fla0", "Sin2", "Sin3", "Sin4", "Saw2", "Saw3", "Saw4", "Tri2", "Tri3", "Tri4"];
    for (speed, least) in [(5, 8), (7, 8), (20, 10)] {
        let touches = specimens.iter().zip([33, 90, 208, 0].iter().cycle()).map(|(specimen, direction)| {
            format!(
                "[[touch]]\nkind = \"slide\"\nspecimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\n"
            )
        });
        let scene = folder.scene("slow.toml", format!("fidelity = \"taxel\"\n{}", touches.collect::<String>()));
        let lines = records(&["run", &scene, "--json"]);
        let frames = |kind: &str, frame: &str| -> Vec<u64> {
            let mut frames: Vec<u64> =
                lines.iter().filter(|line| line["kind"] == kind).filter_map(|line| line[frame].as_u64()).collect();
            frames.sort_unstable();
            frames
        };
        let events = frames("event", "frame");
        assert_eq!(frames("contact_end", "event_frame"), events, "{speed} mm/s");
        assert!(events.len() >= least, "{speed} mm/s: {events:?}");
    }
}

#[test]
fn a_cut_off_event_has_a_bound_and_says_why() {
    let folder = Folder::new("cut-off");
    let lines = output(&["run", "scene:Saw3@50", "--json", "--config", &published(&folder)]);
    let speed = r#""speed":null,"speed_at_most":{"mm_s":"#;
    assert!(lines[0].contains(speed) && lines[0].contains(r#""why":{"speed":"cut off: "#), "{}", lines[0]);
}

#[test]
fn a_stream_that_ends_inside_an_event_says_how_far_it_got() {
    let lines = output(&["run", "scene:Saw3@150", "--json", "--samples", "--frames", "80"]);
    let end = concat!(
        r#"{"kind":"end","frames":80,"dropped":0,"baseline":"complete","incomplete":{"frame":35,"frames":45},"#,
        r#""time_ns":2633333333,"clock":"frames"}"#
    );
    assert_eq!(lines, [end]);
}

#[test]
fn a_source_error_is_told_even_if_nobody_reads_the_output() {
    let mut child = start(&["run", "-", "--json"]);
    drop(child.stdout.take());
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&[GRAY, b"FRAME\nshort"].concat()).unwrap();
    drop(stdin);
    says(&child.wait_with_output().unwrap(), 1, &["truncated"]);
}

#[test]
fn a_budget_chooses_a_configuration_that_runs() {
    let folder = Folder::new("budget");
    let path = folder.0.to_str().unwrap();
    let told = output(&["trade", "--budget", "M4F<90k,flash<128K", "-o", path]).join("\n");
    assert_has(&told, &["specimen", "% right, 95 % interval", "WSTAC_CONFIG=\"$OLDPWD/wstac.toml\"", "wstac run"]);
    let [config, model] = ["wstac.toml", "model.wsm"].map(|name| folder.path(name));
    let lines = output(&["run", "scene:Saw3@150", "--json", "--config", &config, "--model", &model]);
    assert!(lines.iter().any(|line| line.contains(r#""texture":{"specimen":"#)), "{lines:?}");
    // The second time there is a file to overwrite.
    let again = |more: &[&str]| {
        run(&[&["trade", "--budget", "ram<16K,model=none", "--by", "direction", "-o", path], more].concat())
    };
    says(&again(&[]), 1, &["wstac.toml: exists already"]);
    says(&again(&["--force"]), 0, &[]);
    // A choice without a model removes the model of an earlier one.
    assert!(!folder.0.join("model.wsm").exists());
    assert!(std::fs::read_to_string(folder.0.join("build.txt")).unwrap().contains("WSTAC_PIXELS="));
}

#[test]
fn the_budgets_of_the_help_choose_something() {
    let help = output(&["trade", "--help"]).join("\n");
    let mut budgets = 0;
    for example in help.split("--budget '").skip(1) {
        let (budget, rest) = example.split_once('\'').unwrap();
        let rest = rest.lines().next().unwrap();
        let by = rest.split_once("--by ").map_or("specimen", |(_, by)| by.split([' ', '`']).next().unwrap());
        let said = output(&["trade", "--budget", budget, "--by", by]).join("\n");
        let expected = if by == "specimen" { "% right" } else { "wrong or missing" };
        assert!(said.contains(expected), "{budget} gave {said}");
        budgets += 1;
    }
    assert!(budgets >= 3, "{budgets} examples");
}

#[test]
fn a_build_is_for_the_core_that_was_asked_about() {
    let folder = Folder::new("core");
    let path = folder.0.to_str().unwrap();
    for (arguments, has, lacks) in [
        (&["M0<200k,M3<100k"][..], &["--target thumbv6m-none-eabi)", "--target thumbv7m-none-eabi)"][..], "h743"),
        (&["flash<64K,format=GREY", "--core", "M7"], &["--bin h743)"], "emulated"),
        (&["M7<60k,format=BAYER8"], &["--target thumbv7em-none-eabihf)", "Another board"], "h743"),
        (&["format=GREY"], &["--target thumbv7em-none-eabihf)"], "h743"),
    ] {
        output(&[&["trade", "-o", path, "--force", "--budget"], arguments].concat());
        let build = std::fs::read_to_string(folder.0.join("build.txt")).unwrap();
        assert!(has.iter().all(|part| build.contains(part)) && !build.contains(lacks), "{arguments:?} gave {build}");
    }
}

#[test]
fn a_model_without_a_price_keeps_what_is_known() {
    let folder = Folder::new("own");
    let [map, model] = ["map.csv", "own.wsm"].map(|name| folder.path(name));
    std::fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/models/tradeoff/svm-20f.wsm"), &model).unwrap();
    let kept = include_str!("../../wstac-tradeoff/data/map.csv").lines();
    let own = kept.filter(|line| !line.contains("builtin:") || line.contains("builtin:svm-20f,"));
    std::fs::write(&map, own.map(|line| line.replace("builtin:svm-20f", &model) + "\n").collect::<String>()).unwrap();
    folder.file("base.toml", "");
    let says = "own.wsm has no price on boards: ci/measure prices --keep ";
    let table = output(&["trade", "--map", &map]).join("\n");
    // Of a frame, the price is known without the model.
    let mut own = table.lines().filter(|line| line.starts_with('|') && line.contains("own.wsm"));
    let is_partly_known = |line: &str| line.ends_with(" | – | – | – |") && !line.ends_with("| – | – | – | – |");
    assert!(table.contains(says) && own.any(is_partly_known), "{table}");
    let chosen = output(&["trade", "--map", &map, "--budget", "M4F<60k"]).join("\n");
    assert!(chosen.contains(says) && chosen.contains(" instructions per frame, – per event"), "{chosen}");
    assert!(!chosen.contains("– instructions per frame"), "{chosen}");
    refused(&["trade", "--map", &map, "--budget", "flash<64K"], &["bytes of flash not known"]);
}

#[test]
fn a_maps_own_configuration_and_models_are_chosen() {
    let folder = Folder::new("map");
    let [map, chosen] = ["map.csv", "chosen"].map(|name| folder.path(name));
    std::fs::write(&map, include_str!("../../wstac-tradeoff/data/map.csv")).unwrap();
    let arguments = ["trade", "--budget", "M4F<60k", "--map", &map, "-o", &chosen];
    refused(&arguments, &["base.toml"]);
    folder.file("base.toml", "[features]\nfloor_levels = 3.5\n");
    output(&arguments);
    let config = std::fs::read_to_string(folder.0.join("chosen/wstac.toml")).unwrap();
    assert!(config.contains("floor_levels = 3.5") && config.contains("stride = "), "{config}");
}

#[test]
fn a_budget_that_cannot_be_read_or_met_says_so() {
    for (budget, code, parts) in [
        ("M5<3", 2, ["term \"M5<3\"", "expected M0, M3"]),
        ("M4F<10", 1, ["the nearest is", "expected M4F<10"]),
        ("model=nosuch", 2, ["\"nosuch\"", "expected one of none, path-svm"]),
        ("model=none", 1, ["tells what --by is about", "--by speed"]),
    ] {
        ends(&["trade", "--budget", budget], code, &parts);
    }
}

#[test]
fn figures_are_svg_and_other_names_say_what_converts_them() {
    let folder = Folder::new("figures");
    for arguments in [&["plot", "scene:Saw3@150"][..], &["trade", "--map", "kept"]] {
        let path = folder.path(&format!("{}.svg", arguments[0]));
        output(&[arguments, &["-o", &path]].concat());
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("<svg ") && text.len() > 5000, "{path}: {} bytes", text.len());
    }
    for arguments in [
        &["plot", "scene:Saw3@150", "-o"][..],
        &["trade", "--map", "kept", "-o"],
        &["train", "-o", "a.wsm", "--confusion"],
    ] {
        for (name, help) in [("a.png", "-f png"), ("a.PDF", "-f pdf")] {
            let path = folder.path(name);
            ends(
                &[arguments, &[&path]].concat(),
                2,
                &[&path, "expected .svg); help: write an SVG, then rsvg-convert", help],
            );
        }
    }
    ends(&["plot", "scene:Saw3@150", "-o", "-"], 2, &["figures are files"]);
    assert_eq!(folder.names(), ["plot.svg", "trade.svg"]);
}

#[test]
fn several_sensors_give_what_each_gives_alone_under_its_name() {
    let scenes = [("left", "scene:Saw3@150,90deg"), ("right", "scene:Fla0@120")];
    let sources = scenes.map(|(name, scene)| format!("cam:{name}={scene}"));
    let both = output(&["run", &sources[0], &sources[1], "--json", "--features"]);
    for (name, scene) in scenes {
        let start = format!(r#"{{"sensor":"{name}","#);
        let of_it: Vec<String> =
            both.iter().filter_map(|line| Some(format!("{{{}", line.strip_prefix(&start)?))).collect();
        assert_eq!(of_it, output(&["run", scene, "--json", "--features"]), "{name}");
    }
    let text = output(&["run", &sources[0], &sources[1]]);
    assert!(text.iter().any(|line| line.starts_with("left: event at frame")), "{text:?}");
    assert_eq!(text.iter().filter(|line| line.contains(": end after ")).count(), 2);
}

#[test]
fn a_sensor_that_fails_leaves_the_others_to_their_ends() {
    let folder = Folder::new("sensor-fails");
    let broken = folder.written("broken.y4m", [GRAY, b"FRAME\nshort"].concat());
    let run = |sources: &[&str]| run(["run", "--json"].iter().chain(sources));
    let broken = format!("cam:broken={broken}");
    let both = run(&[&broken, "cam:sound=scene:Saw3@150"]);
    says(&both, 1, &["wstac: broken: ", "truncated", "1 of 2 sensors"]);
    let ends = [("broken", 0), ("sound", 140)]
        .map(|(name, frames)| format!(r#"{{"sensor":"{name}","kind":"end","frames":{frames}"#));
    assert_has(&String::from_utf8_lossy(&both.stdout), &ends.each_ref().map(String::as_str));
    // Nothing starts before all sources are open.
    let none = run(&["cam:there=scene:Saw3@150", "cam:gone=nothing"]);
    assert_eq!((none.status.code(), none.stdout.len()), (Some(1), 0));
    for arguments in [
        &["cam:a=scene:Saw3@150", "scene:Saw3@150"][..],
        &["cam:a b=scene:Saw3@150"],
        &["cam:a=scene:Saw3@150", "cam:b=scene:Saw3@150", "--save-raw", "never-made"],
    ] {
        let refused = run(arguments);
        assert_eq!((refused.status.code(), refused.stdout.len()), (Some(2), 0), "{arguments:?}");
    }
}

#[test]
fn a_run_without_an_event_says_why() {
    let folder = Folder::new("no-event");
    for (level, count, says) in [
        (0, 2, "no event: the source ended before the baseline was complete"),
        (0, 60, "no event: every taxel stayed dark; check the light, the exposure and [layout]"),
        (255, 60, "no event: a taxel was saturated all the time; shorten the exposure"),
        (51, 60, "no event: no touch was seen; the brightest taxel reached 20 % of full scale"),
    ] {
        ends(&["run", &folder.written("a.y4m", [GRAY, &frames(level, count)].concat())], 0, &[says]);
    }
    assert!(!said(&run(&["run", "scene:Saw3@150"])).contains("no event"));
    // A touch was seen, and its sample did not fit.
    let done = run(&["run", "scene:Saw3@150", "--frames", "60"]);
    assert_has(&printed(&done), &["was incomplete: 25 of 70 frames"]);
    assert!(!said(&done).contains("no event"), "{}", said(&done));
}
