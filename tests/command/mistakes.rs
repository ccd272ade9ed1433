//! Tests what the command says after common mistakes: it names what was probably meant.

use wstac_tests::command::{run, said};

#[test]
fn a_command_with_a_typo_is_suggested() {
    for (given, meant) in [("rnu", "run"), ("tarin", "train"), ("mnoitor", "monitor")] {
        let done = run(&[given]);
        assert_eq!(done.status.code(), Some(2));
        assert!(said(&done).contains(&format!("'{meant}'")), "{given}: {}", said(&done));
    }
    for given in ["zzz", "xy"] {
        let done = run(&[given]);
        assert_eq!(done.status.code(), Some(2));
        assert!(!said(&done).contains("similar"), "{given}: {}", said(&done));
    }
}

#[test]
fn help_about_what_there_is_not_lists_the_topics() {
    for (given, expected) in [("nothing", "a topic: sources, answers, config, json\n"), ("rnu", "; did you mean run?")]
    {
        let done = run(&["help", given]);
        assert_eq!(done.status.code(), Some(2));
        assert!(said(&done).contains(expected), "{given}: {}", said(&done));
    }
}

#[test]
fn names_without_their_prefix_are_explained() {
    for (arguments, meant) in [
        (&["run", "Saw3@150"][..], "a simulated slide is scene:Saw3@150"),
        (&["run", "scene:Saw3@150", "--model", "path-svm"], "did you mean builtin:path-svm?"),
        (&["run", "scene:Saw3@150", "--model", "builtin:path-smv"], "did you mean builtin:path-svm?"),
        (&["run", "scene:Saw3@150", "--config", "none.toml"], "none.toml: no such file or folder"),
    ] {
        let done = run(arguments);
        assert_eq!(done.status.code(), Some(1));
        assert!(said(&done).contains(meant), "{}", said(&done));
    }
}

#[test]
fn a_study_without_arguments_explains_itself() {
    let done = run(&["trade"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("Usage: wstac trade"), "{}", said(&done));
}
