"""Writes the licenses of what is built into a program. They ask to go along with it.

    notices.py MANIFEST TARGET FOLDER    of the package of MANIFEST, as it is built for TARGET

FOLDER gets dependencies.txt, with a list of crates and the texts that are in their packages; rust-standard-library.html if
the compiler has it; and musl.txt if the target has this C library, and this Python has zig. Needs no network once the
crates are downloaded.
"""

import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

# Names of files at the top of a package.
TEXT = re.compile(r"(licen[cs]e|copying|copyright|notice|unlicense)", re.IGNORECASE)
# Parts of C libraries that are not compiled.
UNUSED = {"contrib", "examples", "programs", "tests"}


def fail(message):
    sys.exit(f"notices.py: {message}")


def cargo(*arguments):
    done = subprocess.run(["cargo", *arguments], stdout=subprocess.PIPE, text=True, check=False)
    return done.stdout if done.returncode == 0 else fail(f"cargo {arguments[0]} failed")


def built_in(manifest, target):
    """Returns names and versions of the crates that are linked: those of macros and build scripts are not."""
    tree = cargo("tree", "--locked", "--manifest-path", manifest, "--target", target, "--edges", "normal,no-proc-macro",
                 "--prefix", "none", "--format", "{p}")
    return {tuple(line.split()[:2]) for line in tree.splitlines() if line}


def packages(manifest, target):
    """Returns what cargo knows of these crates, without those of this repository."""
    linked = built_in(manifest, target)
    every = json.loads(cargo("metadata", "--locked", "--format-version", "1", "--manifest-path", manifest, "--filter-platform", target))["packages"]
    found = [package for package in every if package["source"] and (package["name"], "v" + package["version"]) in linked]
    return sorted(found, key=lambda package: (package["name"], package["version"]))


def texts(package):
    """Returns the license texts of a crate."""
    folder = Path(package["manifest_path"]).parent
    files = [file for file in folder.iterdir() if file.is_file() and TEXT.match(file.name) and file.suffix != ".rs"]
    if package["license_file"]:
        files.append(folder / package["license_file"])
    if package["links"]:
        # A C library that comes along.
        files += [file for file in folder.rglob("LICENSE") if not UNUSED.intersection(file.relative_to(folder).parts)]
    return [file.read_text(errors="replace").strip() for file in sorted(set(files))]


def main():
    if len(sys.argv) != 4:
        fail(f"{len(sys.argv) - 1} arguments were given, expected MANIFEST TARGET FOLDER")
    manifest, target, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    found = packages(manifest, target)
    if not found:
        fail(f"{manifest}: no dependencies were found")
    folder.mkdir(parents=True, exist_ok=True)
    known, users = {}, {}
    lines = ["These libraries are built in. Where there is a *, the package has no text. MIT and Apache-2.0 are also the licenses of WSTac,",
             "whose texts come along.", ""]
    for package in found:
        name, own = f"{package['name']} {package['version']}", texts(package)
        if not own and not package["license"]:
            fail(f"{name}: neither a license nor a text was found")
        for text in own:
            # The same text in other lines is the same text.
            key = hashlib.sha256(" ".join(text.split()).encode()).hexdigest()
            known.setdefault(key, text)
            users.setdefault(key, {})[name] = None
        by = "" if own or not package["authors"] else f", by {', '.join(package['authors'])}"
        source = f", https://crates.io/crates/{package['name']}/{package['version']}"
        lines.append(f"{name}{'' if own else ' *'}: {(package['license'] or 'see below').strip()}{by}{source}")
    if any("IJG" in (package["license"] or "") for package in found):
        lines += ["", "This software is based in part on the work of the Independent JPEG Group."]
    for key, text in known.items():
        lines += ["", "-" * 80, f"Of {', '.join(users[key])}:", "", text]
    (folder / "dependencies.txt").write_text("\n".join(lines) + "\n")
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
    library = Path(sysroot) / "share/doc/rust/COPYRIGHT-library.html"
    if library.exists():
        shutil.copy(library, folder / "rust-standard-library.html")
    zig = importlib.util.find_spec("ziglang")
    if target.endswith("-musl") and zig:
        shutil.copy(Path(zig.origin).parent / "lib/libc/musl/COPYRIGHT", folder / "musl.txt")


main()
