//! What Python asks of a source.

use std::collections::BTreeMap;

use pyo3::prelude::*;
use wstac_core::rate::FrameRate;
use wstac_host::camera::ControlSetting;
use wstac_host::source::FramePolicy;
use wstac_host::source::open::OpenOptions;

use crate::config::Config;
use crate::model::Model;
use crate::refused;
use crate::stream::Rate;

/// What Python asks of a source; `None` asks nothing.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    pub(crate) rate: Option<Rate>,
    pub(crate) format: Option<String>,
    pub(crate) size: Option<(u32, u32)>,
    pub(crate) matrix: Option<String>,
    pub(crate) range: Option<String>,
    pub(crate) every: bool,
    pub(crate) keep_controls: bool,
    pub(crate) controls: BTreeMap<String, i32>,
    pub(crate) config: Option<Config>,
    pub(crate) models: Vec<Model>,
}

impl Asked {
    /// The same for the library.
    pub(crate) fn options(&self) -> PyResult<OpenOptions> {
        let rate = self.rate.map(|(numerator, denominator)| FrameRate::new(numerator, denominator));
        let format = self.format.as_deref().map(|format| {
            let padded = format!("{format:<4}");
            let code = <[u8; 4]>::try_from(padded.as_bytes()).ok().filter(|code| code.is_ascii());
            code.ok_or_else(|| {
                refused(format_args!("format is {format:?}, expected a four-character code such as YUYV"))
            })
        });
        let controls = self.controls.iter().map(|(name, &value)| ControlSetting { name: name.clone(), value });
        Ok(OpenOptions {
            fps: rate.transpose().map_err(refused)?,
            format: format.transpose()?,
            size: self.size,
            delivery: if self.every { FramePolicy::Every } else { FramePolicy::Newest },
            keep_controls: self.keep_controls,
            controls: controls.collect(),
        })
    }
}
