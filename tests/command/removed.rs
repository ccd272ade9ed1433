//! Tests that `wstac` says what to use instead of a command or an option that was removed.

use std::any::TypeId;
use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use wstac_tests::command::{ends, good, run, said, says};

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
        says(&done, 2, &[&format!("{line}: was removed; help: ")]);
        for code in code(instead) {
            assert!(said(&done).contains(code), "{line}: {} lacks {code}", said(&done));
        }
    }
}

/// Appends the texts of the files in a folder that have names of users: code, headers, messages, configurations.
fn append_sources(folder: &Path, all: &mut String) {
    // It names replacements itself.
    let answers = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("wstac-cli/src/commands/removed.rs");
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name());
        let ends = ["rs", "py", "h", "toml"].iter().any(|end| path.extension().is_some_and(|found| found == *end));
        if entry.file_type().unwrap().is_dir() {
            if name != "target" && !name.to_string_lossy().starts_with('.') {
                append_sources(&path, all);
            }
        } else if ends && path != answers {
            *all += &fs::read_to_string(&path).unwrap_or_default();
        }
    }
}

/// Returns the words of all crates and of the packages for Python, C and ROS.
fn names() -> HashSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut all = String::new();
    for entry in fs::read_dir(root).unwrap().map(Result::unwrap) {
        if entry.file_name().to_string_lossy().starts_with("wstac-") {
            append_sources(&entry.path(), &mut all);
        }
    }
    words(&all).map(str::to_owned).collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').filter(|word| !word.is_empty())
}

#[test]
fn everything_to_use_instead_is_there() {
    let (names, root) = (names(), Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap());
    let mut asked = 0;
    for (what, instead) in rows() {
        for used in code(instead) {
            asked += 1;
            if let Some(arguments) = used.strip_prefix("wstac ") {
                let (command, options) = arguments.split_once(' ').unwrap_or((arguments, ""));
                let help = good(&["help", command]);
                assert!(help.contains("Usage:"), "{what}: {used}: {help}");
                for option in options.split(' ').filter(|option| option.starts_with("--")) {
                    assert!(help.split_whitespace().any(|word| word == option), "{what}: {used}: no {option}");
                }
            } else if used.starts_with("ci/") {
                assert!(root.join(used.split(' ').next().unwrap()).is_file(), "{what}: {used}");
            } else if !used.starts_with("numpy.") {
                // Of a path, its last part; of a call, its name.
                let name = used.split('(').next().unwrap().rsplit("::").next().unwrap();
                for word in words(name).filter(|word| !word.chars().all(char::is_numeric)) {
                    assert!(names.contains(word), "{what}: {used}: {word} is nowhere");
                }
            }
        }
    }
    assert!(asked > 40, "{asked}");
}

/// What has another name now works by its former one, for one release.
#[test]
#[expect(deprecated)]
fn former_names_are_the_same_types() {
    fn is<A: 'static, B: 'static>() -> bool {
        TypeId::of::<A>() == TypeId::of::<B>()
    }
    use wstac_core::reason::Reason;
    assert!(is::<wstac_core::trigger::Trigger, wstac_core::paper::trigger::Trigger>());
    assert!(is::<wstac_core::motion::Motion, wstac_core::touch::motion::Motion>());
    assert!(is::<wstac_core::speed::NoSpeed, Reason>() && is::<wstac_core::direction::Unclear, Reason>());
    assert!(is::<wstac_host::source::names::Sensor, wstac_host::source::names::SensorSpec>());
}

#[test]
fn an_argument_of_a_script_that_was_removed_ends_it() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("ci/train");
    let done = Command::new(script).args(["table", "--shard", "1/2"]).output().unwrap();
    says(&done, 2, &["--shard and --merge were removed"]);
}

/// Returns the text of a module's file, the crate's own if the path is empty.
fn module_text(folder: &Path, module: &str) -> Option<String> {
    let file = folder.join(if module.is_empty() { "lib".into() } else { module.replace("::", "/") });
    let mut places = [file.with_extension("rs"), file.join("mod.rs")].into_iter();
    places.find_map(|place| fs::read_to_string(place).ok())
}

/// The last part of a path into a crate, which that crate defines no more.
#[test]
fn items_that_were_removed_are_gone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut asked = 0;
    for (what, _) in rows().into_iter().filter(|(what, _)| !what.contains("for one release")) {
        for item in code(what) {
            let Some((name, path)) = item.split_once("::") else { continue };
            let folder = root.join(name.replace('_', "-")).join("src");
            if !name.starts_with("wstac_") || !folder.is_dir() {
                continue;
            }
            let (module, last) = path.rsplit_once("::").unwrap_or(("", path));
            asked += 1;
            let Some(text) = module_text(&folder, module) else {
                // The module is gone, or what comes before the last part is a type: the one around it says so.
                let (around, gone) = module.rsplit_once("::").unwrap_or(("", module));
                let text = module_text(&folder, around).unwrap_or_else(|| panic!("{item}: no file of {around}"));
                let all: Vec<_> = words(&text).collect();
                let is_there =
                    all.windows(2).any(|two| ["mod", "struct", "enum", "trait"].contains(&two[0]) && two[1] == gone);
                assert!(!is_there, "{item}: {gone} is there");
                continue;
            };
            let public: Vec<_> = words(&text).collect();
            let is_there = public.windows(3).any(|three| three[0] == "pub" && three[2] == last);
            assert!(!is_there, "{item} is there");
        }
    }
    assert!(asked > 8, "{asked}");
}

#[test]
fn an_option_of_another_command_is_unknown_as_before() {
    ends(&["run", "scene:Saw3@150", "--loop"], 2, &["unexpected argument '--loop'"]);
}
