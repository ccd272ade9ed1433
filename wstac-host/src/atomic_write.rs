//! Files that are written completely or not at all.

use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use crate::error::{Error, ErrorKind};
use crate::files::has_name;

/// The files of this process that are not whole yet.
static UNFINISHED: Names = Names::new();

/// Removes every file of this process that is not whole yet, and lets none be created any more.
///
/// A process that is about to end at once, because of a signal, leaves nothing half-written this way.
pub fn remove_unfinished() {
    UNFINISHED.remove_all();
}

/// The random names of files that are not whole yet.
#[derive(Debug)]
struct Names(Mutex<NameList>);

#[derive(Debug)]
struct NameList {
    paths: Vec<PathBuf>,
    /// Whether the process is about to end.
    is_closed: bool,
}

impl Names {
    const fn new() -> Self {
        Self(Mutex::new(NameList { paths: Vec::new(), is_closed: false }))
    }

    fn lock(&self) -> MutexGuard<'_, NameList> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Creates a file and notes its name. Nothing can come between the two.
    fn create(&'static self, path: &Path) -> io::Result<(File, Unfinished)> {
        let mut list = self.lock();
        if list.is_closed {
            return Err(io::Error::other("the program is about to end"));
        }
        // `create_new` follows no symbolic link, and gives the mode of any new file: 0o666 less the umask.
        let file = File::create_new(path)?;
        list.paths.push(path.to_owned());
        Ok((file, Unfinished { path: path.to_owned(), names: self }))
    }

    fn remove_all(&self) {
        let mut list = self.lock();
        list.is_closed = true;
        for path in list.paths.drain(..) {
            // It may have been removed already.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Keeps the random name of a file in the list of unfinished ones.
#[derive(Debug)]
struct Unfinished {
    path: PathBuf,
    names: &'static Names,
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        self.names.lock().paths.retain(|path| *path != self.path);
    }
}

/// Opens an existing file of this name and locks it, so that it can be replaced; `None` if there is none.
///
/// Recorders lock the file that they write. The lock is held until the returned file is dropped.
///
/// # Errors
/// Another program is writing the file.
pub fn lock_existing(path: &Path) -> Result<Option<File>, Error> {
    for _ in 0..100 {
        // A link is not followed, and a pipe is not waited for.
        let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK | libc::O_NOCTTY;
        // A file that cannot be opened has no recorder of this user.
        let Ok(file) = File::options().read(true).custom_flags(flags).open(path) else { return Ok(None) };
        // On a system without locks the file is not locked.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = "another wstac is writing it, expected to be the only one";
            return Err(Error::new(ErrorKind::Busy, path.display(), message));
        }
        // The name may have gone to another file before the lock.
        if has_name(&file, path) {
            return Ok(Some(file));
        }
        if path.symlink_metadata().is_err() {
            return Ok(None);
        }
    }
    Err(Error::new(ErrorKind::Busy, path.display(), "other programs replace it again and again"))
}

/// A file that takes its name only when all of it is written.
///
/// Until [`commit`](Self::commit) it is in the same folder under a random name.
/// It is removed if it is dropped before that, and whatever had the name stays as it was.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("fit.svg");
/// use std::io::Write;
///
/// use wstac_host::atomic_write::AtomicFile;
///
/// let mut file = AtomicFile::create(&path)?;
/// file.write_all(b"<svg/>")?;
/// assert!(!path.exists());
/// file.commit()?;
/// assert_eq!(std::fs::read(&path)?, b"<svg/>");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct AtomicFile {
    // Errors of a file that knows its temporary name would show that name.
    file: BufWriter<File>,
    temporary: TempPath,
    path: PathBuf,
    unfinished: Unfinished,
}

impl AtomicFile {
    /// Creates the file under a random name in the folder of `path`.
    ///
    /// # Errors
    /// The folder does not exist, or no file can be created in it. The error names `path`.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut name = tempfile::Builder::new();
        let file = name.prefix(".wstac-").suffix(".part").make_in(folder, |path| UNFINISHED.create(path));
        let ((file, unfinished), temporary) = file.map_err(|error| Error::io(path.display(), error))?.into_parts();
        Ok(Self { file: BufWriter::new(file), temporary, path: path.to_owned(), unfinished })
    }

    /// Returns the open file, for a writer of its own.
    ///
    /// # Errors
    /// The system has no descriptor left.
    pub fn file(&self) -> Result<File, Error> {
        self.file.get_ref().try_clone().map_err(|error| Error::io(self.path.display(), error))
    }

    /// Gives the file its name, and replaces a file that has it.
    ///
    /// # Errors
    /// The rest cannot be written, the name is that of a folder, or another program is recording to the file of that
    /// name. The error names the path.
    pub fn commit(self) -> Result<(), Error> {
        let _replaced = lock_existing(&self.path)?;
        self.finish(|file, path| file.persist(path).map_err(|error| error.error))
    }

    /// Gives the file its name if nothing has it.
    ///
    /// # Errors
    /// The rest cannot be written, or the name is taken. The error names the path.
    pub fn commit_new(self) -> Result<(), Error> {
        self.finish(|file, path| file.persist_noclobber(path).map_err(|error| error.error))
    }

    fn finish(self, give: impl FnOnce(TempPath, &Path) -> io::Result<()>) -> Result<(), Error> {
        let Self { file, temporary, path, unfinished } = self;
        let file = file.into_inner().map_err(io::IntoInnerError::into_error);
        // Without `sync_all`, a power failure could leave a name without its content.
        let whole = file.and_then(|file| file.sync_all());
        let renamed = whole.and_then(|()| give(temporary, &path));
        drop(unfinished);
        renamed.map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => {
                let message = "exists already: it was made in the meantime";
                Error::new(ErrorKind::AlreadyExists, path.display(), message).caused_by(error)
            }
            _ => Error::io(path.display(), error),
        })
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.file.seek(place)
    }
}

/// Writes a file completely or not at all.
///
/// # Errors
/// The file cannot be written. The error names the path, and a file that had the name stays as it was.
pub fn atomic_write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes.as_ref()).map_err(|error| Error::io(path.display(), error))?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{MetadataExt, symlink};

    use super::*;

    /// Returns the names of everything in a folder.
    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_written_completely_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        atomic_write(&path, "one").unwrap();
        atomic_write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        let missing = folder.path().join("none").join("a.svg");
        let error = atomic_write(&missing, "one").unwrap_err().to_string();
        assert!(error.contains("none/a.svg: no such file") && !error.contains(".wstac-"), "{error}");
        // A folder of that name cannot be replaced: nothing is left beside it.
        let taken = folder.path().join("b");
        fs::create_dir(&taken).unwrap();
        assert!(atomic_write(&taken, "one").unwrap_err().to_string().contains("/b: "));
        assert_eq!(names(folder.path()), ["a.svg", "b"]);
    }

    #[test]
    fn an_old_file_stays_until_the_new_one_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        fs::write(&path, "old").unwrap();
        let mut half = AtomicFile::create(&path).unwrap();
        half.write_all(&vec![b'x'; 100_000]).unwrap();
        half.flush().unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        drop(half);
        assert_eq!((names(folder.path()), fs::read_to_string(&path).unwrap()), (vec!["a.svg".into()], "old".into()));
    }

    #[test]
    fn a_file_that_somebody_records_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        let recorder = File::create(&path).unwrap();
        recorder.lock().unwrap();
        fs::write(&path, "half").unwrap();
        let error = atomic_write(&path, "other").unwrap_err();
        assert!(error.kind() == ErrorKind::Busy && error.message().contains("another wstac is writing it"), "{error}");
        assert_eq!((names(folder.path()).len(), fs::read_to_string(&path).unwrap().as_str()), (1, "half"));
        drop(recorder);
        atomic_write(&path, "other").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "other");
    }

    #[test]
    fn a_name_that_is_taken_in_the_meantime_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        let file = AtomicFile::create(&path).unwrap();
        fs::write(&path, "theirs").unwrap();
        assert_eq!(file.commit_new().unwrap_err().kind(), ErrorKind::AlreadyExists);
        assert_eq!((names(folder.path()).len(), fs::read_to_string(&path).unwrap().as_str()), (1, "theirs"));
    }

    #[test]
    fn a_process_that_ends_at_once_leaves_nothing_unfinished() {
        let folder = tempfile::tempdir().unwrap();
        let file = AtomicFile::create(&folder.path().join("a.svg")).unwrap();
        assert_eq!(names(folder.path()).len(), 1);
        // Other tests of this process may have files, too: only this one's list is looked at.
        let own = file.unfinished.path.clone();
        assert!(UNFINISHED.lock().paths.contains(&own));
        drop(file);
        assert!(!UNFINISHED.lock().paths.contains(&own) && names(folder.path()).is_empty());
    }

    /// A signal may come at any time: before a file is created, while it is, or after.
    #[test]
    fn nothing_is_created_once_the_process_is_about_to_end() {
        static LISTS: [Names; 50] = [const { Names::new() }; 50];
        for list in &LISTS {
            let folder = tempfile::tempdir().unwrap();
            let create = |number: u32| {
                let created = list.create(&folder.path().join(number.to_string()));
                created.ok().map(|(_, unfinished)| unfinished)
            };
            std::thread::scope(|scope| {
                // All are kept until the end: one that is dropped is no longer in the list.
                let creating = scope.spawn(|| (0..1000).map_while(create).collect::<Vec<_>>());
                while list.lock().paths.is_empty() && !creating.is_finished() {}
                list.remove_all();
                assert!(!creating.join().unwrap().is_empty());
            });
            assert!(create(1000).is_none() && names(folder.path()).is_empty());
        }
    }

    #[test]
    fn a_new_file_has_the_mode_of_any_new_file() {
        let folder = tempfile::tempdir().unwrap();
        let [plain, atomic] = ["plain", "atomic"].map(|name| folder.path().join(name));
        fs::write(&plain, "").unwrap();
        atomic_write(&atomic, "").unwrap();
        let mode = |path| fs::metadata(path).unwrap().mode();
        assert_eq!(mode(&atomic), mode(&plain));
    }

    #[test]
    fn a_symbolic_link_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let [victim, path] = ["victim", "a.svg"].map(|name| folder.path().join(name));
        fs::write(&victim, "theirs").unwrap();
        let planted = ["a.svg", "a.svg.part", "a.svg.tmp", ".a.svg", ".a.svg.part", ".wstac-.part"];
        for name in planted {
            symlink(&victim, folder.path().join(name)).unwrap();
        }
        atomic_write(&path, "ours").unwrap();
        let expected = ("theirs", b"ours".into());
        assert_eq!((fs::read_to_string(&victim).unwrap().as_str(), fs::read(&path).unwrap()), expected);
        // The link that had the name is replaced, the others are as they were.
        assert!(!fs::symlink_metadata(&path).unwrap().is_symlink());
        for name in &planted[1..] {
            assert_eq!(fs::read_link(folder.path().join(name)).unwrap(), victim);
        }
        assert_eq!(names(folder.path()).len(), 1 + planted.len());
    }
}
