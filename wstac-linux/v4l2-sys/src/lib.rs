//! Bindings of Linux's `linux/videodev2.h`, which bindgen made (`ci/generated v4l2 --write`).
//!
//! They take the place of the registry's crate of this name, whose build script makes them in every build, and needs
//! libclang for it. They are the same text for x86-64, aarch64, 32-bit ARM, x86 and RISC-V, which `ci/generated v4l2`
//! checks: types of C have their own names, and structures the layout of C.

#[allow(clippy::all, clippy::pedantic)]
#[allow(missing_docs, unreachable_pub)]
#[allow(non_camel_case_types, non_snake_case, non_upper_case_globals)]
#[rustfmt::skip]
mod bindings;

pub use bindings::*;
