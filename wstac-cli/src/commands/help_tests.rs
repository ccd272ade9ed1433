//! Help and man pages fit terminals of 80 columns.

use clap::{Command, CommandFactory};

use serde_json::Value;

use super::Arguments;
use super::topics::Topic;
use wstac_host::config::Config;

/// Columns of a terminal.
const WIDTH: usize = 80;

/// Columns that a man page has for text whose lines are kept: `man` indents them by 7.
const MAN_WIDTH: usize = WIDTH - 7;

/// Returns every command as it is after changes to the first, each with its full name.
fn commands(command: Command) -> Vec<(String, Command)> {
    fn add(prefix: &str, command: &Command, all: &mut Vec<(String, Command)>) {
        let name = format!("{prefix} {}", command.get_name());
        all.push((name.trim_start().to_owned(), command.clone()));
        command.get_subcommands().for_each(|below| add(&name, below, all));
    }
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let mut all = Vec::new();
    add("", &command, &mut all);
    assert!(all.len() > 20, "{}", all.len());
    all
}

/// Returns the short and the long help of a command.
fn helps(command: &Command) -> [String; 2] {
    let mut command = command.clone();
    [command.render_help().to_string(), command.render_long_help().to_string()]
}

/// Returns the column of a line's first character that is no space, and the text from there on.
fn indented(line: &str) -> (usize, &str) {
    let text = line.trim_start_matches(' ');
    (line.len() - text.len(), text)
}

/// Returns whether a line is the single left-over word of a wrapped paragraph, comment or table cell.
///
/// The line before it has text at the same column: at its start, after a gap of two spaces, or after the dash of a
/// list. A single word with a line below it that is indented further is the heading of a list item.
fn is_left_over(before: &str, line: &str, after: &str) -> bool {
    let (column, text) = indented(line);
    let word = text.strip_prefix("# ").unwrap_or(text);
    if word.is_empty() || word.contains(' ') || is_json(word) || is_table(word) {
        return false;
    }
    let (after_column, after_text) = indented(after);
    if !after_text.is_empty() && after_column > column {
        return false;
    }
    let before: Vec<char> = before.chars().collect();
    let (left, right) = before.split_at(column.min(before.len()));
    let is_at_column = right.first().is_some_and(|first| *first != ' ');
    let is_list_item = left.iter().collect::<String>().trim() == "-";
    is_at_column && (is_list_item || left.iter().all(|space| *space == ' ') || left.ends_with(&[' ', ' ']))
}

/// Returns whether a line is one of a JSON object.
fn is_json(line: &str) -> bool {
    line.starts_with("{\"") || (line.starts_with('"') && line.contains("\":"))
}

/// Returns whether a line is the head of a TOML table.
fn is_table(line: &str) -> bool {
    line.starts_with('[') && line.ends_with(']')
}

/// Returns the lines of a text that are single left-over words, each with the line before it.
fn left_overs(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
    let with_neighbors = |(index, line): (usize, &&str)| {
        let before = index.checked_sub(1).map_or("", |index| lines[index]);
        let after = lines.get(index + 1).copied().unwrap_or_default();
        is_left_over(before, line, after).then(|| format!("{before}\n{line}"))
    };
    lines.iter().enumerate().filter_map(with_neighbors).collect()
}

/// Returns what is wrong with the JSON objects of a text, which start with `{"` in lines of their own.
///
/// An object in several lines ends each but the last between two members, and the next is one column further in.
fn split_objects(text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let (column, object) = indented(line);
        if !object.starts_with("{\"") {
            continue;
        }
        let (mut object, mut depth) = (object.to_owned(), depth_after(0, object));
        while depth > 0 {
            let next = lines.next().unwrap_or_default();
            let (next_column, members) = indented(next);
            if depth != 1 || !object.ends_with(',') || next_column != column + 1 || members.is_empty() {
                wrong.push(format!("{object}\n{next}"));
                break;
            }
            depth = depth_after(depth, members);
            object.push_str(members);
        }
    }
    wrong
}

/// Returns how many brackets are open after a text.
fn depth_after(depth: i32, text: &str) -> i32 {
    text.chars().fold(depth, |depth, character| match character {
        '{' | '[' => depth + 1,
        '}' | ']' => depth - 1,
        _ => depth,
    })
}

#[test]
fn no_line_is_wider_than_80_columns() {
    // Neither where the terminal's width is unknown, as in a pipe, nor in one of 80 columns.
    for command in [Arguments::command(), Arguments::command().term_width(WIDTH)] {
        for (name, command) in commands(command) {
            for line in helps(&command).iter().flat_map(|help| help.lines()) {
                assert!(line.chars().count() <= WIDTH, "{name}: {line}");
            }
        }
    }
}

#[test]
fn no_line_is_a_single_left_over_word() {
    let mut found = Vec::new();
    for (name, command) in commands(Arguments::command().term_width(WIDTH)) {
        for help in helps(&command) {
            found.extend(left_overs(&help).into_iter().map(|lines| format!("{name}:\n{lines}")));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n\n"));
}

#[test]
fn json_examples_are_split_between_members_only() {
    let mut objects = 0;
    for (name, command) in commands(Arguments::command().term_width(WIDTH)) {
        let [_, help] = helps(&command);
        objects += help.lines().filter(|line| line.trim_start().starts_with("{\"")).count();
        let wrong = split_objects(&help);
        assert!(wrong.is_empty(), "{name}:\n{}", wrong.join("\n\n"));
    }
    assert!(objects >= 9, "{objects}");
}

#[test]
fn lines_that_man_pages_keep_fit_80_columns() {
    for (name, command) in commands(Arguments::command()) {
        let more = command.get_after_long_help().or(command.get_after_help()).map(ToString::to_string);
        let more = more.unwrap_or_default();
        for line in more.lines() {
            // A man page leaves out the indentation below a heading.
            let kept = line.strip_prefix("  ").unwrap_or(line);
            assert!(kept.chars().count() <= MAN_WIDTH, "{name}: {line}");
        }
    }
}

#[test]
fn what_the_checks_look_for_is_found() {
    for (text, count) in [
        ("two words\nalone", 1),
        ("  term  a definition that\n        wraps", 1),
        ("  - value: a definition that\n    wraps", 1),
        ("key = 0  # degrees: 0 is right, 270\n         # down", 1),
        ("two words\nnot alone", 0),
        ("a paragraph\n\nword", 0),
        ("a term of two words\nword\n  its definition", 0),
        ("  two words\nword", 0),
        ("a line of words\n  word", 0),
        ("{\"two\": 1}\n\"words\":2}", 0),
        ("two words\n[table]", 0),
    ] {
        assert_eq!(left_overs(text).len(), count, "{text}");
    }
    for (text, count) in [
        ("  {\"a\":1,\n   \"b\":{\"c\":2}}", 0),
        ("  {\"a\":1,\"b\":[1,\n   2]}", 1),
        ("  {\"a\":\n   1}", 1),
        ("  {\"a\":1,\n  \"b\":2}", 1),
        ("  {\"a\":1,", 1),
    ] {
        assert_eq!(split_objects(text).len(), count, "{text}");
    }
}

#[test]
fn the_help_of_run_is_short_and_every_topic_can_be_found() {
    let command = commands(Arguments::command().term_width(WIDTH));
    let of = |name: &str| &command.iter().find(|(known, _)| known == name).unwrap().1;
    let [help, _] = helps(of("wstac run"));
    assert!(help.lines().count() <= 120, "{help}");
    let all = helps(of("wstac"))[1].clone();
    let topics: Vec<_> = of("wstac").get_subcommands().filter(|below| below.is_hide_set()).collect();
    assert_eq!(topics.len(), 4);
    for name in topics.iter().map(|topic| topic.get_name()).chain(["scene"]) {
        assert!(all.contains(&format!("wstac help {name}\n")), "{name}: {all}");
        assert!(help.contains(&format!("wstac help {name}")), "{name}: {help}");
    }
    // A summary has whole keys, each below its table.
    assert!(help.contains("  [trigger]\n  margin = 0.2 ") && !help.contains("[green]"), "{help}");
}

#[test]
fn every_key_of_the_configuration_is_in_its_help() {
    let text = Topic::Config.text();
    let mut keys = 0;
    for table in ["layout", "green", "features", "trigger", "sensor", "speed", "direction"] {
        assert!(text.contains(&format!("\n  [{table}]\n")), "{table}: {text}");
        // The error for a key that is not known names all that are.
        let error = Config::parse(&format!("[{table}]\nno_such_key = 1")).unwrap_err().to_string();
        let (_, known) = error.split_once("expected").unwrap();
        for key in known.split('"').skip(1).step_by(2) {
            assert!(text.contains(&format!("{key} = ")), "[{table}] {key}: {text}");
            keys += 1;
        }
    }
    assert!(keys >= 20, "{keys}");
}

#[test]
fn every_field_of_the_json_lines_is_in_its_help() {
    let text = Topic::Json.text();
    let schema: Value = serde_json::from_str(wstac_host::record::RECORD_SCHEMA).unwrap();
    let mut fields = 0;
    for rule in schema["allOf"].as_array().unwrap() {
        let kind = rule["if"]["properties"]["kind"]["const"].as_str().unwrap();
        // Only recordings have these.
        if ["lost", "sum", "clock"].contains(&kind) {
            continue;
        }
        for name in rule["then"]["propertyNames"]["enum"].as_array().into_iter().flatten() {
            let has_line = |line: &str| line.strip_prefix(&format!("  {} ", name.as_str().unwrap())).is_some();
            assert!(text.lines().any(has_line), "{kind}: {name}");
            fields += 1;
        }
    }
    assert!(fields >= 90, "{fields}");
    // A unit, and whether it is always there.
    assert!(text.contains("\n  time_s [s]  event?, motion, contact_end\n"), "{text}");
    assert!(text.contains("\n    speed.sd? [mm/s]\n"), "{text}");
}
