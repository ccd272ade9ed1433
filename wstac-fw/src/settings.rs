//! The settings that a host has set, in flash: they survive a reset at any time.
//!
//! They are one item of a map of the crate `sequential-storage`. It is chosen because it writes each word once, which
//! memory with error correction needs, has checksums, and uses two sectors in turn. `ekv` is made for many keys in many
//! pages of a few kB, and a sector of the STM32H743 has 128 kB.
//!
//! An item that was not written to its end is not valid, and the one before it holds. So a reset at any time leaves the
//! old settings or the new ones.

use core::ops::Range;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::Error;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::wire::{Refusal, Settings};

use crate::setup;

/// The key of the settings. It changes if their bytes mean something else, so that they are not taken for others.
const KEY: u8 = 1;
/// The longest item: settings and their key, in whole words of 32 bytes.
const MOST: usize = 224;

/// Memory of which whole words are aligned, as some flash needs.
#[repr(align(32))]
struct Buffer([u8; MOST]);

/// Returns the settings that were kept in a range of a flash; `None` if there are none.
///
/// The flash must not wait for anything but itself.
pub fn load<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Option<Settings> {
    fetch(flash, range).ok()?
}

/// The reason why there is no item.
enum Failure {
    /// What the flash holds is no map, not even one that can be repaired.
    Map,
    /// The flash itself failed.
    Flash,
}

impl<E> From<Error<E>> for Failure {
    fn from(error: Error<E>) -> Self {
        if matches!(error, Error::Storage { .. }) { Self::Flash } else { Self::Map }
    }
}

/// Reads the item.
// It is not inlined, so that its buffer does not lie on the stack for ever.
#[inline(never)]
fn fetch<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<Option<Settings>, Failure> {
    let config = MapConfig::try_new(range).map_err(|_| Failure::Flash)?;
    let mut map = MapStorage::<u8, _, _>::new(flash, config, Cache::new_uncached());
    let mut buffer = Buffer([0; MOST]);
    let bytes = block_on(map.fetch_item::<&[u8]>(&mut buffer.0, &KEY))?;
    Ok(bytes.and_then(|bytes| postcard::from_bytes::<Option<Settings>>(bytes).ok()?))
}

/// Keeps settings in place of those before, or `None` of them.
///
/// # Errors
/// Returns [`Refusal::Memory`] if the flash fails, or if the settings cannot be read again.
#[inline(never)]
pub fn keep<F: NorFlash>(flash: &mut F, range: Range<u32>, settings: Option<&Settings>) -> Result<(), Refusal> {
    let mut bytes = [0; MOST];
    let bytes: &[u8] = postcard::to_slice(&settings, &mut bytes).map_err(|_| Refusal::Memory)?;
    if let Err(Failure::Map) = store(flash, range.clone(), bytes) {
        let is_lost = match fetch(flash, range.clone()) {
            Ok(found) => found.is_none(),
            Err(failure) => matches!(failure, Failure::Map),
        };
        // What is there is no map with settings, so nothing is lost with it.
        if is_lost {
            block_on(flash.erase(range.start, range.end)).map_err(|_| Refusal::Memory)?;
            let _ = store(flash, range.clone(), bytes);
        }
    }
    // Whatever happened, what can be read is what counts.
    if load(flash, range).as_ref() == settings { Ok(()) } else { Err(Refusal::Memory) }
}

/// Stores an item.
#[inline(never)]
fn store<F: NorFlash>(flash: &mut F, range: Range<u32>, item: &[u8]) -> Result<(), Failure> {
    let config = MapConfig::try_new(range).map_err(|_| Failure::Flash)?;
    let mut map = MapStorage::<u8, _, _>::new(flash, config, Cache::new_uncached());
    let mut buffer = Buffer([0; MOST]);
    Ok(block_on(map.store_item(&mut buffer.0, &KEY, &item))?)
}

/// Returns the layout of settings that a board with such frames can use, with at most so many lines of exposure.
///
/// # Errors
/// Returns the reason why it cannot use them.
#[inline(never)]
pub fn check(settings: &Settings, size: FrameSize, rate: FrameRate, most: u16) -> Result<Layout, Refusal> {
    let layout = settings.layout(size)?;
    let camera = FrameGeometry::with_stride(setup::GREEN, layout, rate, setup::STRIDE).map_err(Refusal::Layout)?;
    let _ = setup::checked_with(camera, settings.floor, settings.trigger).map_err(Refusal::Layout)?;
    match settings.exposure {
        Some(found) if !(1..=most).contains(&found) => Err(Refusal::Exposure { found, most }),
        _ => Ok(layout),
    }
}

#[cfg(test)]
mod tests;
