//! WSTac's pipeline for firmware in C: `libwstac_fw.a`, with the header `include/wstac_fw.h`.
//!
//! Nothing is allocated: a pipeline and a model live in memory that the caller provides. Every call checks its
//! pointers, and that the memory behind them has been set up. Every fault is a status, with a text. A pipeline or a
//! model is used by only one thread, or one interrupt level, at a time. Two of them share nothing.
//!
//! | what | file |
//! | --- | --- |
//! | pixel formats | `format.rs` |
//! | frames and stripes in | `pipeline.rs` |
//! | trigger, law of durations, floor | `settings.rs` |
//! | events, features, motion; speed and direction as published | `answers.rs` |
//! | texture models | `model.rs` |
//! | messages to a host | `link.rs` |
//! | the library's version | `version.rs` |
//! | statuses and their texts | `status.rs` |
#![no_std]

// A program of a host that tests this library stops in its own way.
#[cfg(feature = "hosted")]
extern crate std;

pub mod answers;
pub mod format;
pub mod link;
mod memory;
pub mod model;
pub mod pipeline;
pub mod settings;
pub mod status;
pub mod version;

/// Stops the program. It is never reached: a linked program has no panic left, which `ci/capi` checks.
///
/// It traps on Arm and x86-64, so that it would be noticed; elsewhere it stands still.
#[cfg(not(feature = "hosted"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        #[cfg(target_arch = "arm")]
        // SAFETY: an undefined instruction has no effect but its fault.
        unsafe {
            core::arch::asm!("udf #0");
        }
        #[cfg(target_arch = "x86_64")]
        // SAFETY: an undefined instruction has no effect but its fault.
        unsafe {
            core::arch::asm!("ud2");
        }
    }
}
