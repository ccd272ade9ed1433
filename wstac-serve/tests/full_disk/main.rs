//! A recording for which there is no room. It is a program of its own, because the limit is one of the process.

#[path = "../tools/page.rs"]
#[allow(dead_code)]
mod page;

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use serde_json::json;
use tempfile::tempdir;
use wstac_host::config::Config;
use wstac_serve::Tools;

/// A limit on the size of files acts like a full disk.
#[test]
fn a_full_disk_refuses_a_recording_and_changes_nothing() {
    setrlimit(Resource::Fsize, Rlimit { current: Some(100_000), ..getrlimit(Resource::Fsize) }).unwrap();
    let folder = tempdir().unwrap();
    let tools = Tools { record_to: Some(folder.path().to_owned()), ..Tools::default() };
    let served = page::Served::new(None, &Config::default(), tools);
    let mut page = served.page();
    served.allow(40);
    page.until_frame(40);
    let why = page.refusal(&json!({"order": "record"}));
    assert!(
        why.contains("wstac-1.mcap: the file may not become as large") && why.contains("nothing was recorded"),
        "{why}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no file stays");
    served.allow(41);
    page.until_frame(41);
    assert_eq!(page.status["phase"], "watching");
    assert_eq!(served.end().0, 0);
}
