//! Turns a configuration and a model file into `setup.rs`, the source that is compiled in.

use std::path::{Path, PathBuf};

use wstac_core::green::any::YcbcrMethod;
use wstac_core::model::Model;
use wstac_core::model::file::Input;
use wstac_core::paper::speed::Law;
use wstac_core::touch::crosstalk::Correction;

use crate::check;
use crate::pixels::Pixels;
use wstac_host::config::{Config, Estimator, Kernel};

/// Returns the source. An error says what is wrong with a file or with the name of the pixel format. `sizes` are those
/// of the frames of the boards that are built.
pub fn source(
    config: Option<&Path>,
    model: Option<PathBuf>,
    pixels: Option<&str>,
    models: Option<&str>,
    sizes: &[[u16; 2]],
) -> Result<String, String> {
    let pixels = Pixels::named(pixels)?;
    let (variable, file) = config.map_or(("", Path::new("wstac.toml")), |file| ("WSTAC_CONFIG=", file));
    let config = Config::read(file).map_err(|error| format!("{variable}{error}{}", where_from(file)))?;
    check_frame(&config, sizes).map_err(|error| format!("{variable}{}: {error}", file.display()))?;
    if is_wave(&config) {
        check::wave()?;
    }
    let mut source = configuration(&config, pixels)?;
    source += &laws(&config);
    if config.green.yuv != YcbcrMethod::default() && pixels.name != "YUYV" {
        println!("cargo::warning=[green] yuv has no effect: frames of {} have no chroma", pixels.name);
    }
    source += &pixels.source(config.green.yuv);
    source += &match model {
        Some(file) => texture(&file, &config)
            .map_err(|error| format!("WSTAC_MODEL={}: {error}{}", file.display(), where_from(&file)))?,
        None => no_texture(models, &config)
            .map_err(|error| format!("WSTAC_MODELS={}: {error}", models.unwrap_or_default()))?,
    };
    Ok(source)
}

/// Returns what a message adds to the name of a file: where a relative one starts.
fn where_from(file: &Path) -> &'static str {
    if file.is_relative() { " (relative names are from wstac-fw)" } else { "" }
}

/// Refuses a calibration with frames of another size than a board's.
fn check_frame(config: &Config, sizes: &[[u16; 2]]) -> Result<(), String> {
    let Some(frame) = config.layout.frame() else { return Ok(()) };
    match sizes.iter().find(|size| **size != frame) {
        Some(size) => Err(format!(
            "[layout] frame is {frame:?}, expected {size:?}, the size of the board's frames: calibrate with frames of that \
             size, or write the corners for them and leave frame out"
        )),
        None => Ok(()),
    }
}

fn configuration(config: &Config, pixels: &Pixels) -> Result<String, String> {
    let kernel = match config.features.ln {
        Kernel::Fixed => "fixed::Fixed",
        Kernel::Libm => "libm::Libm",
        Kernel::Micromath => "micromath::Micromath",
    };
    let trigger = config.trigger().map_err(|error| error.to_string())?;
    check::backtrack(trigger.backtrack())?;
    let (following, follow) = match config.following().map_err(|error| error.to_string())? {
        None => ("FixedBaseline", "wstac_core::paper::baseline_policy::FixedBaseline".to_owned()),
        Some(follow) => {
            let windows = follow.windows();
            let follow = format!(
                "match wstac_core::paper::baseline_policy::TrackingBaseline::new({windows}) {{
    Ok(follow) => follow,
    Err(_) => panic!(\"checked by the build script\"),
}}"
            );
            ("TrackingBaseline", follow)
        }
    };
    let per_touch = if trigger.is_per_touch() { ".one_event_per_touch()" } else { "" };
    let real = |bits: u32| f64::from(bits) / 65_536.0;
    let layout = match config.layout.explicit() {
        Some((taxel, corners)) => format!("Layout::new(frame, {taxel:?}, {corners:?})"),
        None => "Layout::paper(frame)".to_owned(),
    };
    let frame = config.layout.frame().map_or_else(String::new, |[width, height]| {
        format!("assert!(frame.width() == {width} && frame.height() == {height}, \"[layout] frame is [{width}, {height}]\");\n    ")
    });
    Ok(format!(
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
    Ok(trigger) => trigger{per_touch},
    Err(_) => panic!(\"checked by the build script\"),
}};
/// The type of the baseline policy: fixed or tracking.
pub type BaselinePolicy = wstac_core::paper::baseline_policy::{following};
/// The baseline policy at the start of a stream.
pub const FOLLOWING: BaselinePolicy = {follow};
/// Returns the layout of the taxels in frames of this size.
///
/// # Errors
/// Returns the errors of [`Layout::new`] and [`Layout::paper`].
pub const fn layout(frame: FrameSize) -> Result<Layout, ConfigError> {{
    {frame}{layout}
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
    ))
}

/// Returns whether the law takes 25 taxels.
fn is_wave(config: &Config) -> bool {
    config.speed.estimator() == Some(Estimator::Wave)
}

/// Returns the source of the law. It has the type of the one that is chosen, so no code of another one is linked.
fn laws(config: &Config) -> String {
    let [slowest, fastest] = config.speed.range();
    let durations = config.speed.law().unwrap_or(Law::PUBLISHED);
    let (law, value) = match config.speed.estimator() {
        Some(estimator) => {
            let law = match estimator {
                Estimator::Coherence => "ByCoherence",
                Estimator::Edges => "ByEdges",
                Estimator::Wave => "ByWave",
            };
            let value = format!(
                "match motion(rate) {{
        Ok(motion) => Ok(wstac_core::law::{law}(motion)),
        Err(error) => Err(error),
    }}"
            );
            (format!("wstac_core::law::{law}"), value)
        }
        None => ("SpeedConfig".to_owned(), "durations(rate)".to_owned()),
    };
    let readout = config.sensor.readout.map(|time| format!("ReadoutTime::from_ms({:?})", time.ms()));
    let readout = readout.as_deref().unwrap_or("None");
    format!(
        "/// The time in which the camera reads its rows, as the configuration states it.
pub const READOUT: Option<ReadoutTime> = {readout};
/// The type of the law from an event to its answers.
pub type Law = {law};
/// Returns the law from an event to its answers, for a camera of this rate.
///
/// # Errors
/// Returns the errors of [`motion`] or [`durations`].
pub const fn law(rate: FrameRate) -> Result<Law, ConfigError> {{
    {value}
}}
/// Returns the parameters of arrival times for a camera of this rate.
///
/// # Errors
/// Returns the errors of [`MotionConfig::new`].
pub const fn motion(rate: FrameRate) -> Result<MotionConfig, ConfigError> {{
    MotionConfig::new({:?}, rate)
}}
/// Returns the law of durations for a camera of this rate: the one in force, or else the published one.
///
/// # Errors
/// Returns the errors of [`SpeedConfig::new`] and [`SpeedConfig::fitted_on`].
pub const fn durations(rate: FrameRate) -> Result<SpeedConfig, ConfigError> {{
    match SpeedConfig::new(wstac_core::paper::speed::{durations:?}, {:?}, ThresholdOn::{:?}, rate) {{
        Ok(speed) => speed.fitted_on({slowest:?}, {fastest:?}),
        Err(error) => Err(error),
    }}
}}
",
        config.sensor.pitch_mm, config.speed.threshold, config.speed.threshold_on,
    )
}

/// The kinds of models: the module of each and its type, which is the variant of `ModelKind`, too.
const KINDS: [(&str, &str); 4] =
    [("linear_svm", "LinearSvm"), ("forest", "Forest"), ("boosted", "Boosted"), ("network", "Network")];

/// Returns the source of the model's items. The model has the type of its own kind, so no code of another kind is
/// linked.
fn texture(file: &Path, config: &Config) -> Result<String, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let (words, _) = bytes.as_chunks::<4>();
    let words: Vec<_> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let model = Model::from_words(&words).map_err(|error| error.to_string())?;
    let kind = match model {
        Model::LinearSvm(_) => KINDS[0],
        Model::Forest(_) => KINDS[1],
        Model::Boosted(_) => KINDS[2],
        Model::Network(_) => KINDS[3],
    };
    let file = file.canonicalize().map_err(|error| error.to_string())?;
    let file = file.to_str().ok_or("its path is no UTF-8")?;
    let checked = format!(
        "static CHECKED: Kind = wstac_core::include_model!(KindOf, {file:?});
/// The texture model.
pub const MODEL: Option<&Kind> = Some(&CHECKED);
"
    );
    Ok(types(kind, model.input(), config)? + &checked)
}

/// Returns the source of the model's items without a model. `models` are those that a host may send: a kind, a colon
/// and a sample.
fn no_texture(models: Option<&str>, config: &Config) -> Result<String, String> {
    let (kind, input) = models.unwrap_or("linear_svm:frames").split_once(':').unwrap_or_default();
    let kind = KINDS.into_iter().find(|(name, _)| *name == kind);
    let input = [Input::Frames, Input::Path, Input::TaxelPath].into_iter().find(|known| known.name() == input);
    let (Some(kind), Some(input)) = (kind, input) else {
        return Err(
            "expected KIND:SAMPLE of linear_svm, forest, boosted or network, and of frames, path or taxel_path"
                .to_owned(),
        );
    };
    let none = "/// The texture model: `None`, because `WSTAC_MODEL` was not set.
pub const MODEL: Option<&Kind> = None;
";
    Ok(types(kind, input, config)? + none)
}

/// Returns the source of the correction of cross-talk, as a constant.
fn crosstalk(correction: &Correction) -> String {
    format!(
        "static CORRECTION: wstac_core::touch::crosstalk::Correction =
    match wstac_core::touch::crosstalk::Correction::new({:?}) {{
        Some(correction) => correction,
        None => panic!(\"checked by the build script\"),
    }};
/// The cross-talk of the configuration's taxels.
#[derive(Clone, Debug)]
pub struct Crosstalk;
impl wstac_core::touch::crosstalk::CorrectionSource for Crosstalk {{
    const EMPTY: Self = Self;
    fn correction(&self) -> Option<&wstac_core::touch::crosstalk::Correction> {{
        Some(&CORRECTION)
    }}
}}
",
        correction.weights()
    )
}

/// Returns the source of the types of a model.
fn types((module, kind): (&str, &str), input: Input, config: &Config) -> Result<String, String> {
    let sample = match (input, config.speed.law()) {
        (Input::Frames, _) => "OverTime",
        (Input::Path, None) => "AlongPath",
        (Input::TaxelPath, None) => "AlongTaxels",
        (Input::Path | Input::TaxelPath, Some(_)) => {
            return Err("its sample is along the path, expected law = \"arrival\"".to_owned());
        }
        (other, _) => return Err(format!("its sample is {}, expected frames, path or taxel_path", other.name())),
    };
    let taxels = if input == Input::TaxelPath || is_wave(config) { "TaxelRing" } else { "NoTaxels" };
    let ring = "wstac_core::touch::taxel_ring::";
    let (taxels, constant) = match config.layout.correction().filter(|_| taxels == "TaxelRing") {
        Some(correction) => (format!("{ring}Corrected<{ring}{taxels}, Crosstalk>"), crosstalk(&correction)),
        None => (format!("{ring}{taxels}"), String::new()),
    };
    let live = if is_wave(config) { "LiveWave" } else { "LiveMotion" };
    Ok(format!(
        "use wstac_core::model::{module}::{kind} as KindOf;
/// The type of the texture model.
pub type Kind = KindOf<'static>;
/// The kind of the texture model, as messages name it.
#[cfg(any(feature = \"models\", test))]
pub const KIND: wstac_core::wire::ModelKind = wstac_core::wire::ModelKind::{kind};
/// The sample that the texture model takes.
pub type ModelSample = crate::textures::{sample};
/// The type of what the pipeline keeps of the taxels: nothing, unless the law or the texture model takes 25 of them.
pub type Taxels = {taxels};
{constant}/// The type of what follows whatever slides, frame by frame.
pub type Live = wstac_core::touch::motion::{live};
/// Whether the law takes 25 taxels.
pub const IS_WAVE: bool = {};
",
        is_wave(config)
    ))
}
