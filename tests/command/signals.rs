//! Tests that signals end every command in time, that nothing blocks before that, and that full disks are said.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use wstac_tests::command::{Signal, ends, good, prints, program, run_script, said, says, send, start, wstac};
use wstac_tests::folder::{Folder, GRAY, SMALL, frames};

const SIGNALS: [Signal; 3] = [Signal::INT, Signal::TERM, Signal::HUP];

/// Sends a signal, and returns how the process ended. It would run for hours without the signal.
fn end(child: &mut Child, signal: Signal) -> Result<ExitStatus, String> {
    let started = Instant::now();
    send(child, signal);
    while started.elapsed() < Duration::from_mins(2) {
        if let Some(status) = child.try_wait().unwrap() {
            return Ok(status);
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    Err(format!("still runs 2 minutes after {signal:?}"))
}

/// Sends a signal, which ends a program with exit code 0, and returns what it has printed.
fn printed_until(child: &mut Child, signal: Signal) -> String {
    assert_eq!(end(child, signal).unwrap().code(), Some(0));
    let mut text = String::new();
    child.stdout.take().unwrap().read_to_string(&mut text).unwrap();
    text
}

fn pipe(folder: &Folder, name: &str) -> String {
    let path = folder.path(name);
    assert!(program("mkfifo").arg(&path).status().unwrap().success());
    path
}

#[test]
fn every_signal_ends_a_stream_with_its_end_record_from_the_first_byte_on() {
    let folder = Folder::new("signals-stream");
    // With a layout and a readout, there is no note before the first frame.
    let config = &folder.written("c.toml", "[layout]\npreset = \"paper\"\n[sensor]\nreadout_ms = 0\n");
    for signal in SIGNALS {
        for (first_on_stdout, arguments) in
            [(false, &["run", "-", "--json"][..]), (true, &["run", "-", "--json", "--features", "--config", config])]
        {
            let mut child = start(arguments);
            let mut stdin = child.stdin.take().unwrap();
            stdin.write_all(GRAY).unwrap();
            // Another half frame, and the pipe stays open.
            stdin.write_all(&[&frames(3, 1)[..], b"FRAME\nhalf"].concat()).unwrap();
            let (out, err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
            let (mut out, mut err) = (BufReader::new(out), BufReader::new(err));
            let first = &mut [0];
            if first_on_stdout { out.read_exact(first) } else { err.read_exact(first) }.unwrap();
            let status = end(&mut child, signal).unwrap();
            let mut text = String::new();
            out.read_to_string(&mut text).unwrap();
            assert_eq!(status.code(), Some(0), "{signal:?} {text}");
            let end = text.lines().last().unwrap();
            assert!(end.starts_with(r#"{"kind":"end","#), "{signal:?} {text}");
            let after_a_frame = concat!(
                r#"{"kind":"end","frames":1,"dropped":0,"baseline":"incomplete","incomplete":null,"#,
                r#""time_ns":0,"clock":"frames"}"#
            );
            assert!(!first_on_stdout || end == after_a_frame, "{signal:?} {text}");
        }
    }
}

#[test]
fn a_pipe_that_nobody_writes_to_is_said_to_be_waited_for() {
    let folder = Folder::new("signals-pipe");
    let mut child = start(&["run", &pipe(&folder, "a.y4m")]);
    let note = BufReader::new(child.stderr.take().unwrap()).lines().next().unwrap().unwrap();
    assert!(note.ends_with("a.y4m: waits for Y4M from a program that writes to this pipe"), "{note}");
    end(&mut child, Signal::INT).unwrap();
}

#[test]
fn every_signal_ends_several_sensors_a_monitor_and_a_recording() {
    let folder = Folder::new("signals-kinds");
    let file = &folder.path("a.mcap");
    let slow = folder.scene("slow.toml", SMALL.replace("150", "1\nlead_in = 100000"));
    for signal in SIGNALS {
        let mut child = start(&["run", &format!("cam:left={slow}"), &format!("cam:right={slow}"), "--json"]);
        let mut notes = BufReader::new(child.stderr.take().unwrap()).lines();
        assert!(notes.by_ref().take(2).all(|note| note.is_ok()));
        thread::sleep(Duration::from_millis(200));
        let text = printed_until(&mut child, signal);
        assert_eq!(text.matches(r#""kind":"end""#).count(), 2, "{signal:?} {text}");

        let mut child = start(&["monitor", "-"]);
        thread::sleep(Duration::from_millis(300));
        let text = printed_until(&mut child, signal);
        assert!(text.starts_with("end after 0 frames"), "{text}");

        let mut child = start(&["record", "-", "-o", file, "--force"]);
        let mut stdin = child.stdin.take().unwrap();
        stdin.write_all(GRAY).unwrap();
        stdin.write_all(&frames(3, 40)).unwrap();
        let mut notes = BufReader::new(child.stderr.take().unwrap()).lines();
        notes.next().unwrap().unwrap();
        thread::sleep(Duration::from_millis(300));
        printed_until(&mut child, signal);
        prints(&["run", file, "--json"], &[r#""kind":"end","frames":40,"#]);
    }
}

/// Whoever reads the output may have stopped: a pipe that is full holds nobody up.
#[test]
fn a_reader_that_takes_nothing_holds_up_no_end() {
    let folder = Folder::new("signals-reader");
    let file = &folder.path("a.mcap");
    let slow = "specimen = \"Saw3\"\nspeed = 150\nlead_in = 50000\nfidelity = \"taxel\"\n";
    let mut child = start(&["run", &folder.scene("slow.toml", slow), "--json", "--features"]);
    thread::sleep(Duration::from_millis(800));
    end(&mut child, Signal::INT).unwrap();
    // A recording whose records fill the pipe is whole.
    let mut child = start(&["record", "-", "-o", file, "--json"]);
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(GRAY).unwrap();
    let dark_and_lit = [frames(3, 40), frames(240, 20)].concat();
    let writer = thread::spawn(move || {
        // Each of these is an event, and each has a record. The end of the program closes the pipe.
        while stdin.write_all(&dark_and_lit).is_ok() {}
    });
    thread::sleep(Duration::from_millis(2500));
    assert_eq!(end(&mut child, Signal::INT).unwrap().code(), Some(0));
    writer.join().unwrap();
    prints(&["run", file, "--json"], &[r#""kind":"end""#]);
    ends(&["recover", file, "-o", &folder.path("b.mcap")], 0, &["the recording was finished properly"]);
}

/// Commands without an end of their own end like programs without handlers, and leave nothing behind.
#[test]
fn every_other_command_ends_at_once_and_leaves_nothing() {
    let folder = Folder::new("signals-others");
    folder.file("slow.toml", "specimen = \"Saw3\"\nspeed = 1\nlead_in = 100000\n");
    folder.file("sweep.toml", "specimens = [\"Saw3\"]\nslides = 100000\n[scene]\nfidelity = \"rendered\"\n");
    let before = folder.names();
    // Every command handles all signals in one place.
    for ((command, is_handled), signal) in [
        (&["trade", "--slides", "110", "-o", "new"][..], false),
        (&["plot", "scene:slow.toml", "-o", "new.svg"], false),
        (&["scene", "render", "slow.toml", "-o", "new.y4m"], true),
        (&["calibrate", "scene:slow.toml", "-o", "new.toml"], true),
        (&["dataset", "sweep.toml", "-o", "new.npz"], true),
        (&["dataset", "--input", "path", "-o", "new.npz"], true),
        (&["train", "-o", "new.wsm"], true),
        (&["doctor", "scene:slow.toml", "--seconds", "600"], true),
        // It may be over by then.
        (&["demo"], true),
    ]
    .into_iter()
    .zip(SIGNALS.into_iter().cycle())
    {
        let mut process = program(wstac());
        process.args(command).current_dir(&folder.0).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = process.spawn().unwrap();
        thread::sleep(Duration::from_millis(400));
        let status = end(&mut child, signal).unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let number = signal.as_raw();
        let ended = status.code() == Some(128 + number) || status.signal() == Some(number);
        assert!(ended || is_handled, "{command:?} {status:?}");
        for name in ["new.png", "new.toml", "new.refused.png"] {
            let _ = fs::remove_file(folder.0.join(name));
        }
        assert_eq!(folder.names(), before, "{command:?} {signal:?}");
    }
}

#[test]
fn a_signal_that_the_parent_ignores_stays_ignored() {
    let script = "trap '' HUP INT TERM; exec \"$0\" run - --json --features";
    let mut process = program("bash");
    process.args(["-c", script]).arg(wstac()).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = process.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(GRAY).unwrap();
    stdin.write_all(&frames(3, 1)).unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().contains("default-layout"));
    lines.next().unwrap().unwrap();
    for signal in SIGNALS {
        send(&child, signal);
    }
    thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none(), "it has ended");
    stdin.write_all(&frames(3, 1)).unwrap();
    assert!(lines.next().unwrap().unwrap().contains(r#""frame":1"#));
    drop(stdin);
    assert!(lines.next().unwrap().unwrap().contains(r#""kind":"end""#));
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

/// A pipe without a writer is waited for, and a signal ends the wait; what cannot be a stream is refused at once.
#[test]
fn opening_a_pipe_never_blocks_for_good() {
    let folder = Folder::new("signals-pipes");
    fs::create_dir(folder.0.join("pictures")).unwrap();
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/models/svm.wsm"), folder.0.join("svm.wsm")).unwrap();
    folder.file("base.toml", "");
    let waiting =
        ["pipe", "pipe.toml", "pipe.wsm", "pipe.onnx", "pipe.bin", "pipe.y4m"].map(|name| pipe(&folder, name));
    let refused = ["pipe.mcap", "pipe.npz", "pictures/1.png"].map(|name| pipe(&folder, name));
    let path = |name: &str| folder.path(name);
    let [source, toml, wsm, onnx, bin, y4m] = &waiting;
    for (command, signal) in [
        &["run", source][..],
        &["run", y4m],
        &["run", &format!("cam:a={source}"), "cam:b=scene:Saw3@150"],
        &["record", source, "-o", &path("new.mcap")],
        &["calibrate", source, "-o", &path("new.toml")],
        &["doctor", source],
        &["plot", source, "-o", &path("new.svg")],
        &["monitor", bin],
        &["run", "scene:Saw3@150", "--config", toml],
        &["run", "scene:Saw3@150", "--model", wsm],
        &["run", &format!("scene:{toml}")],
        &["record", "scene:Saw3@150", "--guide", toml, "-o", &path("files")],
        &["dataset", toml, "-o", &path("new.npz")],
        &["model", "import", onnx, "-o", &path("new.wsm")],
        &["model", "inspect", wsm],
        &["model", "eval", wsm, "a.npz"],
        &["model", "learn", wsm, "a.npz", "-o", &path("new.wsm")],
        &["model", "calibrate", wsm, "a.npz", "b.npz", "-o", &path("new.wsm")],
        &["train", toml, "-o", &path("new.wsm")],
        &["trade", "--map", toml],
        &["trade", "--map", "kept", "--prices", toml],
        &["trade", "--config", toml, "--slides", "1"],
    ]
    .into_iter()
    .zip(SIGNALS.into_iter().cycle())
    {
        let mut child = start(command);
        thread::sleep(Duration::from_millis(150));
        assert!(child.try_wait().unwrap().is_none(), "{command:?} did not wait: {:?}", child.wait_with_output());
        end(&mut child, signal).unwrap_or_else(|error| panic!("{command:?}: {error}"));
    }
    let [mcap, npz, _] = &refused;
    let pictures = path("pictures");
    for command in [
        &["recover", mcap, "-o", &path("new.mcap")][..],
        &["dataset", mcap, "-o", &path("new.npz")],
        &["model", "eval", "builtin:svm", npz],
        &["run", &pictures],
    ] {
        let mut child = start(command);
        drop(child.stdin.take());
        let started = Instant::now();
        while child.try_wait().unwrap().is_none() && started.elapsed() < Duration::from_mins(2) {
            thread::sleep(Duration::from_millis(10));
        }
        let _ = child.kill();
        let done = child.wait_with_output().unwrap();
        assert!(done.status.code() == Some(1) && said(&done).contains("pipe"), "{command:?}: {}", said(&done));
    }
    // With a writer, pipes are read.
    let write = |pipe: &str, content: Vec<u8>| {
        let pipe = pipe.to_owned();
        thread::spawn(move || File::options().write(true).open(pipe).unwrap().write_all(&content).unwrap())
    };
    let config = write(toml, b"[trigger]\nwindow = 5\n".to_vec());
    let model = write(wsm, fs::read(folder.0.join("svm.wsm")).unwrap());
    prints(&["run", "scene:Saw3@150", "--size", "160x120", "--config", toml, "--model", wsm], &["texture Saw3"]);
    let stream = write(source, [GRAY, &frames(3, 3)].concat());
    prints(&["run", source, "--json"], &[r#""frames":3,"#]);
    for thread in [config, model, stream] {
        thread.join().unwrap();
    }
}

/// A limit of the size of files acts like a full disk: whatever the signal does, no half of a file stays.
#[test]
fn a_file_that_cannot_be_written_leaves_nothing() {
    let folder = Folder::new("signals-limit");
    let path = |name: &str| folder.path(name);
    folder.file("a.toml", "specimens = [\"Saw3\"]\nslides = 2\n");
    let trained = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/seeds/model_import/forest.onnx");
    fs::copy(trained, folder.0.join("forest.onnx")).unwrap();
    let scene = folder.scene("s.toml", SMALL.replace("40, 40", "80, 80"));
    good(&["record", &scene, "-o", &path("a.mcap"), "--label", "specimen=Saw3"]);
    folder.file("old.new.jsonl", "mine");
    let before = folder.names();
    for (command, blocks) in [
        ("dataset a.mcap -o new.npz", 0),
        ("dataset a.toml -o new.npz", 0),
        ("model import forest.onnx -o new.wsm", 0),
        ("plot a.mcap -o new.svg", 0),
        ("scene render s.toml -o new.y4m", 100),
        ("recover a.mcap -o new.mcap", 100),
        ("run a.mcap --save-raw new.raw", 6),
        ("man new", 0),
        ("trade --map kept -o new.svg", 0),
        ("run a.mcap --features --force -o old.new.jsonl", 8),
    ] {
        let script = format!("ulimit -f {blocks}; exec \"$0\" {command}");
        let done = run_script(&folder, &script);
        says(&done, 1, &["new"]);
        assert!(!said(&done).contains(".wstac-"), "{command}: {}", said(&done));
        let _ = fs::remove_dir(folder.0.join("new"));
        assert_eq!(folder.names(), before, "{command}");
    }
    assert_eq!(fs::read(path("old.new.jsonl")).unwrap(), b"mine");
    // Of raw frames, the whole ones are kept, and the stream goes on to its end.
    let script = "ulimit -f 14; exec \"$0\" run a.mcap --json --save-raw new.raw";
    let done = run_script(&folder, script);
    says(&done, 1, &["new.raw: ", "has the first 2 frames"]);
    assert!(String::from_utf8_lossy(&done.stdout).contains(r#""kind":"end""#));
    assert_eq!(fs::metadata(Path::new(&path("new.raw"))).unwrap().len(), 2 * 80 * 80);
}

#[test]
fn a_full_output_is_an_error_of_every_command() {
    let folder = Folder::new("signals-full");
    let scene = folder.scene("s.toml", SMALL.replace("40, 40", "160, 120"));
    good(&["record", &scene, "-o", &folder.path("a.mcap")]);
    for arguments in [
        &["--help"][..],
        &["-h"],
        &["--version"],
        &["run", "--help"],
        &["help", "model"],
        &["completions", "bash"],
        &["run", "a.mcap"],
        &["run", "a.mcap", "--json"],
        &["model", "inspect", "builtin:svm"],
        &["scene", "explain", "Saw3@150", "--no-cost"],
        &["scene", "strain", "Saw3@150"],
        &["scene", "render", "s.toml", "-o", "-"],
        &["trade", "--budget", "M4F<60k"],
        &["doctor", "a.mcap"],
        &["calibrate", "a.mcap", "-o", "new.toml", "--force"],
        &["devices", "--json"],
        &["demo"],
    ] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let done = program(wstac()).args(arguments).current_dir(&folder.0).stdout(full).output().unwrap();
        says(&done, 1, &["standard output: No space left"]);
    }
    // A reader that has seen enough is no error.
    let mut child = start(&["--help"]);
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
