"""The version of all packages, which one command sets.

    version.py VERSION    writes it where crates, wheels, packages of ROS 2, headers and citations state it, and heads the changelog's
                          unreleased changes with it
    version.py            checks that all of these state the same, and prints it
"""

from __future__ import annotations

import re
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

from common import ROOT, fail, version

FORM = r"\d+\.\d+\.\d+"
# By names of files: what stands before and behind a version.
STATED = {
    "Cargo.toml": (r'^(?:version|.* path = "[^"]+", version) = "', '"'),
    "Cargo.lock": (r'^name = "wstac[^"]*"\nversion = "', '"'),
    "pyproject.toml": (r'^version = "', '"'),
    "setup.py": (r'^    version="', '"'),
    "package.xml": ("<version>", "<"),
    "types.toml": ('VERSION_TEXT "', r"\\"),
    "wstac_types.h": ('VERSION_TEXT "', '"'),
    "CITATION.cff": ("^version: ", "$"),
}
# The three parts of a version, in this order.
PARTS = ("MAJOR", "MINOR", "PATCH")
HEADERS = ("wstac-c/src/types.rs", "wstac-c/include/wstac_types.h")


def main() -> None:
    old, given = version(), sys.argv[1:]
    if given and (len(given) != 1 or not re.fullmatch(FORM, given[0])):
        fail(f"version is {' '.join(given)!r}, expected one such as 0.4.0")
    new = (given or [old])[0]
    tracked = subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True, cwd=ROOT).stdout.split("\n")
    for name in filter(None, tracked):
        stated = STATED.get(Path(name).name)
        # The bindings of V4L2 have the version of the crate that they replace.
        if stated is None or "v4l2-sys" in name:
            continue
        text = (ROOT / name).read_text(encoding="utf-8")
        found = re.findall(f"{stated[0]}({FORM})(?={stated[1]})", text, re.MULTILINE)
        if not given:
            # Programs of tests are no packages, and cargo checks lock files.
            if set(found) - {old} and not name.startswith("tests/") and not name.endswith(".lock"):
                fail(f"{name}: version is {', '.join(found)}, expected {old}; help: python3 tests/release/version.py {old} sets it")
        elif old in found:
            text = re.sub(f"({stated[0]}){re.escape(old)}(?={stated[1]})", rf"\g<1>{new}", text, flags=re.MULTILINE)
            (ROOT / name).write_text(text, encoding="utf-8")
    if given:
        day = datetime.now(timezone.utc).date().isoformat()
        parts = [rf"(VERSION_{part}(?:: u32 =)? )\d+" for part in PARTS]
        changes = {name: list(zip(parts, new.split("."))) for name in HEADERS}
        changes["CHANGELOG.md"] = [(r"(## \[Unreleased\]\n)", f"\n## [{new}] - {day}\n")]
        changes["CITATION.cff"] = [(r"(date-released: )\S+", day)]
        for name, each in changes.items():
            text = (ROOT / name).read_text(encoding="utf-8")
            for before, value in each:
                text = re.sub(before, rf"\g<1>{value}", text, count=1)
            (ROOT / name).write_text(text, encoding="utf-8")
    print(new)


main()
