//! Tables of records as CSV (RFC 4180, lines end as on Unix): the names and values are those of JSON.

use std::borrow::Cow;

use serde_json::Value;
use wstac_host::json::seconds;
use wstac_host::output::{FEATURE_NAMES, Output};
use wstac_host::visible;

/// The kind of record that a table has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Table {
    Events,
    /// The ten features of every frame.
    Features,
    /// Speed and direction of every frame while something slides.
    Motion,
}

/// The column of seconds from the first frame, which every table has. Not every kind of record has it in JSON.
const SECONDS: &str = "time_s";

impl Table {
    /// Returns whether a record has a row.
    pub(super) fn has(self, output: &Output) -> bool {
        match self {
            Self::Events => matches!(output, Output::Event(_)),
            Self::Features => matches!(output, Output::Features(_)),
            Self::Motion => matches!(output, Output::Motion(_)),
        }
    }

    /// Returns the columns: the paths of the fields in JSON.
    fn columns(self) -> impl Iterator<Item = &'static str> {
        let columns = match self {
            Self::Events => {
                "frame frames time_ns time_s completed_ns completed_s stamp stamp_within_ms \
                 touch_frame end_frame contact duration_frames \
                 speed/mm_s speed/sd speed/extrapolated speed_at_most/mm_s speed_at_most/extrapolated \
                 direction/deg direction/sd direction/confidence basis \
                 place_mm/value place_mm/sd width_mm/value width_mm/sd contacts acceleration/mm_s2 acceleration/sd \
                 texture/specimen texture/pattern texture/depth_mm texture/class texture/confidence texture/known \
                 period_mm/value period_mm/sd frames_filled reliable why/speed why/direction why/texture why/reliable"
            }
            Self::Features => "frame time_ns time_s stamp stamp_within_ms f/0 f/1 f/2 f/3 f/4 f/5 f/6 f/7 f/8 f/9",
            Self::Motion => {
                "frame time_ns time_s stamp stamp_within_ms contact speed/mm_s speed/sd direction/deg direction/sd basis"
            }
        };
        columns.split(' ')
    }

    /// Returns the line of the columns' names, with its end. Rows of sensors with names have a first column for them.
    pub(super) fn head(self, has_sensors: bool) -> String {
        let sensor = has_sensors.then_some(Cow::Borrowed("sensor"));
        let names: Vec<_> = sensor.into_iter().chain(self.columns().map(name)).collect();
        names.join(",") + "\n"
    }

    /// Returns the row of a record, whose line of JSON and whose time in seconds from the first frame these are.
    pub(super) fn row(self, sensor: Option<&str>, line: &Value, time_s: Option<f64>) -> String {
        let mut cells: Vec<_> = sensor.into_iter().map(|name| quoted(name).into_owned()).collect();
        cells.extend(self.columns().map(|column| match line.pointer(&format!("/{column}")) {
            None | Some(Value::Null) if column == SECONDS => {
                time_s.map(|time_s| Value::from(seconds(time_s)).to_string()).unwrap_or_default()
            }
            None | Some(Value::Null) => String::new(),
            Some(Value::String(text)) => quoted(text).into_owned(),
            Some(value) => value.to_string(),
        }));
        cells.join(",")
    }
}

/// Returns a column's name: the names along the path, joined; a feature has its own, and a length those of C and
/// Python.
fn name(column: &'static str) -> Cow<'static, str> {
    let feature = column.strip_prefix("f/").and_then(|index| FEATURE_NAMES.get(index.parse::<usize>().ok()?));
    match (feature, column.split_once("_mm/")) {
        (Some(name), _) => Cow::Borrowed(*name),
        (None, Some((length, "value"))) => Cow::Owned(format!("{length}_mm")),
        (None, Some((length, field))) => Cow::Owned(format!("{length}_{field}_mm")),
        (None, None) => Cow::Owned(column.replace('/', "_")),
    }
}

/// Returns a text as a cell of one line, in quotes if it needs them.
fn quoted(text: &str) -> Cow<'_, str> {
    let text = visible::line(text);
    if text.contains([',', '"']) || text.starts_with(' ') || text.ends_with(' ') {
        return Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_if_they_must_be() {
        for (text, cell) in [
            ("Saw3", "Saw3"),
            ("a,b", "\"a,b\""),
            ("say \"yes\"", "\"say \"\"yes\"\"\""),
            (" led", "\" led\""),
            ("über", "über"),
        ] {
            assert_eq!(quoted(text), cell);
        }
        // A cell never ends a line, and never controls a terminal.
        for text in ["two\nlines", "a\rb", "\x1b[31mred"] {
            assert!(!quoted(text).contains(char::is_control), "{text:?}");
        }
    }

    #[test]
    fn columns_keep_their_order() {
        let head = Table::Events.head(false);
        let lengths = ",basis,place_mm,place_sd_mm,width_mm,width_sd_mm,contacts,acceleration_mm_s2,";
        assert!(head.contains(lengths), "{head}");
        let features = "frame,time_ns,time_s,stamp,stamp_within_ms,r1,r2,r3,r4,r5,c1,c2,c3,c4,c5\n";
        assert_eq!(Table::Features.head(false), features);
    }
}
