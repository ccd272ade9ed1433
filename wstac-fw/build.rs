//! Compiles in the files that the environment names, and tells how to link. Refuses a target that is not the chip's.
//!
//! | variable | it names |
//! | --- | --- |
//! | `WSTAC_CONFIG` | a configuration file, as `wstac run --config` takes it; without it, `wstac.toml` of this folder |
//! | `WSTAC_MODEL` | a texture model's file, as `wstac model import` writes it; without it there is no texture |
//! | `WSTAC_MODELS` | without a model: those that a host may send, such as `forest:frames`; `linear_svm:frames` if unset |
//! | `WSTAC_REVISION` | the revision that the firmware reports; without it the beginning of git's commit |
//! | `WSTAC_FPS` | the frames per second of the boards' sensors, 15 to 60; without it 30 |
//! | `WSTAC_MHZ` | the clock of the core in MHz; a Pico: 120, the default, 72 or, without USB, 48; an STM32U575: 72, the default, or 24 |
//! | `WSTAC_REST` | the seconds without light after which a board rests, 5 to 3600; without it, it never does |
//! | `WSTAC_PIXELS` | the camera's pixel format, such as YUYV; without it GREY |

// Modules of another crate and of this program.
#![allow(unreachable_pub)]

#[path = "build/check.rs"]
mod check;
#[path = "build/link.rs"]
mod link;
#[path = "build/pixels.rs"]
mod pixels;
#[path = "build/setup.rs"]
mod setup;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=build");
    println!("cargo:rerun-if-changed=../wstac-host/src/config.rs");
    println!("cargo:rerun-if-changed=../wstac-host/src/config/speed.rs");
    println!("cargo:rerun-if-changed=../wstac-host/src/config/crosstalk.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo:rustc-env=WSTAC_REVISION={}", revision());
    if let Err(error) = check::target().and_then(|()| check::rows()) {
        return refuse(&error);
    }
    println!("cargo:rustc-check-cfg=cfg(float)");
    link::emulated(&out);
    link::stm32(&out);
    link::pico(&out);
    let text = |name: &str| variable(name).map(|value| value.to_string_lossy().into_owned());
    let [pixels, models] = ["WSTAC_PIXELS", "WSTAC_MODELS"].map(text);
    // The sizes of the sensors' frames, and of `LAYOUT` in `src/emulated/bench.rs`.
    let boards = [("CARGO_FEATURE_NODE", [320, 240]), ("CARGO_FEATURE_EMULATED", [400, 400])];
    let sizes = boards.iter().filter(|(feature, _)| env::var_os(feature).is_some()).map(|(_, size)| *size);
    let sizes: Vec<_> = sizes.collect();
    println!("cargo:rerun-if-changed=wstac.toml");
    let config = named("WSTAC_CONFIG");
    let source = check::numbers(text).and_then(|numbers| {
        let model = named("WSTAC_MODEL");
        Ok(numbers + &setup::source(config.as_deref(), model, pixels.as_deref(), models.as_deref(), &sizes)?)
    });
    // Without a wave, it is 200 bytes for a few products.
    let has_wave = source.as_ref().is_ok_and(|source| source.contains("ByWave"));
    if has_wave && env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv6m")) {
        println!("cargo:rustc-cfg=float");
    }
    match source {
        Ok(source) => fs::write(out.join("setup.rs"), source).expect("OUT_DIR can be written"),
        Err(error) => refuse(&error),
    }
}

/// Lets the build fail with one line that says what is wrong, instead of the many lines of a panic.
fn refuse(error: &str) {
    println!("cargo::error={}", error.replace('\n', " "));
}

/// Returns the revision of the source; empty if it is not known.
fn revision() -> String {
    if let Some(revision) = variable("WSTAC_REVISION") {
        return revision.to_string_lossy().into_owned();
    }
    let git = |arguments: &[&str]| {
        let done = Command::new("git").args(arguments).output().ok().filter(|done| done.status.success())?;
        String::from_utf8(done.stdout).ok().map(|text| text.trim().to_owned())
    };
    // The log of the head changes with every commit.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| Path::new(log).exists()) {
        println!("cargo:rerun-if-changed={log}");
    }
    git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_default()
}

/// Returns the value of a variable, if it has one.
fn variable(name: &str) -> Option<OsString> {
    println!("cargo:rerun-if-env-changed={name}");
    env::var_os(name).filter(|value| !value.is_empty())
}

/// Returns the path of the file that a variable names.
fn named(name: &str) -> Option<PathBuf> {
    let file = PathBuf::from(variable(name)?);
    println!("cargo:rerun-if-changed={}", file.display());
    // Relative names are relative to the caller's folder, which is the package's folder or the one above. Cargo runs
    // this in the former.
    Some(file)
}
