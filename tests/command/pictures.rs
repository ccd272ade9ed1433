//! Tests that a folder of JPEG pictures gives what the camera's own recording of them gives.

use std::fs;

use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_tests::command::{good, refused};
use wstac_tests::folder::Folder;

/// Returns the lines of features and events, without their times.
fn records(source: &str) -> Vec<String> {
    let text = good(&["run", source, "--json", "--features", "--readout", "0"]);
    let lines = text.lines().filter(|line| line.contains(r#""kind":"features""#) || line.contains(r#""kind":"event""#));
    let records: Vec<_> = lines.map(str::to_owned).collect();
    assert!(records.len() > 100 && records.iter().any(|line| line.contains(r#""contact":"slide""#)), "{text}");
    records
}

#[test]
fn a_folder_of_jpegs_is_read_as_motion_jpeg_is() {
    let folder = Folder::new("pictures-jpeg");
    let text = "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [200, 200]\nformat = \"MJPG\"\n";
    let scene = folder.scene("scene.toml", text);
    let recording = folder.0.join("a.mcap");
    good(&["record", &scene, "-o", recording.to_str().unwrap()]);
    let pictures = folder.0.join("pictures");
    fs::create_dir(&pictures).unwrap();
    let mut source = McapSource::open(&recording, None).unwrap();
    let mut count = 0;
    while let SourceEvent::Frame(Frame { encoded, .. }) = source.next_event().unwrap() {
        fs::write(pictures.join(format!("frame{count}.jpg")), encoded.unwrap()).unwrap();
        count += 1;
    }
    assert!(count > 100, "{count}");
    let expected = records(recording.to_str().unwrap());
    let name = pictures.to_str().unwrap();
    assert_eq!(records(name), expected);
    // A recording of the folder has the pictures as they are.
    let again = folder.0.join("b.mcap");
    good(&["record", name, "-o", again.to_str().unwrap()]);
    assert_eq!(records(again.to_str().unwrap()), expected);
    assert!(fs::metadata(&again).unwrap().len() < 2 * fs::metadata(&recording).unwrap().len());
    // A PNG among them is not left out silently.
    fs::write(pictures.join("frame7.png"), "").unwrap();
    refused(&["run", name], &[&format!("has 1 PNG file and {count} JPEG files, expected pictures of one kind")]);
}
