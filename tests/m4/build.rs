//! Links like the programs of wstac-fw, and writes the function under test, `classify`. An environment variable chooses
//! what it calls:
//!
//! | variable | value |
//! | --- | --- |
//! | `M4_MODEL` | a model file, compiled in by `include_model!` as the type of its kind |
//! | `M4_RUST` | a Rust file with `pub fn classify(sample: &[i16; 700]) -> u8` |
//! | `M4_C` | an object file with `int classify(const int16_t *sample)`, and everything that it needs |
//!
//! Without any of them, `classify` returns 0 at once, and the harness itself is measured.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumb")) {
        // The build of wstac-fw knows the memories.
        println!("cargo:rustc-link-arg=-Tlink.x");
    }
    println!("cargo:rerun-if-changed=build.rs");

    let mut body = "fn answer(_: &[i16; 700]) -> u8 {\n    0\n}\n".to_owned();
    if let Some(file) = named("M4_MODEL") {
        let kind = match fs::read(&file).expect("a model file").get(12) {
            Some(1 | 2) => "linear_svm::LinearSvm",
            Some(3) => "forest::Forest",
            Some(5) => "network::Network",
            _ => "boosted::Boosted",
        };
        let name = kind.rsplit(':').next().unwrap_or(kind);
        body = format!(
            "use wstac_core::{{include_model, model::{kind}}};\n\
             static MODEL: {name}<'static> = include_model!({name}, {file:?});\n\
             #[inline(always)]\nfn answer(sample: &[i16; 700]) -> u8 {{\n    MODEL.classify(sample)\n}}\n"
        );
    } else if let Some(file) = named("M4_RUST") {
        body = format!(
            "#[path = {file:?}]\n#[allow(clippy::all, warnings)]\nmod model;\nuse model::classify as answer;\n"
        );
    } else if let Some(file) = named("M4_C") {
        println!("cargo:rustc-link-arg-bins={}", file.display());
        body = "unsafe extern \"C\" {\n    #[link_name = \"classify\"]\n    fn of_c(sample: *const i16) -> i32;\n}\n\
                #[inline(always)]\nfn answer(sample: &[i16; 700]) -> u8 {\n    \
                // SAFETY: it reads 700 numbers.\n    unsafe { of_c(sample.as_ptr()) as u8 }\n}\n"
            .to_owned();
    }
    fs::write(out.join("answer.rs"), body).expect("OUT_DIR can be written");
}

/// Returns the file that a variable names.
fn named(variable: &str) -> Option<PathBuf> {
    println!("cargo:rerun-if-env-changed={variable}");
    let file = PathBuf::from(env::var_os(variable)?);
    println!("cargo:rerun-if-changed={}", file.display());
    Some(Path::new(&file).canonicalize().expect("the file that the environment names"))
}
