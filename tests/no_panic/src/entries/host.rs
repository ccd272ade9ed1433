//! What only a host asks for.

entries! {
    host:
    instruction_set() -> &'static str { wstac_core::green::instruction_set() }
}
