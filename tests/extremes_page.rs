//! The page of extremes names tests: each is there and runs, and no test of extremes is left out.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The tests of a file: names of functions behind `#[test]`, or within `proptest!`, that are not ignored.
fn tests_of(source: &str) -> BTreeSet<&str> {
    let mut is_test = false;
    let mut tests = BTreeSet::new();
    for line in source.lines().map(str::trim_start) {
        if line.starts_with("#[ignore") {
            is_test = false;
        } else if line == "#[test]" {
            is_test = true;
        } else if let Some(rest) = line.strip_prefix("fn ") {
            tests.extend(rest.split('(').next().filter(|_| is_test));
            is_test = false;
        }
    }
    tests
}

/// Whether `cargo test --workspace` gets to a file: a module of the core or the host, or of a test that is declared.
fn is_run(path: &str) -> bool {
    let declared = text("tests/Cargo.toml");
    let entry =
        |path: &str| path.strip_prefix("tests/").is_some_and(|path| declared.contains(&format!("path = \"{path}\"")));
    let Some((folder, name)) = path.rsplit_once('/') else { return false };
    let module = name.strip_suffix(".rs").unwrap_or_default();
    if path.starts_with("tests/") {
        let main = format!("{folder}/main.rs");
        return entry(path) || entry(&main) && text(&main).contains(&format!("mod {module};"));
    }
    path.starts_with("wstac-core/") || path.starts_with("wstac-linux/src/")
}

#[test]
fn every_line_names_a_test_that_runs_and_no_extreme_is_left_out() {
    let page = text("docs/EXTREMES.md");
    let stages = text("ci/test");
    let stages = stages.lines().find_map(|line| line.strip_prefix("for stage in ")).unwrap();
    let stages: BTreeSet<&str> = stages.trim_end_matches("; do").split_whitespace().chain(["long"]).collect();
    assert!(text("ci/unit").contains("cargo test --locked --workspace"));
    let mut named = BTreeSet::new();
    let mut rows = 0;
    for row in page.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| ---")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let last = cells.last().unwrap().trim();
        // A heading, or a table of another kind.
        if cells.len() != 4 || last == "test" {
            continue;
        }
        rows += 1;
        if last == "the same" {
            continue;
        }
        for name in last.split(", ").map(|name| name.trim_matches('`')) {
            if let Some(stage) = name.strip_prefix("ci/") {
                assert!(stages.contains(stage), "{name} is no stage of ci/test, nor ci/long: {row}");
                continue;
            }
            let (path, test) = name.split_once("::").unwrap_or_else(|| panic!("{name}, expected file::test: {row}"));
            assert!(is_run(path), "{path} is no file that ci/unit runs");
            assert!(tests_of(&text(path)).contains(test), "{path} has no test {test}");
            named.insert(name.to_owned());
        }
    }
    let files = fs::read_dir(root().join("tests")).unwrap().map(|entry| entry.unwrap().file_name());
    let mut extremes: Vec<String> = files
        .filter_map(|name| name.into_string().ok())
        .filter(|name| name.starts_with("extremes") && name != "extremes_page.rs")
        .map(|name| format!("tests/{name}"))
        .collect();
    assert_eq!(extremes.len(), 3, "{extremes:?}");
    extremes.extend(
        ["features", "decisions", "directions", "scores", "speeds"].map(|m| format!("tests/error_bounds/{m}.rs")),
    );
    extremes.extend(
        ["hostile.rs", "untouched.rs", "ln.rs", "long/counters.rs", "long/day.rs"].map(|m| format!("tests/{m}")),
    );
    extremes.push("wstac-core/src/model/tests/extremes.rs".into());
    for path in extremes {
        for test in tests_of(&text(&path)) {
            assert!(named.contains(&format!("{path}::{test}")), "{path}::{test} is not on docs/EXTREMES.md");
        }
    }
    println!("{rows} extremes, {} tests", named.len());
}
