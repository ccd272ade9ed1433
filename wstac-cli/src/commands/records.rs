//! The records of a source: as text, JSON Lines or CSV, to standard output or to a file.

use std::fmt::{self, Write as _};
use std::io::Write;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use clap::ValueEnum;

use super::csv::Table;
use super::files::NewFile;
use super::output::{Stop, json, note, stdout, text, text_of};
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{JsonLine, SensorLine};
use wstac_host::output::{DisturbedBaseline, Output};
use wstac_host::source::StreamInfo;
use wstac_host::visible;

/// The form of records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Form {
    /// Lines for a person
    #[default]
    Text,
    /// JSON Lines: one object per line
    Json,
    /// A table of one kind of record: a line of names, then rows
    Csv,
}

impl Form {
    /// Returns JSON if it was asked for, else text.
    pub(super) fn json_if(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }

    /// Returns the name as it is given in arguments.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
            Self::Csv => "csv",
        }
    }
}

/// Where the records of all sensors go: standard output, or a file that takes its name when it is whole.
#[derive(Debug, Default)]
pub(super) struct Destination {
    state: Mutex<DestinationState>,
}

#[derive(Debug, Default)]
struct DestinationState {
    /// The file; `None` for standard output.
    file: Option<NewFile>,
    /// A first line that is not written yet.
    head: Option<String>,
    /// Whether the records are one array of JSON.
    is_array: bool,
    records: u64,
    /// Whether anything was written, and whether writing failed.
    has_begun: bool,
    has_failed: bool,
}

impl Destination {
    /// Creates a destination for lines behind a first one, or for one array of JSON: a file, or standard output.
    pub(super) fn new(file: Option<NewFile>, head: Option<String>, is_array: bool) -> Self {
        Self { state: Mutex::new(DestinationState { file, head, is_array, ..DestinationState::default() }) }
    }

    fn state(&self) -> MutexGuard<'_, DestinationState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes a record: a whole line with its end, whoever else writes.
    fn write(&self, line: &str) -> Result<(), Stop> {
        let mut state = self.state();
        state.begin()?;
        match (state.is_array, state.records) {
            (false, _) => state.write(line)?,
            // The comma behind a record comes with the next one.
            (true, 0) => state.write(&format!("[\n{}", line.trim_end()))?,
            (true, _) => state.write(&format!(",\n{}", line.trim_end()))?,
        }
        state.records += 1;
        Ok(())
    }

    /// Writes the first line, if nothing was written yet.
    fn begin(&self) -> Result<(), Stop> {
        self.state().begin()
    }

    /// Gives a file its name. It returns the name, and how many records the file has.
    ///
    /// It returns `None` for standard output, and if nothing was written or writing failed: then there is no file. The
    /// records of a source that failed are written, with its end.
    ///
    /// # Errors
    /// The file cannot be written, or its name is taken by now.
    pub(super) fn finish(self) -> Result<Option<(PathBuf, u64)>, Error> {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let DestinationState { file, is_array, records, has_begun, has_failed, .. } = state;
        let Some(mut file) = file.filter(|_| has_begun && !has_failed) else { return Ok(None) };
        if is_array {
            file.file.write_all(b"\n]\n").map_err(|error| Error::io(file.path.display(), error))?;
        }
        let path = file.path.clone();
        file.commit()?;
        Ok(Some((path, records)))
    }
}

impl DestinationState {
    fn begin(&mut self) -> Result<(), Stop> {
        match self.head.take() {
            Some(head) => self.write(&head),
            None => Ok(()),
        }
    }

    /// Writes a line at once: who reads along sees it, and after a crash it is in the unfinished file.
    fn write(&mut self, line: &str) -> Result<(), Stop> {
        self.has_begun = true;
        if let Some(NewFile { file, path, .. }) = &mut self.file {
            let written = file.write_all(line.as_bytes()).and_then(|()| file.flush());
            self.has_failed |= written.is_err();
            return Ok(written.map_err(|error| Error::io(path.display(), error))?);
        }
        // One lock for the line and its flush.
        let mut out = stdout();
        out.write_all(line.as_bytes())?;
        Ok(out.flush()?)
    }
}

/// A note as a line of JSON.
#[derive(serde::Serialize)]
struct NoteLine<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    sensor: Option<&'a str>,
    kind: &'a str,
    note: &'a str,
    message: &'a str,
}

/// Writes the records of one sensor.
pub(super) struct Records<'a> {
    form: Form,
    table: Table,
    destination: Option<&'a Destination>,
    sensor: Option<String>,
    /// Whether notes are left out.
    is_quiet: bool,
    line: String,
}

impl<'a> Records<'a> {
    /// Creates the records of a sensor without a name, on standard output.
    pub(super) fn new(form: Form) -> Self {
        Self { form, table: Table::Events, destination: None, sensor: None, is_quiet: false, line: String::new() }
    }

    /// Creates records that go to a destination. `table` is the kind of record that CSV has.
    pub(super) fn to(destination: &'a Destination, form: Form, table: Table) -> Self {
        Self { table, destination: Some(destination), ..Records::new(form) }
    }

    /// Names each record by its sensor.
    pub(super) fn of_sensor(self, sensor: Option<&str>) -> Self {
        Self { sensor: sensor.map(str::to_owned), ..self }
    }

    /// Leaves out notes.
    pub(super) fn quiet(self, is_quiet: bool) -> Self {
        Self { is_quiet, ..self }
    }

    /// Writes a record as a line. Lost frames have none, and a disturbed baseline becomes a note.
    pub(super) fn write(&mut self, output: &Output) -> Result<(), Stop> {
        self.write_at(output, None)
    }

    /// Writes a record as a line, with its time in seconds from the first frame for a table.
    pub(super) fn write_at(&mut self, output: &Output, time_s: Option<f64>) -> Result<(), Stop> {
        let Some(line) = JsonLine::new(output) else {
            if let Output::BaselineDisturbed { .. } = output {
                self.note(DisturbedBaseline);
            }
            return Ok(());
        };
        self.line.clear();
        let sensor = self.sensor.as_deref();
        match self.form {
            Form::Json => self.line = json(&SensorLine { sensor, line })?,
            // Writing to a string does not fail.
            Form::Text => {
                if let Some(sensor) = sensor {
                    let _ = write!(self.line, "{sensor}: ");
                }
                let _ = text(&mut self.line, output);
                self.line = visible::line(&self.line).into_owned();
            }
            Form::Csv if self.table.has(output) => {
                let line = serde_json::to_value(line);
                let line = line.map_err(|error| Error::with_cause(ErrorKind::Io, "standard output", error))?;
                self.line = self.table.row(sensor, &line, time_s);
            }
            Form::Csv => return self.leave_out(output),
        }
        self.line.push('\n');
        match self.destination {
            Some(destination) => destination.write(&self.line),
            None => Destination::default().write(&self.line),
        }
    }

    /// Handles a record that a table has no row for: what a person should know becomes a note.
    fn leave_out(&self, output: &Output) -> Result<(), Stop> {
        match output {
            Output::Fault(_) | Output::Interrupted(_) => self.note(text_of(output)),
            Output::End(_) => {
                self.note(text_of(output));
                // A table without rows has its first line, too.
                return self.destination.map_or(Ok(()), Destination::begin);
            }
            _ => {}
        }
        Ok(())
    }

    /// Says at once what a program should know, too: as a note, and in JSON as a record of kind `note` with this name.
    pub(super) fn notice(&self, name: &str, message: &str) {
        self.note(message);
        if self.form != Form::Json {
            return;
        }
        let line = NoteLine { sensor: self.sensor.as_deref(), kind: "note", note: name, message };
        let line = serde_json::to_string(&line).unwrap_or_default() + "\n";
        // If this cannot be written, neither can the next record, whose error is reported.
        let _ = self.destination.unwrap_or(&Destination::default()).write(&line);
    }

    /// Says what is assumed of a source: where its taxels are, and that the published law holds at its rate.
    pub(super) fn assumptions(&self, info: &StreamInfo, config: &Config) {
        let layout = config.layout_note(info).map(|doubt| ("default-layout", format!("{doubt} with --config")));
        for (name, doubt) in layout.into_iter().chain(config.rate_note(info).map(|doubt| ("rate", doubt))) {
            self.notice(name, &doubt);
        }
    }

    /// Writes a note about this sensor to standard error, unless notes are left out.
    pub(super) fn note(&self, message: impl fmt::Display) {
        match &self.sensor {
            _ if self.is_quiet => {}
            Some(sensor) => note(format_args!("{sensor}: {message}")),
            None => note(message),
        }
    }
}
