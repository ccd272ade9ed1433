//! Tests the page of `wstac doctor --report`.

use std::fs;

use serde_json::Value;

use wstac_tests::command::{assert_has, ends, good, program, records, said};
use wstac_tests::folder::Folder;

/// Reads a page as a browser does: prints its elements, the addresses in it and its text, and writes its picture.
const READER: &str = "\
import base64, html.parser, json, sys
class Page(html.parser.HTMLParser):
    found = {'tags': [], 'addresses': [], 'text': []}
    def handle_starttag(self, tag, attributes):
        self.found['tags'].append(tag)
        for name, value in attributes:
            assert not name.startswith('on'), name
            if name in ('src', 'href'): self.found['addresses'].append(value)
    def handle_data(self, data):
        self.found['text'].append(data)
page = Page(convert_charrefs=True)
page.feed(open(sys.argv[1], encoding='utf-8').read())
page.close()
for address in page.found['addresses']:
    kind, data = address.split(',', 1)
    assert kind == 'data:image/png;base64', kind
    open(sys.argv[2], 'wb').write(base64.b64decode(data, validate=True))
print(json.dumps(page.found))
";

fn read(folder: &Folder, page: &str) -> Value {
    let picture = folder.0.join("pictures/1.png");
    fs::create_dir_all(folder.0.join("pictures")).unwrap();
    let mut python = program("python3");
    let done = python.args(["-c", READER, page]).arg(picture).output().unwrap();
    assert!(done.status.success(), "{}", said(&done));
    serde_json::from_slice(&done.stdout).unwrap()
}

#[test]
fn a_page_has_advice_picture_numbers_system_and_configuration() {
    let folder = Folder::new("report-page");
    let text = "specimen = \"Saw3\"\nspeed = 150\n[light]\nleak = 0.2\n[sensor]\nsize = [200, 200]\n";
    let scene = format!("scene:{}", folder.file("<b>scene&.toml", text).display());
    let config = folder.file("wstac.toml", "# <script>alert('no')</script> & \"quotes\"\n[trigger]\nwindow = 5\n");
    let page = folder.0.join("report.html").to_str().unwrap().to_owned();
    let arguments = ["doctor", &scene, "--config", config.to_str().unwrap()];
    let plain = good(&arguments);
    assert_eq!(good(&[&arguments[..], &["--report", &page]].concat()), plain);
    let found = read(&folder, &page);
    let list = |name: &str| -> Vec<String> { serde_json::from_value(found[name].clone()).unwrap() };
    let tags = list("tags");
    for tag in &tags {
        let known = ["html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "ul", "li", "strong", "br"];
        let more = ["img", "pre", "table", "tr", "th", "td"];
        assert!(known.contains(&&**tag) || more.contains(&&**tag), "{tag}");
    }
    assert_eq!(list("addresses").len(), 1);
    // A phone lays it out as wide as itself; ci/pages browser shows it to one.
    assert!(fs::read_to_string(&page).unwrap().contains("content=\"width=device-width, initial-scale=1\""));
    let text = list("text").concat();
    // The numbers, the advice and the configuration are there to the letter.
    assert!(text.contains(plain.trim_end()), "{text}");
    assert!(text.contains("# <script>alert('no')</script> & \"quotes\"\n[trigger]\nwindow = 5\n"), "{text}");
    let report = records(&[&arguments[..], &["--json"]].concat()).remove(0);
    assert_eq!(report["healthy"], false);
    for finding in report["verdict"].as_array().unwrap() {
        assert_has(&text, &["found", "advice"].map(|key| finding[key].as_str().unwrap()));
    }
    let system = ["architecture", std::env::consts::ARCH, "kernel", "processor", "wstac doctor scene:"];
    assert_has(&text, &[&["<b>scene&.toml"], &system[..]].concat());
    let json = text.lines().find(|line| line.starts_with("{\"source\"")).unwrap();
    let shown: Value = serde_json::from_str(json).unwrap();
    assert_eq!(shown["verdict"], report["verdict"]);
    // The picture is a PNG file with light at the taxels.
    ends(&["run", &folder.path("pictures")], 0, &["8-bit RGB"]);
}

#[test]
fn a_page_is_not_overwritten_and_sources_without_pictures_have_one() {
    let folder = Folder::new("report-again");
    let text = "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"\n";
    let (scene, page) = (folder.scene("scene.toml", text), folder.path("report.html"));
    good(&["doctor", &scene, "--report", &page]);
    let found = read(&folder, &page);
    assert_eq!(found["addresses"].as_array().unwrap().len(), 0);
    let before = fs::read(&page).unwrap();
    ends(&["doctor", &scene, "--report", &page], 1, &["exists already"]);
    assert!(fs::read(&page).unwrap() == before);
    good(&["doctor", &scene, "--report", &page, "--force"]);
    ends(&["doctor", &scene, "--report", &page.replace(".html", ".png")], 2, &["expected .html"]);
    // A source that cannot be measured has no page.
    ends(&["doctor", "none.y4m", "--report", &folder.path("other.html")], 1, &[]);
    assert!(!folder.0.join("other.html").exists());
}
