//! Tests of the figure's words and numbers, and of its well-formedness, also for events without answers.

use super::*;
use wstac_core::paper::direction::Direction;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::json::{JsonLine, rounded, with_deviation};
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::Processor;
use wstac_host::source::open::{OpenOptions, open};

/// Returns the first event of a source, and its figure.
fn figure(source: &str, config: &str) -> (Found, String) {
    figure_of(source, config, 1)
}

/// Returns an event of a source, and its figure.
fn figure_of(source: &str, config: &str, number: u64) -> (Found, String) {
    let found = found_in(source, config, number).unwrap();
    let text = drawn(&found);
    (found, text)
}

fn found_in(source: &str, config: &str, number: u64) -> Result<Found, Error> {
    let options = OpenOptions { size: Some((320, 180)), ..OpenOptions::default() };
    let mut source = open(source, &options, &[&wstac_scene::source::Scenes]).unwrap();
    let (info, config) = (source.info().clone(), Config::parse(config).unwrap());
    let outputs = OutputOptions { samples: true, ..OutputOptions::default() };
    let mut reading = Processor::new(&info, &config, outputs).unwrap();
    find(source.as_mut(), &info, &mut reading, &config, number)
}

/// Draws an event, and checks the figure.
fn drawn(found: &Found) -> String {
    let text = draw(found);
    well_formed(&text);
    legible(&text);
    text
}

/// Returns the words of a figure.
fn all_words(text: &str) -> String {
    words(text).into_iter().map(|(_, words)| words).collect::<Vec<_>>().join(" ")
}

/// Checks tags, nesting, quotes and entities of an SVG, and that all places are numbers on the page.
fn well_formed(text: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        let words = &rest[..start];
        for (at, _) in words.match_indices('&') {
            assert!(["&amp;", "&lt;", "&gt;"].iter().any(|entity| words[at..].starts_with(entity)), "{words}");
        }
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        assert_eq!(tag.matches('\'').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap());
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "{open:?} {rest}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}

/// Returns the places of all texts: left, right, base, about.
fn words(text: &str) -> Vec<([f64; 4], String)> {
    let attribute = |tag: &str, name: &str| {
        let at = tag.find(&format!(" {name}='"))? + name.len() + 3;
        Some(tag[at..].split('\'').next()?.to_owned())
    };
    let lines = text.lines().filter(|line| line.starts_with("<text ") && !line.contains("rotate"));
    lines
        .map(|line| {
            let number = |name| attribute(line, name).unwrap().parse::<f64>().unwrap();
            let (x, y, size) = (number("x"), number("y"), number("font-size"));
            let inner = line.split_once('>').unwrap().1.trim_end_matches("</text>");
            let inner = inner.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
            let width = text::width_of(&inner, size);
            let left = match attribute(line, "text-anchor").unwrap().as_str() {
                "start" => x,
                "middle" => x - width / 2.0,
                _ => x - width,
            };
            ([left, y - 0.7 * size, left + width, y], inner)
        })
        .collect()
}

/// Checks that no text lies on another, none leaves the page, and none is too small.
fn legible(text: &str) {
    let words = words(text);
    let page = text.split("viewBox='0 0 ").nth(1).and_then(|rest| rest.split('\'').next()).unwrap();
    let [width, height] = page.split(' ').map(|side| side.parse::<f64>().unwrap()).collect::<Vec<_>>()[..] else {
        panic!("{page}")
    };
    for (at, (a, one)) in words.iter().enumerate() {
        assert!(a[0] >= 0.0 && a[2] <= width && a[1] >= 0.0 && a[3] <= height, "{one:?} at {a:?}");
        for (b, other) in &words[at + 1..] {
            let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
            assert!(apart, "{one:?} at {a:?} lies on {other:?} at {b:?}");
        }
    }
    // A line of several words has a width of its own: other fonts than ours must not let it end outside of the sheet.
    for line in text.lines().filter(|line| line.starts_with("<text")) {
        let (tag, words) = line.split_once('>').unwrap();
        assert_eq!(tag.contains(" textLength='"), words.trim_end_matches("</text>").contains(' '), "{line}");
    }
    for size in text.split("font-size='").skip(1).map(|rest| rest.split('\'').next().unwrap()) {
        assert!(size.parse::<f64>().unwrap() >= 7.0, "{size}");
    }
}

#[test]
fn the_numbers_are_those_of_the_event() {
    let (found, text) = figure("scene:Saw3@150,90deg", "");
    let caption = all_words(&text);
    let event = serde_json::to_value(JsonLine::new(&Output::Event(Box::new(found.record.clone())))).unwrap();
    let [speed, sd] = ["mm_s", "sd"].map(|key| event["speed"][key].as_f64().unwrap());
    for expected in [
        " r1 ".into(),
        " c5 ".into(),
        format!(": slide, speed {} mm/s, direction ", with_deviation(speed, sd as f32)),
        format!("first frame {} (", event["frame"]),
        format!("lit {} frames", event["duration_frames"].as_u64().unwrap() + 1),
        "a  Rows".into(),
        "b  Columns".into(),
        "c  Light at each taxel".into(),
        "d  Arrival along the motion".into(),
    ] {
        assert!(caption.contains(&expected), "{expected}: {caption}");
    }
    assert_eq!(text, figure("scene:Saw3@150,90deg", "").1, "the same bytes");
    // 70 points for each of ten lines, as in the event's sample.
    let lines = text.lines().filter(|line| line.starts_with("<polyline") && line.matches(',').count() == 70).count();
    assert_eq!(lines, 10);
    assert_eq!(event["sample"][3][40].as_f64(), Some(found.features[3][40]));
}

#[test]
fn the_light_moves_over_the_map_as_the_slide_does() {
    for (degrees, near, far) in [(0, 10, 14), (90, 22, 2), (180, 14, 10), (270, 2, 22)] {
        let (found, _) = figure(&format!("scene:Saw3@150,{degrees}deg"), "");
        let arrivals = arrival::arrivals(&found);
        assert!(arrivals[near].unwrap() + 1.0 < arrivals[far].unwrap(), "{degrees}: {arrivals:?}");
        let found = f64::from(found.record.direction.degrees.unwrap());
        let off = (found - f64::from(degrees) + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 2.0, "{degrees}: {found}");
    }
}

#[test]
fn a_cut_off_event_shows_its_bound() {
    let (found, text) = figure("scene:Saw3@50", "[speed]\nlaw = \"published\"");
    let bound = rounded(found.record.speed_at_most.unwrap().mm_s);
    assert!(text.contains(&format!("speed at most {bound:.0} mm/s")) && text.contains("at least"), "{text}");
}

#[test]
fn no_answers_are_no_trouble() {
    // No light is as bright as this, so no frame is lit.
    let (found, text) = figure("scene:Saw3@150", "[speed]\nlaw = \"published\"\nthreshold = 5.0");
    assert!(found.lit.is_none() && text.contains(">no speed<"), "{text}");
    // Panel and caption give the same reason.
    assert!(caption::caption(&found).ends_with("d: empty, because the event has no speed."));
    let (mut found, _) = figure("scene:Saw3@150", "[speed]\nthreshold_on = \"above_baseline\"\nlaw = \"published\"");
    found.record.direction.degrees = Err(Reason::NoOrder);
    found.taxels.iter_mut().flatten().for_each(|taxels| taxels[7] = 1.0);
    let text = drawn(&found);
    assert!(text.contains(">unclear<") && text.contains("One taxel reached full scale"), "{text}");
    assert!(text.contains(">no direction<"), "{text}");
    assert!(caption::caption(&found).ends_with("d: empty, because the event has no direction."));
    // All lines at once, and never lit.
    found.features = [[-4.0; 70]; 10];
    found.baseline = [-4.0; 10];
    found.taxels.fill(None);
    drawn(&found);
}

#[test]
fn centroids_of_light_before_the_motion_have_no_line() {
    let folder = std::env::temp_dir().join(format!("wstac-plot-held-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("held.toml");
    let held = "[[touch]]\nkind = \"slide\"\nspecimen = \"Saw3\"\nspeed = 150\nhold = 2\n";
    std::fs::write(&file, held).unwrap();
    // A wave gives a touch with a slip no velocity.
    let coherence = "[speed]\nestimator = \"coherence\"\n";
    let (found, text) = figure_of(&format!("scene:{}", file.display()), coherence, 2);
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(found.record.speed.is_ok());
    let caption = all_words(&text);
    assert!(caption.contains("d: empty, because the centroids") && !text.contains("<circle"), "{caption}");
    assert!(text.contains(">light is not of the motion<"), "{text}");
    // All frames of the touch are in the sample.
    let lit = format!("lit {} frames", found.record.lit_frames.unwrap() + 1);
    for form in [format!(" {lit}, 0."), format!(", {lit}, not reliable")] {
        assert!(caption.contains(&form), "{caption}");
    }
    // Slides that begin with their motion have both, if they end in the sample.
    for speed in [60, 150, 300, 600] {
        let (found, text) = figure(&format!("scene:Saw3@{speed},30deg"), "");
        assert!(found.record.speed.is_ok() && text.contains("<circle") && text.contains(" mm/s</text>"), "{speed}");
    }
}

#[test]
fn a_touch_that_is_no_slide_names_its_kind() {
    let (mut found, _) = figure("scene:Saw3@150", "");
    (found.record.contact, found.record.basis) = (Some(Contact::Press), None);
    found.record.speed = Err(Reason::NoSlide(Contact::Press));
    found.record.direction = Direction::by_arrival(Err(Reason::NoSlide(Contact::Press)));
    let text = drawn(&found);
    let caption = all_words(&text);
    assert!(text.contains(">press<") && caption.contains(" s): press,"), "{caption}");
}

#[test]
fn a_law_of_durations_says_when_a_taxel_is_lit() {
    let (_, text) = figure("scene:Saw3@150,90deg", "[speed]\nlaw = \"published\"");
    let caption = all_words(&text);
    for expected in ["d  Arrival along the motion", "Lit: above 0.", "direction 90° (confidence 0.9"] {
        assert!(caption.contains(expected), "{expected}: {caption}");
    }
}

#[test]
fn very_slow_and_very_fast_stay_on_the_page() {
    for law in ["arrival", "published"] {
        let (mut found, _) = figure("scene:Saw3@150", &format!("[speed]\nlaw = \"{law}\""));
        for mm_s in [0.001, 3.0, 990.0, 1e6] {
            found.record.speed.as_mut().unwrap().mm_s = mm_s;
            drawn(&found);
        }
    }
}

#[test]
fn a_source_without_the_event_says_how_many_it_has() {
    let failed = |number| found_in("scene:Saw3@150", "", number).unwrap_err().to_string();
    assert!(failed(2).ends_with("has 1 event, expected number 2"), "{}", failed(2));
}

#[test]
fn a_long_name_of_a_source_stays_on_the_page() {
    let (mut found, _) = figure("scene:Saw3@150", "");
    found.about = format!("/{}/WWWWWWWWWWWWWWWWWWWW\u{1b} & a <clip>.y4m", "a-folder/".repeat(40));
    drawn(&found);
}
