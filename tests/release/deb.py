"""Builds the Debian package of the wstac command or of wstac-node, and prints its path.

    deb.py         of the command that ci/build wstac builds
    deb.py FILE    of a static program, which may be for another machine

The command is asked for its pages and completions. Where it was built, it is built for.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from common import ROOT, TARGET, commit_time, fail, place, run, wstac


@dataclass
class Package:
    """A Debian package before it is packed."""

    name: str
    manifest: str
    suggests: str
    summary: str
    description: str
    root: Path

    @property
    def share(self) -> Path:
        return self.root / "usr/share"

    def install(self, source: Path, to: str, mode: int = 0o644) -> Path:
        """Copies a file to a path in the package."""
        path = self.root / to
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, path)
        path.chmod(mode)
        return path


def of_wstac(root: Path, command: Path) -> Package:
    """Returns the package of the command, with what it has besides the program."""
    description = """\
 Reads the frames of a whisker tactile sensor from a V4L2 camera, a recording
 or a simulated sensor, and prints what slid over it, how fast and in which
 direction. Records, calibrates, shows and plots as well."""
    package = Package("wstac", "wstac-cli/Cargo.toml", "ffmpeg, v4l-utils", "tactile events from a WSTac sensor", description, root)
    package.install(ROOT / "wstac-cli/package/70-wstac.rules", "usr/lib/udev/rules.d/70-wstac.rules")
    completions = {"bash": "bash-completion/completions/wstac", "zsh": "zsh/vendor-completions/_wstac", "fish": "fish/vendor_completions.d/wstac.fish"}
    for shell, to in completions.items():
        (package.share / to).parent.mkdir(parents=True)
        (package.share / to).write_text(run(command, "completions", shell), encoding="utf-8")
    pages = package.share / "man"
    run(command, "man", pages)
    for page in sorted(pages.iterdir()):
        section = pages / f"man{page.suffix[1:]}"
        section.mkdir(exist_ok=True)
        run("gzip", "-9n", page.rename(section / page.name))
    return package


def of_node(root: Path) -> Package:
    """Returns the package of wstac-node, with what it has besides the program."""
    description = """\
 Reads whisker tactile sensors as wstac does, and publishes what they find on a
 network of Zenoh, as JSON or as messages of ROS 2. The packages of ROS 2
 for colcon are in /usr/share/wstac-node."""
    package = Package("wstac-node", "wstac-node/Cargo.toml", "wstac", "WSTac sensors on a Zenoh network", description, root)
    for name in ("wstac_msgs", "wstac_ros"):
        shutil.copytree(ROOT / "wstac-ros" / name, package.share / "wstac-node" / name, ignore=shutil.ignore_patterns("__pycache__"))
    for page in ("NETWORK.md", "ROS.md"):
        package.install(ROOT / "docs" / page, f"usr/share/doc/wstac-node/{page}")
    return package


def architecture_of(program: Path) -> str:
    """Returns Debian's name of the machine that a program is for."""
    said = run("readelf", "-h", program, env={**os.environ, "LC_ALL": "C"})
    machine = re.search(r"Machine: *(.*)", said)[1]
    if machine.endswith("X86-64"):
        return "amd64"
    return "arm64" if machine == "AArch64" else run("dpkg", "--print-architecture").strip()


def needs(package: Package, program: Path, files: Path) -> str:
    """Returns what a program is linked with, and from which version on."""
    if "NEEDED" not in run("readelf", "-d", program, env={**os.environ, "LC_ALL": "C"}):
        return ""
    # dpkg-shlibdeps wants a source package's description beside it.
    (files / "debian").mkdir()
    (files / "debian/control").write_text(f"Source: wstac\n\nPackage: {package.name}\nArchitecture: any\n")
    said = run("dpkg-shlibdeps", "-O", f"root/usr/bin/{package.name}", cwd=files)
    return f"Depends: {said.strip().removeprefix('shlibs:Depends=')}\n"


def pack(package: Package, program: Path, version: str, architecture: str, files: Path) -> Path:
    """Writes what Debian reads of a package, and makes its file."""
    size = run("du", "-sk", "--apparent-size", package.root / "usr").split()[0]
    depends = needs(package, program, files)
    address, mail = (place(name)[1][1] for name in ("Cargo.toml", "wstac-ros/wstac_msgs/package.xml"))
    maintainer = f"{os.environ.get('DEBFULLNAME', 'The WSTac authors')} <{os.environ.get('DEBEMAIL', mail)}>"
    homepage = f"Homepage: {address}\n" if address else ""
    (package.root / "DEBIAN").mkdir()
    (package.root / "DEBIAN/control").write_text(
        f"Package: {package.name}\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: {maintainer}\n{homepage}"
        f"Section: science\nPriority: optional\nInstalled-Size: {size}\n{depends}Suggests: {package.suggests}\n"
        f"Description: {package.summary}\n{package.description}\n"
    )
    paths = sorted((str(path.relative_to(package.root)) for path in (package.root / "usr").rglob("*") if path.is_file()), key=str.encode)
    sums = [f"{hashlib.md5((package.root / path).read_bytes()).hexdigest()}  {path}\n" for path in paths]
    (package.root / "DEBIAN/md5sums").write_text("".join(sums))
    (TARGET / "debian").mkdir(parents=True, exist_ok=True)
    made = TARGET / "debian" / f"{package.name}_{version}_{architecture}.deb"
    time = {**os.environ, "SOURCE_DATE_EPOCH": commit_time()}
    run("dpkg-deb", "--root-owner-group", "--build", package.root, made, env=time)
    return made


def main() -> None:
    os.umask(0o022)
    command = wstac()
    own = len(sys.argv) < 2
    program = command if own else Path(sys.argv[1]).absolute()
    architecture = architecture_of(program)
    if own:
        target = re.search(r"^host: (.*)", run("rustc", "-vV"), re.MULTILINE)[1]
    else:
        target = f"{ {'arm64': 'aarch64', 'amd64': 'x86_64'}.get(architecture, architecture)}-unknown-linux-musl"
    with tempfile.TemporaryDirectory() as name:
        files = Path(name)
        root = files / "root"
        root.mkdir()
        if own or program.name == "wstac":
            package = of_wstac(root, command)
        elif program.name == "wstac-node":
            package = of_node(root)
        else:
            fail(f'program is "{program}", expected wstac or wstac-node')
        installed = package.install(program, f"usr/bin/{package.name}", 0o755)
        if own:
            # This machine's strip knows its own programs alone.
            run("strip", installed)
        doc = package.share / "doc" / package.name
        changes = package.install(ROOT / "CHANGELOG.md", str((doc / "changelog").relative_to(root)))
        run("gzip", "-9n", changes)
        subprocess.run([sys.executable, ROOT / "tests/release/notices.py", package.manifest, target, doc / "licenses"], check=True, cwd=ROOT)
        texts = [(ROOT / name).read_text(encoding="utf-8") for name in ("LICENSE-MIT", "LICENSE-APACHE")]
        head = "WSTac is under MIT or Apache-2.0, at your choice. What is built in has the licenses of the folder licenses.\n"
        (doc / "copyright").write_text("\n".join([head, *texts]), encoding="utf-8")
        version = run(command, "--version").strip().removeprefix("wstac ")
        print(pack(package, program, version, architecture, files))


if __name__ == "__main__":
    main()
