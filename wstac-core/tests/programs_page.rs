//! The core's program on docs/PROGRAMS.md is the one on the crate's front page, which compiles and runs as a doctest.

/// Returns the block of Rust in Markdown that starts with `start`.
fn block<'p>(page: &'p str, start: &str) -> Option<&'p str> {
    let blocks = page.split("```rust\n").skip(1).filter_map(|rest| Some(rest.split_once("```")?.0));
    blocks.into_iter().find(|block| block.starts_with(start))
}

#[test]
fn the_program_on_the_page_is_that_of_the_documentation() {
    let page: String = include_str!("../src/lib.rs")
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .flat_map(|line| [line.strip_prefix(' ').unwrap_or(line), "\n"])
        .collect();
    let start = "use wstac_core::{green::gray::Gray, law";
    let program = block(&page, start).unwrap();
    assert!(program.contains("Pipeline::builder"));
    assert_eq!(block(include_str!("../../docs/PROGRAMS.md"), start), Some(program));
}
