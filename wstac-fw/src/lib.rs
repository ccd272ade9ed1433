//! Firmware of a WSTac tactile sensor: the code that a board needs besides `wstac-core` to turn its own camera's frames
//! into events.
#![no_std]

#[cfg(test)]
extern crate std;
#[cfg(feature = "node")]
use defmt_rtt as _;

#[cfg(any(feature = "stm32", feature = "rp"))]
pub mod bus;
pub mod crash_record;
#[cfg(feature = "emulated")]
pub mod emulated;
mod float;
/// The former name of [`stm32`].
#[cfg(feature = "h743")]
#[deprecated(since = "0.4.0", note = "use `stm32`")]
pub mod h743 {
    pub use crate::stm32::{Stm32 as H743, usart as usart3, *};
}
#[cfg(any(feature = "learn", test))]
pub mod learner;
#[cfg(feature = "node")]
pub mod link;
pub mod live;
pub mod meanwhile;
#[cfg(test)]
mod mock_flash;
#[cfg(any(feature = "models", test))]
pub mod models;
#[cfg(feature = "node")]
pub mod node;
pub mod picture;
pub mod reader;
pub mod rest;
#[cfg(feature = "node")]
mod restart;
#[cfg(feature = "rp")]
pub mod rp;
pub mod sccb;
pub mod self_test;
pub mod sensor;
#[cfg(feature = "node")]
pub mod serial;
#[cfg(any(feature = "settings", test))]
pub mod settings;
#[cfg(feature = "node")]
pub mod settings_store;
/// The former name of [`settings_store`].
#[cfg(feature = "node")]
#[deprecated(since = "0.4.0", note = "use `settings_store`")]
pub mod keeper {
    pub use crate::settings_store::{SettingsStore as Keeper, *};
}
pub mod setup;
#[cfg(feature = "node")]
pub mod stack;
#[cfg(feature = "stm32")]
pub mod stm32;
pub mod stripes;
pub mod textures;
#[cfg(feature = "usb")]
mod usb;
