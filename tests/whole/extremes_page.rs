//! Tests that every test on the page of extremes exists and runs, and that the page names every test of extremes.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns the tests of a file: names of functions with `#[test]`, also within `proptest!`, that are neither ignored
/// nor left out by a `#[cfg]`, whatever the order of the attributes.
fn tests_of(source: &str) -> BTreeSet<&str> {
    let (mut is_test, mut is_left_out) = (false, false);
    let mut tests = BTreeSet::new();
    for line in source.lines().map(str::trim_start) {
        if line.starts_with("#[") {
            is_test |= line == "#[test]";
            is_left_out |= line.contains("ignore") || line.starts_with("#[cfg");
        } else if !line.starts_with("//") {
            let name = line.strip_prefix("fn ").and_then(|rest| rest.split('(').next());
            tests.extend(name.filter(|_| is_test && !is_left_out));
            (is_test, is_left_out) = (false, false);
        }
    }
    tests
}

/// Returns whether a source declares a module, public or not.
fn declares(source: &str, module: &str) -> bool {
    source.lines().map(str::trim).any(|line| {
        let private = line.strip_prefix("pub ").or_else(|| line.strip_prefix("pub(crate) ")).unwrap_or(line);
        private.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) == Some(module)
    })
}

/// Returns whether a file below a crate's `src` is the root of the crate, or declared by a module of it.
fn is_module(path: &str) -> bool {
    let Some((folder, name)) = path.rsplit_once('/') else { return false };
    let stem = name.strip_suffix(".rs").unwrap_or_default();
    if folder.ends_with("/src") && ["lib", "main"].contains(&stem) {
        return root().join(path).exists();
    }
    let (folder, stem) = if stem == "mod" { folder.rsplit_once('/').unwrap_or_default() } else { (folder, stem) };
    let parents = if folder.ends_with("/src") {
        ["lib", "main"].map(|root| format!("{folder}/{root}.rs"))
    } else {
        [format!("{folder}.rs"), format!("{folder}/mod.rs")]
    };
    parents.iter().any(|parent| root().join(parent).exists() && declares(&text(parent), stem) && is_module(parent))
}

/// Returns whether a file of `tests/` is declared as a test, or a module of one that is.
fn is_declared_test(path: &str) -> bool {
    let manifest = text("tests/Cargo.toml");
    let line = format!("path = \"{}\"", path.strip_prefix("tests/").unwrap_or_default());
    if manifest.split("\n[").any(|part| part.starts_with("[test]]") && part.lines().any(|other| other == line)) {
        return true;
    }
    let Some((folder, name)) = path.rsplit_once('/') else { return false };
    let stem = name.strip_suffix(".rs").unwrap_or_default();
    let (folder, stem) = if stem == "mod" { folder.rsplit_once('/').unwrap_or_default() } else { (folder, stem) };
    ["main", "mod"].iter().any(|parent| {
        let parent = format!("{folder}/{parent}.rs");
        parent != path && root().join(&parent).exists() && declares(&text(&parent), stem) && is_declared_test(&parent)
    })
}

/// Returns whether `cargo test --workspace` reaches a file.
fn is_run(path: &str) -> bool {
    if let Some(name) = path.strip_prefix("wstac-core/tests/") {
        // Cargo finds these without a declaration.
        return !name.contains('/') && !text("wstac-core/Cargo.toml").contains("autotests");
    }
    if path.starts_with("tests/") {
        return is_declared_test(path);
    }
    // A member of the workspace.
    let member = path.split_once("/src/").map(|(member, _)| format!("\"{member}\","));
    let manifest = text("Cargo.toml");
    let members =
        manifest.split_once("members = [").and_then(|(_, rest)| rest.split_once(']')).map(|(members, _)| members);
    member.is_some_and(|member| members.is_some_and(|all| all.contains(&member))) && is_module(path)
}

/// Returns the rows of the page that have three cells, without headings. Measured numbers between marks are of another
/// kind.
fn rows_of(page: &str) -> Vec<Vec<&str>> {
    let mut is_measured = false;
    let mut rows = Vec::new();
    for line in page.lines() {
        is_measured = (is_measured || line.starts_with("<!-- fade:")) && line != "<!-- fade end -->";
        if is_measured || !line.trim_start().starts_with('|') {
            continue;
        }
        let inner = line.strip_prefix("| ").and_then(|rest| rest.strip_suffix(" |"));
        let cells: Vec<&str> = inner.unwrap_or_default().split(" | ").collect();
        assert_eq!(cells.len(), 3, "expected | a | b | c |: {line}");
        if cells != ["---"; 3] && cells.last() != Some(&"test") {
            rows.push(cells);
        }
    }
    assert!(!is_measured, "<!-- fade: has no <!-- fade end -->");
    rows
}

#[test]
fn a_test_that_is_left_out_is_none() {
    let source = "#[ignore]\n#[test]\nfn a() {}\n#[test]\n#[ignore = \"slow\"]\nfn b() {}\n#[cfg(any())]\n#[test]\nfn c() {}\n\
        #[test]\n// Why.\n#[should_panic]\nfn d() {}\n#[cfg(test)]\nmod tests {\n    #[test]\n    fn e() {}\n}\nfn f() {}\n";
    assert_eq!(tests_of(source), BTreeSet::from(["d", "e"]));
    assert!(is_run("wstac-core/src/model/tests/extremes.rs") && is_run("tests/long/day.rs"));
    assert!(is_run("tests/untouched.rs") && is_run("tests/whole/ln.rs") && is_run("tests/whole/error_bounds/mod.rs"));
    assert!(is_run("tests/whole/error_bounds/features.rs"));
    assert!(is_run("wstac-train/src/model/integers.rs"));
    for path in [
        "wstac-core/src/none.rs",
        "wstac-fw/src/reader.rs",
        "tests/benches/frames.rs",
        "tests/long/none.rs",
        "tests/whole/error_bounds/none.rs",
        "tests/src/extreme.rs",
        "wstac-core/tests/models/a.rs",
    ] {
        assert!(!is_run(path), "{path}");
    }
    assert!(declares("pub(crate) mod a;", "a") && !declares("// mod a;", "a") && !declares("mod ab;", "a"));
}

#[test]
#[should_panic(expected = "expected | a | b | c |")]
fn a_row_with_another_number_of_cells_is_found() {
    rows_of("<!-- fade: x -->\n| a | b |\n<!-- fade end -->\n| a | b | c | d |\n");
}

#[test]
fn every_line_names_a_test_that_runs_and_no_extreme_is_left_out() {
    let page = text("docs/EXTREMES.md");
    let scripts = [text("ci/test"), text("ci/long")];
    // Lanes of the first, and parts of the second: name=(stage …).
    let lanes = scripts.iter().flat_map(|script| script.lines());
    let lanes = lanes.filter_map(|line| line.split_once("=(")?.1.strip_suffix(')'));
    let stages: BTreeSet<&str> = lanes.flat_map(str::split_whitespace).chain(["long"]).collect();
    assert!(stages.contains("unit") && stages.contains("vm") && stages.contains("fuzz"), "{stages:?}");
    assert!(text("ci/unit").contains("cargo test --locked --workspace"));
    let mut named = BTreeSet::new();
    let rows = rows_of(&page);
    for cells in &rows {
        let (row, last) = (cells.join(" | "), cells[2]);
        if last == "the same" {
            continue;
        }
        for name in last.split(", ").map(|name| name.trim_matches('`')) {
            if let Some(command) = name.strip_prefix("ci/") {
                // A script, or what a script does with a word behind it.
                let stage = command.split_whitespace().next_back().unwrap();
                assert!(stages.contains(stage), "{name} is no stage of ci/test, nor ci/long: {row}");
                continue;
            }
            let (path, test) = name.split_once("::").unwrap_or_else(|| panic!("{name}, expected file::test: {row}"));
            assert!(is_run(path), "{path} is no file that ci/unit runs: {row}");
            assert!(tests_of(&text(path)).contains(test), "{path} has no test {test}");
            named.insert(name.to_owned());
        }
    }
    let files = fs::read_dir(root().join("tests/whole")).unwrap().map(|entry| entry.unwrap().file_name());
    let mut extremes: Vec<String> = files
        .filter_map(|name| name.into_string().ok())
        .filter(|name| name.starts_with("extremes") && name != "extremes_page.rs")
        .map(|name| format!("tests/whole/{name}"))
        .collect();
    assert_eq!(extremes.len(), 3, "{extremes:?}");
    extremes.extend(
        ["features", "decisions", "directions", "scores", "speeds"].map(|m| format!("tests/whole/error_bounds/{m}.rs")),
    );
    extremes.extend(
        ["command/hostile.rs", "untouched.rs", "whole/ln.rs", "long/counters.rs", "long/day.rs"]
            .map(|m| format!("tests/{m}")),
    );
    extremes.push("wstac-core/src/model/tests/extremes.rs".into());
    for path in extremes {
        for test in tests_of(&text(&path)) {
            assert!(named.contains(&format!("{path}::{test}")), "{path}::{test} is not on docs/EXTREMES.md");
        }
    }
    println!("{} extremes, {} tests", rows.len(), named.len());
}
