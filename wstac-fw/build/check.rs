//! Refuses builds that would link and be wrong, or whose error would not say what is missing.

use std::env;
use std::fs;

use crate::link::STM32;

/// The chips: the feature, how names of its targets begin, and the target of its boards.
const CHIPS: &[(&str, &str, &str)] = &[
    ("h743", "thumbv7em", "thumbv7em-none-eabihf"),
    ("h747", "thumbv7em", "thumbv7em-none-eabihf"),
    // Its Cortex-M33 runs code of a Cortex-M4F, with the DSP instructions that thumbv8m.main does without.
    ("u575", "thumbv7em", "thumbv7em-none-eabihf"),
    ("rp2040", "thumbv6m", "thumbv6m-none-eabi"),
    ("rp2350", "thumbv8m.main", "thumbv8m.main-none-eabihf"),
];

/// The chips with a choice of clocks: those of the core in MHz, the default first, and in words.
const CLOCKS: &[(&str, &[u32], &str)] = &[("rp2040", &[120, 72, 48], "120, 72 or 48"), ("u575", &[72, 24], "72 or 24")];

/// Returns whether a feature of this package is on.
fn has(feature: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase().replace('-', "_"))).is_some()
}

/// Checks that at most one chip is chosen, and that the target is for it.
pub fn target() -> Result<(), String> {
    let chosen: Vec<_> = CHIPS.iter().filter(|(feature, ..)| has(feature)).collect();
    let target = env::var("TARGET").unwrap_or_default();
    match chosen[..] {
        [] if has("stm32") => {
            Err("the feature stm32 is no chip (expected h743, h747 or u575, which turn it on)".to_owned())
        }
        [] if has("rp") => Err("the feature rp is no chip (expected rp2040 or rp2350, which turn it on)".to_owned()),
        [] => Ok(()),
        [("u575", ..)] if has("usb") => {
            Err("the feature usb is not for an STM32U575; help: --no-default-features leaves it out".to_owned())
        }
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

/// Returns the source of the numbers that variables name.
pub fn numbers(variable: impl Fn(&str) -> Option<String>) -> Result<String, String> {
    let text = |name| variable(name).unwrap_or_default();
    let number = |name, default: u32| variable(name).map_or(Some(default), |text| text.parse().ok());
    // The sensors' tables make every one of these.
    let Some(fps @ 15..=60) = number("WSTAC_FPS", 30) else {
        return Err(format!(
            "WSTAC_FPS is \"{}\", expected whole frames per second, 15 to 60; help: without it, 30",
            text("WSTAC_FPS")
        ));
    };
    let (clocks, said) =
        CLOCKS.iter().find(|(chip, ..)| has(chip)).map_or((&[120][..], ""), |(_, clocks, said)| (clocks, said));
    let Some(mhz) = number("WSTAC_MHZ", clocks[0]).filter(|mhz| clocks.contains(mhz)) else {
        let found = text("WSTAC_MHZ");
        if said.is_empty() {
            return Err(format!("WSTAC_MHZ is \"{found}\", which only a Pico and an STM32U575 have; help: unset it"));
        }
        let usual = clocks[0];
        return Err(format!(
            "WSTAC_MHZ is \"{found}\", expected the MHz of the core, {said}; help: without it, {usual}"
        ));
    };
    let Some(rest) = rest(&variable) else {
        return Err(format!(
            "WSTAC_REST is \"{}\", expected whole seconds without light, 5 to 3600; help: without it, the board \
             never rests",
            text("WSTAC_REST")
        ));
    };
    // RP2040-E16: events of USB get lost if the core's clock is not a tenth faster than USB's 48 MHz.
    if mhz == 48 && has("usb") {
        return Err(
            "WSTAC_MHZ is \"48\", with which USB loses events (RP2040-E16); help: use 72, or leave usb out".to_owned()
        );
    }
    if mhz == 48 && fps > 30 {
        return Err(format!(
            "WSTAC_MHZ is \"48\", too slow for WSTAC_FPS={fps}; help: use 72, or at most 30 per second"
        ));
    }
    if rest > 0 && has("emulated") {
        return Err("WSTAC_REST needs an HM01B0; help: unset it".to_owned());
    }
    if rest > 0 && has("motion") {
        return Err("WSTAC_REST leaves too few frames for the feature motion; help: leave one of them out".to_owned());
    }
    Ok(format!(
        "/// The frames per second of the sensors.
pub const FPS: u32 = {fps};
/// The clock of the core of an RP2040 or STM32U575 in MHz; that of an RP2350 has 120.
pub const MHZ: u32 = {mhz};
/// The seconds without light after which a board rests; 0 if it never does.
pub const REST: u32 = {rest};
"
    ))
}

/// Returns the seconds without light after which a board rests, 0 if it never does; `None` if the variable is wrong.
fn rest(variable: impl Fn(&str) -> Option<String>) -> Option<u32> {
    variable("WSTAC_REST").map_or(Some(0), |text| text.parse().ok().filter(|rest| (5..=3600).contains(rest)))
}

/// Checks that an event that begins while a sensor rests is not reliable: its sample begins so many frames earlier.
pub fn backtrack(frames: u8) -> Result<(), String> {
    if frames < 10 && env::var_os("WSTAC_REST").is_some_and(|text| !text.is_empty()) {
        return Err(format!(
            "[trigger] backtrack is {frames}, with which WSTAC_REST would lose the begin of a touch; help: use 10"
        ));
    }
    Ok(())
}

/// Checks that every program for an STM32 says where its flash is.
pub fn rows() -> Result<(), String> {
    println!("cargo:rerun-if-changed=Cargo.toml");
    if !has("stm32") {
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
        if is_built && !STM32.iter().any(|(known, ..)| *known == name) {
            return Err(format!(
                "wstac-fw/build/link.rs: STM32 has no row for the program {name} of Cargo.toml, expected where its flash \
                 begins, and its KiB; help: step 2 of docs/BOARDS.md"
            ));
        }
    }
    Ok(())
}
