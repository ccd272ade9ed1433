//! Every entry point of `wstac-core`, with arguments that are unknown to the compiler, and a panic handler that cannot
//! be linked.
//!
//! If a panic is left after optimization, the handler is linked and calls a function that does not exist. Arguments
//! need not come from a constructor: every bit pattern of every field is covered. Models are the exception, because
//! kernels rely on their checks.
//!
//! Only `Display` of errors is left out. It uses `core::fmt`, which has panics of its own, and no code from bytes to
//! events formats text.

unsafe extern "C" {
    fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: there is no such function, so a program that calls it does not exist.
    unsafe { a_panic_is_reachable() }
}

/// The address of a function. `probe.x` keeps the functions that these point to.
pub struct Kept(#[allow(dead_code)] pub *const ());

// SAFETY: nobody reads through the pointer.
unsafe impl Sync for Kept {}

/// Declares the entry points of a group. Each function is named `group.function`, and is kept although nothing calls
/// it.
macro_rules! entries {
    ($group:ident: $($name:ident $(<$life:lifetime>)? ($($argument:ident: $type:ty),*) -> $result:ty $body:block)*) => {
        $(
            #[unsafe(export_name = concat!(stringify!($group), ".", stringify!($name)))]
            #[inline(never)]
            pub fn $name$(<$life>)?($($argument: $type),*) -> $result $body

            const _: () = {
                #[used]
                #[cfg_attr(target_os = "none", unsafe(link_section = ".entries"))]
                static KEPT: crate::entries::Kept = crate::entries::Kept($name as *const ());
            };
        )*
    };
}

#[cfg(not(feature = "deliberate"))]
mod camera;
#[cfg(not(feature = "deliberate"))]
mod events;
#[cfg(not(feature = "deliberate"))]
mod formats;
#[cfg(all(not(feature = "deliberate"), not(target_os = "none")))]
mod host;
#[cfg(not(feature = "deliberate"))]
mod kernels;
#[cfg(not(feature = "deliberate"))]
mod models;
#[cfg(not(feature = "deliberate"))]
mod samples;
#[cfg(not(feature = "deliberate"))]
mod wire;

#[cfg(feature = "deliberate")]
entries! {
    deliberate:
    index(bytes: &[u8], at: usize) -> u8 { bytes[at] }
}
