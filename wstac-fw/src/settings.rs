//! The settings that a host has set, and learned textures, in flash: they survive a reset at any time.
//!
//! Each is one item of a map of the crate `sequential-storage`. It is chosen because it writes each word once, which
//! memory with error correction needs, has checksums, and uses two sectors in turn. `ekv` is made for many keys in many
//! pages of a few kB, and a sector of the STM32H743 has 128 kB.
//!
//! An item that was not written to its end is not valid, and the one before it holds. So a reset at any time leaves the
//! old item or the new one, and all others as they are.

use core::ops::Range;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use sequential_storage::Error;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};
#[cfg(any(feature = "learn", test))]
use wstac_core::crc::crc32;
use wstac_core::layout::{FrameSize, Layout};
#[cfg(any(feature = "learn", test))]
use wstac_core::learned::Center;
#[cfg(any(feature = "learn", test))]
use wstac_core::model::calibration::MOST_DIMENSIONS;
#[cfg(any(feature = "learn", test))]
use wstac_core::model::place::Place;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
#[cfg(any(feature = "learn", test))]
use wstac_core::wire::{MOST_TEXTURES, TextureName};
use wstac_core::wire::{Refusal, Settings};

use crate::setup;

/// The key of the settings. A key changes if its bytes mean something else, so that they are not taken for others.
const KEY: u8 = 1;
/// The key of the first learned texture. The others follow.
#[cfg(any(feature = "learn", test))]
const FIRST_TEXTURE: u8 = 16;
/// The longest item: settings and their key, in whole words of 32 bytes.
const MOST: usize = 224;

/// Memory of which whole words are aligned, as some flash needs.
#[repr(align(32))]
struct Buffer([u8; MOST]);

/// Returns the settings that were kept in a range of a flash; `None` if there are none.
///
/// The flash must not wait for anything but itself.
pub fn load<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Option<Settings> {
    fetch(flash, range, KEY, |bytes| postcard::from_bytes::<Option<Settings>>(bytes).ok()?).ok()?
}

/// Returns the kept settings that a board with such frames can use, with their layout; `None` if there are none.
///
/// An exposure of more than so many lines, which older firmware took, is left out: with it there would be no frames.
pub fn usable<F: NorFlash>(
    flash: &mut F,
    range: Range<u32>,
    size: FrameSize,
    rate: FrameRate,
    most: u16,
) -> Option<(Settings, Layout)> {
    let mut settings = load(flash, range)?;
    settings.exposure = settings.exposure.filter(|lines| *lines <= most);
    Some((settings, check(&settings, size, rate, most).ok()?))
}

/// A flash of which a part reads as erased.
struct Masked<'f, F> {
    flash: &'f mut F,
    hidden: Range<u32>,
}

impl<F: NorFlash> ErrorType for Masked<'_, F> {
    type Error = F::Error;
}

impl<F: NorFlash> ReadNorFlash for Masked<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        if self.hidden.contains(&offset) {
            bytes.fill(0xFF);
            return Ok(());
        }
        self.flash.read(offset, bytes).await
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash> NorFlash for Masked<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        self.flash.erase(from, to).await
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(offset, bytes).await
    }
}

/// The reason why there is no item.
enum StoreFailure {
    /// The flash holds no map, not even one that can be repaired.
    Map,
    Flash,
}

impl<E> From<Error<E>> for StoreFailure {
    fn from(error: Error<E>) -> Self {
        if matches!(error, Error::Storage { .. }) { Self::Flash } else { Self::Map }
    }
}

fn keys() -> impl Iterator<Item = u8> {
    let settings = core::iter::once(KEY);
    #[cfg(any(feature = "learn", test))]
    let settings = settings.chain((FIRST_TEXTURE..).take(MOST_TEXTURES));
    settings
}

// It is not inlined, so that its buffer does not lie on the stack for ever.
fn fetch<F: NorFlash, T>(
    flash: &mut F,
    range: Range<u32>,
    key: u8,
    read: impl FnOnce(&[u8]) -> Option<T>,
) -> Result<Option<T>, StoreFailure> {
    fetch_without(flash, range, 0..0, key, read)
}

/// Reads an item as if a part of the flash were erased.
#[inline(never)]
fn fetch_without<F: NorFlash, T>(
    flash: &mut F,
    range: Range<u32>,
    hidden: Range<u32>,
    key: u8,
    read: impl FnOnce(&[u8]) -> Option<T>,
) -> Result<Option<T>, StoreFailure> {
    let config = MapConfig::try_new(range).map_err(|_| StoreFailure::Flash)?;
    let mut map = MapStorage::<u8, _, _>::new(Masked { flash, hidden }, config, Cache::new_uncached());
    let mut buffer = Buffer([0; MOST]);
    let bytes = block_on(map.fetch_item::<&[u8]>(&mut buffer.0, &key))?;
    Ok(bytes.and_then(read))
}

/// Keeps settings in place of those before, or `None` of them.
///
/// # Errors
/// Returns [`Refusal::Memory`] if the flash fails, or if the settings cannot be read again.
#[inline(never)]
pub fn keep<F: NorFlash>(flash: &mut F, range: Range<u32>, settings: Option<&Settings>) -> Result<(), Refusal> {
    let mut bytes = [0; MOST];
    let bytes: &[u8] = postcard::to_slice(&settings, &mut bytes).map_err(|_| Refusal::Memory)?;
    put(flash, range.clone(), KEY, bytes);
    // Whatever happened, what can be read is what counts.
    if load(flash, range).as_ref() == settings { Ok(()) } else { Err(Refusal::Memory) }
}

/// Stores an item. If what is there is no map with items, it is erased first.
fn put<F: NorFlash>(flash: &mut F, range: Range<u32>, key: u8, item: &[u8]) {
    #[cfg(any(feature = "learn", test))]
    end_move(flash, &range);
    if let Err(StoreFailure::Map) = store(flash, range.clone(), key, item) {
        let is_lost = |key| match fetch(flash, range.clone(), key, |_| Some(())) {
            Ok(found) => found.is_none(),
            Err(failure) => matches!(failure, StoreFailure::Map),
        };
        // The flash holds no map with items, so nothing is lost with it.
        if keys().all(is_lost) && block_on(flash.erase(range.start, range.end)).is_ok() {
            let _ = store(flash, range, key, item);
        }
    }
}

#[inline(never)]
fn store<F: NorFlash>(flash: &mut F, range: Range<u32>, key: u8, item: &[u8]) -> Result<(), StoreFailure> {
    let config = MapConfig::try_new(range).map_err(|_| StoreFailure::Flash)?;
    let mut map = MapStorage::<u8, _, _>::new(Masked { flash, hidden: 0..0 }, config, Cache::new_uncached());
    let mut buffer = Buffer([0; MOST]);
    Ok(block_on(map.store_item(&mut buffer.0, &key, &item))?)
}

/// Erases a sector whose items were all moved to the other one, if a reset came before it was erased.
///
/// The crate moves them again after a reset, and erases the copies first. If the reset came while the sector was
/// erased, only the copies were whole.
#[cfg(any(feature = "learn", test))]
#[inline(never)]
fn end_move<F: NorFlash>(flash: &mut F, range: &Range<u32>) {
    let size = F::ERASE_SIZE as u32;
    let Some(middle) = range.start.checked_add(size).filter(|middle| middle + size == range.end) else { return };
    let is_set = |flash: &mut F, at| {
        let mut byte = [0; 1];
        block_on(flash.read(at, &mut byte)).is_ok() && byte != [0xFF]
    };
    // At rest, one of the sectors is empty. A sector that is full is marked in its last word, too.
    if !is_set(flash, range.start) || !is_set(flash, middle) {
        return;
    }
    for old in [range.start..middle, middle..range.end] {
        if !is_set(flash, old.end - 1) {
            continue;
        }
        let mut is_moved = |key| {
            let [with, without] = [0..0, old.clone()].map(|hidden| {
                fetch_without(flash, range.clone(), hidden, key, |item| Some(crc32(item.iter().copied())))
            });
            matches!((with, without), (Ok(with), Ok(without)) if with == without)
        };
        if keys().all(&mut is_moved) {
            let _ = block_on(flash.erase(old.start, old.end));
            return;
        }
    }
}

/// A texture that was learned, as it is kept.
#[cfg(any(feature = "learn", test))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptTexture {
    /// The checksum of the model in whose projection the center is.
    pub model: u32,
    /// The name.
    pub name: TextureName,
    /// The center.
    pub center: Center,
}

/// The bytes of a texture that is kept, as postcard writes them.
#[cfg(any(feature = "learn", test))]
type TextureItem<'a> = Option<(u32, TextureName, u32, &'a [u8])>;

#[cfg(any(feature = "learn", test))]
impl KeptTexture {
    fn read(bytes: &[u8]) -> Option<Self> {
        let (model, name, far, bytes) = postcard::from_bytes::<TextureItem<'_>>(bytes).ok()??;
        let mut numbers = [0; MOST_DIMENSIONS];
        let pairs = bytes.as_chunks::<2>().0;
        for (number, pair) in numbers.iter_mut().zip(pairs) {
            *number = i16::from_le_bytes(*pair);
        }
        let place = Place::new(numbers.get(..pairs.len())?)?;
        Some(Self { model, name, center: Center::new(place, far) })
    }
}

/// Returns the learned texture at a place; `None` if there is none.
#[cfg(any(feature = "learn", test))]
pub fn load_texture<F: NorFlash>(flash: &mut F, range: Range<u32>, place: u8) -> Option<KeptTexture> {
    fetch(flash, range, FIRST_TEXTURE + place, KeptTexture::read).ok()?
}

/// Keeps a learned texture at a place, or `None`. Returns whether it can be read again.
#[cfg(any(feature = "learn", test))]
#[inline(never)]
pub fn keep_texture<F: NorFlash>(flash: &mut F, range: Range<u32>, place: u8, texture: Option<&KeptTexture>) -> bool {
    let (mut bytes, mut numbers) = ([0; MOST], [0; 2 * MOST_DIMENSIONS]);
    let item: TextureItem<'_> = texture.map(|KeptTexture { model, name, center }| {
        let places = center.place().numbers();
        for (pair, number) in numbers.as_chunks_mut::<2>().0.iter_mut().zip(places) {
            *pair = number.to_le_bytes();
        }
        (*model, *name, center.far(), numbers.get(..2 * places.len()).unwrap_or_default())
    });
    let Ok(bytes) = postcard::to_slice(&item, &mut bytes) else { return false };
    put(flash, range.clone(), FIRST_TEXTURE + place, bytes);
    load_texture(flash, range, place).as_ref() == texture
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
