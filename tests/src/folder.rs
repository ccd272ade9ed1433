//! A folder for the files of one test.

use std::fs;
use std::path::{Path, PathBuf};

/// A slide in small pictures.
pub const SMALL: &str = "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [40, 40]\n";

/// The head of a clip of gray frames of 40 × 40 pixels in Y4M.
pub const GRAY: &[u8] = b"YUV4MPEG2 W40 H40 F30:1 Cmono\n";

/// Returns such frames of one level in Y4M, without the head.
pub fn frames(level: u8, count: usize) -> Vec<u8> {
    [&b"FRAME\n"[..], &[level; 1600]].concat().repeat(count)
}

/// A new folder that is removed at the end, with its path.
pub struct Folder(pub PathBuf);

impl Folder {
    /// Creates a folder of this process and this name, which no other test of the process uses.
    ///
    /// # Panics
    /// If it cannot be created.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("wstac-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir(&path).unwrap();
        Self(path)
    }

    /// Writes a file in the folder.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path
    }

    /// Writes a file in the folder, and returns its path as an argument.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn written(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        text(&self.file(name, content)).to_owned()
    }

    /// Returns the path of a name in the folder, as an argument.
    ///
    /// # Panics
    /// If it is not UTF-8.
    pub fn path(&self, name: &str) -> String {
        text(&self.0.join(name)).to_owned()
    }

    /// Writes a scene in the folder, and returns its name for `wstac`.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn scene(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        format!("scene:{}", text(&self.file(name, content)))
    }

    /// Returns the names of its entries, in order.
    ///
    /// # Panics
    /// If it cannot be read.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Returns a path as an argument.
///
/// # Panics
/// If it is not UTF-8.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
