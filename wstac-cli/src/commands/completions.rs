//! `wstac completions` prints the completion script of a shell.

use std::io::Write;

use clap::CommandFactory;
use clap_complete::Shell;

use super::output::Stop;

/// Print a completion script for a shell
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The shell
    shell: Shell,
}

const HELP: &str = "\
Example for bash:
  wstac completions bash \\
    > ~/.local/share/bash-completion/completions/wstac
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "wstac", &mut script);
    Ok(std::io::stdout().write_all(&script)?)
}
