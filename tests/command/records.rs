//! Tests the records of `wstac run` in all forms: text, JSON Lines and CSV, to a file, in part, and without notes.

use std::fs;
use std::io::{BufRead, BufReader, Write};

use serde_json::{Map, Value};

use wstac_tests::command::{Signal, ends, event, good, program, refused, run, said, says, send, start};
use wstac_tests::folder::{self, Folder, GRAY, frames};

/// Prints the rows of a table as JSON Lines, as Python's own reader sees them.
const READER: &str = "\
import csv, json, sys
for row in csv.DictReader(open(sys.argv[1], newline=''), strict=True):
    assert None not in row and None not in row.values(), row
    print(json.dumps(row))
";

/// A slide in small pictures.
const SMALL: [&str; 3] = ["scene:Saw3@150", "--size", "40x40"];

/// Returns the rows of a table.
fn rows(table: &str) -> Vec<Map<String, Value>> {
    let folder = Folder::new("records-rows");
    let path = folder.file("table.csv", table);
    let done = program("python3").args(["-c", READER]).arg(path).output().unwrap();
    assert!(done.status.success(), "{}", said(&done));
    objects(&String::from_utf8(done.stdout).unwrap())
}

fn objects(lines: &str) -> Vec<Map<String, Value>> {
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Returns the fields of an object as cells, with the names of nested ones joined, and features by their own names.
fn cells(object: &Map<String, Value>) -> Map<String, Value> {
    fn add(name: &str, value: &Value, cells: &mut Map<String, Value>) {
        match value {
            Value::Null => {}
            Value::Object(fields) => {
                fields.iter().for_each(|(field, value)| add(&format!("{name}_{field}"), value, cells));
            }
            Value::Array(features) => {
                let names = ["r1", "r2", "r3", "r4", "r5", "c1", "c2", "c3", "c4", "c5"];
                assert_eq!(features.len(), names.len());
                names.iter().zip(features).for_each(|(name, value)| add(name, value, cells));
            }
            Value::String(text) => drop(cells.insert(name.to_owned(), text.clone().into())),
            other => drop(cells.insert(name.to_owned(), other.to_string().into())),
        }
    }
    let mut cells = Map::new();
    object.iter().filter(|(name, _)| *name != "kind").for_each(|(name, value)| add(name, value, &mut cells));
    cells
}

/// A scene of three slides, the second without an edge across itself, with lost frames.
const SCENE: &str = "\
seed = 5
[[slide]]
specimen = \"Saw3\"
speed = 150
[[slide]]
specimen = \"Sin2\"
speed = 90
direction = 30
[[slide]]
specimen = \"Tri4\"
speed = 900
[sensor]
size = [60, 60]
dropped = 0.01
";

/// Returns a scene, a recording of it, and a configuration with the published law.
fn recorded(folder: &Folder) -> [String; 3] {
    let names = [folder.scene("scene.toml", SCENE), folder.path("a.mcap"), folder.path("published.toml")];
    good(&["record", &names[0], "-o", &names[1]]);
    folder.file("published.toml", "[speed]\nlaw = \"published\"\n");
    names
}

/// Every cell of a table is the number or the text of JSON, and JSON has no other field, whatever the source is.
#[test]
fn tables_have_what_json_has() {
    let folder = Folder::new("records-tables");
    let [scene, recording, published] = recorded(&folder);
    let named = format!("cam:left={scene}");
    let mut found = Vec::new();
    for (arguments, kind) in [
        (&[&*scene][..], "event"),
        (&[&recording, "--model", "builtin:path-svm"], "event"),
        (&[&scene, "--model", "builtin:svm"], "event"),
        (&[&scene, "--config", &published, "--model", "builtin:forest"], "event"),
        (&[&named, "cam:right=scene:Saw2@120,60mm"], "event"),
        (&[&scene, "--features"], "features"),
        (&[&recording, "--motion"], "motion"),
        (&[&named, "--motion"], "motion"),
    ] {
        let table = good(&[&["run"], arguments, &["--output-format", "csv"]].concat());
        let mut rows = rows(&table);
        let mut lines = objects(&good(&[&["run"], arguments, &["--json"]].concat()));
        lines.retain(|line| line["kind"] == kind);
        let sensor =
            |object: &Map<String, Value>| object.get("sensor").map_or("", |name| name.as_str().unwrap()).to_owned();
        // Sensors take turns as their threads do.
        lines.sort_by_key(&sensor);
        rows.sort_by_key(&sensor);
        assert_eq!(rows.len(), lines.len(), "{arguments:?}: {table}");
        assert!(rows.len() >= 2, "{arguments:?}: {table}");
        assert_eq!(table.lines().count(), rows.len() + 1);
        for (row, line) in rows.iter().zip(&lines) {
            let mut cells = cells(line);
            let filled: Map<String, Value> =
                row.clone().into_iter().filter(|(_, cell)| !cell.as_str().unwrap().is_empty()).collect();
            if !cells.contains_key("time_s") {
                let nanoseconds: f64 = cells["time_ns"].as_str().unwrap().parse().unwrap();
                let seconds: f64 = row["time_s"].as_str().unwrap().parse().unwrap();
                assert!((seconds - nanoseconds / 1e9).abs() < 6e-5, "{seconds} {nanoseconds}");
                cells.insert("time_s".to_owned(), row["time_s"].clone());
            }
            found.extend(cells.keys().cloned());
            assert_eq!(filled, cells, "{arguments:?}");
        }
    }
    // Every column was seen, except those that no scene has.
    found.sort();
    found.dedup();
    for name in "sensor r1 c5 speed_sd direction_confidence texture_specimen why_texture why_speed".split(' ') {
        assert!(found.iter().any(|found| found == name), "{name}: {found:?}");
    }
}

#[test]
fn a_table_without_rows_has_its_names() {
    let csv = ["--size", "40x40", "--frames", "40", "--output-format", "csv"];
    let table = good(&[&["run", "scene:Saw3@150"], &csv[..]].concat());
    assert!(table.starts_with("frame,frames,time_ns,time_s,") && table.lines().count() == 1, "{table}");
    // Of several sensors, once.
    let table = good(&[&["run", "cam:a=scene:Saw3@150", "cam:b=scene:Saw3@150"], &csv[..]].concat());
    assert!(table.starts_with("sensor,frame,") && table.lines().count() == 1, "{table}");
}

#[test]
fn a_name_says_the_form_and_files_have_what_standard_output_has() {
    let folder = Folder::new("records-files");
    for (name, stated, printed) in [
        ("a.jsonl", &[][..], &["--json"][..]),
        ("a.ndjson", &[], &["--json"]),
        ("a.CSV", &[], &["--output-format", "csv"]),
        ("a.txt", &[], &[]),
        ("a.log", &["--output-format", "text"], &[]),
        ("records", &["--json"], &["--json"]),
    ] {
        let path = folder.path(name);
        let arguments = ["run", SMALL[0], SMALL[1], SMALL[2], "-o", &path];
        let done = run(&[&arguments[..], stated].concat());
        says(&done, 0, &[&format!("{name}: "), " record"]);
        assert!(done.stdout.is_empty(), "{name}");
        let expected = good(&[&["run"], &SMALL[..], printed].concat());
        assert_eq!(fs::read_to_string(&path).unwrap(), expected, "{name}");
        good(&[&arguments[..], stated, &["--force"]].concat());
        assert_eq!(fs::read_to_string(&path).unwrap(), expected);
    }
    assert_eq!(good(&[&["run", "-o", "-"], &SMALL[..]].concat()), good(&[&["run"], &SMALL[..]].concat()));
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 6);
}

#[test]
fn forms_that_contradict_each_other_are_refused() {
    for (arguments, part) in [
        ("--features --motion --output-format csv", "one kind of record, expected --features or --motion"),
        ("--samples", "--samples needs JSON"),
        ("--samples --output-format csv", "--samples needs JSON"),
        ("--json --output-format text", "cannot be used with"),
        ("--force", "--output"),
        ("--output-format xml", "text, json, csv"),
        ("--since 2 --until 2", "expected --since before --until"),
        ("--since=-1", "expected seconds"),
        ("--until nan", "expected seconds"),
    ] {
        let done = run(["run", "scene:Saw3@150"].into_iter().chain(arguments.split(' ')));
        says(&done, 2, &[part]);
        assert!(done.stdout.is_empty(), "{arguments:?}");
    }
}

/// The file has all records whether the source ends, fails or is stopped, and is not there without any.
#[test]
fn a_file_is_whole_or_not_there() {
    let folder = Folder::new("records-whole");
    let name = &*folder.path("a.jsonl");
    // No source: no file.
    refused(&["run", "none.y4m", "-o", name], &["no such file"]);
    refused(&["run", "cam:a=scene:Saw3@150", "cam:b=none.y4m", "-o", name], &["1 of 2 sensors"]);
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 0);
    // The source fails inside: its records and its end are there.
    let clip = folder.written("a.y4m", [GRAY, &frames(3, 40), b"NONSENSE\n"].concat());
    ends(&["run", &clip, "--features", "-o", name], 1, &[]);
    let lines = objects(&fs::read_to_string(name).unwrap());
    // A note about the layout comes first.
    assert_eq!(lines.len(), 42);
    assert_eq!((&lines[41]["kind"], &lines[41]["frames"]), (&"end".into(), &40.into()));
    // A signal ends it properly.
    let name = &*folder.path("a.csv");
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let mut child = start(&["run", "-", "--features", "--output-format", "csv", "-o", name, "--force"]);
        let mut stdin = child.stdin.take().unwrap();
        stdin.write_all(&[GRAY, &frames(3, 8)].concat()).unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        assert!(lines.next().unwrap().unwrap().contains("Y4M"));
        let has_all = || {
            let files = fs::read_dir(&folder.0).unwrap().map(|entry| entry.unwrap().path());
            let parts = files.filter(|file| file.extension().is_some_and(|ending| ending == "part"));
            parts.map(|part| fs::read_to_string(part).unwrap()).any(|text| text.lines().count() == 9)
        };
        // Every record is in the unfinished file at once.
        while !has_all() {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        send(&child, signal);
        assert_eq!(child.wait().unwrap().code(), Some(0));
        assert_eq!(rows(&fs::read_to_string(name).unwrap()).len(), 8);
    }
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 3);
}

#[test]
fn quiet_leaves_out_notes_and_nothing_else() {
    let arguments = ["run", SMALL[0], SMALL[1], SMALL[2], "--model", "builtin:svm"];
    let (loud, quiet) = (run(&arguments), run(&[&arguments[..], &["--quiet"]].concat()));
    assert_eq!(loud.stdout, quiet.stdout);
    assert!(!loud.stderr.is_empty() && quiet.stderr.is_empty(), "{}", said(&quiet));
    let table = run(&[&arguments[..], &["-q", "--output-format", "csv"]].concat());
    assert!(table.stderr.is_empty() && !table.stdout.is_empty(), "{}", said(&table));
    refused(&["run", "none.y4m", "-q"], &["no such file"]);
}

/// Records of a part are those of the whole whose times are in it, and reading ends soon behind it.
#[test]
fn a_part_has_the_records_of_the_whole() {
    let folder = Folder::new("records-part");
    let [scene, recording, published] = recorded(&folder);
    for (arguments, many) in [
        (&[&*scene, "--model", "builtin:svm"][..], 6),
        (&[&recording, "--features", "--motion"], 300),
        (&[&scene, "--config", &published], 3),
    ] {
        let whole = objects(&good(&[&["run"], arguments, &["--json"]].concat()));
        let (end, whole) = whole.split_last().unwrap();
        assert!(whole.len() >= many, "{} records", whole.len());
        let frames = end["frames"].as_u64().unwrap();
        let seconds = |record: &Map<String, Value>| record["time_ns"].as_u64().unwrap() as f64 / 1e9;
        let all = frames as f64 / 30.0;
        let mut bounds: Vec<f64> = (0..6).map(|part| f64::from(part) * all / 6.0).collect();
        // Just before and behind every record that is no frame's.
        let marks =
            whole.iter().filter(|record| record["kind"] != "features" && record["kind"] != "motion").map(seconds);
        bounds.extend(marks.step_by(2).flat_map(|at| [at - 0.001, at + 0.001]));
        let mut together = 0;
        for (number, &since) in bounds.iter().enumerate() {
            let until = bounds[(number * 5 + 3) % bounds.len()];
            let mut range = vec!["--since".to_owned(), since.to_string()];
            if until > since {
                range.extend(["--until".to_owned(), until.to_string()]);
            }
            let range: Vec<&str> = range.iter().map(String::as_str).collect();
            let part = objects(&good(&[&["run"], arguments, &["--json", "-q"], &range].concat()));
            let (end, part) = part.split_last().unwrap();
            let until = if until > since { until } else { f64::INFINITY };
            let expected: Vec<_> = whole.iter().filter(|record| (since..until).contains(&seconds(record))).collect();
            assert_eq!(part.iter().collect::<Vec<_>>(), expected, "{range:?}");
            together += part.len();
            // Reading ends a sample and a touch behind the part, not at the end of the source.
            let read = end["frames"].as_u64().unwrap();
            assert!(
                read <= frames && (until.is_infinite() == (read == frames) || all - until < 7.0),
                "{read} {range:?}"
            );
            if until < all - 7.0 {
                assert!(read as f64 / 30.0 < until + 7.0, "{range:?}: {read} frames");
            }
        }
        assert!(together > 0);
    }
}

#[test]
fn a_part_without_events_says_how_many_are_outside() {
    ends(&["run", "scene:Saw3@150", "--since", "3"], 0, &["1 event outside of --since and --until"]);
    // Frames behind --until are not read, so nothing is said about them.
    let done = run(&["run", "scene:Saw3@150", "--until", "0.5"]);
    assert!(!said(&done).contains("no event"), "{}", said(&done));
    let text = String::from_utf8(done.stdout).unwrap();
    assert!(text.starts_with("end after ") && text.lines().count() == 1, "{text}");
}

#[test]
fn a_json_file_is_one_array() {
    let folder = Folder::new("records-array");
    let file = folder.path("a.json");
    let lines = good(&[&["run", "--json"][..], &SMALL].concat());
    good(&[&["run", "-o", &file][..], &SMALL].concat());
    let array: Vec<Map<String, Value>> = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    assert_eq!(array, objects(&lines));
}

#[test]
fn several_files_have_their_records_in_the_order_of_their_times() {
    let folder = Folder::new("records-order");
    let [one, other] = ["one.y4m", "other.y4m"].map(|name| folder.path(name));
    good(&["scene", "render", &scene(&folder, "150"), "-o", &one]);
    good(&["scene", "render", &scene(&folder, "250"), "-o", &other]);
    let [one, other] = [format!("b={one}"), format!("a={other}")];
    let lines = good(&["run", &one, &other, "--json", "--features"]);
    let frames = objects(&lines).into_iter().filter(|line| line["kind"] == "features");
    let times: Vec<u64> = frames.map(|line| line["time_ns"].as_u64().unwrap()).collect();
    assert!(times.len() > 200 && times.is_sorted(), "{times:?}");
    assert_eq!(good(&["run", &one, &other, "--json", "--features"]), lines);
}

/// Writes the file of a scene in small pictures, and returns its name.
fn scene(folder: &Folder, speed: &str) -> String {
    folder.written("scene.toml", folder::SMALL.replace("150", speed))
}

#[test]
fn a_source_without_a_layout_says_so_at_once_and_a_scene_does_not() {
    let folder = Folder::new("records-layout");
    let (file, config) = (folder.path("a.y4m"), folder.written("a.toml", "[layout]\npreset = \"paper\"\n"));
    good(&["scene", "render", &scene(&folder, "150"), "-o", &file]);
    let done = run(["run", &file, "--json"]);
    let first = objects(&String::from_utf8_lossy(&done.stdout)).remove(0);
    assert_eq!((&first["kind"], &first["note"]), (&"note".into(), &"default-layout".into()));
    says(&done, 0, &["help: run wstac calibrate"]);
    for silent in [&["run", "--json", &file, "--config", &config][..], &[&["run", "--json"][..], &SMALL].concat()] {
        let done = run(silent);
        assert!(!String::from_utf8_lossy(&done.stdout).contains("default-layout") && !said(&done).contains("[layout]"));
    }
}

#[test]
fn the_published_law_says_that_the_rate_is_another_one() {
    let folder = Folder::new("records-rate");
    let (config, rate) = (&*folder.written("a.toml", "[speed]\nlaw = \"published\"\n"), "rate".into());
    for (fps, law, expected) in [
        ("25", &["--config", config][..], Some("25.00 times per second, and law = \"published\" counts frames at 30")),
        ("62", &["--config", config], Some("31.00 times per second")),
        ("29.97", &["--config", config], None),
        ("25", &[], None),
    ] {
        let done = run([&["run", "--json", "--fps", fps][..], &SMALL, law].concat());
        let lines = objects(&String::from_utf8_lossy(&done.stdout));
        let note =
            lines.iter().find(|line| line["kind"] == "note").map(|line| (&line["note"], line["message"].as_str()));
        let is_said = expected.is_some_and(|words| said(&done).contains(words));
        assert_eq!((note.map(|(name, _)| name), is_said), (expected.map(|_| &rate), expected.is_some()), "{fps}");
        assert!(note.is_none_or(|(_, message)| message.unwrap().contains(expected.unwrap())), "{fps}: {note:?}");
    }
}

#[test]
fn a_file_that_begins_in_a_touch_has_a_baseline_from_later() {
    let folder = Folder::new("records-baseline");
    let (whole, cut) = (folder.path("a.y4m"), folder.path("b.y4m"));
    good(&["scene", "render", &scene(&folder, "150"), "-o", &whole]);
    // Without the first 34 of its frames, the slide begins at frame 12.
    let bytes = fs::read(&whole).unwrap();
    let head = bytes.iter().position(|byte| *byte == b'\n').unwrap() + 1;
    let frame = b"FRAME\n".len() + 40 * 40;
    fs::write(&cut, [&bytes[..head], &bytes[head + 34 * frame..]].concat()).unwrap();
    let event = |arguments: &[&str]| event(&[&["run"], arguments].concat());
    let expected = event(&[&whole]);
    assert_eq!((event(&[&cut])["reliable"].as_bool(), expected["reliable"].as_bool()), (Some(false), Some(true)));
    let found = event(&[&cut, "--baseline-at", "1.8"]);
    assert_eq!((&found["reliable"], &found["contact"]), (&expected["reliable"], &expected["contact"]));
    let touch = |event: &Value| event["touch_frame"].as_u64().unwrap();
    assert_eq!(touch(&found) + 34, touch(&expected));
    let [speed, other] = [&found, &expected].map(|event| event["speed"]["mm_s"].as_f64().unwrap());
    assert!((speed / other - 1.0).abs() < 0.01, "{speed} {other}");
    refused(&["run", &cut, "--baseline-at", "60"], &["ends before the baseline from 60 s on"]);
    refused(&["run", "-", "--baseline-at", "1"], &["can be read only once"]);
}
