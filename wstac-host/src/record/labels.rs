//! The labels of a recording that data sets use.

use crate::source::Labels;

/// Names of the labels that a data set uses.
pub const NAMES: [&str; 4] = ["specimen", "speed", "direction", "sensor"];

/// Checks the labels that a data set uses, and returns the speed in mm/s and the direction in degrees, if present.
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
