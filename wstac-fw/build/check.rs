//! Refuses builds that would link and be wrong, or whose error would not say what is missing.

use std::env;
use std::fs;

use crate::link::H743;

/// The chips: the feature, how names of its targets begin, and the target of its boards.
const CHIPS: &[(&str, &str, &str)] = &[
    ("h743", "thumbv7em", "thumbv7em-none-eabihf"),
    ("rp2040", "thumbv6m", "thumbv6m-none-eabi"),
    ("rp2350", "thumbv8m.main", "thumbv8m.main-none-eabihf"),
];

/// Returns whether a feature of this package is on.
fn has(feature: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase().replace('-', "_"))).is_some()
}

/// Checks that at most one chip is chosen, and that the target is for it.
pub fn target() -> Result<(), String> {
    let chosen: Vec<_> = CHIPS.iter().filter(|(feature, ..)| has(feature)).collect();
    let target = env::var("TARGET").unwrap_or_default();
    match chosen[..] {
        [] if has("rp") => Err("the feature rp is no chip (expected rp2040 or rp2350, which turn it on)".to_owned()),
        [] => Ok(()),
        [(_, begins, _)] if target.starts_with(begins) => Ok(()),
        [(feature, _, expected)] => Err(format!(
            "the feature {feature} is for another processor (found --target {target}, expected --target {expected})"
        )),
        [(first, ..), (second, ..), ..] => Err(format!(
            "the features {first} and {second} are of different chips, expected those of one; \
             help: h743 is a default, which --no-default-features leaves out"
        )),
    }
}

/// Returns whether the board is QEMU's microbit: a Cortex-M0 with 16 KiB of RAM.
pub fn is_microbit() -> bool {
    has("emulated") && !has("mps2") && env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv6m"))
}

/// Checks that the board has memory for the law of 25 taxels. Its stack would overflow without a word.
pub fn wave() -> Result<(), String> {
    if is_microbit() && has("motion") {
        return Err(
            "[speed] estimator is \"wave\", which takes more with the feature motion than the 16 KiB of RAM that this board \
            has, expected \"coherence\" or \"edges\", or a build without motion"
                .to_owned(),
        );
    }
    Ok(())
}

/// Returns the source of the frames per second. The sensors' tables make every one of these.
pub fn fps(chosen: Option<&str>) -> Result<String, String> {
    let text = chosen.unwrap_or("30");
    match text.parse::<u32>() {
        Ok(fps @ 15..=60) => Ok(format!("/// The frames per second of the sensors.\npub const FPS: u32 = {fps};\n")),
        _ => Err(format!("WSTAC_FPS is \"{text}\", expected whole frames per second, 15 to 60; help: without it, 30")),
    }
}

/// Checks that every program for an STM32H743 says where its flash is.
pub fn rows() -> Result<(), String> {
    println!("cargo:rerun-if-changed=Cargo.toml");
    if !has("h743") {
        return Ok(());
    }
    let manifest: toml::Table = fs::read_to_string("Cargo.toml")
        .map_err(|error| error.to_string())
        .and_then(|text| text.parse().map_err(|error: toml::de::Error| error.to_string()))
        .map_err(|error| format!("Cargo.toml: {error}"))?;
    let programs = manifest.get("bin").and_then(toml::Value::as_array).into_iter().flatten();
    for program in programs {
        let name = program.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        let required = program.get("required-features").and_then(toml::Value::as_array).into_iter().flatten();
        let is_built = required.filter_map(toml::Value::as_str).all(has);
        if is_built && !H743.iter().any(|(known, ..)| *known == name) {
            return Err(format!(
                "wstac-fw/build/link.rs: H743 has no row for the program {name} of Cargo.toml, expected where its flash \
                 begins, and its KiB; help: step 2 of docs/BOARDS.md"
            ));
        }
    }
    Ok(())
}
