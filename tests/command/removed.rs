//! Tests that `wstac` says what to use instead of a command or an option that was removed.

use wstac_tests::command::{run, said};

/// Returns the rows of the table "From 0.3" of the changelog's newest section: what was removed, and what to use
/// instead.
fn rows() -> Vec<(&'static str, &'static str)> {
    let changelog = include_str!("../../CHANGELOG.md");
    let newest = changelog.split("\n## ").nth(1).unwrap();
    let table = newest.split("\n### ").find(|section| section.starts_with("From 0.3\n")).unwrap();
    let rows = table.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | "));
    rows.filter(|(what, _)| *what != "what" && !what.starts_with("---")).collect()
}

/// Returns the parts of a text that are code.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn every_removed_command_and_option_says_what_to_use_instead() {
    let lines: Vec<_> = rows()
        .into_iter()
        .flat_map(|(what, instead)| code(what).map(move |line| (line, instead)))
        .filter_map(|(line, instead)| Some((line, line.strip_prefix("wstac ")?, instead)))
        .collect();
    assert!(!lines.is_empty());
    for (line, arguments, instead) in lines {
        let done = run(&arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(done.status.code(), Some(2), "{line}: {}", said(&done));
        assert!(said(&done).contains(&format!("{line}: was removed; help: ")), "{line}: {}", said(&done));
        for code in code(instead) {
            assert!(said(&done).contains(code), "{line}: {} lacks {code}", said(&done));
        }
    }
}

#[test]
fn an_option_of_another_command_is_unknown_as_before() {
    let done = run(&["run", "scene:Saw3@150", "--loop"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("unexpected argument '--loop'"), "{}", said(&done));
}
