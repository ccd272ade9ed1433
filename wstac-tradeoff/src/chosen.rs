//! Files of a selected configuration: those that a board's build and `wstac run` read, and the claims about it.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::candidate::Candidate;
use super::map;
use super::parameters::Format::{YuyvExact, YuyvLinear};
use super::parameters::{AnswerLaw, Setting, kernel_name};
use super::prices::{Core, Price, Prices};
use super::row::{Row, rows};
use super::slides::{MOST_SLIDES, QUICK_SLIDES, SENSORS, TradeSlide, fresh_slides, slides};
use super::sweep::{self, Plan};
use wstac_core::green::any::YcbcrMethod;
use wstac_host::atomic_write::atomic_write;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::ModelFile;
use wstac_host::text_file::file_text;

/// The configuration for a board's build and for `wstac run`.
pub const CONFIG: &str = "wstac.toml";
/// The model, if there is one.
pub const MODEL: &str = "model.wsm";
/// The results, as a map of one row.
pub const CLAIM: &str = "claim.csv";
/// The cost, by core.
pub const PRICE: &str = "price.json";

/// Instructions to build it for a board, and to run it on a host.
pub const BUILD: &str = "build.txt";
/// All five files.
pub const FILES: [&str; 5] = [CONFIG, MODEL, CLAIM, PRICE, BUILD];

/// Returns the configuration file of a setting.
///
/// The parameters come from the setting; all other keys come from `base`, the text of a configuration.
///
/// # Errors
/// `base` is not a configuration.
pub fn config(setting: &Setting, base: &str) -> Result<String, String> {
    let own = Config::parse(base).map_err(|error| error.message().to_owned())?;
    let mut all: toml::Table = wstac_host::text_file::from_toml(base)?;
    let yuv = if setting.format.method() == YcbcrMethod::Linear { "linear" } else { "exact" };
    let parameters: [(&str, &str, toml::Value); 3] = [
        ("green", "yuv", yuv.into()),
        ("green", "stride", i64::from(setting.stride.get()).into()),
        ("features", "ln", kernel_name(setting.kernel).into()),
    ];
    // The law's own parameters stay only with their law.
    let speed = all.entry("speed").or_insert_with(|| toml::Table::new().into());
    if let Some(speed) = speed.as_table_mut()
        && AnswerLaw::of(&own) != setting.law
    {
        speed.retain(|key, _| ["threshold", "threshold_on"].contains(&key));
        let key = if setting.law.estimator().is_some() { "estimator" } else { "law" };
        speed.insert(key.to_owned(), setting.law.name().into());
    }
    for (table, key, value) in parameters {
        let table = all.entry(table).or_insert_with(|| toml::Table::new().into());
        // These are the names of a configuration's tables, so each is a table or absent.
        if let Some(table) = table.as_table_mut() {
            table.insert(key.to_owned(), value);
        }
    }
    toml::to_string(&all).map_err(|error| error.to_string())
}

/// Returns a script to run in the folder; it builds the setting for boards with these cores, and runs it on a host.
fn commands(row: &Row, cores: &[Core]) -> String {
    let with_model = |option: &str| row.model.as_ref().map_or_else(String::new, |_| format!(" {option}"));
    let mut text = String::new();
    if let Some(pixels) = row.setting.format.pixels() {
        text.push_str("# In this folder; $WSTAC is the folder of WSTac's repository.\n");
        let model = with_model(&format!("WSTAC_MODEL=\"$OLDPWD/{MODEL}\""));
        for core in cores {
            // The program of the one real board is for an M7, and reads GREY. The emulated ones read all formats.
            let (about, program) = match (core, pixels) {
                (Core::M7, "GREY") => ("an STM32H743 and its camera: wstac-fw/README.md", "--bin h743".to_owned()),
                _ => (
                    "an emulated board; for yours see \"Another board\" in wstac-fw/README.md",
                    format!("--no-default-features --features emulated --bin emulated --target {}", core.target()),
                ),
            };
            let _ = writeln!(text, "# Cortex-{}: {about}", core.name());
            let files = format!("WSTAC_PIXELS={pixels} WSTAC_CONFIG=\"$OLDPWD/{CONFIG}\"{model}");
            let _ = writeln!(text, "(cd \"$WSTAC/wstac-fw\" && {files} cargo build --release {program})");
        }
    }
    let (code, model) = (row.setting.format.code(), with_model(&format!("--model {MODEL}")));
    let _ = writeln!(text, "# A host:\nwstac run /dev/video0 --format {code} --config {CONFIG}{model}");
    text
}

/// Writes the files to a folder, which is created if necessary, and returns the build and run commands.
///
/// `config` is the configuration's text, and `cores` are those of the target boards.
///
/// # Errors
/// A file cannot be written; the message names it.
pub fn write(
    folder: &Path,
    row: &Row,
    model: Option<&Candidate>,
    prices: &Prices,
    cores: &[Core],
    config: &str,
) -> Result<String, Error> {
    let put = |name: &str, bytes: &[u8]| atomic_write(&folder.join(name), bytes);
    fs::create_dir_all(folder).map_err(|error| Error::io(folder.display(), error))?;
    put(CONFIG, config.as_bytes())?;
    let path = folder.join(MODEL);
    if let Some(model) = model {
        let bytes: Vec<u8> = model.file.words().iter().flat_map(|word| word.to_le_bytes()).collect();
        put(MODEL, &bytes)?;
    } else if path.exists() {
        // The file of an earlier choice: this choice has none.
        fs::remove_file(&path).map_err(|error| Error::io(path.display(), error))?;
    }
    put(CLAIM, map::write(std::slice::from_ref(row)).as_bytes())?;
    let price = |core: Core| prices.of(core, &row.setting, row.model.as_deref()).map(|price| (core.name(), price));
    let all: std::collections::BTreeMap<&str, Price> = Core::ALL.into_iter().filter_map(price).collect();
    let text =
        serde_json::to_string_pretty(&all).map_err(|error| Error::with_cause(ErrorKind::Format, PRICE, error))?;
    put(PRICE, format!("{text}\n").as_bytes())?;
    let commands = commands(row, cores);
    put(BUILD, commands.as_bytes())?;
    Ok(commands)
}

/// The contents of a folder, read again.
#[derive(Debug)]
pub struct Chosen {
    /// The claim.
    pub claim: Row,
    config: Config,
    setting: Setting,
    models: Vec<Candidate>,
    of_each: u32,
}

impl Chosen {
    /// Reads a folder.
    ///
    /// # Errors
    /// A file cannot be read or used.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(CLAIM);
        let expected = "expected what wstac trade --budget … -o FOLDER wrote";
        let text = file_text(&path).map_err(|error| {
            let message = format!("{}: {expected}", error.message());
            Error::new(error.kind(), path.display(), message).caused_by(error)
        })?;
        let about = path.display().to_string();
        let mut claims = map::read(&about, &text)?.into_iter();
        let (Some(claim), None) = (claims.next(), claims.next()) else {
            return Err(Error::new(
                ErrorKind::Format,
                about,
                "does not hold exactly one configuration; choose one again with wstac trade --budget",
            ));
        };
        let config = Config::read(&folder.join(CONFIG))?;
        let model = claim.model.as_ref().map(|name| {
            let file = ModelFile::open(&folder.join(MODEL))?;
            Candidate::new(name.clone(), file)
        });
        let models: Vec<Candidate> = model.into_iter().collect::<Result<_, _>>()?;
        // The files decide, not the claim.
        let format = match (claim.setting.format, config.green.yuv) {
            (YuyvExact | YuyvLinear, YcbcrMethod::Linear) => YuyvLinear,
            (YuyvExact | YuyvLinear, YcbcrMethod::Exact) => YuyvExact,
            (other, _) => other,
        };
        let setting =
            Setting { format, stride: config.green.stride, kernel: config.features.ln, law: AnswerLaw::of(&config) };
        let of_each = u32::try_from(claim.found.slides).unwrap_or(u32::MAX) / SENSORS;
        if !(1..=MOST_SLIDES).contains(&of_each) {
            let most = MOST_SLIDES * SENSORS;
            return Err(Error::new(
                ErrorKind::Format,
                about,
                format_args!("slides is {}, expected {SENSORS} to {most}", claim.found.slides),
            ));
        }
        Ok(Self { claim, config, setting, models, of_each })
    }

    /// Evaluates the configuration on the slides of the claim.
    ///
    /// # Errors
    /// The configuration cannot be run.
    pub fn again(&self) -> Result<Row, Error> {
        self.on(&slides(self.of_each))
    }

    /// Evaluates the configuration on a quick look's slides of other sensors, which played no part in the choice.
    ///
    /// # Errors
    /// The configuration cannot be run.
    pub fn fresh(&self) -> Result<Row, Error> {
        self.on(&fresh_slides(QUICK_SLIDES))
    }

    fn on(&self, slides: &[TradeSlide]) -> Result<Row, Error> {
        let plan = Plan { config: &self.config, settings: &[self.setting], models: &self.models, slides };
        let found = rows(&plan, &sweep::run(&plan)?).pop();
        found.ok_or_else(|| Error::new(ErrorKind::Data, CLAIM, "nothing was run"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::frame::Stride;
    use wstac_host::config::Kernel;

    #[test]
    fn parameters_are_put_into_a_configuration() {
        let setting =
            Setting { format: YuyvLinear, stride: Stride::Five, kernel: Kernel::Libm, law: AnswerLaw::Coherence };
        let text = config(&setting, "[trigger]\nwindow = 7\n[features]\nfloor_levels = 2.5\nln = \"fixed\"\n").unwrap();
        let read = Config::parse(&text).unwrap();
        assert_eq!((read.green.yuv, read.green.stride), (YcbcrMethod::Linear, Stride::Five));
        assert_eq!((read.features.ln, read.features.floor_levels), (Kernel::Libm, 2.5));
        assert!(text.contains("window = 7"), "{text}");
        assert!(config(&setting, "[green]\nstrid = 2\n").unwrap_err().contains("strid"));
    }

    #[test]
    fn a_law_replaces_another_with_its_parameters() {
        let bases = [
            "",
            "[speed]\nestimator = \"edges\"\nthreshold = 0.05\n",
            "[speed]\nlaw = \"published\"\nslope = 200.0\nthreshold = 0.05\n",
            "[speed]\nlaw = \"published\"\nrange_mm_s = [50, 90]\n",
        ];
        for base in bases {
            for law in AnswerLaw::ALL {
                let text = config(&Setting { law, ..Setting::DEFAULT }, base).unwrap();
                let (read, own) = (Config::parse(&text).unwrap(), Config::parse(base).unwrap());
                assert_eq!(AnswerLaw::of(&read), law, "{base} {text}");
                assert_eq!(read.speed.threshold.to_bits(), own.speed.threshold.to_bits(), "{base} {text}");
                // A law of durations is the base's own.
                let durations = own.speed.with_estimator(law.estimator()).law();
                assert_eq!(read.speed.law(), durations, "{base} {text}");
            }
        }
    }
}
