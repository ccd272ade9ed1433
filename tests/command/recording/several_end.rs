//! Tests where a recording of several sensors ends: the same sources make the same file every time.

use std::fs;
use std::process::Output;

use wstac_tests::command::{good, records, run, said, says};
use wstac_tests::folder::{Folder, SMALL};

/// Records these sources several times. Returns how the last recording ended, and its frames by sensor.
fn same_every_time(folder: &Folder, sources: &[&str], options: &[&str]) -> (Output, Vec<u64>) {
    let name = &*folder.path("a.mcap");
    let record = || {
        let done = run(&[&["record", "-o", name, "--force", "--json"], sources, options].concat());
        (fs::read(name).unwrap(), done)
    };
    let (bytes, first) = record();
    for time in 0..3 {
        let (again, done) = record();
        assert_eq!((done.status.code(), &done.stdout), (first.status.code(), &first.stdout), "{time}");
        assert!(again == bytes, "recording {time} is another file: {}", said(&done));
    }
    let mut ends = records(&["run", name, "--json"]);
    ends.retain(|record| record["kind"] == "end");
    ends.sort_by_key(|end| end["sensor"].as_str().unwrap().to_owned());
    (first, ends.iter().map(|end| end["frames"].as_u64().unwrap()).collect())
}

/// Returns three sensors of which the second has the fastest slide.
fn scenes(folder: &Folder) -> Vec<String> {
    let sensor = |(name, speed, fps)| {
        let text = format!("specimen = \"Saw3\"\nspeed = {speed}\n[sensor]\nsize = [40, 40]\nfps = {fps}\n");
        format!("cam:{name}={}", folder.scene(&format!("{name}.toml"), text))
    };
    [("a", 100, 30), ("b", 200, 30), ("c", 150, 25)].map(sensor).to_vec()
}

#[test]
fn events_of_all_sensors_end_a_recording_at_the_same_place() {
    let folder = Folder::new("recording-several-events");
    let scenes = scenes(&folder);
    let sources: Vec<&str> = scenes.iter().map(String::as_str).collect();
    for events in ["1", "2", "3"] {
        let (done, frames) = same_every_time(&folder, &sources, &["--events", events]);
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
        let found = String::from_utf8_lossy(&done.stdout).matches(r#""kind":"event""#).count();
        assert_eq!(found.to_string(), events, "{}", said(&done));
        // The sensors end at one time.
        let seconds = [frames[0] as f64 / 30.0, frames[1] as f64 / 30.0, frames[2] as f64 / 25.0];
        assert!(seconds.iter().all(|time| (time - seconds[0]).abs() < 0.05), "{frames:?}");
    }
}

#[test]
fn a_source_that_fails_ends_a_recording_at_the_same_place() {
    let folder = Folder::new("recording-several-fails");
    let scenes = scenes(&folder);
    let broken = &folder.path("broken.y4m");
    good(&["scene", "render", &folder.written("d.toml", SMALL), "-o", broken]);
    let mut bytes = fs::read(broken).unwrap();
    // The header of the 51st frame is damaged.
    let header = bytes.windows(6).enumerate().filter(|(_, window)| *window == b"FRAME\n").nth(50).unwrap().0;
    bytes[header..header + 5].copy_from_slice(b"OTHER");
    fs::write(broken, bytes).unwrap();
    let failing = format!("cam:d={broken}");
    let sources: Vec<&str> = scenes.iter().chain([&failing]).map(String::as_str).collect();
    let (done, frames) = same_every_time(&folder, &sources, &[]);
    says(&done, 1, &["broken.y4m"]);
    // Frame 50 of 30 per second was the last: the others have those up to 1.6333 s, each from 0 on.
    assert_eq!(frames, [50, 50, 41, 50]);
}

/// Sensors wait for each other's turns, but a fast one does not fill a queue that the others have to pass.
#[test]
fn sensors_of_very_different_rates_are_recorded() {
    let folder = Folder::new("recording-several-rates-apart");
    let sensor = |(name, fps): (&str, &str)| {
        let text = format!("specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [24, 24]\nfps = {fps}\n");
        format!("cam:{name}={}", folder.scene(&format!("{name}.toml"), text))
    };
    let sources = [("fast", "1000"), ("slow", "1")].map(sensor);
    let name = &*folder.path("a.mcap");
    let done = run(&["record", &sources[0], &sources[1], "-o", name, "--features-only", "--frames", "2000"]);
    says(&done, 0, &["a.mcap: 2117 frames, 2 events"]);
    good(&["run", name]);
}

#[test]
fn too_many_sensors_are_refused_before_one_is_opened() {
    let folder = Folder::new("recording-several-many");
    let file = folder.path("a.mcap");
    let sources: Vec<String> = (0..21).map(|number| format!("cam:s{number}=none-{number}.y4m")).collect();
    let mut arguments = vec!["record", "-o", &file];
    arguments.extend(sources.iter().map(String::as_str));
    let said_so = says(&run(&arguments), 2, &[]);
    assert_eq!(said_so, "wstac: sources: are 21, expected 1 to 20 sensors in a recording\n");
    // With one less, the files matter.
    arguments.pop();
    assert!(said(&run(&arguments)).contains("none-0.y4m"));
}
