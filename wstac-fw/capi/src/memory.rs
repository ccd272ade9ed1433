//! Memory that a caller provides, and the values that have been set up in it.

use crate::status::WstacFwStatus;

/// The content of a caller's memory: a mark that it has been set up, then the value.
#[repr(C)]
pub(crate) struct Slot<T> {
    mark: u32,
    value: T,
}

/// A C type whose memory holds a [`Slot`].
///
/// # Safety
/// `Self` is plain numbers, at least as large as `Slot<Self::Value>`, and as aligned.
pub(crate) unsafe trait Memory {
    /// The type of the value that is set up in it.
    type Value;
    /// The mark that distinguishes it from memory that has not been set up.
    const MARK: u32;
}

/// Returns whether a [`Slot`] of `T` fits closely into `M`, for a `const` assertion.
pub(crate) const fn fits<M, T>(most_unused: usize) -> bool {
    align_of::<M>() >= align_of::<Slot<T>>()
        && size_of::<M>() >= size_of::<Slot<T>>()
        && size_of::<M>() - size_of::<Slot<T>>() <= most_unused
}

/// Checks memory that has `size` bytes according to the caller.
fn checked<M: Memory>(memory: *const M) -> Result<*mut Slot<M::Value>, WstacFwStatus> {
    if memory.is_null() {
        return Err(WstacFwStatus::Null);
    }
    let slot = memory.cast_mut().cast::<Slot<M::Value>>();
    if memory.is_aligned() { Ok(slot) } else { Err(WstacFwStatus::Memory) }
}

/// Checks that memory has been set up.
///
/// # Safety
/// `slot` is readable, and as large and aligned as a slot.
unsafe fn check_mark<M: Memory>(slot: *const Slot<M::Value>) -> Result<(), WstacFwStatus> {
    // The mark is a slot's first field.
    // SAFETY: guaranteed by the caller; any number is a mark.
    let mark = unsafe { slot.cast::<u32>().read_volatile() };
    if mark == M::MARK { Ok(()) } else { Err(WstacFwStatus::State) }
}

/// Sets up memory of `size` bytes.
///
/// # Errors
/// Returns a status if the memory is null, too small or not aligned, and the errors of `make`.
///
/// # Safety
/// `memory` is null, or `size` bytes that no other code uses meanwhile.
pub(crate) unsafe fn set_up<M: Memory>(
    memory: *mut M,
    size: usize,
    make: impl FnOnce() -> Result<M::Value, WstacFwStatus>,
) -> Result<WstacFwStatus, WstacFwStatus> {
    let slot = checked(memory)?;
    if size < size_of::<M>() {
        return Err(WstacFwStatus::Memory);
    }
    let value = make()?;
    // SAFETY: it is not null, aligned, as large as its type, which holds a slot (`Memory`), and not in use by others
    // (the caller). Its previous content needs no drop, because it owns nothing.
    unsafe { slot.write(Slot { mark: M::MARK, value }) };
    Ok(WstacFwStatus::Ok)
}

/// Returns the value that has been set up in memory, to be changed.
///
/// # Errors
/// Returns a status if the memory is null, not aligned, or not set up.
///
/// # Safety
/// `memory` is null, or readable and writable as its type, and no other code uses it meanwhile.
pub(crate) unsafe fn value_mut<'a, M: Memory>(memory: *mut M) -> Result<&'a mut M::Value, WstacFwStatus> {
    let slot = checked(memory)?;
    // SAFETY: it is readable, and as large and aligned as a slot (the caller, `checked`).
    unsafe { check_mark::<M>(slot) }?;
    // SAFETY: its mark says that `set_up` has written a slot there, and no other code uses it (the caller).
    Ok(unsafe { &mut (*slot).value })
}

/// Returns the value that has been set up in memory, to be read.
///
/// # Errors
/// Returns a status if the memory is null, not aligned, or not set up.
///
/// # Safety
/// `memory` is null, or readable as its type, and no code changes it meanwhile.
pub(crate) unsafe fn value<'a, M: Memory>(memory: *const M) -> Result<&'a M::Value, WstacFwStatus> {
    let slot = checked(memory)?;
    // SAFETY: as in `value_mut`.
    unsafe { check_mark::<M>(slot) }?;
    // SAFETY: as in `value_mut`, and no code changes it (the caller).
    Ok(unsafe { &(*slot).value })
}

/// Returns a caller's struct or array, to be read.
///
/// # Errors
/// Returns a status if the address is null or not aligned.
///
/// # Safety
/// `from` is null, or a `T` that no code changes meanwhile.
pub(crate) unsafe fn borrowed<'a, T>(from: *const T) -> Result<&'a T, WstacFwStatus> {
    if from.is_null() {
        return Err(WstacFwStatus::Null);
    }
    if !from.is_aligned() {
        return Err(WstacFwStatus::Memory);
    }
    // SAFETY: it is not null, aligned, and a `T` (the caller).
    Ok(unsafe { &*from })
}

/// Returns the bytes that a caller provides.
///
/// # Errors
/// Returns a status if the address is null, or if no memory holds so many bytes.
///
/// # Safety
/// `bytes` is null, or `length` bytes that no code changes meanwhile.
pub(crate) unsafe fn bytes<'a>(bytes: *const u8, length: usize) -> Result<&'a [u8], WstacFwStatus> {
    if bytes.is_null() {
        return Err(WstacFwStatus::Null);
    }
    if isize::try_from(length).is_err() {
        return Err(WstacFwStatus::Memory);
    }
    // SAFETY: it is not null, and `length` bytes (the caller), which are at most half of all addresses.
    Ok(unsafe { core::slice::from_raw_parts(bytes, length) })
}

/// Checks that there is a place for a `T`.
///
/// # Errors
/// Returns a status if the address is null or not aligned.
pub(crate) fn place<T>(to: *mut T) -> Result<*mut T, WstacFwStatus> {
    if to.is_null() {
        return Err(WstacFwStatus::Null);
    }
    if to.is_aligned() { Ok(to) } else { Err(WstacFwStatus::Memory) }
}

/// Writes a `T` to a caller's memory.
///
/// # Errors
/// Returns a status if the address is null or not aligned.
///
/// # Safety
/// `to` is null, or memory for a `T` that no other code uses meanwhile.
pub(crate) unsafe fn give<T>(to: *mut T, value: T) -> Result<WstacFwStatus, WstacFwStatus> {
    let to = place(to)?;
    // SAFETY: it is not null, aligned, and memory for a `T` (the caller).
    unsafe { to.write(value) };
    Ok(WstacFwStatus::Ok)
}
