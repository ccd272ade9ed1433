//! `wstac recover` makes a complete recording of one that was cut off.

use std::path::PathBuf;

use super::files::Outputs;
use super::output::{Stop, note};
use super::record::is_same;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::record::{Recovered, Unread, recover};
use wstac_host::source::mcap::McapSource;

/// Make a whole recording of a damaged or interrupted one
///
/// After a crash, a power cut or kill -9, FILE.mcap has no end, and viewers refuse it. Everything that was completely
/// written goes to a new file. FILE.mcap stays as it is.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The recording
    #[arg(value_name = "FILE.mcap")]
    input: PathBuf,

    /// Write the recording to this new file
    #[arg(short, long, value_name = "NEW.mcap")]
    output: PathBuf,

    /// Overwrite NEW.mcap
    #[arg(long)]
    force: bool,
}

const HELP: &str = "\
Recovered data:
  - Every frame that was completely written, with all that belongs to it.
    wstac record hands each frame to the system at once. After kill -9,
    only the frames that waited in memory for a slow disk are missing;
    wstac record prints at its end how many waited at most.
  - If bytes are damaged, the frames of that second (or 4 MiB) become
    lost frames. Later frames keep their place in time, and wstac run
    counts the lost ones as dropped.
  - If a length is damaged, the position of what follows is unknown. The
    program reports how many bytes it could not read, and from where on.
    Frames in them are not counted. The new file has all the rest, and
    the exit code is 1.
  The new file takes its name when it is whole. The recording
  must not be compressed (mcap decompress undoes that). Recordings of
  other programs are recovered, too, but without their attachments.

Exit code:
  0   there is a new file, and only the incomplete end of the recording
      is missing
  1   a damaged part of the recording, or all of it, cannot be read, or
      the new file cannot be written
  2   wrong arguments
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (old, new) = (&arguments.input, &arguments.output);
    if is_same(old, new) {
        return Err(Error::new(ErrorKind::Usage, new.display(), "is the recording itself, expected a new file").into());
    }
    wstac_host::record::check_readable(old)?;
    let outputs = Outputs::new(arguments.force).reading([old]);
    // An existing file of the new name stays until there is a better one.
    let file = outputs.create(new)?;
    let found = recover(old, file.file.file()?, new)?;
    file.commit()?;
    let Recovered { frames, events, damaged, whole, bytes, unread, doubtful } = found;
    let (frames, events) = (counted(frames, "frame"), counted(events, "event"));
    note(format_args!("{}: {frames}, {events}, {:.1} MB", new.display(), bytes as f64 / 1e6));
    if damaged > 0 {
        note(format_args!("{} damaged, recorded as lost", counted(damaged, "frame")));
    }
    if doubtful > 0 {
        let doubtful = counted(doubtful, "message");
        note(format_args!("{doubtful} with a name that may be wrong: it stands in a damaged part"));
    }
    // The description of a recording has no checksum of its own, so damage in it shows only when it is read.
    if let Err(error) = McapSource::open(new, None) {
        note(format_args!("wstac run cannot use the new file: {error}"));
    }
    if let Some(Unread { at, bytes, damaged }) = unread {
        if damaged {
            let message = format_args!(
                "is damaged: {} from {at} on could not be read; {} has the rest",
                counted(bytes, "byte"),
                new.display()
            );
            return Err(Error::new(ErrorKind::Format, old.display(), message).into());
        }
        let bytes = counted(bytes, "byte");
        note(format_args!("the end has an incomplete record: {bytes} from {at} on"));
    }
    note(if whole { "the recording was finished properly" } else { "the recording was not finished" });
    Ok(())
}
