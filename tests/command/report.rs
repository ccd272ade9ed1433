//! Tests the page of `wstac doctor --report`.

use std::fs;

use serde_json::Value;

use wstac_tests::command::{good, run, said};
use wstac_tests::folder::Folder;

/// Returns the names of a page's elements, and the text outside of them.
fn parts(page: &str) -> (Vec<&str>, String) {
    let elements = page.split('<').skip(1).map(|part| part.split_once('>').unwrap());
    let tags = elements.clone().map(|(tag, _)| tag.split([' ', '>']).next().unwrap().trim_start_matches('/'));
    let text = elements.map(|(_, text)| text).collect::<String>().replace("&lt;", "<").replace("&gt;", ">");
    (tags.collect(), text.replace("&quot;", "\"").replace("&#39;", "'").replace("&amp;", "&"))
}

#[test]
fn a_page_has_advice_picture_numbers_system_and_configuration() {
    let folder = Folder::new("report-page");
    let text = "specimen = \"Saw3\"\nspeed = 150\n[light]\nleak = 0.2\n[sensor]\nsize = [200, 200]\n";
    let scene = folder.scene("<b>scene&.toml", text);
    let config = folder.file("wstac.toml", "# <script>alert('no')</script> & \"quotes\"\n[trigger]\nwindow = 5\n");
    let page = folder.path("report.html");
    let arguments = ["doctor", &scene, "--config", config.to_str().unwrap()];
    let plain = good(&arguments);
    assert_eq!(good(&[&arguments[..], &["--report", &page]].concat()), plain);
    let page = fs::read_to_string(&page).unwrap();
    let (tags, text) = parts(&page);
    for tag in &tags {
        let known =
            ["!doctype", "html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "ul", "li", "strong"];
        let more = ["br", "img", "pre", "table", "tr", "th", "td"];
        assert!(known.contains(&&*tag.to_lowercase()) || more.contains(tag), "{tag}");
    }
    // One picture, which is in the page. ci/pages browser shows the page to a phone, too.
    assert_eq!(page.matches(" src=").count() + page.matches(" href=").count(), 1);
    assert!(page.contains(" src=\"data:image/png;base64,"));
    assert!(page.contains("content=\"width=device-width, initial-scale=1\""));
    // The numbers, the advice and the configuration are there to the letter.
    assert!(text.contains(plain.trim_end()), "{text}");
    assert!(text.contains("# <script>alert('no')</script> & \"quotes\"\n[trigger]\nwindow = 5\n"), "{text}");
    let report: Value = serde_json::from_str(&good(&[&arguments[..], &["--json"]].concat())).unwrap();
    assert_eq!(report["healthy"], false);
    for finding in report["verdict"].as_array().unwrap() {
        assert!(
            text.contains(finding["found"].as_str().unwrap()) && text.contains(finding["advice"].as_str().unwrap())
        );
    }
    for part in ["<b>scene&.toml", "architecture", std::env::consts::ARCH, "kernel", "processor", "wstac doctor scene:"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    let json = text.lines().find(|line| line.starts_with("{\"source\"")).unwrap();
    let shown: Value = serde_json::from_str(json).unwrap();
    assert_eq!(shown["verdict"], report["verdict"]);
}

#[test]
fn a_source_without_pictures_has_a_page() {
    let folder = Folder::new("report-again");
    let text = "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"\n";
    let scene = folder.scene("scene.toml", text);
    let page = folder.path("report.html");
    good(&["doctor", &scene, "--report", &page]);
    assert!(!fs::read_to_string(&page).unwrap().contains(" src="));
    good(&["doctor", &scene, "--report", &page, "--force"]);
    let done = run(&["doctor", &scene, "--report", &page.replace(".html", ".png")]);
    assert_eq!(done.status.code(), Some(2));
    assert!(said(&done).contains("expected .html"), "{}", said(&done));
    // A source that cannot be measured has no page.
    let other = folder.0.join("other.html");
    assert_eq!(run(&["doctor", "none.y4m", "--report", other.to_str().unwrap()]).status.code(), Some(1));
    assert!(!other.exists());
}
