//! What a camera's interrupt does while the core uses a frame: it sums the rows of the next one.
//!
//! An event takes longer on a Cortex-M0 than a camera needs for a stripe, and a ring of two stripes is full then.

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering, compiler_fence};

/// The present work: it is a pointer to one, so that a word holds it.
static WORK: AtomicPtr<&mut (dyn FnMut() + Send)> = AtomicPtr::new(ptr::null_mut());

/// Returns what `main` returns. Until then, [`interrupt`] does `work`.
///
/// `work` is also done before, for what is there already.
#[allow(unsafe_code)]
pub fn meanwhile<T>(work: &mut (dyn FnMut() + Send), main: impl FnOnce() -> T) -> T {
    let mut work = work;
    // A stripe that becomes complete in between is taken, too.
    #[cfg(feature = "node")]
    critical_section::with(|_| {
        WORK.store((&raw mut work).cast(), Ordering::Release);
        // SAFETY: no interrupt comes meanwhile.
        unsafe { interrupt() };
    });
    #[cfg(not(feature = "node"))]
    {
        work();
        WORK.store((&raw mut work).cast(), Ordering::Release);
    }
    let result = main();
    // An interrupt has ended before this goes on, and nothing that it wrote was read before.
    WORK.store(ptr::null_mut(), Ordering::Release);
    compiler_fence(Ordering::SeqCst);
    result
}

/// Does the work of [`meanwhile`], if there is some.
///
/// # Safety
/// Only interrupts of one priority, which do not interrupt each other, and what [`meanwhile`] itself runs call it.
#[allow(unsafe_code)]
pub unsafe fn interrupt() {
    let work = WORK.load(Ordering::Acquire);
    if !work.is_null() {
        // SAFETY: the pointer is taken back before the work ends, and nothing else uses what the work has borrowed.
        unsafe { (*work)() };
    }
}
