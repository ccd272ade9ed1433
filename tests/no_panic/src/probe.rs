//! Links the entry points of `wstac-core` as a Cortex-M program. It is linked and measured, and never run.
#![no_std]
#![no_main]
#![allow(missing_docs, clippy::type_complexity)]

mod entries;
