//! Turns a configuration and a model file into `setup.rs`, the source that is compiled in.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use wstac_core::model::Model;

use crate::pixels::Pixels;
use wstac_host::config::{Config, Kernel};

/// Returns the source. An error says what is wrong with a file or with the name of the pixel format.
pub fn source(config: Option<PathBuf>, model: Option<PathBuf>, pixels: Option<&str>) -> Result<String, String> {
    let pixels = Pixels::named(pixels)?;
    let config = match config {
        Some(file) => {
            Config::read(&file).map_err(|error| format!("WSTAC_CONFIG={error} (relative names are from wstac-fw)"))?
        }
        None => Config::default(),
    };
    let mut source = configuration(&config, pixels)?;
    source += &pixels.source(config.green.yuv)?;
    source += &match model {
        Some(file) => texture(&file)
            .map_err(|error| format!("WSTAC_MODEL={}: {error} (relative names are from wstac-fw)", file.display()))?,
        None => NO_TEXTURE.to_owned(),
    };
    Ok(source)
}

/// The source of the model's items if there is no model.
const NO_TEXTURE: &str = "/// The type of the texture model.
pub type Kind = wstac_core::model::linear_svm::LinearSvm<'static>;
/// The texture model: `None`, because `WSTAC_MODEL` was not set.
pub const MODEL: Option<&Kind> = None;
";

fn configuration(config: &Config, pixels: &Pixels) -> Result<String, String> {
    let kernel = match config.features.ln {
        Kernel::Fixed => "fixed::Fixed",
        Kernel::Libm => "libm::Libm",
        Kernel::Micromath => "micromath::Micromath",
    };
    let trigger = config.trigger().map_err(|error| error.to_string())?;
    let (following, follow) = match config.following().map_err(|error| error.to_string())? {
        None => ("FixedBaseline", "wstac_core::baseline_policy::FixedBaseline".to_owned()),
        Some(follow) => {
            let windows = follow.windows();
            let follow = format!(
                "match wstac_core::baseline_policy::TrackingBaseline::new({windows}) {{
    Ok(follow) => follow,
    Err(_) => panic!(\"checked by the build script\"),
}}"
            );
            ("TrackingBaseline", follow)
        }
    };
    let [slowest, fastest] = config.speed.range();
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let layout = match config.layout.explicit() {
        Some((taxel, corners)) => format!("Layout::new(frame, {taxel:?}, {corners:?})"),
        None => "Layout::paper(frame)".to_owned(),
    };
    let frame = config.layout.frame().map_or_else(String::new, |[width, height]| {
        format!("assert!(frame.width() == {width} && frame.height() == {height}, \"[layout] frame is [{width}, {height}]\");\n    ")
    });
    let mut source = String::new();
    write!(
        source,
        "/// The log kernel.
pub type Ln = wstac_core::ln::{kernel};
/// The stride: which rows and columns of a taxel are counted.
pub const STRIDE: Stride = Stride::{:?};
/// The darkness floor of the camera's pixels.
pub const FLOOR: Floor = match Floor::new({:?}, {}) {{
    Ok(floor) => floor,
    Err(_) => panic!(\"[features] floor_levels is above the full scale, {}\"),
}};
/// The parameters of the trigger.
pub const TRIGGER: TriggerConfig = match TriggerConfig::new({}, {:?}, {}, Rule::{:?}, {:?}) {{
    Ok(trigger) => trigger,
    Err(_) => panic!(\"checked by the build script\"),
}};
/// The type of the baseline policy: fixed or tracking.
pub type BaselinePolicy = wstac_core::baseline_policy::{following};
/// The baseline policy at the start of a stream.
pub const FOLLOWING: BaselinePolicy = {follow};
/// Returns the layout of the taxels in frames of this size.
///
/// # Errors
/// Returns the errors of [`Layout::new`] and [`Layout::paper`].
pub const fn layout(frame: FrameSize) -> Result<Layout, ConfigError> {{
    {frame}{layout}
}}
/// Returns the configuration of the speed law for a camera of this rate.
///
/// # Errors
/// Returns the errors of [`SpeedConfig::new`] and [`SpeedConfig::fitted_on`].
pub const fn speed(rate: FrameRate) -> Result<SpeedConfig, ConfigError> {{
    match SpeedConfig::new(Law::{:?}, {:?}, ThresholdOn::{:?}, rate) {{
        Ok(speed) => speed.fitted_on({slowest:?}, {fastest:?}),
        Err(error) => Err(error),
    }}
}}
",
        config.green.stride,
        config.features.floor_levels,
        pixels.full_scale,
        pixels.full_scale,
        trigger.window(),
        real(trigger.multiplier().bits()),
        trigger.backtrack(),
        trigger.rule(),
        real(trigger.margin().bits()),
        config.speed.law(),
        config.speed.threshold,
        config.speed.threshold_on,
    )
    .map_err(|error| error.to_string())?;
    Ok(source)
}

/// Returns the source of the model's items. The model has the type of its own kind, so no code of another kind is linked.
fn texture(file: &Path) -> Result<String, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let (words, _) = bytes.as_chunks::<4>();
    let words: Vec<_> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let kind = match Model::from_words(&words).map_err(|error| error.to_string())? {
        Model::LinearSvm(_) => "linear_svm::LinearSvm",
        Model::Forest(_) => "forest::Forest",
        Model::Boosted(_) => "boosted::Boosted",
    };
    let file = file.canonicalize().map_err(|error| error.to_string())?;
    let file = file.to_str().ok_or("its path is no UTF-8")?;
    Ok(format!(
        "use wstac_core::model::{kind} as KindOf;
/// The type of the texture model.
pub type Kind = KindOf<'static>;
static CHECKED: Kind = wstac_core::include_model!(KindOf, {file:?});
/// The texture model.
pub const MODEL: Option<&Kind> = Some(&CHECKED);
"
    ))
}
