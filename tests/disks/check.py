"""Shows what recordings take on ext4, XFS and Btrfs, each in an image of its own: one that ended, one that was killed, the
same after its recovery, and the recovered one. None may keep room that was reserved. And records to disks of 4 kB to 4 MB,
which are full soon: what is left can be read, or nothing is left.

    check.py WSTAC [COUNT]    needs root, loop devices, and the programs that make these file systems
    check.py WSTAC full [COUNT]    full disks only

COUNT is how many sizes by chance are tried with each option, of up to 160 kB and as many larger ones: all 1000 without it.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

FRAMES = b"YUV4MPEG2 W100 H80 F30:1 Cmono\n" + b"".join(b"FRAME\n" + bytes([n]) * 8000 for n in range(40))
MEBIBYTE = 1 << 20


@contextmanager
def disk(kind: str, folder: Path) -> Iterator[Path]:
    """Makes a file system of 400 MiB, and mounts it as long as it is used."""
    image, at = folder / f"{kind}.image", folder / kind
    with image.open("wb") as file:
        file.truncate(400 * MEBIBYTE)
    at.mkdir()
    subprocess.run([f"mkfs.{kind}", "-q", image], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["mount", "-o", "loop", image, at], check=True)
    try:
        yield at
    finally:
        subprocess.run(["umount", at], check=True)
        image.unlink()


def killed(wstac: str, file: Path) -> None:
    """Kills a program that records 40 frames from a pipe, and waits for more."""
    with subprocess.Popen(
        [wstac, "record", "-", "-o", file], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as recorder:
        recorder.stdin.write(FRAMES)
        recorder.stdin.flush()
        for _ in range(100):
            if file.exists() and file.stat().st_size > 300_000:
                break
            time.sleep(0.1)
        recorder.kill()


def shown(kind: str, what: str, file: Path, other: str) -> bool:
    """Prints what a file takes, and tells whether nothing of it was reserved and never written."""
    found = file.stat()
    taken = found.st_blocks * 512
    freed = taken < found.st_size + MEBIBYTE
    print(f"{kind:<6} {what:<28} {found.st_size:>12} {taken:>12}  {'freed' if freed else other}", flush=True)
    return freed


def check(wstac: str, kind: str, at: Path) -> bool:
    def run(*arguments: str | Path) -> str:
        return subprocess.run([wstac, *arguments], check=True, capture_output=True, text=True).stdout

    run("record", "scene:Saw3@150", "--size", "100x100", "-o", at / "whole.mcap")
    killed(wstac, at / "killed.mcap")
    right = shown(kind, "ended", at / "whole.mcap", "KEPT")
    # A recording that was killed may keep its room until it is recovered.
    shown(kind, "killed", at / "killed.mcap", "reserved")
    run("recover", at / "killed.mcap", "-o", at / "recovered.mcap")
    right &= shown(kind, "killed, after its recovery", at / "killed.mcap", "KEPT")
    right &= shown(kind, "recovered", at / "recovered.mcap", "KEPT")
    records = [json.loads(line) for line in run("run", at / "recovered.mcap", "--json").splitlines()]
    frames = [record["frames"] for record in records if record["kind"] == "end"]
    if frames != [40]:
        print(f"{kind}: the recovered recording has {frames} frames, expected 40", file=sys.stderr)
    return right and frames == [40]


OPTIONS = ("", "--features-only", "--crop", "--compress zstd", "--compress lz4", "--compress lz4 --features-only")
# More than 4 MB, also when they are compressed.
NOISE = b"YUV4MPEG2 W400 H400 F30:1 Cmono\n" + b"".join(b"FRAME\n" + random.Random(n).randbytes(160_000) for n in range(60))


def fills(wstac: str, at: Path, options: list[str], size: int) -> str | None:
    """Records to a disk of so many kB. Returns what is wrong with what is left."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", at], check=True)
    try:
        file = at / "a.mcap"
        done = subprocess.run([wstac, "record", "-", *options, "-o", file], input=NOISE, capture_output=True, check=False)
        said = done.stderr.decode()
        is_full = done.returncode == 1 and "the disk is full" in said
        # Features of two seconds may fit.
        if not is_full and not (done.returncode == 0 and "--features-only" in options):
            return f"exit code {done.returncode}, {said!r}"
        if not file.exists():
            return None if "nothing was recorded" in said else f"nothing is there, and {said!r}"
        read = subprocess.run([wstac, "run", file, "--json"], capture_output=True, text=True, check=False)
        return None if read.returncode == 0 else f"what is left is not read: {read.stderr!r}"
    finally:
        subprocess.run(["umount", at], check=True)


def full_disks(wstac: str, at: Path, count: int) -> bool:
    at.mkdir()
    right, generator = True, random.Random()
    for options in OPTIONS:
        small, large = range(4, 164, 4), range(164, 4004, 4)
        # Features are small.
        parts = [small] if "--features-only" in options else [small, large]
        sizes = [size for part in parts for size in generator.sample(part, min(count, len(part)))]
        for size in sizes:
            wrong = fills(wstac, at, options.split(), size)
            if wrong:
                print(f"a disk of {size} kB, {options or 'no options'}: {wrong}", file=sys.stderr)
                right = False
        print(f"{len(sizes)} full disks, {options or 'no options'}", flush=True)
    return right


def main() -> None:
    if os.geteuid() != 0:
        sys.exit("disks: mounting needs root")
    count, only_full = int(sys.argv[-1]) if sys.argv[-1].isdigit() else 1000, sys.argv[2:3] == ["full"]
    right = True
    with tempfile.TemporaryDirectory() as folder:
        right &= full_disks(sys.argv[1], Path(folder) / "full", count)
        if not only_full:
            print(f"{'disk':<6} {'recording':<28} {'bytes':>12} {'on disk':>12}")
        for kind in () if only_full else ("ext4", "xfs", "btrfs"):
            with disk(kind, Path(folder)) as at:
                right &= check(sys.argv[1], kind, at)
    sys.exit(not right)


if __name__ == "__main__":
    main()
