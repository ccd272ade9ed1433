//! `wstac recover` makes a complete recording of one that was cut off.

use std::path::PathBuf;

use super::files::{Outputs, is_same};
use super::output::{Stop, note};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::record::{Unread, recover};

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
  - Every frame that was completely written and is not damaged, with all
    that belongs to it. wstac record hands each frame to the system at
    once. After kill -9, only the frames that waited in memory for a slow
    disk are missing; wstac record prints how many waited at most.
  - Every frame has a checksum. Damaged frames become lost frames where
    they were. Later frames keep their place in time, and wstac run
    counts the lost ones as dropped. If the first frames are gone, the
    first one that is left stands at the start. A frame that no checksum
    vouches for is left out.
  - A file without any checksum is copied, and a message says so.
  - Every frame is taken once. If another tool wrote the messages in
    another order, they are put in order; otherwise frames that stand
    behind later ones are left out.
  - Of a compressed recording that was killed, what the compressor had
    not written is lost: up to a second of frames.
  The new file takes its name when it is whole. It is compressed as the
  recording is. Recordings of other programs are recovered, too, but
  without their attachments, and the exit code is 1.

Exit code:
  0   there is a new file, wstac run can read it, and every frame that
      was recorded is in it or is reported as lost; only the incomplete
      end of the recording is missing
  1   nothing can say how many frames are missing (also if the end is
      damaged and not just incomplete) or in which order they were, no
      frame can be recovered, wstac run cannot read the new file, or
      there is none
  2   wrong arguments
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (old, new) = (&arguments.input, &arguments.output);
    if is_same(old, new) {
        return Err(Error::new(ErrorKind::Usage, new.display(), "is the recording itself, expected a new file").into());
    }
    let size = old.metadata().map_err(|error| Error::io(old.display(), error))?.len();
    let outputs = Outputs::new(arguments.force).reading([old]);
    // An existing file of the new name stays until there is a better one.
    let file = outputs.create(new)?;
    // A large file takes its time.
    note(format_args!("reading {:.1} MB", size as f64 / 1e6));
    let found = recover(old, file.file.file()?, new)?;
    file.commit()?;
    let (frames, events) = (counted(found.frames, "frame"), counted(found.events, "event"));
    note(format_args!("{}: {frames}, {events}, {:.1} MB", new.display(), found.bytes as f64 / 1e6));
    let unchecked = if found.frames > 0 { "frame" } else { "message" };
    let all = [
        (found.damaged, "frame", "damaged, recorded as lost"),
        (found.repeated, "frame", "left out: there already, or behind later frames"),
        (found.unchecked, unchecked, "without a checksum: nothing vouches for them"),
        (found.left_out, "record", "left out: attachments, or of kinds that no recording has"),
        (found.doubtful, "message", "with a name that may be wrong: it stands in a damaged part"),
    ];
    for (count, of, what) in all.into_iter().filter(|(count, ..)| *count > 0) {
        note(format_args!("{} {what}", counted(count, of)));
    }
    if let Some(Unread { at, bytes, damaged }) = found.unread {
        let bytes = counted(bytes, "byte");
        note(if damaged {
            format!("{bytes} from {at} on could not be read")
        } else {
            format!("the end has an incomplete record: {bytes} from {at} on")
        });
    }
    if let Some(problem) = found.problem {
        let message = format_args!("{problem}; {} has what could be recovered", new.display());
        return Err(Error::new(ErrorKind::Format, old.display(), message).into());
    }
    note(if found.whole { "the recording was finished properly" } else { "the recording was not finished" });
    Ok(())
}
