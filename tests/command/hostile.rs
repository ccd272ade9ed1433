//! Tests hostile inputs to the `wstac` command: each gives a clear message, the right exit code, and no panic.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use wstac_tests::command::{program, wstac};
use wstac_tests::folder::{self, Folder, GRAY};

/// The input of a run, and the expected result.
struct Case {
    name: &'static str,
    arguments: Vec<String>,
    stdin: Vec<u8>,
    /// The exit code.
    code: i32,
    /// Parts of the message on standard error.
    says: Vec<&'static str>,
    /// Whether the stream had started, so that there must be an end record.
    ended: bool,
}

fn case(name: &'static str, arguments: &[&str], code: i32, says: &[&'static str]) -> Case {
    let arguments = arguments.iter().map(|argument| (*argument).to_owned()).collect();
    Case { name, arguments, stdin: Vec::new(), code, says: says.to_vec(), ended: false }
}

/// Creates a case with a Y4M stream on standard input.
fn y4m(name: &'static str, stream: &[u8], code: i32, says: &[&'static str]) -> Case {
    Case { stdin: stream.to_vec(), ..case(name, &["run", "-", "--json"], code, says) }
}

fn y4m_that_ends(name: &'static str, stream: &[u8], code: i32, says: &[&'static str]) -> Case {
    Case { ended: true, ..y4m(name, stream, code, says) }
}

/// Creates a case with a configuration file and a valid stream.
fn config(dir: &Path, name: &'static str, text: &[u8], says: &[&'static str]) -> Case {
    let path = dir.join(format!("{}.toml", name.replace(' ', "-")));
    fs::write(&path, text).unwrap();
    Case { stdin: frames(2), ..case(name, &["run", "-", "--json", "--config", path.to_str().unwrap()], 1, says) }
}

/// Returns a clip of dark gray frames.
fn frames(count: usize) -> Vec<u8> {
    [GRAY, &folder::frames(3, count)].concat()
}

fn cases(dir: &Path) -> Vec<Case> {
    let file = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = dir.join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let folder = |name: &str, files: &[(&str, &[u8])]| -> String {
        let path = dir.join(name);
        fs::create_dir(&path).unwrap();
        for (name, bytes) in files {
            fs::write(path.join(name), bytes).unwrap();
        }
        path.to_str().unwrap().to_owned()
    };
    let text = |path: PathBuf| path.to_str().unwrap().to_owned();
    let mut truncated = frames(3);
    truncated.truncate(truncated.len() - 700);
    let mut garbage_between = frames(1);
    garbage_between.extend(b"GARBAGE HERE\n");
    let random: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();

    vec![
        // Arguments.
        case("no command", &[], 2, &["Usage"]),
        case("unknown command", &["slide"], 2, &["slide"]),
        case("no source", &["run"], 2, &["<SOURCE>"]),
        case("two sources", &["run", "a.y4m", "b.y4m"], 2, &["NAME=SOURCE"]),
        case("unknown option", &["run", "-", "--fast"], 2, &["--fast"]),
        case("frame rate of zero", &["run", "-", "--fps", "0"], 2, &["--fps", "above 0"]),
        case("unknown matrix", &["run", "-", "--matrix", "bt2020"], 2, &["bt2020", "bt601"]),
        case("size without an x", &["run", "-", "--size", "1280"], 2, &["1280", "WIDTHxHEIGHT"]),
        case("samples without json", &["run", "-", "--samples"], 2, &["--json"]),
        case("unknown shell", &["completions", "cmd"], 2, &["cmd", "bash"]),
        // Sources.
        case("missing file", &["run", "no-such.y4m"], 1, &["no-such.y4m"]),
        case("missing device", &["run", "/dev/video99"], 1, &["/dev/video99"]),
        case("device that is no camera", &["run", "/dev/null"], 1, &["/dev/null"]),
        case("no source at all", &["run", ""], 1, &["SOURCE"]),
        case("unknown specimen", &["run", "scene:Cube9@150"], 2, &["Cube9", "Saw"]),
        case("control of a scene", &["run", "scene:Saw3@150", "--control", "gain=3"], 2, &["gain=3", "a camera"]),
        y4m("carriage return", b"YUV4MPEG2 W4 H4 F30:1 Cmono\r\nFRAME\n", 1, &["\"mono\\r\""]),
        case("scene file that is missing", &["run", "scene:none.toml"], 1, &["none.toml"]),
        case("empty folder", &["run", &folder("empty", &[])], 1, &["empty", ".png"]),
        case(
            "folder of a broken PNG",
            &["run", &folder("broken", &[("1.png", b"\x89PNG\r\n\x1a\nno")])],
            1,
            &["1.png"],
        ),
        case("file of another kind", &["run", &text(file("notes.txt", b"hello"))], 1, &["notes.txt"]),
        case("empty file", &["run", &text(file("empty.y4m", b""))], 1, &["empty.y4m"]),
        // Y4M streams.
        y4m("nothing on standard input", b"", 1, &["standard input"]),
        y4m("random bytes", &random, 1, &["standard input", "YUV4MPEG2"]),
        y4m("frame too small for taxels", b"YUV4MPEG2 W3 H3 F30:1 Cmono\nFRAME\n123456789", 1, &["taxel"]),
        y4m_that_ends("frame cut short", &truncated, 1, &["frame 2", "900", "1600"]),
        y4m_that_ends("garbage between frames", &garbage_between, 1, &["FRAME"]),
        y4m_that_ends("no frames", &frames(0), 0, &[]),
        y4m_that_ends("fewer frames than the baseline", &frames(5), 0, &[]),
        // Configurations.
        config(dir, "unknown key", b"[trigger]\nwindw = 5\n", &["unknown-key.toml", "windw", "window"]),
        config(dir, "infinite margin", b"[trigger]\nmargin = inf\n", &["margin", "inf"]),
        config(
            dir,
            "corner outside the frame",
            format!("[layout]\ntaxel = [5, 5]\ncorners = {:?}\n", vec![[38, 0]; 25]).as_bytes(),
            &["corner-outside-the-frame.toml", "[layout]", "taxel 0", "(43, 5)", "40x40"],
        ),
        config(
            dir,
            "floor of a thousand levels",
            b"[features]\nfloor_levels = 1000\n",
            &["levels.toml", "[features]", "floor_levels", "1000"],
        ),
        config(dir, "not TOML", b"\xff\xfe{}", &["not-TOML.toml"]),
        case("missing configuration", &["run", "-", "--config", "none.toml"], 1, &["none.toml"]),
        case(
            "file to save to is there",
            &["run", "scene:Saw3@150", "--save-raw", &text(file("kept.raw", b"kept"))],
            1,
            &["kept.raw"],
        ),
    ]
}

#[test]
fn hostile_inputs_get_a_clear_message_and_the_right_exit_code() {
    let folder = Folder::new("hostile");
    let mut wrong = Vec::new();
    let cases = cases(&folder.0);
    assert!(cases.len() >= 30);
    for case in &cases {
        let mut child = program(wstac())
            .args(&case.arguments)
            .current_dir(&folder.0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // A program may refuse its input early, which closes the pipe.
        let _ = child.stdin.take().unwrap().write_all(&case.stdin);
        let output = child.wait_with_output().unwrap();
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        let mut faults = Vec::new();
        if output.status.code() != Some(case.code) {
            faults.push(format!("exit code {:?}, expected {}", output.status.code(), case.code));
        }
        for part in case.says.iter().filter(|part| !stderr.contains(*part)) {
            faults.push(format!("does not say {part:?}"));
        }
        if stderr.contains("panicked") {
            faults.push("panicked".to_owned());
        }
        if case.ended != stdout.contains(r#""kind":"end""#) {
            faults.push(format!("end record expected: {}", case.ended));
        }
        println!("{:32} {:?}  {}", case.name, output.status.code(), stderr.trim_end().replace('\n', "\n    "));
        if !faults.is_empty() {
            wrong.push(format!("{}: {}\n  said: {stderr}", case.name, faults.join("; ")));
        }
    }
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
    println!("{} hostile inputs", cases.len());
    assert_eq!(fs::read(folder.0.join("kept.raw")).unwrap(), b"kept");
}
