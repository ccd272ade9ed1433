//! The rolling shutters of the vectors, which `readout.json` lists.

use serde::Deserialize;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};

use super::case::{directory, read};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Shutter {
    readout_ms: Option<f32>,
    order: String,
    frame: [u16; 2],
    taxel: [u16; 2],
    corners: [[u16; 2]; TAXELS],
}

#[derive(Deserialize)]
struct Shutters {
    shutters: Vec<Shutter>,
}

impl Shutter {
    pub(super) fn config(&self) -> MotionConfig {
        let mut orders = [RowOrder::Down, RowOrder::Up, RowOrder::Right, RowOrder::Left].into_iter();
        let order = orders.find(|order| format!("{order:?}").to_lowercase() == self.order).expect(&self.order);
        let [width, height] = self.frame.map(u32::from);
        let layout = Layout::new(FrameSize::new(width, height).unwrap(), self.taxel, self.corners).unwrap();
        let time = self.readout_ms.map(|ms| ReadoutTime::from_ms(ms).unwrap());
        let readout = Readout::of_layout(time, order, &layout, FrameRate::NOMINAL);
        MotionConfig::published(FrameRate::NOMINAL).with_readout(readout)
    }
}

/// Returns the parameters before each of the shutters.
pub(super) fn rolling() -> Vec<MotionConfig> {
    let Shutters { shutters } = read(&directory().join("readout.json"));
    shutters.iter().map(Shutter::config).collect()
}

/// Returns the parameters before one of the shutters, or before a global one.
pub(super) fn config_of(shutter: Option<usize>, rolling: &[MotionConfig]) -> MotionConfig {
    let global = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    shutter.map_or(global, |number| rolling[number])
}
