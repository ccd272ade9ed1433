//! Tests recordings whose chunks are compressed.

use std::fs;

use wstac_tests::command::{good, program, run_script, said, says, wstac};
use wstac_tests::folder::{Folder, text};

use super::cuts::chunks;
use super::flips::{ended, outcome, recovered_twice, small};
use super::piped_to;

/// A recording that was killed has all chunks that were finished, and a recovery of it can be read.
#[test]
fn a_killed_compressed_recording_loses_its_last_second() {
    let folder = Folder::new("recording-compressed-killed");
    let file = folder.0.join("a.mcap");
    for compression in ["zstd", "lz4"] {
        let mut command = program(wstac());
        command.args(["record", "-", "--compress", compression, "-o", text(&file)]);
        // No frame of noise is found in the compressed file, so only its size says how far it is.
        let (mut child, _open) = piped_to(command, &file, 200, |bytes| bytes.len() > 6000);
        child.kill().unwrap();
        child.wait().unwrap();
        let (frames, lost) = ended(recovered_twice(&folder, text(&file)).1.as_bytes());
        // The number of frames per second depends on the machine.
        assert!((1..=200).contains(&frames) && lost == 0, "{compression}: {frames} frames, {lost} lost");
        fs::remove_file(&file).unwrap();
    }
}

/// Bytes that are gone from a chunk make its length wrong, and the index. The chunks behind it are found all the same.
#[test]
fn chunks_behind_a_damaged_one_come_back() {
    let folder = Folder::new("recording-compressed-gone");
    for compression in ["--compress=zstd", "--compress=lz4"] {
        let (bytes, recorded) = small(&folder, &[compression]);
        let places = chunks(&bytes);
        assert!(places.len() > 3, "{places:?}");
        let inside = (places[1] + 1000, places[2] - 1000);
        let across = (places[1] + 1000, places[2] + 1000);
        let head = (places[1] + 20, places[1] + 70);
        let last = (places[places.len() - 1] + 500, places[places.len() - 1] + 1500);
        for (what, (from, to), most) in
            [("inside", inside, 32), ("across", across, 64), ("head", head, 32), ("last", last, 32)]
        {
            let damaged = [&bytes[..from], &bytes[to..]].concat();
            let outcome = outcome(&folder, &damaged);
            assert_eq!((outcome.run, outcome.recover), (Some(1), Some(0)), "{compression} {what}: {}", outcome.said);
            let (frames, lost) = outcome.found.unwrap();
            assert_eq!(frames + lost, recorded.0 + recorded.1, "{compression} {what}: {frames} and {lost}");
            assert!(frames + most >= recorded.0, "{compression} {what}: {frames} of {recorded:?}");
            let said = outcome.said;
            assert!(said.contains("finished properly") && !said.contains(" 0 bytes"), "{said}");
        }
    }
}

/// A chunk that waits for its compression does not count as if it could not be compressed.
#[test]
fn a_compressed_recording_fills_a_small_disk() {
    let folder = Folder::new("recording-compressed-full");
    let file = folder.0.join("a.mcap");
    for compression in ["zstd", "lz4"] {
        let _ = fs::remove_file(&file);
        let script = format!(
            "ulimit -f 1000; exec \"$0\" record scene:Saw3@150 --size 300x300 --compress {compression} -o a.mcap"
        );
        says(&run_script(&folder, &script), 1, &["the disk is full"]);
        let size = file.metadata().unwrap().len();
        println!("{compression}: {size} of {} bytes", 1000 << 10);
        assert!(size > 800 << 10, "{compression}: {size} bytes");
        good(&["run", file.to_str().unwrap(), "--json"]);
    }
}

/// Whatever the first moment writes: what is left on a disk that is full at once can be read, or nothing is left.
#[test]
fn a_recording_that_a_full_disk_ends_at_once_is_finished_or_not_there() {
    let folder = Folder::new("recording-full");
    let file = folder.0.join("a.mcap");
    let compressed = ["--compress zstd", "--compress lz4", "--compress lz4 --features-only"];
    let all = ["", "--features-only", "--crop"].into_iter().chain(compressed);
    // Each has sizes of its own. `ci/long disks` tries all of them.
    for (first, options) in (4..).step_by(3).zip(all) {
        for kib in (first..140).step_by(17) {
            let script = format!(
                "ulimit -f {kib}; exec \"$0\" record scene:Saw3@150 --size 240x240 --frames 9 {options} -o a.mcap"
            );
            let said = said(&run_script(&folder, &script));
            let is_there = file.exists();
            assert!(is_there || said.contains("nothing was recorded"), "{options} {kib}: {said}");
            if is_there {
                good(&["run", file.to_str().unwrap(), "--json"]);
                fs::remove_file(&file).unwrap();
            }
        }
    }
}
