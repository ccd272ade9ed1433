//! A chosen configuration as files: what a board's build and `wstac run` read, and what was claimed of it.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::candidate::Candidate;
use super::knobs::Format::{YuyvExact, YuyvLinear};
use super::knobs::{Front, kernel_name};
use super::map;
use super::prices::{Core, Price, Prices};
use super::row::{Row, rows};
use super::slides::{MOST_SLIDES, SENSORS, slides};
use super::sweep::{self, Plan};
use crate::config::Config;
use crate::error::Error;
use crate::model::file::ModelFile;
use wstac_core::green::any::YcbcrMethod;

/// The configuration for a board's build and for `wstac run`.
pub const CONFIG: &str = "wstac.toml";
/// The model, where there is one.
pub const MODEL: &str = "model.wsm";
/// What was found of it, as a map of one row.
pub const CLAIM: &str = "claim.csv";
/// What it costs, by core.
pub const PRICE: &str = "price.json";

/// The configuration file of a setting.
pub fn config(front: &Front) -> String {
    let yuv = if front.format.method() == YcbcrMethod::Linear { "linear" } else { "exact" };
    let (stride, kernel) = (front.stride.get(), kernel_name(front.kernel));
    format!("[green]\nyuv = \"{yuv}\"\nstride = {stride}\n[features]\nln = \"{kernel}\"\n")
}

/// How a setting in a folder is built for a board, in `wstac-fw`, and run on a host.
pub fn commands(row: &Row, folder: &Path) -> String {
    // Builds run elsewhere: the whole path, where it can be told.
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let [config, model] = [CONFIG, MODEL].map(|name| folder.join(name).display().to_string());
    let with_model = |option: &str| row.model.as_ref().map_or_else(String::new, |_| format!(" {option}{model}"));
    let mut text = String::new();
    if let Some(pixels) = row.front.format.pixels() {
        let model = with_model("WSTAC_MODEL=");
        // The one real board's program reads GREY; the emulated ones read all.
        let emulated = "--no-default-features --features emulated --bin emulated";
        let bin = if pixels == "GREY" { "--bin h743" } else { emulated };
        let _ = writeln!(text, "WSTAC_PIXELS={pixels} WSTAC_CONFIG={config}{model} cargo build --release {bin}");
    }
    let (code, model) = (row.front.format.code(), with_model("--model "));
    let _ = writeln!(text, "wstac run /dev/video0 --format {code} --config {config}{model}");
    text
}

/// Writes the files to a folder, which is made where there is none.
///
/// # Errors
/// Names the file that cannot be written.
pub fn write(folder: &Path, row: &Row, model: Option<&Candidate>, prices: &Prices) -> Result<(), Error> {
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(|error| Error::new(path.display(), error))
    };
    fs::create_dir_all(folder).map_err(|error| Error::new(folder.display(), error))?;
    put(CONFIG, config(&row.front).as_bytes())?;
    if let Some(model) = model {
        let bytes: Vec<u8> = model.file.words().iter().flat_map(|word| word.to_le_bytes()).collect();
        put(MODEL, &bytes)?;
    }
    put(CLAIM, map::write(std::slice::from_ref(row)).as_bytes())?;
    let price = |core: Core| prices.of(core, &row.front, row.model.as_deref()).map(|price| (core.name(), price));
    let all: std::collections::BTreeMap<&str, Price> = Core::ALL.into_iter().filter_map(price).collect();
    let text = serde_json::to_string_pretty(&all).map_err(|error| Error::new(PRICE, error))?;
    put(PRICE, format!("{text}\n").as_bytes())
}

/// What is found of the configuration in a folder, on the slides that its claim is of, and the claim.
///
/// # Errors
/// Where a file cannot be read, or the configuration cannot be run.
pub fn rerun(folder: &Path) -> Result<[Row; 2], Error> {
    let path = folder.join(CLAIM);
    let text = fs::read_to_string(&path).map_err(|error| Error::new(path.display(), error))?;
    let about = path.display().to_string();
    let mut claims = map::read(&about, &text)?.into_iter();
    let (Some(claim), None) = (claims.next(), claims.next()) else {
        return Err(Error::new(about, "expected one configuration"));
    };
    let config = Config::read(&folder.join(CONFIG))?;
    let model = claim.model.as_ref().map(|name| {
        let file = ModelFile::open(&folder.join(MODEL))?;
        Candidate::new(name.clone(), false, file)
    });
    let models: Vec<Candidate> = model.into_iter().collect::<Result<_, _>>()?;
    // The files decide, not the claim.
    let format = match (claim.front.format, config.green.yuv) {
        (YuyvExact | YuyvLinear, YcbcrMethod::Linear) => YuyvLinear,
        (YuyvExact | YuyvLinear, YcbcrMethod::Exact) => YuyvExact,
        (other, _) => other,
    };
    let fronts = [Front { format, stride: config.green.stride, kernel: config.features.ln }];
    let of_each = u32::try_from(claim.found.slides).unwrap_or(u32::MAX) / SENSORS;
    if !(1..=MOST_SLIDES).contains(&of_each) {
        let most = MOST_SLIDES * SENSORS;
        return Err(Error::new(about, format_args!("slides is {}, expected {SENSORS} to {most}", claim.found.slides)));
    }
    let slides = slides(of_each);
    let plan = Plan { config: &config, fronts: &fronts, models: &models, slides: &slides, light: 1.0 };
    let found = rows(&plan, &sweep::run(&plan)?).pop();
    let found = found.ok_or_else(|| Error::new(&about, "nothing was run"))?;
    Ok([found, claim])
}
