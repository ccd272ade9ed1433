//! The files of the page, which are parts of the program.

/// Returns the media type and the text of a file of the page.
pub(crate) fn file(path: &str) -> Option<(&'static str, &'static str)> {
    Some(match path {
        "/" => ("text/html; charset=utf-8", include_str!("../page/index.html")),
        "/page.css" => ("text/css; charset=utf-8", include_str!("../page/page.css")),
        "/page.js" => ("text/javascript; charset=utf-8", include_str!("../page/page.js")),
        "/tools.js" => ("text/javascript; charset=utf-8", include_str!("../page/tools.js")),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::file;

    /// Most bytes of the whole page.
    const BUDGET: usize = 200_000;

    #[test]
    fn the_page_is_small_and_loads_nothing_from_elsewhere() {
        let files = ["/", "/page.css", "/page.js", "/tools.js"].map(|path| file(path).unwrap().1);
        let bytes: usize = files.iter().map(|text| text.len()).sum();
        assert!(bytes < BUDGET, "{bytes}");
        for text in files {
            assert!(!text.contains("https://") && !text.contains("src=\"http") && !text.contains("@import"), "{text}");
        }
        assert!(file("/other").is_none() && file("/../Cargo.toml").is_none());
    }
}
