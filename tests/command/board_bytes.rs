//! Writes to standard output what a board sends for a scene: `board_bytes scene:Saw3@150 [MODEL…]`. The checks of the
//! node play a board with it, and it makes `wstac-host/examples/board.bin`.

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;

use wstac_host::model_file::ModelFile;

#[path = "monitor/board.rs"]
mod board;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = std::env::args().skip(1).collect::<Vec<_>>();
    let (scene, models) = arguments.split_first().ok_or("expected the name of a scene, such as scene:Saw3@150")?;
    let models = models.iter().map(|model| ModelFile::open(Path::new(model))).collect::<Result<Vec<_>, _>>()?;
    io::stdout().write_all(&board::sent(scene, &models, true, false).frames.concat())?;
    Ok(())
}
