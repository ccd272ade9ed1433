//! WSTac's pipeline for firmware in C: `libwstac_fw.a`, whose header is `include/wstac_fw.h`.
//!
//! Nothing is allocated: a pipeline and a model live in memory that the caller gives. Every call checks its pointers and that what
//! they point to has been set up; what is wrong is a status, with a text. A pipeline or a model is used by one thread, or one level
//! of interrupts, at a time; there is nothing that two of them share.
//!
//! | what | file |
//! | --- | --- |
//! | pixel formats | `format.rs` |
//! | frames and stripes in | `pipeline.rs` |
//! | trigger, speed law, floor | `settings.rs` |
//! | events, features, speed, direction | `answers.rs` |
//! | texture models | `model.rs` |
//! | statuses and their texts | `status.rs` |
#![no_std]

pub mod answers;
pub mod format;
mod memory;
pub mod model;
pub mod pipeline;
pub mod settings;
pub mod status;

/// Not reached: no panic is left in what a program links, which `ci/capi` checks. Traps on Arm and x86-64, so that it would
/// not go unseen; elsewhere it stands still.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        #[cfg(target_arch = "arm")]
        // SAFETY: an undefined instruction has no effect but its fault.
        unsafe {
            core::arch::asm!("udf #0");
        }
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        unsafe {
            core::arch::asm!("ud2");
        }
    }
}
