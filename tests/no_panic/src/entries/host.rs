//! Entry points that only a host uses.

entries! {
    host:
    instruction_set() -> &'static str { wstac_core::green::instruction_set() }
}
