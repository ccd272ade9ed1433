//! The labels of a recording that data sets use.

use crate::source::Labels;
use crate::visible::is_plain;

/// Names of the labels that a data set uses; the task is for LeRobot.
pub const NAMES: [&str; 5] = ["specimen", "speed", "direction", "sensor", "task"];

/// Parses a label as a person writes it: NAME=VALUE.
///
/// ```
/// use wstac_host::record::labels::parse;
///
/// assert_eq!(parse("specimen=Saw3"), Ok(("specimen".to_owned(), "Saw3".to_owned())));
/// assert!(parse("Saw3").unwrap_err().contains("expected NAME=VALUE"));
/// ```
///
/// # Errors
/// The text has no name or no value.
pub fn parse(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().into(), value.trim().into()))
        }
        _ => Err(format!("{text:?} is no label, expected NAME=VALUE such as specimen=Saw3")),
    }
}

/// Returns labels by name, each once, and checks those that a data set uses.
///
/// ```
/// use wstac_host::record::labels::by_name;
///
/// let label = |name: &str, value: &str| (name.to_owned(), value.to_owned());
/// assert_eq!(by_name([label("speed", "150"), label("specimen", "Saw3")]).unwrap()["speed"], "150");
/// assert!(by_name([label("speed", "150"), label("speed", "9")]).unwrap_err().contains("expected one value"));
/// assert!(by_name([label("speed", "fast")]).unwrap_err().contains("expected mm/s"));
/// ```
///
/// # Errors
/// A name is given twice, or a label is not valid.
pub fn by_name(given: impl IntoIterator<Item = (String, String)>) -> Result<Labels, String> {
    let mut labels = Labels::new();
    for (name, value) in given {
        if let Some(other) = labels.get(&name) {
            return Err(format!("{name} is {other:?} and {value:?}, expected one value"));
        }
        labels.insert(name, value);
    }
    check(&labels)?;
    Ok(labels)
}

/// Checks that labels are plain text, and those that a data set uses. Returns the speed in mm/s and the direction in
/// degrees, if present.
///
/// Plain text has no character that controls a terminal, is invisible, or turns the direction of writing.
///
/// ```
/// use wstac_host::record::labels::check;
///
/// let labels = [("speed", "150"), ("direction", "90")].map(|(name, value)| (name.to_owned(), value.to_owned()));
/// assert_eq!(check(&labels.into()), Ok((Some(150.0), Some(90))));
/// ```
///
/// # Errors
/// A label is not valid; the message names the label, the value found and the values expected.
pub fn check(labels: &Labels) -> Result<(Option<f64>, Option<u16>), String> {
    for (name, value) in labels {
        if let Some(found) = [name, value].into_iter().flat_map(|text| text.chars()).find(|c| !is_plain(*c)) {
            let found = u32::from(found);
            return Err(format!(
                "label {name:?} is {value:?}, expected plain text (found the character U+{found:04X})"
            ));
        }
    }
    let speed = labels.get("speed").map(|speed| {
        let number = speed.parse().ok().filter(|speed: &f64| *speed > 0.0 && speed.is_finite());
        number.ok_or_else(|| format!("label speed is {speed:?}, expected mm/s such as 150"))
    });
    let direction = labels.get("direction").map(|direction| {
        let number = direction.parse().ok().filter(|direction| (0..360).contains(direction));
        number.ok_or_else(|| format!("label direction is {direction:?}, expected whole degrees, 0 to 359"))
    });
    Ok((speed.transpose()?, direction.transpose()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_plain_text() {
        let one = |name: &str, value: &str| check(&[(name.to_owned(), value.to_owned())].into());
        for text in ["Saw3", "Größe 3 mm", "木材", "چوب\u{200c}ها", "👍🏽", "a, b=c"] {
            assert_eq!(one("specimen", text), Ok((None, None)), "{text}");
        }
        let turned = "label \"specimen\" is \"Saw\\u{202e}3\", expected plain text (found the character U+202E)";
        assert_eq!(one("specimen", "Saw\u{202e}3").unwrap_err(), turned);
        for c in "\0\n\u{1b}\u{7f}\u{85}\u{ad}\u{61c}\u{180e}\u{200b}\u{200e}\u{2028}\u{2066}\u{feff}\u{e0041}".chars()
        {
            assert!(one("specimen", &format!("a{c}b")).is_err(), "{c:?}");
            assert!(one(&format!("a{c}"), "b").is_err(), "{c:?}");
        }
    }
}
