//! When the rows of a picture are exposed: a rolling shutter reads them one after the other.

/// Where the rows that a sensor reads follow each other in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RowOrder {
    /// From top to bottom: the picture is as the sensor reads it.
    #[default]
    Down,
    /// From bottom to top.
    Up,
    /// From left to right.
    Right,
    /// From right to left.
    Left,
}
