//! Tests of `--units`: the parts of a set, put together in order, equal the whole set.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use wstac_tests::command::{ends, run, says};
use wstac_tests::folder::{Folder, text};

fn number(bytes: &[u8], at: usize, length: usize) -> usize {
    bytes[at..at + length].iter().rev().fold(0, |sum, &byte| (sum << 8) | usize::from(byte))
}

/// Returns the name, header and data of every array, by the directory of the archive.
fn arrays(npz: &[u8]) -> Vec<(String, String, Vec<u8>)> {
    let end = npz.len() - 22;
    assert_eq!(npz[end..end + 4], *b"PK\x05\x06");
    let (count, mut at) = (number(npz, end + 10, 2), number(npz, end + 16, 4));
    let mut arrays = Vec::new();
    for _ in 0..count {
        assert_eq!(npz[at..at + 4], *b"PK\x01\x02");
        assert_eq!(npz[at + 10..at + 16], [0, 0, 0, 0, 0x21, 0], "stored, 1 January 1980");
        let (bytes, length, local) = (number(npz, at + 24, 4), number(npz, at + 28, 2), number(npz, at + 42, 4));
        let name = String::from_utf8(npz[at + 46..at + 46 + length].to_vec()).unwrap();
        assert_eq!(npz[local..local + 4], *b"PK\x03\x04");
        assert_eq!(npz[local + 4..local + 30], npz[at + 6..at + 32]);
        let npy = &npz[local + 30 + length..][..bytes];
        assert_eq!(npy[..8], *b"\x93NUMPY\x01\0");
        let start = 10 + number(npy, 8, 2);
        assert_eq!(start % 64, 0);
        let header = String::from_utf8(npy[10..start].to_vec()).unwrap();
        arrays.push((name, header.trim_end().to_owned(), npy[start..].to_vec()));
        at += 46 + length;
    }
    assert_eq!(at, end);
    arrays
}

/// An array of NumPy.
#[derive(Clone, Debug, PartialEq)]
struct Array {
    dtype: String,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl Array {
    fn of(header: &str, data: Vec<u8>) -> Self {
        let between = |from: &str, to: &str| header.split_once(from).unwrap().1.split_once(to).unwrap().0.to_owned();
        let shape = between("'shape': (", ")");
        let shape = shape.split(',').filter_map(|length| length.trim().parse().ok()).collect();
        Self { dtype: between("'descr': '", "'"), shape, data }
    }

    /// Returns the bytes of an element of the first dimension.
    fn width(&self) -> usize {
        let one: usize = self.dtype[2..].parse().unwrap();
        let points = if self.dtype.contains('U') { 4 } else { 1 };
        one * points * self.shape[1..].iter().product::<usize>()
    }
}

/// Returns the arrays of a data set by their names.
fn read(path: &Path) -> BTreeMap<String, Array> {
    let arrays = arrays(&fs::read(path).unwrap()).into_iter();
    arrays.map(|(name, header, data)| (name, Array::of(&header, data))).collect()
}

/// Returns what a command that must succeed says.
fn good(arguments: &[&str]) -> String {
    says(&run(arguments), 0, &[])
}

/// Returns what `numpy.concatenate` makes of the same array of several parts; arrays without a dimension are the same
/// in all parts.
fn concatenated(parts: &[Array]) -> Array {
    let (first, kind) = (&parts[0], parts[0].dtype.as_bytes()[1]);
    assert!(parts.iter().all(|part| part.dtype.as_bytes()[1] == kind && part.shape.get(1..) == first.shape.get(1..)));
    if first.shape.is_empty() {
        assert!(parts.iter().all(|part| part == first), "{parts:?}");
        return first.clone();
    }
    // Only strings have other widths: they are padded to the widest.
    let widest = parts.iter().max_by_key(|part| part.width()).unwrap();
    let padded = |part: &Array| -> Vec<u8> {
        let elements = part.data.chunks(part.width());
        elements.flat_map(|element| [element, &vec![0; widest.width() - element.len()]].concat()).collect()
    };
    let mut shape = first.shape.clone();
    shape[0] = parts.iter().map(|part| part.shape[0]).sum();
    Array { dtype: widest.dtype.clone(), shape, data: parts.iter().flat_map(padded).collect() }
}

/// Makes parts of a data set that end at these units, and checks that together they are the whole set.
fn parts_are_whole(folder: &Folder, command: &[&str], kind: &str, behind: &[u32]) {
    let path = folder.0.join("whole.npz");
    good(&[command, &["-o", text(&path), "--force"]].concat());
    let whole = read(&path);
    let mut parts = Vec::new();
    let (mut from, count) = (0, behind.last().unwrap());
    for to in behind {
        let path = folder.0.join("part.npz");
        let units = format!("{from}..{to}");
        let said = good(&[command, &["--units", &units, "-o", text(&path), "--force"]].concat());
        assert!(said.contains(&format!("units {units} of {count} {kind}\n")), "{said}");
        parts.push(read(&path));
        from = *to;
    }
    for (name, array) in &whole {
        let of_parts: Vec<Array> = parts.iter().map(|part| part[name].clone()).collect();
        assert!(concatenated(&of_parts) == *array, "{command:?}: {name}");
    }
    assert!(parts.iter().all(|part| part.keys().eq(whole.keys())), "{command:?}");
    let over = format!("{}..{}", count - 1, count + 1);
    let parts = [&format!("found {over}, expected at most 0..{count}: {count} {kind}")[..]];
    ends(&[command, &["--units", &over, "-o", "never.npz"]].concat(), 2, &parts);
}

#[test]
fn parts_of_a_sweep_are_the_whole_set() {
    let folder = Folder::new("units sweep");
    // Names of specimens differ in length, and directions of some parts are whole.
    let sweep =
        "specimens = [\"Fla0\", \"Sphere\"]\nspeeds = [100, 150.5]\ndirections = [0, 270.5]\nslides = 5\nseed = 7\n";
    let sweep = folder.file("s.toml", format!("{sweep}[scene.whisker]\noverlap_mm = 0.4\n"));
    parts_are_whole(&folder, &["dataset", text(&sweep)], "slides", &[1, 5, 6, 10]);
    // A part without a sample has empty arrays.
    let none = folder.file("n.toml", "specimens = [\"Fla0\"]\nslides = 12\n[scene.sensor]\ndropped = 0.7\n");
    parts_are_whole(&folder, &["dataset", text(&none)], "slides", &(1..=12).collect::<Vec<_>>());
    assert!(read(&folder.0.join("whole.npz"))["X.npy"].shape[0] < 12, "all slides have a sample");
}

#[test]
fn parts_of_random_slides_are_the_whole_set() {
    let folder = Folder::new("units random");
    // Of short slides at an end of the range some have no sample.
    let sweep = folder.file("s.toml", "slides = 5\nsensors = 3\nspeeds = [10, 600]\nlengths = [20, 60]\n");
    parts_are_whole(&folder, &["dataset", text(&sweep), "--input", "taxel-path"], "slides", &[1, 5]);
}

#[test]
fn parts_of_recordings_are_the_whole_set() {
    let folder = Folder::new("units recordings");
    let recordings = folder.0.join("recordings");
    fs::create_dir(&recordings).unwrap();
    // Not all of them have the label of a sensor, and not all specimens a depth.
    let scenes = ["Saw3@150,30deg", "Fla0@100", "Saw3@220", "Tri2@90,180deg"];
    for (k, (scene, specimen)) in scenes.into_iter().zip(["Saw3", "Fla0", "Saw3", "denim"]).enumerate() {
        let (file, label) = (recordings.join(format!("{k}.mcap")), format!("specimen={specimen}"));
        let labels = ["--label", &label, "--label", "sensor=a", "--features-only"];
        let labels = if k == 0 { &labels[..] } else { &["--label", &label, "--features-only"] };
        good(&[&["record", &format!("scene:{scene},seed={k}"), "-o", text(&file)][..], labels].concat());
    }
    let both = text(&recordings.join("both.mcap")).to_owned();
    let sources = ["cam:left=scene:Saw3@150", "cam:right=scene:Fla0@120"];
    good(&[&["record"], &sources[..], &["--size", "40x40", "-o", &both, "--label", "specimen=Saw3"]].concat());
    let config = folder.file("c.toml", "[trigger]\nwindow = 6\n");
    for more in [&[][..], &["--input", "path", "--test", "0.3"], &["--input", "taxel-path", "--config", text(&config)]]
    {
        let command = [&["dataset", text(&recordings)], more].concat();
        parts_are_whole(&folder, &command, "recordings", &[1, 5, 6]);
    }
    // Each part looks at the labels and rates of all recordings.
    let fast = folder.file("fast.toml", "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [40, 40]\nfps = 40\n");
    let file = recordings.join("6.mcap");
    good(&["record", &format!("scene:{}", text(&fast)), "-o", text(&file), "--label", "specimen=Saw3"]);
    let command = ["dataset", text(&recordings), "--units", "0..1", "-o", "never.npz"];
    ends(&command, 1, &["6.mcap: its rate of frames differs"]);
}

/// `ci/long many` compares the parts with the whole map, and does the same with slides by chance.
#[test]
fn a_part_of_a_study_has_the_rows_of_its_settings() {
    let folder = Folder::new("units trade");
    let config = folder.file("c.toml", "[trigger]\nwindow = 6\n");
    let study = ["trade", "--slides", "1", "--model", "builtin:svm", "--config", text(&config)];
    let part = folder.0.join("part");
    let made = [&study[..], &["--units", "97..98", "-o", text(&part)]].concat();
    let said = good(&made);
    assert!(said.contains("units 97..98 of 336 settings\n"), "{said}");
    assert_eq!(fs::read_dir(&part).unwrap().count(), 2, "map.csv and base.toml");
    let map = fs::read_to_string(part.join("map.csv")).unwrap();
    assert!(map.lines().count() == 2 && map.contains("RGB565,"), "{map}");
    ends(&made, 1, &["map.csv: exists already"]);
    ends(&["trade", "--units", "336..337", "-o", "never"], 2, &["found 336..337, expected at most 0..336"]);
    ends(&["trade", "--units", "0..1"], 2, &["-o <FOLDER>"]);
}

#[test]
fn units_are_a_range() {
    for wrong in ["3", "1..1", "2..1", "1..", "..2", "-1..2", "a..b", "1...2"] {
        let units = format!("--units={wrong}");
        ends(&["dataset", &units, "-o", "never.npz"], 2, &[&format!("found {wrong:?}, expected A..B")]);
    }
}
