//! The memory that glibc reserves for threads.
//!
//! Only this file of the command holds unsafe code: the setting is a function of C.

/// Limits the reserves of all threads together to two.
///
/// glibc reserves 64 MB of addresses for each thread, or 128 MB to align them. If addresses are limited, few are left
/// for threads that read and record, and a request for memory that fails ends the program.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(super) fn limit() {
    /// `M_ARENA_MAX` of malloc.h.
    const MOST_ARENAS: i32 = -8;
    unsafe extern "C" {
        // SAFETY: it takes any numbers, at any time.
        safe fn mallopt(parameter: i32, value: i32) -> i32;
    }
    // Without the limit, the program does the same with more addresses.
    let _ = mallopt(MOST_ARENAS, 2);
}

/// Other libraries of C reserve nothing for a thread.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn limit() {}
