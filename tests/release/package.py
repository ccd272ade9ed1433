"""Checks what people install of this machine: the crates packaged and built from their packages alone, by the oldest Rust
that is supported; cargo install; and the Debian package, in a root that has nothing but Debian in it, where the demo runs.

    package.py    needs root or sudo for that root
"""

from __future__ import annotations

import gzip
import hashlib
import os
import re
import subprocess
import tarfile
from pathlib import Path

from common import AS_ROOT, ROOT, TARGET, CleanRoot, demo_is_that_of_the_readme, fail, folder, run, say, wstac

MANIFESTS = ("Cargo.toml", "wstac-fw/Cargo.toml", "wstac-fw/capi/Cargo.toml", "wstac-node/Cargo.toml", "wstac-python/Cargo.toml")
CRATES = ("wstac", *(f"wstac-{name}" for name in ("core", "host", "linux", "scene", "train", "plot", "setup", "serve", "tradeoff", "cli")))


def oldest_rust() -> str:
    """Returns the oldest Rust, which is stated in several files, and checks that it is the same in all."""
    texts = [(ROOT / manifest).read_text(encoding="utf-8") for manifest in MANIFESTS]
    stated = [version for text in texts for version in re.findall(r'^rust-version = "(.*)"$', text, re.MULTILINE)]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    stated += re.findall(r"Rust ([0-9.]*[0-9]) or newer", readme)
    if len(stated) != len(MANIFESTS) + 1 or len(set(stated)) != 1:
        fail(f"oldest Rust is stated {', '.join(stated)}, expected the same, once in each of {', '.join(MANIFESTS)} and README.md")
    return stated[0]


def crates(rust: str) -> None:
    """Packages the crates, each built from what is in it."""
    options = run("ci/tool", "oldest").split()
    # Git may say that a file was changed; that is no fault of the package.
    named = [option for crate in CRATES for option in ("-p", crate)]
    run("cargo", *options, "package", "--quiet", "--locked", "--allow-dirty", *named, quiet=True, why="cargo package failed")
    for crate in sorted((TARGET / "package").glob("*.crate")):
        with tarfile.open(crate) as archive:
            # What is needed to pass it on, and not to build it.
            if not any(name.endswith("/LICENSE-MIT") for name in archive.getnames()):
                fail(f"{crate} has no LICENSE-MIT")
        say(f"package: {crate.name}, {crate.stat().st_size} bytes, built from itself by Rust {rust}")


def publishing() -> None:
    """Asks cargo whether it would publish these crates alone; nothing is uploaded."""
    dry = ("cargo", "publish", "--workspace", "--dry-run", "--no-verify", "--locked", "--allow-dirty")
    said = subprocess.run(dry, check=False, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    ready = re.findall(r"Uploading (wstac[a-z-]*) ", said.stdout)
    if said.returncode or set(CRATES) != set(ready):
        fail(f"cargo publish --dry-run would publish {', '.join(ready) or 'nothing'}, expected {', '.join(CRATES)}:\n{said.stdout}")
    say(f"package: cargo would publish {', '.join(ready)}")


def cargo_install(command: Path, at: Path) -> None:
    run("cargo", "install", "--quiet", "--locked", "--path", "wstac-cli", "--root", at / "install", quiet=True)
    installed, expected = (run(program, "--version").strip() for program in (at / "install/bin/wstac", command))
    if installed != expected:
        fail(f'cargo install gave "{installed}", expected {expected}')
    say(f"package: cargo install gives {installed}")


def debian_package(command: Path) -> Path:
    """Builds the Debian package twice: the same bytes."""
    sums = []
    for _ in range(2):
        made = Path(run("ci/release", "deb", env={**os.environ, "WSTAC": str(command)}).strip())
        sums.append(hashlib.sha256(made.read_bytes()).hexdigest())
    if sums[0] != sums[1]:
        fail(f"{made} is another one when it is built again")
    with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", made], stdout=subprocess.PIPE) as unpacked:
        with tarfile.open(fileobj=unpacked.stdout, mode="r|") as archive:
            pages = [gzip.decompress(archive.extractfile(file).read()) for file in archive if re.search(r"/man[157]/", file.name) and file.isfile()]
    if len(pages) < 20 or not all(pages):
        fail(f"{made} has no man pages, or empty ones")
    say(f"package: {made.name}, {made.stat().st_size} bytes, needs {run('dpkg-deb', '-f', made, 'Depends').strip()}")
    return made


def udev_knows_cameras(root: CleanRoot, at: Path) -> None:
    """Checks the rule, as udev reads it, on a device that every machine has; it is told that this one is a camera."""
    rules = root.at / "etc/udev/rules.d"
    own = (root.at / "usr/lib/udev/rules.d/70-wstac.rules").read_text(encoding="utf-8")
    own = own.replace("video4linux", "mem").replace('ATTR{index}!="0"', 'ATTR{dev}!="1:3"')
    (at / "70-wstac.rules").write_text(own, encoding="utf-8")
    camera = 'KERNEL=="null", ENV{ID_V4L_CAPABILITIES}=":capture:", ENV{ID_BUS}="usb", ENV{ID_SERIAL_SHORT}="SN0001"\n'
    (at / "61-camera.rules").write_text(camera)
    root.copy(at / "70-wstac.rules", at / "61-camera.rules", to="/etc/udev/rules.d")
    script = 'mount --rbind /sys "$1/sys" && chroot "$1" udevadm test /sys/devices/virtual/mem/null'
    command = [*AS_ROOT, "unshare", "--mount", "sh", "-c", script, "-", root.at]
    said = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout
    group = root.run("getent", "group", "video").split(":")[2]
    for found in ("DEVLINKS=/dev/wstac-SN0001", "TAGS=:uaccess:", "MODE 0660", f"GROUP {group}"):
        if found not in said:
            fail(f'udev does not say "{found}" of a camera:\n{said}')
    if re.search(r"wstac\.rules:[0-9]* Invalid", said):
        fail(f"udev refuses the rule:\n{said}")
    run(*AS_ROOT, "rm", "-r", rules / "61-camera.rules", rules / "70-wstac.rules", root.at / "dev/wstac-SN0001", root.at / "run/udev")
    say("package: udev gives a camera the group video, uaccess and /dev/wstac-SERIAL")


def installed(deb: Path, at: Path) -> None:
    """Installs the package in a clean root with udev, which reads the rule, uses it as nobody, and removes it."""
    root = CleanRoot(at / "root", "udev")
    root.copy(deb, to="/wstac.deb")
    root.run("dpkg", "-i", "/wstac.deb", why="dpkg -i failed")
    root.run("rm", "/wstac.deb")
    last = demo_is_that_of_the_readme(root.run("wstac", "demo", user="nobody", why="wstac demo failed in the clean root"))
    say(f"package: in the clean root, as nobody: {last}")
    completes = """. /usr/share/bash-completion/completions/wstac && COMP_WORDS=(wstac calib) COMP_CWORD=1 && _wstac wstac calib wstac &&
        [ "${COMPREPLY[*]}" = calibrate ]"""
    root.run("bash", "-c", completes, user="nobody", why="bash does not complete wstac calib to calibrate")
    say("package: bash completes wstac calib to calibrate")
    udev_knows_cameras(root, at)
    root.run("dpkg", "--purge", "wstac")
    left = run(*AS_ROOT, "find", root.at, "-iname", "*wstac*", "-not", "-path", "*/var/log/*").split()
    if left:
        fail(f"dpkg --purge leaves {', '.join(left)}")
    say("package: purged, nothing of it is left")


def main() -> None:
    # Not in /tmp, which may refuse a clean root its devices. debootstrap takes no path with spaces.
    where = ROOT / "target"
    if re.search(r"\s", str(where)):
        where = Path("/var/tmp")
    with folder(where, "package-") as at:
        crates(oldest_rust())
        publishing()
        command = wstac()
        cargo_install(command, at)
        installed(debian_package(command), at)


if __name__ == "__main__":
    main()
