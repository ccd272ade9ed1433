//! Tests that no input takes memory out of proportion: every command reads what claims to be large in 256 MB of address
//! space, and ends with an error that names it.

use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::process::Output;

use wstac_tests::command::{program, run_in, said, says, wstac};
use wstac_tests::folder::Folder;

use super::good;

/// The address space in bytes.
const SPACE: u32 = 256 << 20;
/// Runs a program with little memory, and writes how much of it was used, in KiB. What the interpreter has itself,
/// about 10 MB, is the least that it can see.
const LIMITED: &str = "\
import resource, subprocess, sys
space, peak, *command = sys.argv[1:]
limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (int(space), int(space)))
done = subprocess.run(command, stdin=subprocess.DEVNULL, preexec_fn=limit)
open(peak, 'w').write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
sys.exit(done.returncode)
";
/// Bytes that the files claim to have. They take some KiB on the disk.
const CLAIM: u64 = 6 << 30;
/// Bytes that the files claim to have if they are read to their ends: more than there is memory.
const READ_CLAIM: u64 = 300 << 20;
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Runs `wstac` with little memory, and prints a line of a table: the command, its most memory and its exit code.
fn limited(folder: &Folder, arguments: &[&str]) -> Output {
    let mut command = program("python3");
    command.args(["-c", LIMITED, &SPACE.to_string(), "peak"]).arg(wstac()).args(arguments).current_dir(&folder.0);
    let done = command.output().unwrap();
    let kib: u32 = fs::read_to_string(folder.0.join("peak")).unwrap().parse().unwrap();
    let line = arguments.join(" ").replace(&format!("{}/", folder.0.display()), "");
    println!("| `wstac {line}` | {} MB | {:?} |", kib >> 10, done.status.code().unwrap_or(-1));
    done
}

/// Returns the start of a record: its code and its length.
fn head(op: u8, length: u64) -> Vec<u8> {
    [&[op][..], &length.to_le_bytes()].concat()
}

/// Writes a file of this size with a start and an end, and nothing but a hole between.
fn sparse(path: &Path, size: u64, start: &[u8], end: &[u8]) {
    let mut file = File::create(path).unwrap();
    file.write_all(start).unwrap();
    file.set_len(size).unwrap();
    file.seek(SeekFrom::Start(size - end.len() as u64)).unwrap();
    file.write_all(end).unwrap();
}

/// Writes a recording, claims that one of its records is large, and returns the bytes before that.
fn description(folder: &Folder) -> Vec<u8> {
    let name = folder.0.join("small.mcap");
    good(&["record", "scene:Saw3@150", "--size", "40x40", "--frames", "40", "-o", name.to_str().unwrap()]);
    let bytes = fs::read(&name).unwrap();
    let mut at = 8;
    // The description ends where the first chunk starts.
    while bytes[at] != 6 {
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    bytes[..at].to_vec()
}

/// Returns the record at the end of a recording without frames.
fn end_of_none() -> Vec<u8> {
    let counts = ["frames", "0", "lost", "0", "place", "0"];
    let summed = ["wstac.end"].into_iter().chain(counts);
    let summed = summed.flat_map(|text| [&(text.len() as u64).to_le_bytes(), text.as_bytes()].concat());
    let sum = format!("{:08x}", wstac_core::crc::crc32(summed));
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let texts: Vec<u8> = ["crc32", &sum].into_iter().chain(counts).flat_map(text).collect();
    let body = [&text("wstac.end")[..], &(texts.len() as u32).to_le_bytes(), &texts].concat();
    [&head(12, body.len() as u64)[..], &body].concat()
}

#[test]
fn a_recording_that_claims_gigabytes_takes_little_memory() {
    let folder = Folder::new("recording-limits-claims");
    let start = description(&folder);
    // The recording says that it has no frames, so that its end is whole.
    let ended = [&end_of_none()[..], &head(15, 4), &[0; 4], &head(2, 20), &[0; 20], MAGIC].concat();
    let sizes = |size: u64| [&[0; 16][..], &size.to_le_bytes(), &[0; 8], &size.to_le_bytes()].concat();
    // A chunk, a chunk that was never finished with a long message, and every kind of record.
    for (name, claim) in [
        ("chunk", READ_CLAIM),
        ("open", CLAIM),
        ("record-3", CLAIM),
        ("record-4", CLAIM),
        ("record-5", CLAIM),
        ("record-7", CLAIM),
        ("record-9", READ_CLAIM),
        ("record-12", CLAIM),
        ("record-144", READ_CLAIM),
    ] {
        let rest = claim - (start.len() + 9 + ended.len()) as u64;
        let record = match name.strip_prefix("record-") {
            Some(op) => [head(op.parse().unwrap(), rest), vec![1, 0, 255, 255, 255, 255]].concat(),
            None if name == "chunk" => [head(6, rest), sizes(rest - 40)].concat(),
            None => [head(6, u64::MAX), vec![0; 16], vec![255; 12], vec![0; 4], vec![255; 8], head(5, rest)].concat(),
        };
        let path = folder.0.join(format!("{name}.mcap"));
        sparse(&path, claim, &[&start[..], &record].concat(), &ended);
        let file = path.to_str().unwrap();
        // Every command reads by the same reader, so the others get two of these files.
        let is_chunk = ["chunk", "open"].contains(&name);
        let others = [&["dataset", file, "-o", "new.npz"][..], &["doctor", file]];
        for arguments in [&["run", file][..]].into_iter().chain(others.into_iter().filter(|_| is_chunk)) {
            // Attachments and private records are no part of the stream, whatever their length is.
            let said = says(&limited(&folder, arguments), 1, &[&format!("{name}.mcap")]);
            let is_skipped = ["record-9", "record-144"].contains(&name) && arguments[0] == "run";
            assert!(!is_skipped || said.contains("has no frame"), "{name} {arguments:?}: {said}");
        }
        // A recovery reads all of it.
        if is_chunk || name == "record-9" {
            let small = [&record[..], &[0; 5]].concat();
            sparse(&path, READ_CLAIM, &[&start[..], &small].concat(), &ended);
            let done = limited(&folder, &["recover", file, "-o", "new.mcap", "--force"]);
            assert!(matches!(done.status.code(), Some(0 | 1)), "{name}: {}", said(&done));
        }
        fs::remove_file(&path).unwrap();
    }
    // An index of gigabytes, and a description of frames that take gigabytes.
    let index = start.len() as u64 + 13;
    let footer = [&head(2, 20)[..], &index.to_le_bytes(), &[0; 12], MAGIC].concat();
    let path = folder.0.join("index.mcap");
    let before = [&start[..], &head(15, 4), &[0; 4], &head(3, CLAIM - index - 9 - footer.len() as u64)].concat();
    sparse(&path, CLAIM, &before, &footer);
    let done = limited(&folder, &["run", path.to_str().unwrap()]);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{}", said(&done));
}

#[test]
fn texts_and_models_without_an_end_take_little_memory() {
    let folder = Folder::new("recording-limits-texts");
    sparse(&folder.0.join("base.toml"), CLAIM, b"a = 1\n", b"");
    let scene = "scene:Saw3@150";
    for name in ["hole.toml", "hole.csv", "hole.wsm", "hole.npz", "hole.onnx", "hole.json", "hole.ubj", "hole.y4m"] {
        sparse(&folder.0.join(name), CLAIM, b"", b"");
    }
    for (arguments, part) in [
        (&["run", scene, "--config", "/dev/zero"][..], "/dev/zero"),
        (&["run", scene, "--config", "hole.toml"], "hole.toml"),
        (&["run", "scene:hole.toml"], "hole.toml"),
        (&["run", scene, "--model", "/dev/zero"], "/dev/zero"),
        (&["run", scene, "--model", "hole.wsm"], "hole.wsm"),
        (&["run", "hole.y4m"], "hole.y4m"),
        (&["record", scene, "--guide", "/dev/zero", "-o", "new"], "/dev/zero"),
        (&["dataset", "hole.toml", "-o", "new.npz"], "hole.toml"),
        (&["trade", "--prices", "/dev/zero"], "/dev/zero"),
        (&["trade", "--config", "/dev/zero"], "/dev/zero"),
        (&["trade", "--map", "hole.csv"], "base.toml"),
        (&["model", "inspect", "/dev/zero"], "/dev/zero"),
        (&["model", "import", "hole.onnx", "-o", "new.wsm"], "hole.onnx"),
        (&["model", "import", "hole.json", "-o", "new.wsm"], "hole.json"),
        (&["model", "import", "hole.ubj", "-o", "new.wsm"], "hole.ubj"),
        (&["model", "import", "hole.npz", "-o", "new.wsm"], "hole.npz"),
        (&["model", "eval", "builtin:svm", "hole.npz"], "hole.npz"),
    ] {
        says(&limited(&folder, arguments), 1, &[part]);
    }
    // The largest text that is read takes the most memory in these forms.
    for (line, name) in [("[],", "lists"), ("k", "keys")] {
        let most = 1 << 20;
        let text = match name {
            "lists" => format!("x=[{}]", line.repeat(most / 3 - 2)),
            _ => (0..most / 10).fold(String::new(), |text, key| text + &format!("k{key}=1\n")),
        };
        assert!((most / 2..=most).contains(&text.len()), "{}", text.len());
        fs::write(folder.0.join("full.toml"), text).unwrap();
        // Each of these is parsed into another type.
        for arguments in [
            &["run", scene, "--config", "full.toml"][..],
            &["run", "scene:full.toml"],
            &["dataset", "full.toml", "-o", "new.npz"],
            &["record", scene, "--guide", "full.toml", "-o", "new"],
            &["trade", "--prices", "full.toml"],
        ] {
            says(&limited(&folder, arguments), 1, &[]);
        }
    }
}

/// Writes a data set whose samples take little room in the file: `X` and `X_path` have this many, and `y` their labels.
const BOMB: &str = "\
import sys, zipfile
path, n, descr, label = sys.argv[1], int(sys.argv[2]), sys.argv[3], bytes.fromhex(sys.argv[4])
def npy(descr, shape):
    text = f\"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\\n\".encode()
    return b'\\x93NUMPY\\x01\\x00' + len(text).to_bytes(2, 'little') + text
with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED, compresslevel=1) as file:
    for name, descr, shape, element in [(X, '<i2', (n, 10, 70), b'\\1\\0' * 700) for X in ('X', 'X_path')] + [('y', descr, (n,), label)]:
        with file.open(name + '.npy', 'w') as out:
            out.write(npy(descr, shape))
            for first in range(0, n, 1000):
                out.write(element * min(1000, n - first))
";

/// A data set of a few hundred kilobytes may have gigabytes of samples or labels.
#[test]
fn samples_and_labels_that_compress_well_take_little_memory() {
    let folder = Folder::new("recording-limits-samples");
    let bomb = |name: &str, samples: u32, descr: &str, label: &str| {
        let arguments = [name, &samples.to_string(), descr, label];
        let done = program("python3").args(["-c", BOMB]).args(arguments).current_dir(&folder.0).output().unwrap();
        assert!(done.status.success(), "{}", said(&done));
        assert!(fs::metadata(folder.0.join(name)).unwrap().len() < 8 << 20);
    };
    bomb("many.npz", 400_000, "<i8", "0100000000000000");
    bomb("less.npz", 50_000, "<i8", "0100000000000000");
    for (file, part) in [("many.npz", ": 400000 samples, expected"), ("less.npz", ": 50000 samples take up to")] {
        fs::copy(folder.0.join(file), folder.0.join("held.npz")).unwrap();
        for arguments in [
            &["model", "learn", "builtin:embedding", file, "-o", "new.wsm"][..],
            &["model", "calibrate", "builtin:svm", file, "held.npz", "-o", "new.wsm"],
            &["train", file, "--input", "frames", "-o", "new.wsm"],
        ] {
            let said = says(&limited(&folder, arguments), 1, &[&format!("{file}: array X"), part]);
            assert_eq!(said.lines().filter(|line| line.starts_with("wstac: ")).count(), 1, "{said}");
        }
    }
    // Of each sample, only the answer is kept.
    let done = limited(&folder, &["model", "eval", "builtin:svm", "less.npz"]);
    assert!(matches!(done.status.code(), Some(0 | 1)), "{}", said(&done));
    bomb("texts.npz", 2200, "<U1000", &"00f60100".repeat(1000));
    let done = limited(&folder, &["train", "texts.npz", "--input", "frames", "-o", "new.wsm"]);
    assert!(said(&done).contains("array y: has more than 8 MB of text"), "{}", said(&done));
}

/// Frames of which a few take all the memory are refused, and nothing stays behind.
#[test]
fn large_frames_are_refused_where_there_is_little_memory() {
    let folder = Folder::new("recording-limits-frames");
    folder.file("s.toml", "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [8000, 8000]\n");
    for (compression, name) in [("", "plain.mcap"), ("--compress=lz4", "lz4.mcap")] {
        let arguments = ["record", "scene:s.toml", "--frames", "1", "-o", name, compression];
        let arguments = &arguments[..if compression.is_empty() { 6 } else { 7 }];
        says(&limited(&folder, arguments), 1, &["frames of 61 MB"]);
        assert_eq!(folder.names(), ["peak", "s.toml"]);
        says(&run_in(&folder, arguments), 0, &[]);
        for arguments in [&["recover", name, "-o", "new.mcap"][..], &["run", name], &["dataset", name, "-o", "new.npz"]]
        {
            let done = limited(&folder, arguments);
            assert!(matches!(done.status.code(), Some(0 | 1)), "{arguments:?}: {}", said(&done));
            for new in ["new.mcap", "new.npz"] {
                let _ = fs::remove_file(folder.0.join(new));
            }
            let mut expected = [name, "peak", "s.toml"];
            expected.sort_unstable();
            assert_eq!(folder.names(), expected, "{arguments:?}");
        }
        fs::remove_file(folder.0.join(name)).unwrap();
    }
}
