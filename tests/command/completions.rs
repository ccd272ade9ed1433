//! Tests the completions of bash, in bash.

use std::process::Command;

use wstac_tests::command::{good, said};
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
        let mut bash = Command::new("bash");
        bash.args(["--norc", "-c", COMPLETE, "bash"]).arg(&script).arg(line).current_dir(&folder.0);
        let done = bash.output().unwrap();
        assert!(done.status.success(), "{line}: {}", said(&done));
        let text = String::from_utf8(done.stdout).unwrap();
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
