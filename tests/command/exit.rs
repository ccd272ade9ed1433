//! Tests that every exit code of docs/EXIT.md is the one that its example has.

use std::process::Stdio;

use wstac_tests::command::{good, program, said, wstac};
use wstac_tests::folder::Folder;

const PAGE: &str = include_str!("../../docs/EXIT.md");

/// Returns the rows of the page's tables: the first cell, and the example in the last. That of signals is three.
fn examples() -> Vec<(String, String)> {
    let rows = PAGE.lines().filter(|line| line.starts_with("| ") && line.ends_with("` |"));
    let split = |row: &str| {
        let cells = row.replace("\\|", "\u{1}");
        let cells: Vec<_> = cells.trim_matches('|').split('|').map(str::trim).collect();
        let [first, _, example] = cells[..] else { panic!("{row}") };
        (first.to_owned(), example.trim_matches('`').replace('\u{1}', "|"))
    };
    let signals = [("130", "INT"), ("143", "TERM"), ("129", "HUP")];
    let each = |(first, example): (String, String)| match &*first {
        "128 + N" => signals.map(|(code, name)| (code.to_owned(), example.replace("INT", name))).to_vec(),
        _ => vec![(first, example)],
    };
    rows.map(split).flat_map(each).collect()
}

#[test]
fn every_example_of_the_page_ends_with_its_code() {
    let path = format!("{}:{}", wstac().parent().unwrap().display(), std::env::var("PATH").unwrap());
    let mut seen = Vec::new();
    for (first, example) in examples() {
        let folder = Folder::new("exit");
        let mut shell = program("bash");
        shell.args(["-o", "pipefail", "-c", &example]).env("PATH", &path).current_dir(&folder.0).stdin(Stdio::null());
        let done = shell.output().unwrap();
        let code = match &*first {
            command if command.starts_with("`wstac") => 1,
            code => code.parse().unwrap(),
        };
        assert_eq!(done.status.code(), Some(code), "{example}: {}", said(&done));
        // Whoever fails says why, without a panic.
        assert!((code != 1 && code != 2) || !done.stderr.is_empty(), "{example}");
        assert!(!said(&done).contains("panicked"), "{example}: {}", said(&done));
        seen.push(code);
        if code > 128 {
            assert!(!folder.0.join("a.npz").exists());
        }
    }
    assert!(seen.len() >= 20, "{}", seen.len());
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, [0, 1, 2, 129, 130, 143]);
}

#[test]
fn the_help_has_every_code_of_the_page() {
    let help = good(&["--help"]);
    let (_, codes) = help.split_once("Exit codes").unwrap();
    for code in ["\n  0  ", "\n  1  ", "\n  2  ", "\n  128+N  ", "129", "130", "143"] {
        assert!(codes.contains(code), "{code:?}: {codes}");
    }
}
