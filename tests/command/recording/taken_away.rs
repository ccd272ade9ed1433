//! Tests that a recording whose file is removed, moved or replaced while it runs is never said to be saved.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, ChildStdin, Stdio};

use wstac_tests::command::{Signal, prints, program, send, wstac};
use wstac_tests::folder::Folder;

use super::{has_frames, piped_to};

const FRAMES: usize = 20;

/// Starts a recording of standard input that goes on, and whose messages are kept in a file.
fn started(folder: &Folder, options: &[&str], file: &Path) -> (Child, ChildStdin) {
    let (mut child, stdin) = {
        let mut command = program("sh");
        // `piped_to` closes standard error.
        let script = format!("exec \"$0\" record \"$@\" 2> {}", folder.0.join("said").display());
        command.args(["-c", &script]).arg(wstac()).args(options).stdin(Stdio::piped());
        piped_to(command, file, FRAMES, |bytes| has_frames(bytes, FRAMES))
    };
    assert!(child.try_wait().unwrap().is_none());
    (child, stdin)
}

/// Ends the recording, which must fail, and returns what it has said.
fn ended(folder: &Folder, mut child: Child) -> String {
    send(&child, Signal::INT);
    let code = child.wait().unwrap().code();
    let mut said = String::new();
    fs::File::open(folder.0.join("said")).unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(code, Some(1), "{said}");
    assert!(!said.contains(" frames, ") && !said.contains("has what was recorded"), "{said}");
    said
}

#[test]
fn a_recording_that_is_taken_away_is_not_said_to_be_saved() {
    for is_several in [false, true] {
        let folder = Folder::new(if is_several { "recording-taken-several" } else { "recording-taken" });
        let inner = folder.0.join("inner");
        let (file, other) = (inner.join("a.mcap"), folder.0.join("b.mcap"));
        fs::create_dir(&inner).unwrap();
        let name = file.to_str().unwrap();
        let source = if is_several { "cam:a=-" } else { "-" };
        let start = || started(&folder, &[source, "-o", name], &file);

        let (child, _open) = start();
        fs::remove_file(&file).unwrap();
        let said = ended(&folder, child);
        assert!(said.contains("a.mcap: was removed while it was recorded: the recording is lost\n"), "{said}");

        let (child, _open) = start();
        fs::write(&other, "another").unwrap();
        fs::rename(&other, &file).unwrap();
        let said = ended(&folder, child);
        assert!(said.contains("the recording is lost; another file has its name now"), "{said}");
        assert_eq!(fs::read(&file).unwrap(), b"another");
        fs::remove_file(&file).unwrap();

        // Whoever moves it still has it, whole.
        let (child, _open) = start();
        fs::rename(&file, &other).unwrap();
        let said = ended(&folder, child);
        assert!(said.contains("was moved while it was recorded: the recording is in ") && said.contains("/b.mcap"));
        prints(&["run", other.to_str().unwrap(), "--json"], &[&format!(r#""frames":{FRAMES},"#)]);

        let (child, _open) = start();
        fs::remove_dir_all(&inner).unwrap();
        let said = ended(&folder, child);
        assert!(said.contains("was removed while it was recorded"), "{said}");
    }
}

/// A new recording in place of an old one has another name until it is whole.
#[test]
fn a_replacement_that_is_taken_away_replaces_nothing() {
    let folder = Folder::new("recording-taken-force");
    let inner = folder.0.join("inner");
    fs::create_dir(&inner).unwrap();
    let [file, beside] = ["a.mcap", "a.mcap.new"].map(|name| inner.join(name));
    fs::write(&file, "old").unwrap();
    let start = || started(&folder, &["-", "--force", "-o", file.to_str().unwrap()], &beside);

    let (child, _open) = start();
    fs::remove_file(&beside).unwrap();
    fs::write(&beside, "another").unwrap();
    let said = ended(&folder, child);
    assert!(said.contains("a.mcap.new: was removed") && said.contains("a.mcap is as it was"), "{said}");
    assert_eq!(fs::read(&file).unwrap(), b"old");
    fs::remove_file(&beside).unwrap();

    let (child, _open) = start();
    fs::remove_dir_all(&inner).unwrap();
    let said = ended(&folder, child);
    assert!(said.contains("was removed while") && !said.contains("as it was"), "{said}");
}
