//! Tests each row of the table "From 0.3": what was removed says what to use instead or is gone, and that is there.

use std::any::TypeId;
use std::collections::{BTreeSet, HashSet};
use std::fs;
use std::iter;
use std::path::{Path, PathBuf};
use std::process::Command;

use wstac_tests::command::{ends, good, printed, run, said, says};
use wstac_tests::folder::{Folder, text};

/// How a name in the table is tested.
#[derive(Clone, Copy, PartialEq)]
enum Test {
    /// The program or a script says what to use instead.
    Answer,
    /// A configuration with this key is refused.
    Key,
    /// The compiler of C refuses the expression.
    C,
    /// An item of Rust has a second name, which is deprecated.
    Alias,
    /// The sources have no such item or word.
    Gone,
    /// A test of [`ELSEWHERE`] asks for it.
    Elsewhere,
}

/// The starts of the rows that the tests of names do not or not wholly ask for, and the tests that do.
const ELSEWHERE: [(&str, &str, &str); 11] = [
    ("`wstac-node --ros`", "node/check.py", "def check_removed"),
    ("`wstac-node --zenoh`", "node/check.py", "def check_removed"),
    ("`wstac view left=", "view/check.py", "def check_removed"),
    ("keys `←`", "view/check.py", "def check_removed"),
    ("`wstac view --record`", "view/check.py", "def check_removed"),
    ("columns ", "command/removed.rs", "fn a_map_of_before_is_refused_and_a_page_has_one_table_and_one_panel"),
    ("panels ", "command/removed.rs", "fn a_map_of_before_is_refused_and_a_page_has_one_table_and_one_panel"),
    ("the curve of ", "../wstac-plot/src/tests.rs", "fn a_law_of_durations_says_when_a_taxel_is_lit"),
    ("FILE.npz.part", "command/signals.rs", "fn every_other_command_ends_at_once_and_leaves_nothing"),
    ("FILE.png ", "command/program.rs", "fn figures_are_svg_and_other_names_say_what_converts_them"),
    ("the default estimator ", "command/removed.rs", "fn the_default_estimator_is_the_wave"),
];

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

/// Returns how a name of a row is tested.
fn test_of(row: &str, name: &str) -> Test {
    match name {
        _ if row.starts_with("C: ") => Test::C,
        _ if row.contains("for one release)") => Test::Alias,
        _ if name.starts_with("wstac ") || name.starts_with("ci/") => Test::Answer,
        _ if name.contains(" = ") => Test::Key,
        _ if name.contains('_') => Test::Gone,
        _ => Test::Elsewhere,
    }
}

/// Returns the names that are tested in one way, with what to use instead.
fn removed(test: Test) -> Vec<(&'static str, &'static str)> {
    let names = rows().into_iter().flat_map(|(row, instead)| code(row).map(move |name| (row, name, instead)));
    let found: Vec<_> = names.filter(|(row, name, _)| test_of(row, name) == test).collect();
    assert!(!found.is_empty());
    found.into_iter().map(|(_, name, instead)| (name, instead)).collect()
}

#[test]
fn every_row_has_a_test_and_every_test_a_row() {
    let is_elsewhere = |row: &str| code(row).all(|name| test_of(row, name) == Test::Gone) && !row.contains("::");
    let has_more = |row: &str| code(row).any(|name| test_of(row, name) == Test::Elsewhere);
    let left: Vec<_> =
        rows().into_iter().map(|(row, _)| row).filter(|row| is_elsewhere(row) || has_more(row)).collect();
    assert_eq!(left.len(), ELSEWHERE.len(), "{left:#?}");
    for (row, (start, file, test)) in left.into_iter().zip(ELSEWHERE) {
        assert!(row.starts_with(start), "{row}: expected a row that starts with {start}");
        let text = fs::read_to_string(root().join("tests").join(file)).unwrap();
        assert!(text.contains(&format!("\n{test}(")), "{row}: {file} has no {test}");
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

#[test]
fn every_removed_command_and_argument_says_what_to_use_instead() {
    for (line, instead) in removed(Test::Answer) {
        let arguments: Vec<_> = line.split(' ').skip(1).collect();
        let last = arguments.last().unwrap();
        let (done, found) = if let Some(script) = line.split(' ').next().filter(|name| name.starts_with("ci/")) {
            let done = Command::new(root().join(script)).args(&arguments).output().unwrap();
            (done, format!("\"{last}\", expected none behind table; help: --shard and --merge were removed: "))
        } else if arguments.contains(&"--budget") {
            (run(&arguments), format!("term \"{last}\": was removed; help: "))
        } else {
            (run(&arguments), format!("{line}: was removed; help: "))
        };
        says(&done, 2, &iter::once(&*found).chain(code(instead)).collect::<Vec<_>>());
    }
}

#[test]
fn a_key_that_was_removed_says_what_to_use_instead() {
    let folder = Folder::new("removed-key");
    for (key, instead) in removed(Test::Key) {
        let config = folder.file("removed.toml", format!("[speed]\n{key}\n"));
        let name = if key.starts_with("law") { key } else { key.split(' ').next().unwrap() };
        let found = format!("[speed] has {name}, which was removed");
        let parts: Vec<_> = [&*found, "; help: "].into_iter().chain(code(instead)).collect();
        ends(&["run", "scene:Saw3@150", "--config", text(&config)], 1, &parts);
    }
}

#[test]
fn the_default_estimator_is_the_wave() {
    assert!(good(&["help", "config"]).contains("\n  estimator = \"wave\" "));
}

#[test]
fn a_map_of_before_is_refused_and_a_page_has_one_table_and_one_panel() {
    let folder = Folder::new("removed-map");
    let kept = include_str!("../../wstac-tradeoff/data/map.csv");
    let map = folder.file("map.csv", kept.replacen(",objects\n", ",host_frame_ns,host_event_ns\n", 1));
    folder.file("base.toml", "");
    ends(&["trade", "--map", text(&map)], 1, &["line 1: ", "_ns\"", "; help: wstac trade makes another map"]);
    good(&["trade", "--map", "kept", "-o", &folder.path("new")]);
    let [page, figure] = ["new/trade.md", "new/trade.svg"].map(|name| fs::read_to_string(folder.0.join(name)).unwrap());
    assert_eq!(page.matches("\n| --- |").count(), 1, "{page}");
    assert!(figure.contains(">specimen accuracy (%)<") && !figure.contains(">a  ") && !figure.contains(">b  "));
}

#[test]
fn c_that_was_removed_does_not_compile_and_its_replacement_does() {
    let folder = Folder::new("removed-c");
    let folders = ["wstac-fw/capi", "wstac-c"].map(|of| format!("-I{}/{of}/include", text(root())));
    let compiled = |expression: &str| {
        let start = "#include <wstac_fw.h>\nWstacFwSpeedLaw law;\n_Bool physical;\nint size = sizeof";
        let file = folder.file("removed.c", format!("{start}({expression});\n"));
        let done = Command::new("cc").args(&folders).args(["-fsyntax-only", text(&file)]).env("LC_ALL", "C").output();
        (done.as_ref().unwrap().status.success(), said(&done.unwrap()))
    };
    for (name, instead) in removed(Test::C) {
        let (is_there, why) = compiled(name);
        let is_named = why.contains(name.rsplit('.').next().unwrap()) || why.contains("too many arguments");
        assert!(!is_there && is_named, "{name}: {why}");
        for replacement in code(instead) {
            assert_eq!(compiled(replacement), (true, String::new()), "{replacement}");
        }
    }
}

/// Returns the files that have names of users: the name of their crate, their path and text.
fn sources() -> Vec<(String, PathBuf, String)> {
    let endings = ["rs", "py", "h", "toml"].map(|end| format!("wstac*.{end}"));
    let mut git = Command::new("git");
    let listed = git.arg("ls-files").args(endings).current_dir(root()).output().unwrap();
    // The file with the answers has the removed names itself.
    let listed = printed(&listed);
    let files = listed.lines().filter(|file| *file != "wstac-cli/src/commands/removed.rs");
    let package = |file: &str| file.split('/').next().unwrap().replace('-', "_");
    files.map(|file| (package(file), root().join(file), fs::read_to_string(root().join(file)).unwrap())).collect()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_').filter(|word| !word.is_empty())
}

/// Returns the words of these files, and the public items of the crates: each as "crate parent name" and as "parent
/// name". The parent is a module or a type. A method has a second name with its arguments.
fn names(sources: &[(String, PathBuf, String)]) -> HashSet<String> {
    const KINDS: [&str; 8] = ["const", "enum", "fn", "mod", "static", "struct", "trait", "type"];
    let mut found: HashSet<_> = sources.iter().flat_map(|(.., text)| words(text)).map(str::to_owned).collect();
    for (package, path, content) in
        sources.iter().filter(|(_, path, _)| path.extension().is_some_and(|end| end == "rs"))
    {
        let name = |path: &Path| text(path.file_stem().unwrap().as_ref()).to_owned();
        let module = match &*name(path) {
            "lib" => package.clone(),
            "mod" => name(path.parent().unwrap()),
            other => other.to_owned(),
        };
        let (mut parents, mut is_use) = (Vec::new(), false);
        for line in content.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let mut insert = |parents: &[&str], names: &[&str]| {
                for (parent, name) in parents.iter().flat_map(|parent| names.iter().map(move |name| (parent, name))) {
                    found.extend([format!("{package} {parent} {name}"), format!("{parent} {name}")]);
                }
            };
            let all: Vec<_> = words(line).collect();
            let is_kind = |word: &str| KINDS.contains(&word);
            let item = all.windows(2).find(|two| is_kind(two[0]) && !is_kind(two[1])).map(|two| two[1]);
            let (indent, is_public) = (line.len() - line.trim_start().len(), line.trim_start().starts_with("pub "));
            is_use |= line.starts_with("pub use ");
            if is_use {
                insert(&[&module], &all);
                is_use = !line.contains(';');
            } else if indent == 0 && (item.is_some() || all.first() == Some(&"impl")) {
                insert(&[&module], item.filter(|_| is_public).as_slice());
                let has_members = ["impl", "struct", "enum", "trait"].iter().any(|kind| all.contains(kind));
                parents = if has_members { all } else { Vec::new() };
            } else if indent == 4 && (is_public || parents.contains(&"trait")) {
                let name = item.or_else(|| all.get(1).copied()).unwrap_or_default();
                let head = line.split_once("fn ").and_then(|(_, head)| Some(head.split_once(')')?.0.to_owned() + ")"));
                insert(&parents, &[name, head.as_deref().unwrap_or(name)]);
            } else if indent == 4 && parents.contains(&"enum") {
                insert(&parents, all.get(..1).unwrap_or_default());
            }
        }
    }
    found
}

#[test]
fn items_and_words_that_were_removed_are_gone() {
    let names = names(&sources());
    for (name, _) in removed(Test::Gone) {
        let place = name.rsplit_once("::").map(|(path, last)| {
            // Of a method with arguments, what is before its result.
            let (package, parent) = (path.split("::").next().unwrap(), path.split("::").last().unwrap());
            [package, parent, last.split_inclusive(')').next().unwrap()].join(" ")
        });
        assert!(!names.contains(place.as_deref().unwrap_or(name)), "{name} is there");
    }
}

#[test]
fn everything_to_use_instead_is_there() {
    let names = names(&sources());
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
                assert!(root().join(used.split(' ').next().unwrap()).is_file(), "{what}: {used}");
            } else if let Some((path, last)) = used.split('(').next().unwrap().rsplit_once("::") {
                let place = format!("{} {last}", path.split("::").last().unwrap());
                assert!(names.contains(&place), "{what}: {used} is nowhere");
            } else if !used.starts_with("numpy.") {
                for word in words(used.split('(').next().unwrap()).filter(|word| !word.chars().all(char::is_numeric)) {
                    assert!(names.contains(word), "{what}: {used}: {word} is nowhere");
                }
            }
        }
    }
    assert!(asked > 40, "{asked}");
}

/// A former name works for one release, and the compiler says what to use instead.
#[test]
#[expect(deprecated)]
fn former_names_are_deprecated_names_of_the_same_types() {
    fn is<A: 'static, B: 'static>() -> bool {
        TypeId::of::<A>() == TypeId::of::<B>()
    }
    use wstac_core::reason::Reason;
    assert!(is::<wstac_core::trigger::Trigger, wstac_core::paper::trigger::Trigger>());
    assert!(is::<wstac_core::motion::Motion, wstac_core::touch::motion::Motion>());
    assert!(is::<wstac_core::speed::NoSpeed, Reason>() && is::<wstac_core::direction::Unclear, Reason>());
    assert!(is::<wstac_host::source::names::Sensor, wstac_host::source::names::SensorSpec>());
    let mut found = BTreeSet::new();
    for (package, _, text) in sources() {
        let items = text.split("#[deprecated(since = \"0.4.0\", note = ").skip(1);
        let items = items.filter_map(|after| words(after.lines().nth(1)?).nth(2));
        // The macro's own pattern has `$name`.
        let modules = text.split("\nformer!(").skip(1).filter_map(|after| after.lines().next()?.rsplit('"').next());
        let all = items.chain(modules.flat_map(words)).filter(|name| *name != "name");
        found.extend(all.map(|name| format!("{package}::{name}")));
    }
    let aliases = removed(Test::Alias).into_iter();
    let ends_of =
        |(name, _): (&str, &str)| [name.split_once("::").unwrap().0, name.rsplit_once("::").unwrap().1].join("::");
    assert_eq!(found, aliases.map(ends_of).collect());
}

#[test]
fn an_option_of_another_command_is_unknown_as_before() {
    ends(&["run", "scene:Saw3@150", "--loop"], 2, &["unexpected argument '--loop'"]);
}
