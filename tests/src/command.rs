//! The `wstac` command as a separate program.

use std::ffi::OsStr;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;

use rustix::process::{Pid, kill_process, set_parent_process_death_signal};
use serde_json::Value;

pub use rustix::process::Signal;

use crate::folder::Folder;

/// Returns the path of the `wstac` command: that of the variable `WSTAC`, or one that is built now.
///
/// # Panics
/// If it cannot be built.
pub fn wstac() -> &'static PathBuf {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| std::env::var_os("WSTAC").map_or_else(build, PathBuf::from))
}

/// Returns a command for this program. It is killed when the thread ends that started it, and so with its test, however
/// that ends: a program that a killed test has left would use the devices of the next.
pub fn program(name: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(name);
    // SAFETY: the new process makes one system call.
    unsafe { command.pre_exec(|| Ok(set_parent_process_death_signal(Some(Signal::KILL))?)) };
    command
}

/// Runs `wstac` to its end.
///
/// # Panics
/// If it cannot be run.
pub fn run(arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> Output {
    program(wstac()).args(arguments).output().unwrap()
}

/// Runs `wstac` in a folder to its end.
///
/// # Panics
/// If it cannot be run.
pub fn run_in(folder: &Folder, arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> Output {
    program(wstac()).args(arguments).current_dir(&folder.0).output().unwrap()
}

/// Runs a script of bash in a folder to its end. Its `$0` is `wstac`.
///
/// # Panics
/// If it cannot be run.
pub fn run_script(folder: &Folder, script: &str) -> Output {
    program("bash").args(["-c", script]).arg(wstac()).current_dir(&folder.0).output().unwrap()
}

/// Starts `wstac`. Its input and outputs are pipes.
///
/// # Panics
/// If it cannot be started.
pub fn start(arguments: &[&str]) -> Child {
    let mut command = program(wstac());
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Sends a signal to a program that has not been waited for.
///
/// # Panics
/// If it cannot be sent.
pub fn send(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

/// Runs `wstac`, which must succeed, and returns its output.
///
/// # Panics
/// If it fails.
pub fn good(arguments: &[&str]) -> String {
    printed(&run(arguments))
}

/// Runs `wstac`, which must succeed, and returns the objects that it prints, one per line.
///
/// # Panics
/// If it fails, or prints something else.
#[track_caller]
pub fn records(arguments: &[&str]) -> Vec<Value> {
    good(arguments).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Runs `wstac`, which must succeed, and returns the first event that it prints as JSON.
///
/// # Panics
/// If it fails, or prints none.
#[track_caller]
pub fn event(arguments: &[&str]) -> Value {
    let is_event = |record: &Value| record["kind"] == "event";
    records(&[arguments, &["--json"]].concat()).into_iter().find(is_event).expect("an event")
}

/// Returns the output of a run, which must have succeeded.
///
/// # Panics
/// If it failed.
pub fn printed(done: &Output) -> String {
    assert_eq!(done.status.code(), Some(0), "{}", said(done));
    String::from_utf8(done.stdout.clone()).unwrap()
}

/// Returns the messages of a run.
pub fn said(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

/// Checks that a run ended with this exit code and that its messages have these parts. Returns them.
///
/// # Panics
/// If it ended in another way, or lacks a part.
#[track_caller]
pub fn says(done: &Output, code: i32, parts: &[&str]) -> String {
    let said = said(done);
    assert_eq!(done.status.code(), Some(code), "{said}");
    assert_has(&said, parts);
    said
}

/// Runs `wstac`, which must end with this exit code and messages that have these parts.
///
/// # Panics
/// If it ends in another way, or lacks a part.
#[track_caller]
pub fn ends(arguments: &[&str], code: i32, parts: &[&str]) {
    println!("{arguments:?}");
    says(&run(arguments), code, parts);
}

/// Runs `wstac`, which must succeed with an output that has these parts.
///
/// # Panics
/// If it fails, or lacks a part.
#[track_caller]
pub fn prints(arguments: &[&str], parts: &[&str]) {
    assert_has(&good(arguments), parts);
}

/// Runs `wstac`, which must fail with exit code 1, or 2 for wrong arguments, and returns its messages.
///
/// # Panics
/// If it ends in another way.
#[track_caller]
pub fn refusal(arguments: &[&str]) -> String {
    let done = run(arguments);
    assert!(matches!(done.status.code(), Some(1 | 2)), "{arguments:?}: {}", said(&done));
    said(&done)
}

/// Runs `wstac`, which must fail as in [`refusal`] with messages that have these parts.
///
/// # Panics
/// If it ends in another way, or lacks a part.
#[track_caller]
pub fn refused(arguments: &[&str], parts: &[&str]) {
    println!("{arguments:?}");
    assert_has(&refusal(arguments), parts);
}

/// Asserts that a text has every part.
///
/// # Panics
/// If it lacks one.
#[track_caller]
pub fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{text}, expected {part:?}");
    }
}

fn build() -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let built = Command::new(cargo)
        .args(["build", "--release", "-p", "wstac-cli", "--message-format=json"])
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .output()
        .expect("cargo runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    // The last artifact with an executable is the command.
    let messages = String::from_utf8_lossy(&built.stdout).into_owned();
    let executable = messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .next_back();
    executable.expect("cargo names the executable")
}
