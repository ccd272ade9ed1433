//! Writes to standard output what a board sends for a scene: `board_bytes scene:Saw3@150`. The checks of the node play
//! a board with it.

use std::error::Error;
use std::io::{self, Write};

#[path = "monitor/board.rs"]
mod board;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = std::env::args().nth(1).ok_or("expected the name of a scene, such as scene:Saw3@150")?;
    io::stdout().write_all(&board::sent(&scene, &[], true, false).frames.concat())?;
    Ok(())
}
