//! `wstac man` writes the help of every command as man pages.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::{Command, CommandFactory};
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use super::output::Stop;
use super::topics::Topic;
use wstac_host::atomic_write::atomic_write;
use wstac_host::error::Error;

/// Write the man pages of all commands to a folder
///
/// To read a page: man FOLDER/wstac-run.1. Packages of wstac contain the pages.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The folder
    ///
    /// It is created if it does not exist. Pages in it are overwritten.
    folder: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let mut command = super::Arguments::command().disable_help_subcommand(true);
    command.build();
    write_pages(command, &arguments.folder)?;
    Ok(())
}

/// Writes the pages of a command and of its subcommands.
fn write_pages(command: Command, folder: &Path) -> Result<(), Error> {
    let failed = |error: io::Error| Error::io(folder.display(), error);
    fs::create_dir_all(folder).map_err(failed)?;
    for below in command.get_subcommands() {
        write_pages(below.clone(), folder)?;
    }
    let (name, page) = page(command).map_err(failed)?;
    atomic_write(&folder.join(name), page)
}

/// Returns the name and the content of a command's or topic's page.
fn page(mut command: Command) -> io::Result<(String, Vec<u8>)> {
    // The generator would run the lines of tables and examples together.
    let more = command.get_after_long_help().or(command.get_after_help()).map(|help| as_it_stands(&help.to_string()));
    command = command.after_help(None::<&str>).after_long_help(None::<&str>);
    // Only topics are no commands of the list.
    let is_topic = command.is_hide_set();
    let section = if is_topic { Topic::section(command.get_name()) } else { "1" };
    let man = Man::new(command).source(concat!("wstac ", env!("CARGO_PKG_VERSION"))).manual("WSTac").section(section);
    let mut page = Vec::new();
    if is_topic {
        man.render_title(&mut page)?;
        man.render_name_section(&mut page)?;
    } else {
        man.render(&mut page)?;
    }
    if let Some(more) = more {
        more.to_writer(&mut page)?;
    }
    Ok((man.get_filename(), page))
}

/// Returns text whose lines are kept. A line without indentation that ends with a colon is a heading.
fn as_it_stands(text: &str) -> Roff {
    let mut roff = Roff::new();
    roff.control("nf", []);
    for line in text.lines() {
        match line.strip_suffix(':') {
            Some(heading) if !heading.is_empty() && !heading.starts_with(' ') => {
                roff.control("fi", []).control("SH", [heading.to_uppercase().as_str()]).control("nf", []);
            }
            _ => {
                roff.text([roman(line.strip_prefix("  ").unwrap_or(line))]);
            }
        }
    }
    roff.control("fi", []);
    roff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_stay_lines_and_no_text_is_a_request() {
        let roff = as_it_stands("Sources:\n  a   b\n\n  .TH x\n  'x' \\n - …\nNot a heading").render();
        let body = roff.split_once(".nf").unwrap().1;
        let lines: Vec<&str> = body.lines().collect();
        assert_eq!(lines[..6], ["", ".fi", ".SH SOURCES", ".nf", "a   b", ""]);
        assert!(lines[6].starts_with("\\&.TH"), "{roff}");
        assert!(!lines[7].starts_with('\'') && lines[7].contains("\\\\n"), "{roff}");
        assert_eq!(lines[8..], ["Not a heading", ".fi"]);
    }

    #[test]
    fn every_command_has_a_page_with_its_name() {
        let mut command = super::super::Arguments::command().disable_help_subcommand(true);
        command.build();
        let folder = std::env::temp_dir().join(format!("wstac-man-{}", std::process::id()));
        write_pages(command.clone(), &folder).unwrap();
        for below in command.get_subcommands() {
            let name = below.get_name();
            let section = if below.is_hide_set() { Topic::section(name) } else { "1" };
            let page = fs::read_to_string(folder.join(format!("wstac-{name}.{section}"))).unwrap();
            assert!(page.contains(&format!("wstac\\-{}", name.replace('-', "\\-"))), "{page}");
        }
        assert!(folder.join("wstac-model-import.1").is_file());
        let run = fs::read_to_string(folder.join("wstac-run.1")).unwrap();
        assert!(run.contains("\n.SH SOURCES\n.nf\n/dev/videoN "), "{run}");
        // A topic is no command: its page has no synopsis.
        let config = fs::read_to_string(folder.join("wstac-config.5")).unwrap();
        assert!(config.contains("margin = 0.2") && !config.contains("SYNOPSIS"), "{config}");
        fs::remove_dir_all(&folder).unwrap();
    }
}
