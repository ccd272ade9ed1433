//! What settings cost on boards, as counted on emulated cores: `wstac-linux/trade/prices.json`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::knobs::{Setting, kernel_name};
use crate::error::Error;
use crate::model::file::BUILT_IN;

/// The prices that come with the program.
const KEPT: &str = include_str!("../../trade/prices.json");
/// What messages call them.
const ABOUT: &str = "prices.json";

/// A processor core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Core {
    /// Cortex-M0.
    #[value(name = "M0")]
    M0,
    /// Cortex-M3.
    #[value(name = "M3")]
    M3,
    /// Cortex-M4 with floating point.
    #[value(name = "M4F")]
    M4F,
    /// Cortex-M7.
    #[value(name = "M7")]
    M7,
}

impl Core {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::M0, Self::M3, Self::M4F, Self::M7];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::M0 => "M0",
            Self::M3 => "M3",
            Self::M4F => "M4F",
            Self::M7 => "M7",
        }
    }
}

/// What a configuration costs on a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Price {
    /// Instructions from a frame's bytes, in stripes of eight rows, to features.
    pub features: i64,
    /// Instructions of the trigger, a frame.
    pub trigger: i64,
    /// Instructions of the model, an event; 0 without one.
    pub texture: i64,
    /// Instructions of speed, an event.
    pub speed: i64,
    /// Instructions of direction, an event.
    pub direction: i64,
    /// Bytes of the whole firmware with its link and the model.
    pub flash: i64,
    /// Bytes of it, the stack included, the stripe not.
    pub ram: i64,
}

impl Price {
    /// Instructions a frame.
    pub fn frame(&self) -> i64 {
        self.features + self.trigger
    }

    /// Instructions an event.
    pub fn event(&self) -> i64 {
        self.texture + self.speed + self.direction
    }

    /// Instructions a second: of 30 frames, and of an event in each second.
    pub fn instructions_a_second(&self) -> i64 {
        30 * self.frame() + self.event()
    }
}

/// The prices of every setting, each counted apart: a configuration's is their sum.
#[derive(Clone, Debug, Deserialize)]
pub struct Prices {
    /// The compiler that the firmware was built with.
    pub compiler: String,
    cores: BTreeMap<String, CorePrices>,
}

#[derive(Clone, Debug, Deserialize)]
struct CorePrices {
    /// By format, then by stride: of the firmware without a model, with the fixed-point logarithm.
    formats: BTreeMap<String, BTreeMap<String, Size>>,
    /// What another logarithm adds.
    ln: BTreeMap<String, Size>,
    trigger: i64,
    speed: i64,
    direction: i64,
    /// By file; flash and RAM are what they add.
    models: BTreeMap<String, ModelPrice>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Size {
    frame: i64,
    flash: i64,
    ram: i64,
}

#[derive(Clone, Debug, Deserialize)]
struct ModelPrice {
    event: i64,
    flash: i64,
    ram: i64,
}

impl Prices {
    /// Those that come with the program.
    ///
    /// # Errors
    /// None: a test reads them.
    pub fn kept() -> Result<Self, Error> {
        Self::read(ABOUT, KEPT)
    }

    /// Reads prices; `about` names their file.
    ///
    /// # Errors
    /// What of them cannot be read.
    pub fn read(about: &str, text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| Error::new(about, error))
    }

    /// The price of a setting, with a model that comes with the program or without one; nothing where it was not counted.
    pub fn of(&self, core: Core, setting: &Setting, model: Option<&str>) -> Option<Price> {
        let core = self.cores.get(core.name())?;
        let format = core.formats.get(setting.format.name())?.get(&setting.stride.get().to_string())?;
        let ln = core.ln.get(kernel_name(setting.kernel))?;
        let own = |name: &str| core.models.get(&format!("{}.wsm", name.strip_prefix(BUILT_IN)?));
        let model = model.map(|name| own(name).ok_or(())).transpose().ok()?;
        let of_model = |price: fn(&ModelPrice) -> i64| model.map_or(0, price);
        Some(Price {
            features: format.frame + ln.frame,
            trigger: core.trigger,
            texture: of_model(|model| model.event),
            speed: core.speed,
            direction: core.direction,
            flash: format.flash + ln.flash + of_model(|model| model.flash),
            ram: format.ram + ln.ram + of_model(|model| model.ram),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Kernel;
    use crate::trade::knobs::Format;

    #[test]
    fn a_price_is_a_sum() {
        let text = r#"{"compiler": "c", "frame": "f", "cores": {"M4F": {
            "formats": {"YUYV linear": {"2": {"frame": 1000, "flash": 20000, "ram": 4000}}},
            "ln": {"libm": {"frame": 50, "flash": -7, "ram": 8}},
            "trigger": 3, "speed": 4, "direction": 5,
            "models": {"svm.wsm": {"event": 600, "flash": 70, "ram": 80, "sha256": "0"}}}}}"#;
        let prices = Prices::read("p", text).unwrap();
        let setting =
            Setting { format: Format::YuyvLinear, stride: wstac_core::frame::Stride::Two, kernel: Kernel::Libm };
        let price = prices.of(Core::M4F, &setting, Some("builtin:svm")).unwrap();
        assert_eq!((price.frame(), price.event(), price.flash, price.ram), (1053, 609, 20_063, 4088));
        assert_eq!(price.instructions_a_second(), 30 * 1053 + 609);
        assert_eq!(prices.of(Core::M4F, &setting, None).unwrap().event(), 9);
        assert_eq!(prices.of(Core::M4F, &setting, Some("builtin:forest")), None);
        // A file of the same name is another model.
        assert_eq!(prices.of(Core::M4F, &setting, Some("svm")), None);
        assert_eq!(prices.of(Core::M0, &setting, None), None);
        assert_eq!(prices.of(Core::M4F, &Setting::DEFAULT, None), None);
    }

    #[test]
    fn the_kept_prices_are_of_all_cores() {
        let prices = Prices::kept().unwrap();
        for core in Core::ALL {
            for model in [None, Some("builtin:svm"), Some("builtin:forest"), Some("builtin:boosted")] {
                assert!(
                    prices.of(core, &Setting::DEFAULT, model).is_some_and(|price| price.flash > 0),
                    "{core:?} {model:?}"
                );
            }
        }
    }
}
