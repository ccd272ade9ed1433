//! The program in the repository's README is the one on the crate's front page, which compiles and runs as a doctest.

/// The first block of Rust in Markdown.
fn first_block(page: &str) -> Option<&str> {
    Some(page.split_once("```rust\n")?.1.split_once("```")?.0)
}

#[test]
fn the_program_in_the_readme_is_that_of_the_documentation() {
    let page: String = include_str!("../src/lib.rs")
        .lines()
        .map_while(|line| line.strip_prefix("//!"))
        .flat_map(|line| [line.strip_prefix(' ').unwrap_or(line), "\n"])
        .collect();
    let program = first_block(&page).unwrap();
    assert!(program.contains("Pipeline::builder"));
    assert_eq!(first_block(include_str!("../../README.md")), Some(program));
}
