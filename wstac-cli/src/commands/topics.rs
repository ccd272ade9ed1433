//! The topics of `wstac help`: references that belong to no single command.

use std::fmt::Write as _;
use std::io::Write;
use std::sync::LazyLock;

use clap::{Command, CommandFactory, Subcommand};
use serde_json::Value;

use super::output::{Stop, stdout};
use wstac_host::config::DEFAULT_CONFIGURATION;
use wstac_host::record::RECORD_SCHEMA;
use wstac_host::suggest::nearest;

/// What `wstac help` prints of a topic: its text alone.
const ALONE: &str = "{after-help}";

#[derive(Clone, Copy, Debug, Subcommand)]
pub(super) enum Topic {
    /// Every source, camera faults and recovery
    #[command(hide = true, help_template = ALONE, after_help = Self::Sources.text())]
    Sources,
    /// The meaning of the answers
    #[command(hide = true, help_template = ALONE, after_help = Self::Answers.text())]
    Answers,
    /// Every key of the configuration, with its default
    #[command(hide = true, help_template = ALONE, after_help = Self::Config.text())]
    Config,
    /// Every field of the JSON lines, and tables
    #[command(hide = true, help_template = ALONE, after_help = Self::Json.text())]
    Json,
}

impl Topic {
    /// Returns the section of the manual that has the page of a topic: 5 is about formats, 7 about anything else.
    pub(super) fn section(name: &str) -> &'static str {
        if ["config", "json"].contains(&name) { "5" } else { "7" }
    }

    pub(super) fn text(self) -> &'static str {
        static CONFIG: LazyLock<String> = LazyLock::new(|| {
            let indented = DEFAULT_CONFIGURATION.trim_end().replace('\n', "\n  ");
            format!(
                "Configuration:\n  Every key of the file of --config is optional; these are the defaults.\n\n  {indented}\n"
            )
        });
        static JSON: LazyLock<String> =
            LazyLock::new(|| include_str!("topics/json.txt").replace("@@FIELDS@@", &fields()));
        match self {
            Self::Sources => include_str!("topics/sources.txt"),
            Self::Answers => include_str!("topics/answers.txt"),
            Self::Config => &CONFIG,
            Self::Json => &JSON,
        }
    }
}

pub(super) fn run(topic: Topic) -> Result<(), Stop> {
    Ok(stdout().write_all(topic.text().as_bytes())?)
}

/// Returns the error about a topic that there is not. It names those whose help has the word.
pub(super) fn unknown(name: &str) -> clap::Error {
    let commands = super::Arguments::command();
    let topics = commands.get_subcommands().filter(|command| command.is_hide_set()).map(Command::get_name);
    let topics = topics.collect::<Vec<_>>().join(", ");
    let meant = nearest(name, commands.get_subcommands().map(Command::get_name));
    let meant = meant.map_or_else(String::new, |meant| format!("; did you mean {meant}?"));
    let having = having(name, &commands);
    let having = if having.is_empty() { having } else { format!(" (the word is in wstac help {having})") };
    let message =
        format_args!("help about {name:?}{having}, expected a command of wstac --help, or a topic: {topics}{meant}");
    super::wrong_arguments(clap::error::ErrorKind::InvalidSubcommand, message)
}

/// Returns up to four commands and topics whose help has a word: those with an option of this name, or with the name
/// itself, then topics, then those that have it most often.
fn having(word: &str, commands: &Command) -> String {
    let is_it = |other: &str| other.trim_matches('-').eq_ignore_ascii_case(word);
    let of = |command: &Command, name: String| {
        let help = command.clone().render_long_help().to_string();
        let words = help.split(|letter: char| !letter.is_alphanumeric() && !"_-".contains(letter));
        let is_named =
            is_it(command.get_name()) || command.get_arguments().any(|option| option.get_long().is_some_and(is_it));
        ((is_named, command.is_hide_set(), words.filter(|other| is_it(other)).count()), name)
    };
    let mut found = Vec::new();
    for command in commands.get_subcommands() {
        let name = command.get_name();
        found.push(of(command, name.to_owned()));
        found.extend(command.get_subcommands().map(|below| of(below, format!("{name} {}", below.get_name()))));
    }
    found.retain(|((.., count), _)| *count > 0);
    found.sort_by_key(|(rank, _)| std::cmp::Reverse(*rank));
    found.into_iter().take(4).map(|(_, name)| name).collect::<Vec<_>>().join(", ")
}

/// Returns the configuration's keys with these names, each with its comment, below its table.
pub(super) fn keys(names: &[&str]) -> String {
    let (mut text, mut table, mut is_of_key) = (String::new(), "", false);
    for line in DEFAULT_CONFIGURATION.lines() {
        let key = line.split_once(" = ").map(|(key, _)| key.trim_start_matches('#'));
        is_of_key = if line.starts_with(' ') { is_of_key } else { key.is_some_and(|key| names.contains(&key)) };
        if line.starts_with('[') {
            table = line;
        } else if is_of_key {
            // The head of a table comes before its first key.
            let head = std::mem::take(&mut table);
            let end = if head.is_empty() { "" } else { "\n  " };
            let _ = writeln!(text, "  {head}{end}{line}");
        }
    }
    text
}

/// Returns every field of the records that `wstac run --json` prints, from the schema that recordings have.
fn fields() -> String {
    let schema: Value = serde_json::from_str(RECORD_SCHEMA).unwrap_or_default();
    let rules: Vec<&Value> = schema["allOf"].as_array().into_iter().flatten().collect();
    let rule = |kind: &str| {
        rules
            .iter()
            .find(|rule| rule["if"]["properties"]["kind"]["const"] == kind)
            .map_or(&Value::Null, |rule| &rule["then"])
    };
    let mut text = "Fields, each with its unit and the kinds of its records:\n".to_owned();
    text += "  A field that is not always there has a question mark.\n";
    let mut known = Vec::new();
    for name in KINDS.iter().flat_map(|kind| names(&rule(kind)["propertyNames"]["enum"])) {
        if known.contains(&name) {
            continue;
        }
        known.push(name);
        let of: Vec<_> =
            KINDS.iter().filter(|kind| names(&rule(kind)["propertyNames"]["enum"]).any(|has| has == name)).collect();
        let mark = |kind: &str| if names(&rule(kind)["required"]).any(|has| has == name) { "" } else { "?" };
        let others: Vec<_> = KINDS.iter().filter(|kind| !of.contains(kind)).copied().collect();
        let kinds = match (of.len(), others.len()) {
            (_, 0) => format!("all{}", mark(of[0])),
            (6.., _) => format!("all but {}{}", others.join(", "), mark(of[0])),
            _ => of.iter().map(|kind| format!("{kind}{}", mark(kind))).collect::<Vec<_>>().join(", "),
        };
        let stated =
            [&schema["properties"][name]].into_iter().chain(of.iter().map(|kind| &rule(kind)["properties"][name]));
        let Some(field) = stated.into_iter().find(|field| field["description"].is_string()) else { continue };
        describe(&mut text, 2, name, field, &kinds);
        let reference = field["$ref"].as_str().and_then(|name| name.rsplit('/').next()).unwrap_or_default();
        let required =
            if reference.is_empty() { &field["required"] } else { &schema["definitions"][reference]["required"] };
        for (part, field) in field["properties"].as_object().into_iter().flatten() {
            let mark = if names(required).any(|has| has == part) { "" } else { "?" };
            describe(&mut text, 4, &format!("{name}.{part}{mark}"), field, "");
        }
    }
    text
}

/// The kinds of records that `wstac run --json` prints; recordings have others, too.
const KINDS: [&str; 10] =
    ["event", "motion", "features", "contact_end", "slip", "texture", "incomplete", "note", "fault", "end"];

fn names(list: &Value) -> impl Iterator<Item = &str> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// Writes a field's name, unit and kinds, and below them its description in lines that a man page has room for.
fn describe(text: &mut String, indent: usize, name: &str, field: &Value, kinds: &str) {
    let unit = field["unit"].as_str().map(|unit| format!(" [{unit}]")).unwrap_or_default();
    let separator = if kinds.is_empty() { "" } else { "  " };
    let _ = writeln!(text, "{:indent$}{name}{unit}{separator}{kinds}", "");
    let description = field["description"].as_str().unwrap_or_default();
    let words: Vec<_> = description.split(' ').collect();
    let mut line = String::new();
    for (index, word) in words.iter().enumerate() {
        // A last line of a single word would look lost.
        let is_second_to_last = index + 2 == words.len();
        let needed = word.len() + if is_second_to_last { words[index + 1].len() + 1 } else { 0 };
        if !line.is_empty() && indent + 4 + line.chars().count() + 1 + needed > WIDTH {
            let _ = writeln!(text, "{:1$}{line}", "", indent + 4);
            line.clear();
        }
        line += if line.is_empty() { "" } else { " " };
        line += word;
    }
    let _ = writeln!(text, "{:1$}{line}", "", indent + 4);
}

/// Columns of a line.
const WIDTH: usize = 72;
