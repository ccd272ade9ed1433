//! Links the entry points of `wstac-core` as a library of the host.
#![no_std]
#![allow(missing_docs, clippy::type_complexity)]

mod entries;
