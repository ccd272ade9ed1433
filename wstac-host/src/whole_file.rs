//! Files that are there whole or not at all.

use std::fs;
use std::path::Path;

use crate::error::Error;

/// Writes a file under another name first, so that a full disk leaves no half of it, and of an old one all.
///
/// # Errors
/// Names the file.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    let part = path.with_added_extension("part");
    fs::write(&part, bytes).and_then(|()| fs::rename(&part, path)).map_err(|error| {
        let _ = fs::remove_file(&part);
        Error::new(path.display(), error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_whole_or_not_there() {
        let folder = std::env::temp_dir().join(format!("wstac-whole-{}", std::process::id()));
        fs::create_dir(&folder).unwrap();
        let path = folder.join("a.svg");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        let missing = folder.join("none").join("a.svg");
        assert!(write(&missing, "one").unwrap_err().to_string().contains("none/a.svg: "));
        // A folder of that name cannot be replaced: nothing is left beside it.
        let taken = folder.join("b");
        fs::create_dir(&taken).unwrap();
        assert!(write(&taken, "one").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(&folder).unwrap();
    }
}
