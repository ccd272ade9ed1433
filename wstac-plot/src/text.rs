//! The font of all figures, and the width of text in it.

use std::sync::LazyLock;

use ttf_parser::Face;

/// The families that an SVG viewer may use. The letters of all but the last are equally wide.
pub const FAMILIES: &str = "Arimo, Liberation Sans, Helvetica, Arial, sans-serif";

/// Arimo Regular without hinting: Latin, Greek and Cyrillic letters, and signs of mathematics.
///
/// It is embedded (46 kB), so that a PNG or a PDF is the same on every machine, with or without fonts.
/// Its license is in `font/OFL.txt`.
pub const FONT: &[u8] = include_bytes!("../font/Arimo-Regular.ttf");

static FACE: LazyLock<Option<Face<'static>>> = LazyLock::new(|| Face::parse(FONT, 0).ok());

/// Returns the width of a line of text at this font size. A character that the font lacks counts as a square.
pub fn width_of(text: &str, size: f64) -> f64 {
    let Some(face) = FACE.as_ref() else { return size * text.chars().count() as f64 };
    let em = f64::from(face.units_per_em());
    let advance = |character| face.glyph_hor_advance(face.glyph_index(character)?);
    let widths = text.chars().map(|character| advance(character).map_or(1.0, |units| f64::from(units) / em));
    size * widths.sum::<f64>()
}

/// Breaks a text at spaces into lines that are at most this wide. A word that is wider than a line is cut.
pub fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(&format!("{line} {word}"), size) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(String::new()),
        }
        let Some(line) = lines.last_mut().filter(|line| line.is_empty()) else { continue };
        line.push_str(word);
        while let Some((fits, rest)) = lines.last().and_then(|line| cut(line, size, width)) {
            lines.pop();
            lines.extend([fits, rest]);
        }
    }
    lines
}

/// Cuts a line that is too wide into the part that fits and the rest.
fn cut(line: &str, size: f64, width: f64) -> Option<(String, String)> {
    if width_of(line, size) <= width {
        return None;
    }
    let ends = line.char_indices().map(|(at, _)| at).skip(1);
    let at = ends.take_while(|at| width_of(&line[..*at], size) <= width).last();
    // At least one character, however narrow the line is.
    let at = at.or_else(|| line.char_indices().nth(1).map(|(at, _)| at))?;
    Some((line[..at].to_owned(), line[at..].to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_those_of_helvetica() {
        // Advance widths of Helvetica in thousandths of the size, from its AFM file; a minus sign is as wide as a plus.
        for (text, expected) in [("0", 556), ("i", 222), ("W", 944), (" ", 278), ("\u{b0}", 400), ("\u{2212}", 584)] {
            let found = width_of(text, 1000.0);
            assert!((found - f64::from(expected)).abs() < 1.0, "{text:?}: {found}");
        }
        assert!((width_of("\u{89e6}\u{89c9}", 10.0) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn no_line_is_wider_than_asked_and_no_character_is_lost() {
        let text =
            "Event 1 of /a/path/without/a/single/space/that/is/wider/than/any/line.y4m; speed 151.8 mm/s, W\u{89e6}";
        for width in [9.0, 40.0, 120.0, 500.0] {
            let lines = wrapped(text, 7.5, width);
            assert!(lines.iter().all(|line| width_of(line, 7.5) <= width && !line.is_empty()), "{lines:?}");
            let letters = |text: &str| text.chars().filter(|letter| *letter != ' ').collect::<String>();
            assert_eq!(letters(&lines.concat()), letters(text));
        }
        assert_eq!(wrapped("W", 7.5, 1.0), ["W"]);
        assert!(wrapped(" ", 7.5, 1.0).is_empty());
    }
}
