"""Adds things to a clone of the repository as ARCHITECTURE.md says ("Where to add something"), and builds it.

    check.py    a pixel format, an option of cameras, a source, a reason and a key; needs no network once crates are there

Each addition changes at most the files that the table names. What the table leaves to the compiler, the compiler names.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "additions"

RGB332 = '''//! RGB332: one byte per pixel, with 3 bits of green, widened to 8.

use super::{GreenChannel, sum_pixels};
use crate::frame::{Rows, Run};

/// The format RGB332, with G = 255.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rgb332;

impl GreenChannel for Rgb332 {
    type Sum = u32;

    fn full_scale(&self) -> u32 {
        255
    }

    fn row_bytes(&self, width: u16) -> usize {
        usize::from(width)
    }

    #[inline(always)]
    fn add_run(&self, sum: &mut u32, rows: &Rows<'_>, run: Run) {
        let bytes = rows.row(run.y, usize::from(run.x), usize::from(run.width));
        *sum += sum_pixels(bytes, run.stride, |&[byte]| {
            let green = u32::from(byte) >> 2 & 7;
            green << 5 | green << 2 | green >> 1
        });
    }

    fn total(&self, sum: &u32, _pixels: u32) -> u32 {
        *sum
    }
}
'''
# The row of the table behind which the new one stands.
LAST_ROW = '''                => &[], 1, [1 x 1: b"Y", 1 x 1: b"U", 1 x 1: b"V"], None, Some("mono8");
'''
ROW = '''            /// R, G and B of 3, 3 and 2 bits in one byte.
            Rgb332: rgb332::Rgb332 = rgb332::Rgb332
                => &[b"RGB1"], 5, [1 x 1: b"G"], None, None;
'''
OPTION = '''    /// The sensor to read of a recording of several.
    #[cfg_attr(feature = "clap", arg(skip))]
'''
NEW_OPTION = '''    /// Turn frames upside down
    #[cfg_attr(feature = "clap", arg(long))]
    pub upside_down: bool,

'''

# A source of its own kind, as a file of the crate that puts sources together.
BLANK = '''//! Dark frames, by the name `blank:`.

use std::ffi::OsStr;

use crate::core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
use crate::error::Error;
use crate::source::open::{OpenOptions, SourceKind};
use crate::source::{Frame, Source, SourceEvent, StreamInfo};

struct Blank {
    info: StreamInfo,
    left: u32,
}

impl Source for Blank {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(SourceEvent::End) };
        self.left = left;
        Ok(SourceEvent::Frame(Frame::new(&[0; 40 * 40])))
    }
}

pub(crate) struct Blanks;

impl SourceKind for Blanks {
    fn open(&self, name: &OsStr, _: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>> {
        let size = FrameSize::new(40, 40).ok().filter(|_| name == "blank:")?;
        Some(Ok(Box::new(Blank { info: StreamInfo::new("blank", size, PixelFormat::Gray, FrameRate::NOMINAL), left: 50 })))
    }
}
'''
KINDS = '    #[cfg(feature = "scene")]\n    &scene::source::Scenes,\n'
LAST_REASON = "    /// Unclear: a held part seems to have slipped during the touch.\n    Slips,\n"
SENTENCE = '            Self::FasterCamera => "the camera takes more frames per second than were agreed on",\n'


def run(clone: Path, *command: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "CARGO_TARGET_DIR": str(TARGET)}
    return subprocess.run(command, cwd=clone, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def passes(clone: Path, *command: str) -> str:
    """Returns what a command prints; if it fails, so does the check."""
    result = run(clone, *command)
    if result.returncode:
        sys.exit(f"additions: {' '.join(command)} failed\n{result.stdout}")
    return result.stdout


def replace(file: Path, *changes: tuple[str, str]) -> None:
    """Replaces texts, each of which stands in the file once."""
    text = file.read_text(encoding="utf-8")
    for old, new in changes:
        if text.count(old) != 1:
            sys.exit(f"additions: {file.name} has {old!r} {text.count(old)} times (expected 1)")
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")


def touched(clone: Path, most: int) -> None:
    """Checks how many files an addition has changed, and takes them back."""
    files = passes(clone, "git", "status", "--porcelain", "--untracked-files=all").splitlines()
    if len(files) > most:
        sys.exit(f"additions: {len(files)} files changed, expected at most {most}: {files}")
    passes(clone, "git", "stash", "--include-untracked", "--quiet")


def pixel_format(clone: Path) -> None:
    """Adds a decoder and its row: cameras, recordings of parts and pictures know the format."""
    green = clone / "wstac-core/src/green"
    (green / "rgb332.rs").write_text(RGB332, encoding="utf-8")
    replace(green / "mod.rs", ("pub mod rgb565;\n", "pub mod rgb332;\npub mod rgb565;\n"), (LAST_ROW, LAST_ROW + ROW))
    passes(clone, "cargo", "check", "--quiet", "--locked", "--workspace")
    # The parts of frames are compared in every format, and codes are found in the kernel's header.
    found = passes(clone, "cargo", "test", "--quiet", "--locked", "-p", "wstac-host", "--lib", "--", "source::crop", "camera::formats")
    print(found.strip().splitlines()[-1])
    # Without a row, nothing links it; a row without one of its facts is refused.
    replace(green / "mod.rs", (ROW, ROW.replace(", None, None", ", None")))
    if not run(clone, "cargo", "check", "--quiet", "--locked", "-p", "wstac-core").returncode:
        sys.exit("additions: a row of a pixel format without a fact was compiled, expected an error")
    touched(clone, 2)


def camera_option(clone: Path) -> None:
    """Adds a field: commands have the argument, and the compiler names the bindings that do not set it yet."""
    replace(clone / "wstac-host/src/source/open.rs", (OPTION, NEW_OPTION + OPTION))
    passes(clone, "cargo", "build", "--quiet", "--locked", "--workspace", "--exclude", "wstac-c", "--bin", "wstac")
    told = passes(clone, str(TARGET / "debug/wstac"), "run", "--help")
    if "--upside-down" not in told:
        sys.exit("additions: wstac run --help does not have --upside-down, expected the new field")
    c = run(clone, "cargo", "check", "--quiet", "--locked", "-p", "wstac-c")
    if "missing field `upside_down`" not in c.stdout:
        sys.exit(f"additions: wstac-c compiles without the new field, expected an error that names it\n{c.stdout}")
    touched(clone, 1)


def source(clone: Path) -> None:
    """Adds a kind of source: the command reads it by its name."""
    (clone / "wstac/src/blank.rs").write_text(BLANK, encoding="utf-8")
    replace(clone / "wstac/src/lib.rs", (KINDS, f"{KINDS}    &blank::Blanks,\n"), ("\nuse std::ffi::OsStr;\n", "\nmod blank;\n\nuse std::ffi::OsStr;\n"))
    passes(clone, "cargo", "build", "--quiet", "--locked", "-p", "wstac-cli")
    told = passes(clone, str(TARGET / "debug/wstac"), "run", "blank:", "--json")
    if '"frames":50,' not in told:
        sys.exit(f"additions: wstac run blank: printed {told}, expected an end of 50 frames")
    touched(clone, 2)


def reason(clone: Path) -> None:
    """Adds a reason: the compiler asks for its sentence, and a test for its line of a page."""
    file = clone / "wstac-core/src/reason.rs"
    replace(file, (LAST_REASON, f"{LAST_REASON}    /// Not reliable: the sensor is wet.\n    Wet,\n"))
    if "Wet" not in run(clone, "cargo", "check", "--quiet", "--locked", "-p", "wstac-core").stdout:
        sys.exit("additions: a reason without a sentence was compiled, expected an error that names it")
    replace(file, (SENTENCE, f'{SENTENCE}            Self::Wet => "the sensor is wet",\n'))
    passes(clone, "cargo", "check", "--quiet", "--locked", "--workspace")
    if "the sensor is wet" not in run(clone / "tests/pages", "python3", "-m", "unittest", "test_messages").stdout:
        sys.exit("additions: no test asks for the line of a reason in TROUBLESHOOTING.md")
    touched(clone, 1)


def key(clone: Path) -> None:
    """Adds a key of the configuration: help has it, and files may state it."""
    host = clone / "wstac-host/src"
    replace(host / "config.rs", ("    pub stride: Stride,\n", "    pub stride: Stride,\n    /// Whether the sensor is wet.\n    pub wet: bool,\n"))
    replace(host / "config/default.toml", ("[features]\n", "wet = false             # whether the sensor is wet\n[features]\n"))
    passes(clone, "cargo", "build", "--quiet", "--locked", "-p", "wstac-cli")
    wstac = str(TARGET / "debug/wstac")
    (clone / "target").mkdir(exist_ok=True)
    (clone / "target/wet.toml").write_text("[green]\nwet = true\n", encoding="utf-8")
    passes(clone, wstac, "run", "scene:Saw3@150", "--size", "40x40", "--config", "target/wet.toml")
    if "wet = false" not in passes(clone, wstac, "help", "config"):
        sys.exit("additions: wstac help config does not have the new key")
    touched(clone, 2)


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="wstac-additions-") as folder:
        clone = Path(folder) / "clone"
        subprocess.run(["git", "clone", "--quiet", "--shared", str(ROOT), str(clone)], check=True)
        for addition in (pixel_format, camera_option, source, reason, key):
            addition(clone)
            print(f"additions: {addition.__name__.replace('_', ' ')}: as ARCHITECTURE.md says", flush=True)


if __name__ == "__main__":
    main()
