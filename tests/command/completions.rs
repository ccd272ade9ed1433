//! Tests the completions of bash, fish and zsh, in these shells.

use std::process::Command;

use wstac_tests::command::{good, program, said};
use wstac_tests::folder::Folder;

/// Completes a line as bash does: divides it at blanks and colons, calls the function, and prints what it offers.
const COMPLETE: &str = r#"
source "$1"
COMP_LINE=$2 COMP_POINT=${#2} COMP_TYPE=9 COMP_KEY=9
COMP_WORDS=() word=
for ((at = 0; at < ${#COMP_LINE}; at++)); do
    letter=${COMP_LINE:at:1}
    case $letter in
        ' ') [ -z "$word" ] || COMP_WORDS+=("$word"); word= ;;
        :) [ -z "$word" ] || COMP_WORDS+=("$word"); COMP_WORDS+=(:); word= ;;
        *) word+=$letter ;;
    esac
done
[ "${COMP_LINE: -1}" = : ] || COMP_WORDS+=("$word")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
how=$(complete -p wstac)
function=${how#*-F } function=${function%% *}
"$function" wstac "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\n' "${COMPREPLY[@]}"
"#;

#[test]
fn bash_completes_commands_options_models_and_scenes() {
    let folder = Folder::new("completions");
    let script = folder.file("wstac.bash", good(&["completions", "bash"]));
    folder.file("mine.wsm", "");
    let offered = |line: &str| {
        let mut bash = program("bash");
        bash.args(["--norc", "-c", COMPLETE, "bash"]).arg(&script).arg(line).current_dir(&folder.0);
        let text = printed(&mut bash, line);
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(offered("wstac calib"), ["calibrate"]);
    assert_eq!(offered("wstac run --output-f"), ["--output-format"]);
    assert_eq!(offered("wstac run --output-format "), ["text", "json", "csv"]);
    let models = offered("wstac run a.mcap --model ");
    for name in ["builtin:path-svm", "builtin:taxel-embedding", "mine.wsm"] {
        assert!(models.iter().any(|offer| offer == name), "{name}: {models:?}");
    }
    assert_eq!(offered("wstac run a.mcap --model mi"), ["mine.wsm"]);
    // Bash has kept what is before the colon.
    assert_eq!(offered("wstac run a.mcap --model builtin:path-f"), ["path-forest"]);
    assert_eq!(offered("wstac model eval builtin:taxel-path-b"), ["taxel-path-boosted"]);
    assert_eq!(offered("wstac run scene:Tri"), ["Tri2@150", "Tri3@150", "Tri4@150"]);
    // Every name that is offered can be opened.
    for scene in offered("wstac run scene:") {
        let scene = format!("scene:{scene}");
        assert!(good(&["run", &scene, "--frames", "1"]).contains("end after 1 frame"), "{scene}");
    }
    for model in offered("wstac run --model builtin:") {
        good(&["model", "inspect", &format!("builtin:{model}")]);
    }
}

#[test]
fn fish_completes_commands_options_models_and_scenes() {
    let folder = Folder::new("completions-fish");
    let script = folder.file("wstac.fish", good(&["completions", "fish"]));
    folder.file("mine.wsm", "");
    offers("fish", |line| {
        let mut fish = program("fish");
        fish.args(["--no-config", "-c", "source $argv[1]; complete -C $argv[2]"]).arg(&script).arg(line);
        // A name, and what it is.
        let text = printed(fish.current_dir(&folder.0), line);
        text.lines().map(|line| line.split('\t').next().unwrap_or_default().to_owned()).collect()
    });
}

/// Completes a line in a terminal of zsh, and prints what it offers. The folder has `_wstac`.
const ZSH: &str = r#"
zmodload zsh/zpty
cat > setup.zsh <<'END'
fpath=($PWD $fpath)
autoload -U compinit
compinit -u -D
compadd() {
    local -a all
    builtin compadd -O all "$@"
    print -l -- $all >> offered
    builtin compadd "$@"
}
comppostfuncs=(finish)
finish() { : > done }
bindkey '^I' complete-word
: > ready
END
wait_for() { for try in {1..600}; do [ -e $1 ] && return; sleep 0.1; done; echo "no $1" >&2; exit 1 }
rm -f ready done offered
zpty shell zsh -f -i
zpty -w shell 'source ./setup.zsh'
wait_for ready
zpty -w -n shell "$1"$'\t'
wait_for done
zpty -d shell
cat offered
"#;

#[test]
fn zsh_completes_commands_options_models_and_scenes() {
    let folder = Folder::new("completions-zsh");
    folder.file("_wstac", good(&["completions", "zsh"]));
    folder.file("mine.wsm", "");
    offers("zsh", |line| {
        let mut zsh = program("zsh");
        let text = printed(zsh.args(["-f", "-c", ZSH, "zsh", line]).current_dir(&folder.0), line);
        text.lines().map(str::to_owned).collect()
    });
}

/// Checks what a shell offers, which keeps the whole word, unlike bash.
fn offers(shell: &str, offered: impl Fn(&str) -> Vec<String>) {
    for (line, expected) in [
        ("wstac calib", "calibrate"),
        ("wstac run --output-f", "--output-format"),
        ("wstac run --output-format ", "csv"),
        ("wstac run a.mcap --model ", "builtin:path-svm"),
        ("wstac run a.mcap --model ", "mine.wsm"),
        ("wstac run a.mcap --model builtin:path-f", "builtin:path-forest"),
        ("wstac model eval builtin:taxel-path-b", "builtin:taxel-path-boosted"),
        ("wstac run scene:Tri", "scene:Tri3@150"),
        ("wstac run mi", "mine.wsm"),
    ] {
        let offers = offered(line);
        assert!(offers.iter().any(|offer| offer == expected), "{shell}: {line}: {offers:?}, expected {expected}");
    }
}

/// Runs a shell and returns what it printed.
fn printed(shell: &mut Command, line: &str) -> String {
    let done = shell.output().unwrap_or_else(|error| panic!("{shell:?}: {error}"));
    assert!(done.status.success(), "{line}: {}", said(&done));
    String::from_utf8(done.stdout).unwrap()
}
