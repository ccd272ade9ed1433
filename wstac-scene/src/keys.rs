//! Keys of a scene's tables, and the messages for values out of range.

/// A table of a scene's file.
pub(crate) trait Keys {
    /// The name of the table.
    const TABLE: &'static str;

    /// Checks every key.
    ///
    /// # Errors
    /// A value is out of range; the message names the key, the value found and the values expected.
    fn check(&self) -> Result<(), String>;

    /// Checks every key; its error names the table, too.
    ///
    /// # Errors
    /// [`Keys::check`] fails.
    fn check_table(&self) -> Result<(), String> {
        self.check().map_err(|message| format!("[{}] {message}", Self::TABLE))
    }
}

/// Checks that a number is at least `least` and at most `most`; NaN is not.
///
/// # Errors
/// The number is out of range; the message names the key, the value found and the values expected.
pub(crate) fn within(key: &str, found: f64, least: f64, most: f64) -> Result<(), String> {
    if found >= least && found <= most {
        return Ok(());
    }
    Err(format!("{key} is {found}, expected {least} to {most}"))
}
