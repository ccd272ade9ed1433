//! `wstac scene` renders and explains simulated sensors.

mod explain;
mod render;
mod strain;

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use clap::Subcommand;

use super::output::Stop;
use wstac_scene::script::KEYS;

/// Render or explain a simulated sensor, or print whisker strain
///
/// A scene is a simulated sensor: a specimen slides over 25 whiskers, their bases glow, and a camera records them.
/// wstac run scene:… reads a scene like a camera.
#[derive(Debug, clap::Args)]
#[command(after_long_help = KEYS)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Arguments),
    Explain(explain::Arguments),
    Strain(strain::Arguments),
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    match &arguments.command {
        Command::Render(arguments) => render::run(arguments),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Strain(arguments) => strain::run(arguments),
    }
}

/// Returns the name of a scene without `scene:`.
fn named(scene: &OsStr) -> &OsStr {
    scene.as_bytes().strip_prefix(b"scene:").map_or(scene, OsStr::from_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_scene::SceneConfig;

    #[test]
    fn examples_can_be_pasted_from_a_narrow_terminal() {
        // Lines of a configuration are printed two columns further to the right.
        for line in KEYS.lines().chain(wstac_host::config::DEFAULT_CONFIGURATION.lines()) {
            assert!(line.chars().count() <= 72, "{line}");
        }
    }

    #[test]
    fn the_defaults_in_the_help_are_the_defaults() {
        let lines = KEYS.lines().skip_while(|line| !line.starts_with("  specimen"));
        let text: String =
            lines.take_while(|line| !line.starts_with("Several")).fold(String::new(), |text, line| text + line + "\n");
        let expected = SceneConfig::parse_short("Saw3@150").unwrap();
        assert_eq!(SceneConfig::from_toml("help", &text).unwrap(), expected);
        // The test counts the keys, because a missing key would have its default and go unnoticed.
        assert_eq!(text.lines().filter(|line| line.contains(" = ")).count(), 17 + 2 + 8 + 15 + 16 + 7);
    }

    #[test]
    fn the_touches_in_the_help_are_read() {
        let text: String = KEYS
            .lines()
            .skip_while(|line| !line.starts_with("  [[touch]]"))
            .fold(String::new(), |text, line| text + line + "\n");
        let scene = SceneConfig::from_toml("help", &text).unwrap();
        let kinds: Vec<_> = scene.touches.iter().map(wstac_scene::Touch::kind).collect();
        assert_eq!(kinds, ["slide", "press", "twist", "hold", "poke"]);
        // What the help states of a touch is its default, except for what a twist must have.
        for key in ["overlap = 3 ", "approach = ", "lift = ", "hold = 0.2 ", "tilt = ", "direction = ", "pivot = "] {
            let found = text.lines().filter(|line| line.starts_with(&format!("  {key}"))).count();
            assert_eq!(found, if key.starts_with("hold") { 2 } else { 1 }, "{key}");
            let without = text.lines().filter(|line| !line.starts_with(&format!("  {key}")));
            let without = SceneConfig::from_toml("help", &without.collect::<Vec<_>>().join("\n")).unwrap();
            assert_eq!(without, scene, "{key}");
        }
    }
}
