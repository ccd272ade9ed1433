"""What the scripts of a release share: commands, and a clean root of Debian."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[2]
TARGET = (ROOT / os.environ.get("CARGO_TARGET_DIR", "target")).resolve()
FILES = TARGET / "files"
MACHINES = ("x86_64", "aarch64")
AS_ROOT = [] if os.geteuid() == 0 else ["sudo"]

# The firmware of boards with USB: its file, and its chip, target, feature and program.
BOARDS = {
    "pico.uf2": ("rp2040", "thumbv6m-none-eabi", "rp2040", "pico"),
    "pico2.uf2": ("rp2350", "thumbv8m.main-none-eabihf", "rp2350", "pico"),
    "openmv_cam_h7.dfu": ("openmv", "thumbv7em-none-eabihf", "h743", "openmv_cam_h7"),
    "weact_h743.dfu": ("weact", "thumbv7em-none-eabihf", "h743", "weact_h743"),
    "nicla_vision.dfu": ("nicla", "thumbv7em-none-eabihf", "h747", "nicla_vision"),
}


def fail(message: str) -> NoReturn:
    sys.exit(f"ci/release: {message}")


def say(message: str) -> None:
    print(message, flush=True)


def run(*command: str | Path, why: str = "", quiet: bool = False, **options: object) -> str:
    """Runs a command in the repository, and returns what it prints. Where it fails, so does the script: with why, or what
    failed. Standard error is shown then if it is quiet, else at once."""
    every = {"cwd": ROOT, "stderr": subprocess.PIPE if quiet else None, **options}
    done = subprocess.run(list(map(str, command)), check=False, stdout=subprocess.PIPE, text=True, **every)
    if done.returncode:
        print(done.stdout + (done.stderr or ""), file=sys.stderr)
        fail(why or f"{' '.join(map(str, command))} failed")
    return done.stdout


def timed(what: str, *command: str | Path, **options: object) -> None:
    """Runs a command, and prints how long it took."""
    start = time.monotonic()
    run(*command, **options)
    say(f"release: {what} took {(time.monotonic() - start) * 1000:.0f} ms")


def wstac() -> Path:
    """Returns the command that `WSTAC` names, or a built one."""
    return Path(run("ci/build", "wstac").strip())


def version() -> str:
    """Returns the version that the workspace states."""
    package = (ROOT / "Cargo.toml").read_text(encoding="utf-8").split("[workspace.package]")[1]
    return re.search(r'^version = "(.*)"', package, re.MULTILINE)[1]


# What states the address of the repository, and the mail of its maintainers: both as address.py sets them.
MAINTAINER = '  <maintainer email="MAIL">The WSTac authors</maintainer>'
PLACES = {
    "Cargo.toml": 'repository = "URL"',
    "wstac-python/pyproject.toml": 'urls = { Repository = "URL" }',
    "CITATION.cff": 'repository-code: "URL"',
    "wstac-ros/wstac_msgs/package.xml": MAINTAINER,
    "wstac-ros/wstac_ros/package.xml": MAINTAINER,
}


def place(name: str) -> tuple[str, re.Match[str]]:
    """Returns whether a file states a URL or a MAIL, and where: its line, which is a comment until there is an address."""
    word = "MAIL" if PLACES[name] == MAINTAINER else "URL"
    line = re.escape(PLACES[name]).replace(word, "(.*)")
    return word, re.search(rf"^(?:# )?{line}$", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)


def commit_time() -> str:
    """Returns the time of the commit: the same commit makes the same files, byte for byte."""
    if "SOURCE_DATE_EPOCH" in os.environ:
        return os.environ["SOURCE_DATE_EPOCH"]
    done = subprocess.run(["git", "log", "-1", "--format=%ct"], check=False, capture_output=True, text=True, cwd=ROOT)
    return done.stdout.strip() or str(int((ROOT / "CHANGELOG.md").stat().st_mtime))


def demo_is_that_of_the_readme(printed: str) -> str:
    """Returns the last line of `wstac demo`, which the README shows."""
    last = printed.rstrip("\n").rpartition("\n")[2]
    if f"    {last}" not in (ROOT / "README.md").read_text(encoding="utf-8").splitlines():
        fail(f"wstac demo has other answers than README.md:\n{printed}")
    return last


@contextmanager
def folder(where: Path, prefix: str) -> Iterator[Path]:
    """Makes a folder, and removes it with what root has left in it: a clean root, whose /proc is there if it was interrupted."""
    where.mkdir(parents=True, exist_ok=True)
    at = Path(tempfile.mkdtemp(prefix=prefix, dir=where))
    try:
        yield at
    finally:
        subprocess.run([*AS_ROOT, "umount", at / "root/proc"], check=False, stderr=subprocess.DEVNULL)
        subprocess.run([*AS_ROOT, "rm", "-rf", "--one-file-system", at], check=True)


class CleanRoot:
    """A root that has nothing but Debian in it, of this machine's own release."""

    def __init__(self, at: Path, include: str) -> None:
        self.at = at
        release = re.search(r"^VERSION_CODENAME=(\S+)", Path("/etc/os-release").read_text(encoding="utf-8"), re.MULTILINE)[1]
        run(*AS_ROOT, "debootstrap", "--variant=minbase", f"--include={include}", release, at, quiet=True, why=f"debootstrap {release} failed")

    def command(self, *command: str | Path, user: str = "root") -> list[str | Path]:
        """Returns what runs a command in it."""
        clean = ["/usr/bin/env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8", "HOME=/tmp"]
        return [*AS_ROOT, "chroot", f"--userspec={user}", self.at, *clean, *command]

    def run(self, *command: str | Path, user: str = "root", why: str = "") -> str:
        return run(*self.command(*command, user=user), quiet=True, why=why)

    def copy(self, *files: Path, to: str) -> None:
        run(*AS_ROOT, "cp", *files, f"{self.at}{to}")
