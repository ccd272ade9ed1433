//! The `wstac` command.

fn main() {}
