//! `wstac recover`: a whole recording of one that was cut off.

use std::path::PathBuf;

use super::output::{Stop, note};
use super::record::create;
use crate::error::Error;
use crate::record::{Recovered, recover};

/// Make a whole recording of one that was cut off or is damaged
///
/// After a crash, a power cut or kill -9, FILE.mcap has no end, and viewers refuse it. Everything that was completely
/// written goes into a new file; FILE.mcap stays as it is.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The recording
    #[arg(value_name = "FILE.mcap")]
    input: PathBuf,

    /// Write this new file
    #[arg(short, long, value_name = "NEW.mcap")]
    output: PathBuf,

    /// Write over NEW.mcap
    #[arg(long)]
    force: bool,
}

const HELP: &str = "\
What comes back: every frame that was completely written, with all that belongs to it. wstac record
hands a frame to the system as soon as it has it, so after kill -9 that is all but those that
waited in memory for a slow disk (it says at its end how many waited at most).
Where bytes are not those that were written, the frames of that second (or 4 MiB) are entered as
lost: those behind keep their place in time, and wstac run counts them as dropped.
The recording must not be compressed (mcap decompress undoes that); other programs' recordings
come back, too.
Exit code: 0 where there is a new file, however little is in it; 1 where the recording cannot be
read or the new file not written; 2 for wrong arguments.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (old, new) = (&arguments.input, &arguments.output);
    let same = std::fs::canonicalize(old).is_ok_and(|old| std::fs::canonicalize(new).is_ok_and(|new| new == old));
    if same {
        return Err(Error::new(new.display(), "is the recording itself, expected a new file").into());
    }
    crate::record::scan::Scan::open(old)?;
    let file = create(new, arguments.force)?;
    let found = recover(old, file, new).inspect_err(|_| {
        // The old one is still there; half of the new one would be taken for all of it.
        let _ = std::fs::remove_file(new);
    })?;
    let Recovered { frames, events, damaged, whole, bytes } = found;
    note(format_args!("{}: {frames} frames, {events} events, {:.1} MB", new.display(), bytes as f64 / 1e6));
    if damaged > 0 {
        note(format_args!("{damaged} frames were damaged and are entered as lost"));
    }
    note(if whole { "the recording was finished properly" } else { "the recording was not finished" });
    Ok(())
}
