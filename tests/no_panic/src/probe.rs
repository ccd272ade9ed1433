//! The entry points of `wstac-core` as a Cortex-M's program: linked and measured, never run.
#![no_std]
#![no_main]
#![allow(missing_docs, clippy::type_complexity)]

mod entries;
