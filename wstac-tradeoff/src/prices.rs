//! The cost of settings on boards, as counted on emulated cores: `wstac-tradeoff/data/prices.json`.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::parameters::{AnswerLaw, Setting, kernel_name};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::{BUILT_IN, ModelFile};

/// The prices that come with the program.
const KEPT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/prices.json"));
/// The name of the prices in messages.
const ABOUT: &str = "prices.json";

/// Returns the text of a compressed file.
pub(super) fn inflated(about: &str, bytes: &[u8]) -> Result<String, Error> {
    let mut text = String::new();
    let read = flate2::read::DeflateDecoder::new(bytes).read_to_string(&mut text);
    read.map(|_| text).map_err(|error| Error::io(about, error))
}

/// A processor core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Core {
    /// Cortex-M0 and M0+.
    #[cfg_attr(feature = "clap", value(name = "M0", alias = "M0+"))]
    M0,
    /// Cortex-M3.
    #[cfg_attr(feature = "clap", value(name = "M3"))]
    M3,
    /// Cortex-M4 with floating point.
    #[cfg_attr(feature = "clap", value(name = "M4F"))]
    M4F,
    /// Cortex-M7.
    #[cfg_attr(feature = "clap", value(name = "M7"))]
    M7,
}

impl Core {
    /// All four cores.
    pub const ALL: [Self; 4] = [Self::M0, Self::M3, Self::M4F, Self::M7];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::M0 => "M0",
            Self::M3 => "M3",
            Self::M4F => "M4F",
            Self::M7 => "M7",
        }
    }

    /// Returns the compiler's name for it.
    pub fn target(self) -> &'static str {
        match self {
            Self::M0 => "thumbv6m-none-eabi",
            Self::M3 => "thumbv7m-none-eabi",
            Self::M4F | Self::M7 => "thumbv7em-none-eabihf",
        }
    }
}

/// The cost of a configuration on a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Price {
    /// Instructions from a frame's bytes, in stripes of eight rows, to features, and to taxels that a model needs.
    pub features: i64,
    /// Instructions of the trigger per frame.
    pub trigger: i64,
    /// Instructions of the model per event: 0 without one, `None` if it was not counted.
    pub texture: Option<i64>,
    /// Instructions of the law per event: speed, direction and, by arrival times, kind of touch.
    pub law: i64,
    /// Bytes of flash of the whole firmware with its link and the model; `None` if the model was not counted.
    pub flash: Option<i64>,
    /// Bytes of RAM of the whole firmware, with the stack but without the stripe; `None` if the model was not counted.
    pub ram: Option<i64>,
}

impl Price {
    /// Returns the instructions per frame.
    pub fn frame(&self) -> i64 {
        self.features + self.trigger
    }

    /// Returns the instructions per event, or `None` if the model was not counted.
    pub fn event(&self) -> Option<i64> {
        Some(self.texture? + self.law)
    }

    /// Returns the instructions per second: of 30 frames, and of an event in each second.
    pub fn instructions_per_second(&self) -> Option<i64> {
        Some(30 * self.frame() + self.event()?)
    }
}

/// The prices of every setting, each counted separately: a configuration's price is their sum.
#[derive(Clone, Debug, Deserialize)]
pub struct Prices {
    /// The compiler that built the firmware.
    pub compiler: String,
    cores: BTreeMap<String, CorePrices>,
}

#[derive(Clone, Debug, Deserialize)]
struct CorePrices {
    /// Sizes by format, then by stride: of the firmware without a model, with the fixed-point logarithm.
    formats: BTreeMap<String, BTreeMap<String, Size>>,
    /// The additional cost of another logarithm.
    ln: BTreeMap<String, LnPrice>,
    trigger: i64,
    /// Costs of laws; flash and RAM are in addition to those of the formats.
    laws: BTreeMap<String, EventPrice>,
    /// Prices of models by file.
    models: BTreeMap<String, ModelPrice>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Size {
    frame: i64,
    flash: i64,
    ram: i64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct LnPrice {
    frame: i64,
    flash: i64,
    ram: i64,
    /// `flash` with a model of the path, whose sample has fixed-point logarithms in any case.
    path_flash: i64,
}

#[derive(Clone, Debug, Deserialize)]
struct ModelPrice {
    /// Additional instructions per frame, of a model that needs taxels.
    frame: i64,
    /// Additional cost by law: the stacks of a law and of a model are no sum.
    laws: BTreeMap<String, EventPrice>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct EventPrice {
    event: i64,
    flash: i64,
    ram: i64,
}

impl Prices {
    /// Returns the prices that come with the program.
    ///
    /// # Errors
    /// This does not fail: a test reads them.
    pub fn kept() -> Result<Self, Error> {
        Self::read(ABOUT, &inflated(ABOUT, KEPT)?)
    }

    /// Reads prices; `about` names their file.
    ///
    /// # Errors
    /// The text is not valid; the message names the part.
    pub fn read(about: &str, text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| Error::with_cause(ErrorKind::Format, about, error))
    }

    /// Returns the price of a setting, with or without a model, or `None` if the setting was not counted.
    ///
    /// If the model was not counted, its additional cost is not known.
    pub fn of(&self, core: Core, setting: &Setting, model: Option<&str>) -> Option<Price> {
        let core = self.cores.get(core.name())?;
        let format = core.formats.get(setting.format.name())?.get(&setting.stride.get().to_string())?;
        let ln = core.ln.get(kernel_name(setting.kernel))?;
        let law = core.laws.get(setting.law.name())?;
        // Instructions of the model per frame, and what it costs with the law.
        let of_model = match model {
            Some(name) => core.model(name).and_then(|model| Some((model.frame, *model.laws.get(setting.law.name())?))),
            None => Some((0, EventPrice::default())),
        };
        let is_of_path = model.is_some() && setting.law != AnswerLaw::Published;
        let ln_flash = if is_of_path { ln.path_flash } else { ln.flash };
        Some(Price {
            features: format.frame + ln.frame + of_model.map_or(0, |(frame, _)| frame),
            trigger: core.trigger,
            texture: of_model.map(|(_, model)| model.event),
            law: law.event,
            flash: of_model.map(|(_, model)| format.flash + ln_flash + law.flash + model.flash),
            ram: of_model.map(|(_, model)| format.ram + ln.ram + law.ram + model.ram),
        })
    }
}

impl CorePrices {
    /// Returns a model's price.
    ///
    /// Built-in models are found by name. A file is found by its own name, unless a built-in model has that name.
    fn model(&self, name: &str) -> Option<&ModelPrice> {
        if let Some(built_in) = name.strip_prefix(BUILT_IN) {
            return self.models.get(&format!("{built_in}.wsm"));
        }
        let file = Path::new(name).file_name()?.to_str()?;
        let is_built_in = ModelFile::names().any(|name| file.strip_suffix(".wsm") == Some(name));
        if is_built_in { None } else { self.models.get(file) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Format;
    use wstac_host::config::Kernel;

    #[test]
    fn a_price_is_a_sum() {
        let text = r#"{"compiler": "c", "frame": "f", "cores": {"M4F": {
            "formats": {"YUYV linear": {"2": {"frame": 1000, "flash": 20000, "ram": 4000}}},
            "ln": {"libm": {"frame": 50, "flash": -7, "ram": 8, "path_flash": -2}},
            "trigger": 3, "laws": {"published": {"event": 9, "flash": 0, "ram": 0}, "edges": {"event": 30, "flash": 5, "ram": -6}},
            "models": {"svm.wsm": {"frame": 0, "sha256": "0", "laws": {"published": {"event": 600, "flash": 70, "ram": 80}}},
                "taxels.wsm": {"frame": 40, "sha256": "0", "laws": {"edges": {"event": 500, "flash": 90, "ram": 3500}}}}}}}"#;
        let prices = Prices::read("p", text).unwrap();
        let stride = wstac_core::frame::Stride::Two;
        let setting = Setting { format: Format::YuyvLinear, stride, kernel: Kernel::Libm, law: AnswerLaw::Published };
        let price = prices.of(Core::M4F, &setting, Some("builtin:svm")).unwrap();
        assert_eq!((price.frame(), price.event(), price.flash, price.ram), (1053, Some(609), Some(20_063), Some(4088)));
        assert_eq!(price.instructions_per_second(), Some(30 * 1053 + 609));
        assert_eq!(prices.of(Core::M4F, &setting, None).unwrap().event(), Some(9));
        // For a model that was not counted, all but its additional cost is known. A file with a built-in's name is
        // another model.
        for model in ["builtin:forest", "svm", "my/svm.wsm", "my/other.wsm"] {
            let price = prices.of(Core::M4F, &setting, Some(model)).unwrap();
            assert_eq!((price.frame(), price.law), (1053, 9), "{model}");
            assert_eq!((price.event(), price.flash, price.ram), (None, None, None), "{model}");
        }
        let own = Prices::read("p", &text.replace("svm.wsm", "my.wsm")).unwrap();
        assert_eq!(own.of(Core::M4F, &setting, Some("some/my.wsm")).unwrap().event(), Some(609));
        // A law adds to all, and a model of taxels to frames. A model was counted with the laws that it goes with.
        let edges = Setting { law: AnswerLaw::Edges, ..setting };
        let price = prices.of(Core::M4F, &edges, Some("taxels.wsm")).unwrap();
        assert_eq!((price.frame(), price.event(), price.flash, price.ram), (1093, Some(530), Some(20_093), Some(7502)));
        assert_eq!(prices.of(Core::M4F, &edges, Some("builtin:svm")).unwrap().event(), None);
        assert_eq!(prices.of(Core::M4F, &Setting { law: AnswerLaw::Coherence, ..setting }, None), None);
        assert_eq!(prices.of(Core::M0, &setting, None), None);
        assert_eq!(prices.of(Core::M4F, &Setting::DEFAULT, None), None);
    }

    #[test]
    fn the_kept_prices_are_of_all_cores() {
        let prices = Prices::kept().unwrap();
        for core in Core::ALL {
            for model in [None, Some("builtin:svm"), Some("builtin:forest"), Some("builtin:boosted")] {
                assert!(
                    prices.of(core, &Setting::PUBLISHED, model).is_some_and(|price| price.flash > Some(0)),
                    "{core:?} {model:?}"
                );
            }
        }
    }
}
