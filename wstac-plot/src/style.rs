//! Sizes, line widths and colors that all figures share, in points on paper.

/// The size of words: journals ask for at least 7 points.
pub const SIZE: f64 = 7.5;
/// The size of a panel's title.
pub const TITLE: f64 = 9.0;
/// The distance from one line of text to the next.
pub const LINE: f64 = 10.0;

/// The width of frames, ticks and guides.
pub const THIN: f64 = 0.6;
/// The width of lines that show data.
pub const THICK: f64 = 1.1;
/// Half of a marker's width.
pub const RADIUS: f64 = 2.6;

/// The color of axes and words: dark enough on white paper.
pub const INK: &str = "#222222";
/// The color of thresholds and guides.
pub const GRAY: &str = "#6b6b6b";
/// The color of areas behind data.
pub const PALE: &str = "#e9e9e9";

/// A color of a category. These three differ in brightness, and also for readers who are color-blind.
pub const BLUE: &str = "#0072b2";
/// A color of a category.
pub const RED: &str = "#d55e00";
/// A color of a category.
pub const GREEN: &str = "#2a9d72";

/// Five colors in the order of rows or columns.
///
/// They are from plasma by S. van der Walt and N. Smith (CC0): brightness rises in even steps, also in gray print and
/// for readers who are color-blind. The bright end is left out, because it is lost on white.
pub const ORDERED: [&str; 5] = ["#0d0887", "#6a00a8", "#b12a90", "#e16462", "#f2a043"];

/// Returns the color of a fraction, from pale to blue, and a color of words that can be read on it.
pub fn shade(fraction: f64) -> (String, &'static str) {
    let [red, green, blue] = [(247.0, 0.0), (247.0, 114.0), (247.0, 178.0)]
        .map(|(pale, full): (f64, f64)| (pale + (full - pale) * fraction.clamp(0.0, 1.0)).round() as u8);
    (format!("#{red:02x}{green:02x}{blue:02x}"), if fraction > 0.7 { "#ffffff" } else { INK })
}
