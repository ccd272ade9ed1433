//! Keys of a scene's tables: how what is out of range is said.

/// A table of a scene's file.
pub(crate) trait Keys {
    /// Its name.
    const TABLE: &'static str;

    /// Checks every key.
    ///
    /// # Errors
    /// Names the key, what was found and what was expected.
    fn check(&self) -> Result<(), String>;

    /// Checks every key; names the table, too.
    ///
    /// # Errors
    /// As [`Keys::check`].
    fn check_table(&self) -> Result<(), String> {
        self.check().map_err(|message| format!("[{}] {message}", Self::TABLE))
    }
}

/// Whether a number is at least `least` and at most `most`; NaN is not.
///
/// # Errors
/// Names the key, what was found and what was expected.
pub(crate) fn within(key: &str, found: f64, least: f64, most: f64) -> Result<(), String> {
    if found >= least && found <= most {
        return Ok(());
    }
    Err(format!("{key} is {found}, expected {least} to {most}"))
}
