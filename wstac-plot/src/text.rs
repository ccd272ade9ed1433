//! The fonts of all figures, and the width of text in them.

/// The families that an SVG viewer may use. The letters of all but the last are equally wide.
pub const FAMILIES: &str = "Arimo, Liberation Sans, Helvetica, Arial, sans-serif";

/// The widths of Arimo Regular in 2048ths of the font size (its table `hmtx`), from the first code point of each run:
/// Latin, Greek and Cyrillic letters, and signs. 0 is a letter that it lacks.
const WIDTHS: [(u32, &[u16]); 10] = [
    (
        0x20,
        &[
            569, 569, 727, 1139, 1139, 1821, 1366, 391, 682, 682, 797, 1196, 569, 682, 569, 569, 1139, 1139, 1139,
            1139, 1139, 1139, 1139, 1139, 1139, 1139, 569, 569, 1196, 1196, 1196, 1139, 2079, 1366, 1366, 1479, 1479,
            1366, 1251, 1593, 1479, 569, 1024, 1366, 1139, 1706, 1479, 1593, 1366, 1593, 1479, 1366, 1251, 1479, 1366,
            1933, 1366, 1366, 1251, 569, 569, 569, 961, 1139, 682, 1139, 1139, 1024, 1139, 1139, 569, 1139, 1139, 455,
            455, 1024, 455, 1706, 1139, 1139, 1139, 1139, 682, 1024, 569, 1139, 1024, 1479, 1024, 1024, 1024, 684, 532,
            684, 1196,
        ],
    ),
    (
        0xa0,
        &[
            569, 682, 1139, 1139, 1139, 1139, 532, 1139, 682, 1509, 758, 1139, 1196, 682, 1509, 1131, 819, 1124, 682,
            682, 682, 1180, 1100, 682, 682, 682, 748, 1139, 1708, 1708, 1708, 1251, 1366, 1366, 1366, 1366, 1366, 1366,
            2048, 1479, 1366, 1366, 1366, 1366, 569, 569, 569, 569, 1479, 1479, 1593, 1593, 1593, 1593, 1593, 1196,
            1593, 1479, 1479, 1479, 1479, 1366, 1366, 1251, 1139, 1139, 1139, 1139, 1139, 1139, 1821, 1024, 1139, 1139,
            1139, 1139, 569, 569, 569, 569, 1139, 1139, 1139, 1139, 1139, 1139, 1139, 1124, 1251, 1139, 1139, 1139,
            1139, 1024, 1139, 1024, 1366, 1139, 1366, 1139, 1366, 1139, 1479, 1024, 1479, 1024, 1479, 1024, 1479, 1024,
            1479, 1259, 1479, 1139, 1366, 1139, 1366, 1139, 1366, 1139, 1366, 1139, 1366, 1139, 1593, 1139, 1593, 1139,
            1593, 1139, 1593, 1139, 1479, 1139, 1479, 1139, 569, 569, 569, 569, 569, 569, 569, 455, 569, 569, 1505,
            909, 1024, 455, 1366, 1024, 1024, 1139, 455, 1139, 455, 1139, 597, 1139, 684, 1139, 455, 1479, 1139, 1479,
            1139, 1479, 1139, 1237, 1481, 1139, 1593, 1139, 1593, 1139, 1593, 1139, 2048, 1933, 1479, 682, 1479, 682,
            1479, 682, 1366, 1024, 1366, 1024, 1366, 1024, 1366, 1024, 1251, 569, 1251, 768, 1251, 569, 1479, 1139,
            1479, 1139, 1479, 1139, 1479, 1139, 1479, 1139, 1479, 1139, 1933, 1479, 1366, 1024, 1366, 1251, 1024, 1251,
            1024, 1251, 1024, 455,
        ],
    ),
    (
        0x370,
        &[
            1201, 879, 1251, 938, 682, 682, 1472, 1144, 0, 0, 682, 1024, 1024, 1024, 569, 1024, 0, 0, 0, 0, 682, 682,
            1367, 569, 1606, 1716, 786, 0, 1586, 0, 1752, 1541, 455, 1366, 1366, 1128, 1368, 1366, 1251, 1479, 1593,
            569, 1366, 1368, 1706, 1479, 1331, 1593, 1479, 1366, 0, 1266, 1251, 1366, 1634, 1366, 1711, 1531, 569,
            1366, 1184, 913, 1139, 455, 1120, 1184, 1178, 1024, 1140, 913, 903, 1139, 1139, 455, 1024, 1024, 1180,
            1024, 917, 1139, 1413, 1165, 987, 1264, 809, 1120, 1328, 1075, 1460, 1599, 455, 1120, 1139, 1120, 1599,
            1366, 1178, 1120, 1582, 1962, 1582, 1147, 1599, 1231, 1593, 1139, 1479, 1024, 1251, 827, 1279, 1084, 1549,
            1181, 1824, 1706, 1381, 1139, 1380, 1024, 1366, 1366, 1248, 1221, 1509, 1134, 950, 839, 1231, 1173, 1024,
            455, 1593, 905, 905, 1366, 1139, 1479, 1706, 1408, 1165, 1479, 1479, 1479, 1366, 1367, 1771, 1109, 1472,
            1366, 569, 569, 1024, 2165, 2069, 1749, 1193, 1472, 1301, 1472, 1366, 1344, 1366, 1109, 1387, 1366, 1891,
            1237, 1472, 1472, 1193, 1344, 1706, 1479, 1593, 1472, 1366, 1479, 1251, 1301, 1557, 1366, 1515, 1365, 1877,
            1920, 1621, 1813, 1344, 1472, 2069, 1479, 1139, 1173, 1088, 747, 1195, 1139, 1370, 939, 1144, 1144, 896,
            1195, 1408, 1131, 1139, 1109, 1139, 1024, 938, 1024, 1685, 1024, 1173, 1067, 1643, 1685, 1280, 1472, 1067,
            1045, 1536, 1109, 1139, 1139, 1139, 747, 1045, 1024, 455, 569, 455, 1856, 1664, 1139, 896, 1144, 1024,
            1131,
        ],
    ),
    (
        0x2010,
        &[
            682, 682, 1139, 1139, 2048, 2048, 0, 0, 455, 455, 455, 455, 682, 682, 682, 0, 1139, 1139, 717, 0, 0, 0,
            2048, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2048, 0, 384, 725, 0, 0, 0, 0, 0, 682, 682,
        ],
    ),
    (
        0x2070,
        &[
            682, 331, 0, 0, 682, 682, 682, 682, 682, 682, 0, 0, 0, 0, 0, 0, 682, 682, 682, 682, 682, 682, 682, 682,
            682, 682,
        ],
    ),
    (0x20ac, &[1139]),
    (0x2190, &[2048, 1024, 2048, 1024]),
    (
        0x2202,
        &[1012, 0, 0, 0, 1253, 0, 0, 0, 0, 0, 0, 0, 0, 1686, 0, 1460, 1196, 0, 0, 0, 0, 0, 0, 0, 1124, 0, 0, 0, 1460],
    ),
    (0x2248, &[1124]),
    (0x2260, &[1124, 0, 0, 0, 1124, 1124]),
];

/// Returns the width of a line of text at this font size. A character that the font lacks counts as a square.
pub fn width_of(text: &str, size: f64) -> f64 {
    let of = |letter: char| {
        let runs = WIDTHS.iter().filter_map(|(first, run)| run.get(u32::from(letter).checked_sub(*first)? as usize));
        runs.copied().find(|width| *width > 0).map_or(1.0, |width| f64::from(width) / 2048.0)
    };
    size * text.chars().map(of).sum::<f64>()
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
