//! An order of a page to a sensor: a word, with labels or a number, and nothing else. Names of files come from the
//! server.

use std::sync::mpsc::Sender;

use serde::Deserialize;
use wstac_host::record::labels::{NAMES, check};
use wstac_host::source::Labels;
use wstac_host::visible;

/// Most characters of a label's value.
const LONGEST_LABEL: usize = 60;

/// A request, by its word.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(tag = "order", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Action {
    /// Gather a new baseline.
    Rezero {},
    /// Start a recording with these labels.
    Record {
        /// Empty values are left out.
        #[serde(default)]
        labels: Labels,
    },
    /// End what is in progress: a recording, a calibration or an examination.
    Stop {},
    /// Start a calibration.
    Calibrate {},
    /// Find the whiskers in what was seen so far.
    Find {},
    /// Use the calibration of this number.
    Use {
        /// The number that the page was shown it with.
        proposal: u64,
    },
    /// Start the doctor's examination.
    Examine {},
    /// Play a file or a scene, once more if it has ended, or pause it.
    Play { on: bool },
    /// Let a file or a scene start again at its end, or not.
    Loop { on: bool },
    /// Go forward by so many frames in a file or a scene, or back, and perhaps pause there.
    Seek { frames: i64, pause: bool },
}

/// An order for a sensor, and where the reason goes if it is refused.
#[derive(Debug)]
pub(crate) struct Order {
    pub(crate) action: Action,
    pub(crate) refused: Sender<Refused>,
}

impl Order {
    pub(crate) fn refuse(&self, sensor: usize, why: impl Into<String>) {
        // A client that is gone needs no reason.
        let _ = self.refused.send(Refused { sensor, why: why.into() });
    }
}

/// A refusal, for the client that asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Refused {
    pub(crate) sensor: usize,
    pub(crate) why: String,
}

/// Parses the number of a sensor and an action: `0 {"order":"calibrate"}`.
///
/// # Errors
/// It is no order; the message says what was found and expected.
pub(crate) fn parse(text: &str) -> Result<(usize, Action), Refused> {
    let (number, action) = text.split_once(' ').unwrap_or((text, ""));
    let sensor = number.parse().unwrap_or(0);
    let refused = |why: String| Refused { sensor, why };
    if number.parse::<usize>().is_err() {
        return Err(refused(format!("the order has no sensor (found {number:?}), expected its number")));
    }
    // A list of values without names would be an order for the parser, too.
    if !action.trim_start().starts_with('{') {
        return Err(refused(format!("the order is not known (found {}), expected {{\"order\": …}}", start_of(action))));
    }
    let action: Action =
        serde_json::from_str(action).map_err(|error| refused(format!("the order is not known: {error}")))?;
    if let Action::Record { labels } = action {
        let labels = labels_of(labels).map_err(refused)?;
        return Ok((sensor, Action::Record { labels }));
    }
    Ok((sensor, action))
}

/// Returns the first characters of a text, in quotes.
fn start_of(text: &str) -> String {
    format!("{:?}", text.chars().take(20).collect::<String>())
}

/// Checks labels, and leaves out empty ones.
fn labels_of(given: Labels) -> Result<Labels, String> {
    let mut labels = Labels::new();
    for (name, value) in given {
        let value = value.trim();
        if !NAMES.contains(&name.as_str()) {
            return Err(format!("label {name:?} is not known, expected {}", NAMES.join(", ")));
        }
        let count = value.chars().count();
        if count > LONGEST_LABEL {
            return Err(format!("label {name} has {count} characters, expected at most {LONGEST_LABEL}"));
        }
        if visible::line(value) != value {
            return Err(format!("label {name} is \"{}\"; leave the control characters out", visible::line(value)));
        }
        if !value.is_empty() {
            labels.insert(name, value.to_owned());
        }
    }
    check(&labels)?;
    Ok(labels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_words_with_checked_labels() {
        let labels = |text: &str| match parse(text).unwrap() {
            (3, Action::Record { labels }) => labels,
            other => panic!("{other:?}"),
        };
        let found = labels(r#"3 {"order":"record","labels":{"specimen":" Saw3 ","speed":"150","direction":""}}"#);
        assert_eq!(found, [("specimen", "Saw3"), ("speed", "150")].map(|(a, b)| (a.into(), b.into())).into());
        assert!(labels(r#"3 {"order":"record"}"#).is_empty());
        assert_eq!(parse(r#"0 {"order":"use","proposal":4}"#), Ok((0, Action::Use { proposal: 4 })));
        assert_eq!(parse(r#"1 {"order":"examine"}"#), Ok((1, Action::Examine {})));
        assert_eq!(
            parse(r#"0 {"order":"seek","frames":-1,"pause":false}"#),
            Ok((0, Action::Seek { frames: -1, pause: false }))
        );
    }

    #[test]
    fn what_is_no_order_is_refused_with_the_reason() {
        let long = "x".repeat(LONGEST_LABEL + 1);
        for (text, part) in [
            ("", "no sensor"),
            (r#"-1 {"order":"stop"}"#, "no sensor (found \"-1\")"),
            ("0", "not known"),
            (r#"0 {"order":"erase"}"#, "unknown variant `erase`"),
            (r#"0 {"order":"use"}"#, "missing field `proposal`"),
            (r#"0 {"order":"seek","frames":1e30}"#, "invalid type: floating point"),
            (r#"0 {"order":"record","file":"/etc/passwd"}"#, "unknown field `file`"),
            (r#"0 {"order":"calibrate","file":"a.toml"}"#, "unknown field `file`"),
            (r#"0 {"order":"record","labels":{"speed":"fast"}}"#, "label speed is \"fast\", expected mm/s such as 150"),
            (r#"0 {"order":"record","labels":{"direction":"400"}}"#, "expected whole degrees, 0 to 359"),
            (r#"0 {"order":"record","labels":{"path":"../a"}}"#, "label \"path\" is not known, expected specimen"),
            (
                r#"0 {"order":"record","labels":{"specimen":"a\u001bb"}}"#,
                "\"a\\u001bb\"; leave the control characters out",
            ),
            (
                r#"0 {"order":"record","labels":{"specimen":"a\u202eb"}}"#,
                "\"a\\u202eb\"; leave the control characters out",
            ),
            (r#"0 ["record"]"#, "the order is not known (found \"[\\\"record\\\"]\"), expected {\"order\""),
            (r#"0 ["use",1]"#, "the order is not known"),
            (r#"0 "stop""#, "the order is not known"),
            (r#"0 {"order":"record","labels":["specimen","a"]}"#, "the order is not known"),
            (&format!(r#"0 {{"order":"record","labels":{{"specimen":"{long}"}}}}"#), "expected at most 60"),
        ] {
            let why = parse(text).unwrap_err().why;
            assert!(why.contains(part), "{text}: {why}");
        }
    }
}
