//! `wstac completions` prints the completion script of a shell.

use std::fmt::Write as _;
use std::io::Write;

use clap::CommandFactory;
use clap_complete::Shell;

use super::output::Stop;
use wstac_host::model_file::ModelFile;

/// Print a completion script for a shell
///
/// The scripts of bash, fish and zsh also complete the names of the models that come with wstac, and those of scenes.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The shell
    shell: Shell,
}

const HELP: &str = "\
Example for bash:
  wstac completions bash \
    > ~/.local/share/bash-completion/completions/wstac
";

/// Completes the names of models and scenes in bash, and everything else as before.
///
/// Bash takes a name apart at its colons, so that only what is behind the last one is completed.
const BASH: &str = r#"
_wstac_names() {
    local line word before names
    line=${COMP_LINE:0:COMP_POINT}
    word=${line##*[[:space:]]}
    before=${line%"$word"}
    before=${before%"${before##*[![:space:]]}"}
    before=${before##*[[:space:]]}
    case "$before $word" in
        "--model "*) names="$_wstac_models" ;;
        *" builtin:"*) names="$_wstac_models" ;;
        *" scene:"*) names="$_wstac_scenes" ;;
        *) _wstac "$@"; return ;;
    esac
    COMPREPLY=($(compgen -W "$names" -- "$word"))
    if [[ "$before" == --model && "$word" != builtin:* ]]; then
        COMPREPLY+=($(compgen -f -- "$word"))
        compopt -o filenames 2> /dev/null
    fi
    if [[ "$word" == scene:* ]]; then
        compopt -o nospace 2> /dev/null
    fi
    if [[ "$word" == *:* && "$COMP_WORDBREAKS" == *:* ]]; then
        COMPREPLY=("${COMPREPLY[@]#"${word%"${word##*:}"}"}")
    fi
}

complete -F _wstac_names -o bashdefault -o default wstac
"#;

/// Completes the names of models and scenes in zsh, and everything else as the function that it takes the name of.
const ZSH: &str = r#"
_wstac() {
    case "$words[CURRENT - 1] $PREFIX" in
        "--model "*) _alternative "files:file:_files" "models:model:compadd -a _wstac_models" ;;
        *" builtin:"*) compadd -a _wstac_models ;;
        *" scene:"*) compadd -S "" -a _wstac_scenes ;;
        *) _wstac_arguments "$@" ;;
    esac
}
"#;

/// The specimens of scenes, at a speed that all models know.
const SPECIMENS: [&str; 10] = ["Fla0", "Sin2", "Sin3", "Sin4", "Saw2", "Saw3", "Saw4", "Tri2", "Tri3", "Tri4"];

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "wstac", &mut script);
    let models: Vec<_> = ModelFile::full_names().collect();
    let scenes = SPECIMENS.map(|specimen| format!("scene:{specimen}@150"));
    let script = with_names(arguments.shell, String::from_utf8_lossy(&script).into_owned(), &models, &scenes);
    Ok(std::io::stdout().write_all(script.as_bytes())?)
}

/// Returns a script that completes names, too.
fn with_names(shell: Shell, mut script: String, models: &[String], scenes: &[String]) -> String {
    let (models, scenes) = (models.join(" "), scenes.join(" "));
    // Writing to a string does not fail.
    match shell {
        Shell::Bash => {
            let _ = write!(script, "\n_wstac_models=\"{models}\"\n_wstac_scenes=\"{scenes}\"\n{BASH}");
        }
        Shell::Fish => {
            let _ = writeln!(script, "complete -c wstac -l model -x -a \"{models} (__fish_complete_path)\"");
            for (beginning, names) in [("bu", models), ("sc", scenes)] {
                let when = format!("string match -q '{beginning}*' -- (commandline -ct)");
                let _ = writeln!(script, "complete -c wstac -n \"{when}\" -a \"{names}\"");
            }
        }
        Shell::Zsh => {
            let names = format!("_wstac_models=({models})\n_wstac_scenes=({scenes})\n{ZSH}");
            script = script.replace("\n_wstac() {\n", &format!("\n{names}\n_wstac_arguments() {{\n"));
        }
        _ => {}
    }
    script
}
