//! A figure as a file: SVG text, or a renderer's output from it.

use std::path::Path;

use wstac_host::error::{Error, ErrorKind};

#[cfg(feature = "png")]
use resvg::usvg;
#[cfg(all(feature = "pdf", not(feature = "png")))]
use svg2pdf::usvg;

/// Dots per inch of a PNG: the resolution that journals require.
#[cfg(feature = "png")]
const DOTS_PER_INCH: f32 = 300.0;
/// Pixels of SVG per inch.
#[cfg(any(feature = "png", feature = "pdf"))]
const PIXELS_PER_INCH: f32 = 96.0;

/// A file format of figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// SVG text. A viewer draws its words with a font of its own.
    Svg,
    /// A picture of 300 dots per inch.
    #[cfg(feature = "png")]
    Png,
    /// A page of the figure's size. Its words can be selected, and its font is embedded.
    #[cfg(feature = "pdf")]
    Pdf,
}

impl Format {
    /// All formats that this build writes, with the endings of their file names.
    pub const ALL: &[(Self, &str)] = &[
        (Self::Svg, "svg"),
        #[cfg(feature = "png")]
        (Self::Png, "png"),
        #[cfg(feature = "pdf")]
        (Self::Pdf, "pdf"),
    ];

    /// Returns the format for the ending of a file's name, or `None` if no figure has that ending.
    pub fn by_ending(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        Self::ALL.iter().find(|(_, name)| ending.eq_ignore_ascii_case(name)).map(|(format, _)| *format)
    }

    /// Returns the format for a file's name: SVG if the name has no ending.
    ///
    /// # Errors
    /// The name's ending is not that of a figure that this build writes.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let Some(ending) = path.extension() else { return Ok(Self::Svg) };
        Self::by_ending(path).ok_or_else(|| {
            let names: Vec<String> = Self::ALL.iter().map(|(_, name)| format!(".{name}")).collect();
            let (found, expected) = (ending.display(), names.join(", "));
            let message = format_args!("no format of figures (found .{found}, expected one of {expected})");
            Error::new(ErrorKind::Usage, path.display(), message)
        })
    }

    /// Returns the bytes of a file with this figure; `svg` is what this crate drew.
    ///
    /// # Errors
    /// The figure is too large for a picture in memory.
    pub fn encode(self, svg: &str) -> Result<Vec<u8>, Error> {
        match self {
            Self::Svg => Ok(svg.as_bytes().to_vec()),
            #[cfg(feature = "png")]
            Self::Png => png(&tree(svg)?),
            #[cfg(feature = "pdf")]
            Self::Pdf => pdf(&tree(svg)?),
        }
    }
}

/// Returns the figure with every letter placed.
///
/// Only the embedded font is used, so that all machines draw the same.
#[cfg(any(feature = "png", feature = "pdf"))]
fn tree(svg: &str) -> Result<usvg::Tree, Error> {
    let mut options = usvg::Options { dpi: PIXELS_PER_INCH, ..usvg::Options::default() };
    options.fontdb_mut().load_font_data(crate::text::FONT.to_vec());
    usvg::Tree::from_str(svg, &options).map_err(refused)
}

#[cfg(any(feature = "png", feature = "pdf"))]
fn refused(error: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Unsupported, "figure", format_args!("cannot be drawn: {error}"))
}

#[cfg(feature = "png")]
fn png(tree: &usvg::Tree) -> Result<Vec<u8>, Error> {
    let (size, scale) = (tree.size(), DOTS_PER_INCH / PIXELS_PER_INCH);
    let [width, height] = [size.width(), size.height()].map(|side| (side * scale).ceil() as u32);
    let picture = resvg::tiny_skia::Pixmap::new(width, height);
    let mut picture = picture.ok_or_else(|| refused(format_args!("{width}x{height} pixels are too many")))?;
    resvg::render(tree, resvg::tiny_skia::Transform::from_scale(scale, scale), &mut picture.as_mut());
    picture.encode_png().map_err(refused)
}

#[cfg(feature = "pdf")]
fn pdf(tree: &usvg::Tree) -> Result<Vec<u8>, Error> {
    let page = svg2pdf::PageOptions { dpi: PIXELS_PER_INCH };
    svg2pdf::to_pdf(tree, svg2pdf::ConversionOptions::default(), page).map_err(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_decides() {
        assert_eq!(Format::of("a/b".as_ref()).unwrap(), Format::Svg);
        assert_eq!(Format::of("a.b.SVG".as_ref()).unwrap(), Format::Svg);
        let error = Format::of("a.svgz".as_ref()).unwrap_err().to_string();
        assert!(error.starts_with("a.svgz: no format of figures (found .svgz, expected one of .svg"), "{error}");
        assert_eq!(Format::by_ending("folder".as_ref()), None);
    }

    /// Returns a page of words in three alphabets, and a line.
    #[cfg(any(feature = "png", feature = "pdf"))]
    fn page() -> String {
        use crate::svg::{Anchor, Drawing};
        let mut drawing = Drawing::new(crate::page::WIDTH, "A < B");
        drawing.line(&[[10.0, 10.0], [400.0, 60.0]], crate::style::RED, 2.0);
        drawing.text([10.0, 40.0], crate::style::SIZE, Anchor::Start, "Speed ≤ 20 mm/s −5° µ Ωд \u{1b}");
        drawing.finish(72.0)
    }

    #[cfg(feature = "png")]
    #[test]
    fn a_png_has_300_dots_per_inch_and_words() {
        let bytes = Format::Png.encode(&page()).unwrap();
        assert_eq!(bytes, Format::Png.encode(&page()).unwrap(), "the same bytes");
        let picture = resvg::tiny_skia::Pixmap::decode_png(&bytes).unwrap();
        assert_eq!((picture.width(), picture.height()), (2008, 300));
        // The places of the words, without anything else.
        let dark = |[left, top, right, bottom]: [u32; 4]| {
            let all = (left..right).flat_map(|x| (top..bottom).map(move |y| (x, y)));
            all.filter(|(x, y)| picture.pixel(*x, *y).is_some_and(|pixel| pixel.green() < 100)).count()
        };
        assert!(dark([41, 130, 500, 175]) > 500, "{}", dark([41, 130, 500, 175]));
        assert_eq!(dark([41, 200, 500, 300]), 0);
    }

    #[cfg(feature = "pdf")]
    #[test]
    fn a_pdf_has_the_page_s_size_and_the_font() {
        let bytes = Format::Pdf.encode(&page()).unwrap();
        assert_eq!(bytes, Format::Pdf.encode(&page()).unwrap(), "the same bytes");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-1.") && text.contains("Arimo"), "{text}");
        let at = text.find("/MediaBox [").unwrap() + "/MediaBox [".len();
        let sides: Vec<f64> =
            text[at..].split(']').next().unwrap().split(' ').map(|side| side.parse().unwrap()).collect();
        assert!((sides[2] - 481.9).abs() < 0.1 && (sides[3] - 72.0).abs() < 0.1, "{sides:?}");
    }
}
