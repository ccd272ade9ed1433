//! Tests a guided session: a plan, keys on standard input, and one file per slide. Also makes a training set of the
//! files.

use std::fs;
use std::io::Write;
use std::process::{Output, Stdio};

use wstac_tests::command::{ends, good, prints, program, run, said, says, wstac};
use wstac_tests::folder::{Folder, text};

#[test]
fn what_the_plan_gives_is_no_label() {
    let folder = folder("recording-guide-labels");
    let plan = folder.path("plan.toml");
    let files = folder.0.join("files");
    for label in ["specimen=Fla0", "speed=100"] {
        let record = ["record", "scene:Saw3@150", "--guide", &plan, "-o", text(&files), "--label", label];
        ends(&record, 2, &["gives it; leave it out"]);
    }
    assert!(!files.exists());
}

/// Runs a session with these lines as keys. Standard input ends after them.
fn guided(folder: &Folder, keys: &str) -> Output {
    let path = |name: &str| folder.0.join(name).display().to_string();
    let scene = format!("scene:{}", path("s.toml"));
    let (plan, files) = (path("plan.toml"), path("files"));
    let mut command = program(wstac());
    command.args(["record", &scene, "--guide", &plan, "-o", &files, "--label", "person=me"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The session may end before it has read everything.
    let _ = child.stdin.take().unwrap().write_all(keys.as_bytes());
    child.wait_with_output().unwrap()
}

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    let slides = "[[slide]]\nspecimen = \"Saw3\"\nspeed = 150\n".repeat(3);
    fs::write(folder.0.join("s.toml"), format!("gap = 140\n{slides}[sensor]\nsize = [240, 180]\n")).unwrap();
    fs::write(folder.0.join("plan.toml"), "specimens = [\"Saw3\"]\nspeeds = [150]\ncount = 4\n").unwrap();
    folder
}

/// A label is what was planned, so a slide of another speed or direction is named.
#[test]
fn a_slide_that_was_not_as_planned_is_named() {
    let folder = folder("recording-guide-other");
    fs::write(folder.0.join("plan.toml"), "specimens = [\"Saw3\"]\nspeeds = [86]\ndirections = [355]\ncount = 1\n")
        .unwrap();
    let text = said(&guided(&folder, "\n"));
    assert!(text.contains("mm/s, planned 86 mm/s: the label is the planned one; r repeats the slide"), "{text}");
    assert!(!text.contains("planned 355"), "{text}");
    fs::write(folder.0.join("plan.toml"), "specimens = [\"Saw3\"]\ndirections = [340]\ncount = 1\n").unwrap();
    let text = said(&guided(&folder, "\n"));
    assert!(text.contains("°, planned 340°"), "{text}");
}

/// Neither the slide's file nor one that is there before is that of a touch which is no slide.
#[test]
fn a_press_is_not_the_planned_slide() {
    let folder = folder("recording-guide-press");
    let press = "[[touch]]\nkind = \"press\"\n";
    let slide = "[[touch]]\nkind = \"slide\"\nspecimen = \"Saw3\"\nspeed = 150\n";
    let scene = format!("gap = 140\n{press}{slide}{press}[sensor]\nsize = [240, 180]\n");
    fs::write(folder.0.join("s.toml"), scene).unwrap();
    let done = guided(&folder, "\n\nr\n");
    let ended = "it ended; a file has all slides of the plan, in order";
    let said = says(&done, 0, &["wrote ", "1 slide recorded now, 1 of 4 in total", ended]);
    let why = "the touch is a press, which does not slide: repeat the same slide";
    assert_eq!(said.matches(why).count(), 2, "{said}");
    let files: Vec<_> = fs::read_dir(folder.0.join("files")).unwrap().map(|file| file.unwrap().path()).collect();
    assert_eq!(files, [folder.0.join("files/Saw3-150mm_s-1.mcap")]);
    prints(&["run", files[0].to_str().unwrap()], &["slide, speed 1"]);
}

#[test]
fn a_person_is_led_through_a_plan() {
    let folder = folder("recording-guide");
    let parts = [
        "slide 1 of 4: Saw3, 150 mm/s, 1 of 4",
        "\"what\" is no key, expected Enter, r, s or q",
        "slide now: Saw3, 150 mm/s, 2 of 4",
        "2 of 4 in total; a file or a scene that begins with the next slide continues",
    ];
    let done = guided(&folder, "what\ns\n\n\nq\n");
    says(&done, 0, &parts);
    let names = || -> Vec<String> {
        let files = fs::read_dir(folder.0.join("files")).unwrap();
        let mut names: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names(), ["Saw3-150mm_s-2.mcap", "Saw3-150mm_s-3.mcap"]);
    for name in names() {
        let file = folder.0.join("files").join(name).display().to_string();
        let replayed = run(&["run", &file, "--json"]);
        assert_eq!(String::from_utf8_lossy(&replayed.stdout).matches(r#""kind":"event""#).count(), 1);
        // The recording has the event that the person has seen.
        let text = good(&["run", &file]);
        let event = text.lines().find(|line| line.starts_with("event")).unwrap();
        assert!(String::from_utf8_lossy(&done.stdout).contains(event), "{event}: {}", said(&done));
        assert!(said(&replayed).contains("person=me, specimen=Saw3, speed=150"), "{}", said(&replayed));
    }
    // The same command continues the plan. To record the last slide again replaces its file alone. The scene has three
    // slides.
    let kept = fs::read(folder.0.join("files/Saw3-150mm_s-2.mcap")).unwrap();
    let text = said(&guided(&folder, "\nr\n\n\n"));
    assert!(text.contains("slide 1 of 4") && text.contains("slide 4 of 4"), "{text}");
    assert!(text.contains("3 slides recorded now, 4 of 4 in total"), "{text}");
    assert_eq!(fs::read(folder.0.join("files/Saw3-150mm_s-2.mcap")).unwrap(), kept);
    // Each recording of the training set is on one side: training or test.
    let (files, set) = (folder.0.join("files").display().to_string(), folder.0.join("set.npz").display().to_string());
    ends(&["dataset", &files, "-o", &set, "--test", "0.25"], 0, &["4 samples of 4 recordings, 1 of them for tests"]);
}
