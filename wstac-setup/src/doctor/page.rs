//! A report as one page of HTML, which a person attaches to a bug report.
//!
//! The page has no script and asks no server for anything. Every text in it is escaped, because a camera chooses its
//! own name.

use std::fmt::Write;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use wstac_core::layout::Layout;
use wstac_host::picture::Sampler;
use wstac_host::source::StreamInfo;
use wstac_host::visible;

use super::Report;
use crate::canvas::Canvas;

/// Everything that a page shows.
#[derive(Clone, Copy, Debug)]
pub struct Page<'a> {
    /// The results of the diagnosis.
    pub report: &'a Report,
    /// A picture of the sensor; `None` if the source has none.
    pub picture: Option<&'a Picture>,
    /// Facts about the machine and the program: names and values.
    pub system: &'a [(&'static str, String)],
    /// The configuration, as TOML; empty for the default.
    pub configuration: &'a str,
    /// The report as JSON.
    pub json: &'a str,
}

/// A picture of the sensor with its taxels.
#[derive(Clone, Debug)]
pub struct Picture {
    png: Vec<u8>,
    /// Light that is shown as white, as a fraction of full scale.
    white: f32,
}

/// Pixels of the picture along each pixel of the sampled one.
const ENLARGED: usize = 3;
/// Least light that is shown as white, as a fraction of full scale: the noise of a dark sensor stays dark.
const LEAST_WHITE: f32 = 0.02;
const TAXEL: [u8; 3] = [255, 90, 110];

impl Picture {
    /// Draws a frame in green light with the outlines of the taxels.
    pub fn new(info: &StreamInfo, layout: &Layout, bytes: &[u8]) -> Self {
        let sampled = Sampler::new(info).picture(bytes);
        let [width, height] = sampled.size;
        let white = sampled.light.iter().copied().fold(LEAST_WHITE, f32::max);
        let mut canvas = Canvas::new(ENLARGED * width, ENLARGED * height);
        for (place, light) in sampled.light.iter().enumerate() {
            let shade = (255.0 * (light / white).clamp(0.0, 1.0)) as u8;
            let at = [place % width * ENLARGED, place / width * ENLARGED];
            canvas.fill(at, [ENLARGED; 2], [shade / 3, shade, shade / 3]);
        }
        let scale = [width, height].map(|pixels| (ENLARGED * pixels) as f64);
        let scale = [scale[0] / f64::from(info.size.width()), scale[1] / f64::from(info.size.height())];
        let scaled = |place: [u16; 2]| [f64::from(place[0]) * scale[0], f64::from(place[1]) * scale[1]];
        for corner in layout.corners() {
            canvas.outline(scaled(*corner), scaled(layout.taxel()), TAXEL, false);
        }
        Self { png: canvas.to_png(), white }
    }
}

const STYLE: &str = "\
body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222;background:#fff}\
p,li,td{overflow-wrap:anywhere}pre{background:#f4f4f4;padding:1em;overflow-x:auto}\
img{box-sizing:border-box;max-width:100%;border:1px solid #888}\
th{text-align:left;padding-right:1em;vertical-align:top;font-weight:normal;color:#555}";

impl Page<'_> {
    /// Returns the page.
    pub fn to_html(&self) -> String {
        let mut page = String::new();
        // Writing to a string does not fail.
        let _ = self.write(&mut page);
        page
    }

    fn write(&self, page: &mut String) -> std::fmt::Result {
        let Self { report, picture, system, configuration, json } = *self;
        write_head(page, &format!("WSTac: {}", report.source), "Examination of a WSTac sensor")?;
        writeln!(page, "<p>{}</p>\n<h2>Advice</h2>", escaped(&report.source))?;
        if report.healthy {
            writeln!(page, "<p>Nothing to change.</p>")?;
        }
        if !report.verdict.is_empty() {
            writeln!(page, "<ul>")?;
            for finding in &report.verdict {
                let (found, advice) = (escaped(&finding.found), escaped(&finding.advice));
                writeln!(page, "<li><strong>{found}</strong><br>{advice}</li>")?;
            }
            writeln!(page, "</ul>")?;
        }
        if let Some(picture) = picture {
            writeln!(page, "<h2>Picture</h2>")?;
            let data = BASE64_STANDARD.encode(&picture.png);
            writeln!(page, "<img alt=\"The sensor with its 25 taxels\" src=\"data:image/png;base64,{data}\">")?;
            let white = 100.0 * picture.white;
            writeln!(page, "<p>The last frame in green light. White is {white:.1} % of full scale.</p>")?;
        }
        writeln!(page, "<h2>Numbers</h2>\n<pre>{}</pre>", escaped(&report.to_string()))?;
        writeln!(page, "<h2>System</h2>\n<table>")?;
        for (name, value) in system {
            writeln!(page, "<tr><th>{}</th><td>{}</td></tr>", escaped(name), escaped(value))?;
        }
        writeln!(page, "</table>\n<h2>Configuration</h2>")?;
        if configuration.trim().is_empty() {
            writeln!(page, "<p>The default.</p>")?;
        } else {
            writeln!(page, "<pre>{}</pre>", escaped(configuration))?;
        }
        writeln!(page, "<h2>All results as JSON</h2>\n<pre>{}</pre>\n</body></html>", escaped(json))
    }
}

/// Writes a page up to its heading.
pub(crate) fn write_head(page: &mut String, title: &str, heading: &str) -> std::fmt::Result {
    writeln!(page, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">")?;
    // A phone lays it out as wide as itself.
    writeln!(page, "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">")?;
    // Whatever a text contains, a browser loads and runs nothing.
    let policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'";
    writeln!(page, "<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">")?;
    writeln!(page, "<title>{}</title>", escaped(title))?;
    writeln!(page, "<style>{STYLE}</style></head><body>\n<h1>{}</h1>", escaped(heading))
}

/// Returns a text that shows as it is in HTML, in elements and in attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in visible::lines(text).chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_cannot_leave_its_element() {
        assert_eq!(escaped("<script>\"'&"), "&lt;script&gt;&quot;&#39;&amp;");
        assert!(!escaped("a\x1b[31m\0b").contains(['\x1b', '\0']));
        assert_eq!(escaped("two\nlines µ"), "two\nlines µ");
    }
}
