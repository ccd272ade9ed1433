//! Tests what `wstac serve` refuses before it opens its address: folders and files that it could not write.

use std::fs;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;

use wstac_tests::command::{good, refusal, run, said, start};
use wstac_tests::folder::Folder;

const SCENE: &str = "scene:Saw3@150";

fn serve(options: &[&str]) -> String {
    refusal(&[&["serve", SCENE, "--listen", "127.0.0.1:0"], options].concat())
}

#[test]
fn recordings_need_a_folder() {
    let folder = Folder::new("serve-folder");
    let missing = folder.0.join("missing");
    let message = serve(&["--record-to", missing.to_str().unwrap()]);
    assert!(message.contains("missing: does not exist, expected a folder"), "{message}");
    let file = folder.0.join("a.mcap");
    fs::write(&file, "").unwrap();
    let message = serve(&["--record-to", file.to_str().unwrap()]);
    assert!(message.contains("a.mcap: is no folder, expected a folder"), "{message}");
}

#[test]
fn an_address_that_is_none_or_taken_names_the_option() {
    for given in ["8026", "localhost:8026"] {
        let done = run(&["serve", SCENE, "--listen", given]);
        assert_eq!(done.status.code(), Some(2));
        let expected = "expected an address and a port, such as 127.0.0.1:8025";
        assert!(said(&done).contains("--listen") && said(&done).contains(expected), "{}", said(&done));
    }
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap();
    let message = refusal(&["serve", SCENE, "--listen", &taken.to_string()]);
    assert!(message.contains(&format!("--listen {taken}: is taken")), "{message}");
    drop(holder);
}

/// A page takes as many sensors as a recording: a hand has twenty.
#[test]
fn a_page_takes_twenty_sensors() {
    let refused = |count: usize| {
        let sources: Vec<String> = (0..count).map(|number| format!("cam:s{number}={SCENE}")).collect();
        let options = ["--listen", "127.0.0.1:0", "--record-to", "missing"];
        let arguments: Vec<&str> =
            [&["serve"], &*sources.iter().map(String::as_str).collect::<Vec<_>>(), &options].concat();
        refusal(&arguments)
    };
    let message = refused(21);
    assert!(message.contains("found 21 sources, expected at most 20"), "{message}");
    let message = refused(20);
    assert!(message.contains("missing: does not exist"), "{message}");
}

#[test]
fn a_calibration_goes_to_a_new_file() {
    let folder = Folder::new("serve-file");
    let path = |name: &str| folder.path(name);
    fs::write(path("my.toml"), "").unwrap();
    let message = serve(&["--calibrate-to", &path("my.toml")]);
    assert!(message.contains("my.toml: exists already, expected a new file"), "{message}");
    let message = serve(&["--calibrate-to", &path("missing/my.toml")]);
    assert!(message.contains("is in a folder that does not exist"), "{message}");
    let message = serve(&["--calibrate-to", &path("my.mcap")]);
    assert!(message.contains("its name ends in .mcap, expected .toml"), "{message}");
    // Each of several sensors has a file of its own.
    fs::write(path("two-right.toml"), "").unwrap();
    let (left, right) = (format!("cam:left={SCENE}"), format!("cam:right={SCENE}"));
    let message = refusal(&["serve", &left, &right, "--listen", "127.0.0.1:0", "--calibrate-to", &path("two.toml")]);
    assert!(message.contains("two-right.toml: exists already"), "{message}");
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 2, "nothing was written");
}

#[test]
fn all_sensors_of_a_recording_are_shown() {
    let folder = Folder::new("serve-both");
    let both = &*folder.path("both.mcap");
    let sources = ["left=scene:Saw3@150", "right=scene:Tri3@120"];
    good(&[&["record"], &sources[..], &["--features-only", "-o", both]].concat());
    let message = refusal(&["serve", &format!("middle={both}"), "--listen", "127.0.0.1:0"]);
    assert!(message.contains("the recording has no sensor middle, expected one of left, right before ="), "{message}");
    for (source, expected) in [(both.to_owned(), &["left", "right"][..]), (format!("right={both}"), &["right"])] {
        let mut server = start(&["serve", &source, "--listen", "127.0.0.1:0"]);
        let lines = BufReader::new(server.stderr.take().unwrap()).lines().map(Result::unwrap);
        // The address, then a note for each sensor.
        let notes: Vec<String> = lines.skip(1).take(expected.len()).collect();
        server.kill().unwrap();
        server.wait().unwrap();
        for (note, name) in notes.iter().zip(expected) {
            assert!(note.starts_with(&format!("wstac: {name}: {both}: sensor {name}, recorded from")), "{note}");
        }
        assert_eq!(notes.len(), expected.len());
    }
}
