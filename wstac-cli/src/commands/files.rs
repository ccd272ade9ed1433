//! The files that a command writes: new, or replaced on request, and never one of those that it reads.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata};
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirEntryExt, MetadataExt};
use std::path::{Path, PathBuf};

use super::output::check_new;
use wstac_host::atomic_write::AtomicFile;
use wstac_host::error::{Error, ErrorKind};

/// The files that a command may write: none that it reads, and existing ones only with `--force`.
#[derive(Clone, Debug, Default)]
pub(super) struct Outputs {
    inputs: Vec<PathBuf>,
    force: bool,
}

/// The endings of files that this program or others write, each of one format.
const ENDINGS: [&str; 26] = [
    "avi", "bag", "c", "cpp", "csv", "db3", "h", "h5", "json", "jsonl", "mcap", "mkv", "mov", "mp4", "npy", "npz",
    "onnx", "parquet", "png", "py", "rs", "svg", "toml", "txt", "wsm", "y4m",
];

/// Refuses the name of a new output that ends as files of another format do. Other endings are the user's choice, and
/// so is an existing file, which takes `--force`.
///
/// # Errors
/// The ending is known, and none of `expected`.
pub(super) fn check_ending(path: &Path, expected: &[&str]) -> Result<(), Error> {
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
    if expected.contains(&&*ending) || !ENDINGS.contains(&&*ending) || path.symlink_metadata().is_ok() {
        return Ok(());
    }
    let names = expected.iter().map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(" or ");
    let message = format_args!("its name ends in .{ending}, expected {names}: no other format is written");
    Err(Error::new(ErrorKind::Usage, path.display(), message))
}

/// Refuses the name of a figure that does not end in `.svg`. A name without an ending may be one.
pub(super) fn check_figure(path: &Path) -> Result<(), Error> {
    if path == Path::new("-") {
        return Err(Error::new(ErrorKind::Usage, path.display(), "figures are files, expected a name such as a.svg"));
    }
    let Some(ending) = path.extension().filter(|_| !ends(path, "svg")) else { return Ok(()) };
    let ending = ending.display().to_string().to_ascii_lowercase();
    let is_converted = ["png", "pdf"].contains(&&*ending);
    let help =
        if is_converted { format!("; help: write an SVG, then rsvg-convert -f {ending}") } else { String::new() };
    let message = format_args!("figures are SVG (found .{ending}, expected .svg){help}");
    Err(Error::new(ErrorKind::Usage, path.display(), message))
}

/// Returns whether a name ends so, in upper or lower case.
pub(super) fn ends(path: &Path, with: &str) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(with))
}

impl Outputs {
    /// Permits new files, and with `force` existing ones, too.
    pub(super) fn new(force: bool) -> Self {
        Self { inputs: Vec::new(), force }
    }

    /// Protects files and folders that the command reads. Names that are no files do not matter.
    pub(super) fn reading<P: AsRef<Path>>(mut self, inputs: impl IntoIterator<Item = P>) -> Self {
        self.inputs.extend(inputs.into_iter().map(|path| path.as_ref().to_owned()));
        self
    }

    /// Protects the file of a source: also that of a scene, and that of standard input.
    pub(super) fn source(self, name: &OsStr) -> Self {
        if name == "-" {
            return self.reading(["/dev/stdin"]);
        }
        let bytes = name.as_bytes();
        let file = bytes.strip_prefix(b"scene:").or_else(|| bytes.strip_prefix(b"board:"));
        self.reading([file.map_or(name, OsStr::from_bytes)])
    }

    /// Refuses outputs that are inputs by any of their names, that exist, that are no files, that are the same file, or
    /// that cannot be written.
    pub(super) fn check<P: AsRef<Path>>(&self, outputs: impl IntoIterator<Item = P>) -> Result<(), Error> {
        let mut seen = Vec::new();
        for output in outputs {
            let path = output.as_ref();
            self.check_one(path)?;
            Self::check_room(path)?;
            let place = place(path);
            if seen.contains(&place) {
                let message = "is the name of two outputs, expected a name for each";
                return Err(Error::new(ErrorKind::Usage, path.display(), message));
            }
            seen.push(place);
        }
        Ok(())
    }

    pub(super) fn check_one(&self, path: &Path) -> Result<(), Error> {
        if let Some(there) = path.metadata().ok().filter(|there| !there.is_dir()) {
            let of_it = |input: &&PathBuf| is_or_has(input, &there);
            if let Some(input) = self.inputs.iter().find(of_it) {
                let message = format_args!("is an input of the command ({}), expected a new file", input.display());
                return Err(Error::new(ErrorKind::Usage, path.display(), message));
            }
        }
        check_new(path, self.force)
    }

    /// Checks early that a file can be written, also in a folder that is still to be made, unlike the other checks.
    pub(super) fn check_room(path: &Path) -> Result<(), Error> {
        let mut folders = path.ancestors().skip(1).map(|folder| if folder == "" { Path::new(".") } else { folder });
        let Some(folder) = folders.find(|folder| folder.exists()) else { return Ok(()) };
        let name = folder.join(path.file_name().unwrap_or_default());
        AtomicFile::create(&name).map(drop).map_err(|error| error.about(path.display()))
    }

    pub(super) fn create(&self, path: &Path) -> Result<NewFile, Error> {
        self.check_one(path)?;
        Ok(NewFile { file: AtomicFile::create(path)?, path: path.to_owned(), outputs: self.clone() })
    }

    /// Writes a file completely or not at all.
    pub(super) fn write(&self, path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
        let mut new = self.create(path)?;
        new.file.write_all(bytes.as_ref()).map_err(|error| Error::io(path.display(), error))?;
        new.commit()
    }

    /// Creates a file that has its name from the start, so that what is in it can be recovered. It is locked.
    ///
    /// With `--force` it takes the place of a file that nobody is writing. That file's other names keep its content.
    pub(super) fn create_at_once(&self, path: &Path) -> Result<File, Error> {
        self.check_one(path)?;
        let file = AtomicFile::create(path)?;
        let open = file.file()?;
        // On a system without locks the file is not locked.
        let _ = open.try_lock();
        if self.force {
            file.commit()?;
        } else {
            file.commit_new()?;
        }
        Ok(open)
    }
}

/// A file that takes its name when it is whole.
#[derive(Debug)]
pub(super) struct NewFile {
    pub(super) file: AtomicFile,
    pub(super) path: PathBuf,
    outputs: Outputs,
}

impl NewFile {
    /// Gives the file its name, unless another file has taken it in the meantime.
    pub(super) fn commit(self) -> Result<(), Error> {
        self.outputs.check_one(&self.path)?;
        if self.outputs.force { self.file.commit() } else { self.file.commit_new() }
    }
}

/// Returns the folder and the name of a path, however it is written.
fn place(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.join(path.file_name().unwrap_or_default())
}

/// Returns whether two names are of one file.
pub(super) fn is_same(one: &Path, other: &Path) -> bool {
    one.metadata().ok().zip(other.metadata().ok()).is_some_and(|(one, other)| is_one(&one, &other))
}

fn is_one(one: &Metadata, other: &Metadata) -> bool {
    (one.dev(), one.ino()) == (other.dev(), other.ino())
}

/// Returns whether an input is this file, or a folder that has it by any name.
fn is_or_has(input: &Path, file: &Metadata) -> bool {
    let Ok(found) = input.metadata() else { return false };
    if !found.is_dir() {
        return is_one(&found, file);
    }
    let Ok(entries) = fs::read_dir(input) else { return false };
    // A link in the folder has a number of its own.
    let is_it = |entry: &fs::DirEntry| {
        let is_link = entry.file_type().is_ok_and(|kind| kind.is_symlink());
        (is_link || entry.ino() == file.ino()) && entry.path().metadata().is_ok_and(|found| is_one(&found, file))
    };
    entries.flatten().any(|entry| is_it(&entry))
}
