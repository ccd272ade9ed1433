//! Tests that a command that takes its time says so at once, and at its end, also where nobody watches a terminal.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::time::Duration;

use wstac_tests::command::{good, program, start, wstac};
use wstac_tests::folder::Folder;

/// Processor time for the first line. A program of the tests is slower than what people get.
const FIRST: Duration = Duration::from_secs(2);

/// Returns the processor time that a process has taken so far; what others take does not count.
fn processor_time(child: &Child) -> Duration {
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap();
    // Behind the name, which may have spaces: the state, and the 12th and 13th field after it, in hundredths of a
    // second.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    Duration::from_millis(fields[11..=12].iter().map(|field| 10 * field.parse::<u64>().unwrap()).sum())
}

#[test]
fn long_commands_say_something_in_their_first_second() {
    let folder = Folder::new("progress");
    for (arguments, expected) in [
        (&["dataset", "-o", "a.npz"][..], "0 of 12000 slides done"),
        (&["train", "-o", "a.wsm"], "0 of 12000 slides done"),
        (&["trade", "-o", "found"], "touches of 20 sensors"),
        (&["scene", "explain", "scene:Saw3@150"], "measuring what effects cost: about "),
        (&["doctor", "scene:Saw3@150"], "scene: Saw3 at 150 mm/s"),
        (&["plot", "scene:Saw3@150", "-o", "a.svg"], "scene: Saw3 at 150 mm/s"),
    ] {
        let mut command = program(wstac());
        command.args(arguments).current_dir(&folder.0).stdin(Stdio::null());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let line = BufReader::new(child.stderr.take().unwrap()).lines().next().unwrap().unwrap();
        assert!(processor_time(&child) < FIRST, "{arguments:?}: {:?}", processor_time(&child));
        assert!(line.contains(expected), "{arguments:?}: {line}");
        child.kill().unwrap();
        child.wait().unwrap();
    }
    // The events of a demo come one by one.
    let mut child = start(&["demo"]);
    assert!(BufReader::new(child.stdout.take().unwrap()).lines().next().unwrap().unwrap().contains("truth"));
    assert!(processor_time(&child) < FIRST);
    child.kill().unwrap();
    child.wait().unwrap();
}

/// No effect makes a frame faster, whatever this machine measures.
#[test]
fn costs_of_a_scene_are_never_negative() {
    let folder = Folder::new("progress-costs");
    let text = "specimen = \"Saw3\"\nspeed = 600\nfidelity = \"taxel\"\nlead_in = 1\n";
    let scene = folder.file("scene.toml", text);
    let text = good(&["scene", "explain", scene.to_str().unwrap()]);
    let (_, modeled) = text.split_once("Modeled:").unwrap();
    let (costs, _) = modeled.split_once("Not in this scene").unwrap();
    assert!(costs.contains("the whole") && costs.contains("ns per frame") && costs.lines().count() > 5, "{text}");
    let words = costs.split_whitespace().filter(|word| word.parse::<f64>().is_ok_and(|number| number < 0.0));
    assert_eq!(words.collect::<Vec<_>>(), [""; 0], "{text}");
}
