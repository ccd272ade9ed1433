//! What is compiled in: the configuration and the texture model that `WSTAC_CONFIG` and `WSTAC_MODEL` named when this was built
//! (`build.rs`), all checked by then.
#![allow(clippy::unreadable_literal)]

use wstac_core::error::Error;
use wstac_core::features::Floor;
use wstac_core::frame::Stride;
use wstac_core::green::any::YcbcrMethod;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::speed::{Law, SpeedConfig, ThresholdOn};
use wstac_core::trigger::{Rule, TriggerConfig};

include!(concat!(env!("OUT_DIR"), "/setup.rs"));
