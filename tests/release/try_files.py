"""Tries the files of target/files as a user would: programs in an empty root and under qemu, the library for C with
its examples, packages and wheels in a clean root of Debian.

    try_files.py    needs root or sudo for these roots
"""

from __future__ import annotations

import filecmp
import os
import re
import shutil
import struct
import subprocess
from pathlib import Path
from zipfile import ZipFile

from deb import architecture_of
from images import LOADERS
from common import AS_ROOT, BOARDS, FILES, MACHINES, ROOT, TARGET, CleanRoot, demo_is_that_of_the_readme, fail, folder, run, say, timed, version

# What Python prints of an event and a data set: numbers in full.
PYTHON_SAYS = """
import hashlib, wstac
for event in wstac.open("scene:Saw3@150,90deg", models="builtin:path-svm"):
    print(event.contact, event.speed, event.direction, event.texture, hashlib.sha256(event.sample.tobytes()).hexdigest())
print(hashlib.sha256(wstac.simulate("Sin2@120").frames.tobytes()).hexdigest())"""
NODE_LICENSES = ("licenses/rust-standard-library.html", "licenses/musl.txt", "LICENSE-MIT", "LICENSE-APACHE", "NETWORK.md")
# Debian's Python for another machine.
FOREIGN = """python3.11-minimal libpython3.11-minimal libpython3.11-stdlib libc6 zlib1g libexpat1 libssl3 libffi8 libbz2-1.0
    liblzma5 libsqlite3-0 libuuid1 libgcc-s1 libstdc++6""".split()


class Tried:
    """The files, unpacked into a folder."""

    def __init__(self, at: Path) -> None:
        self.at = at
        self.version = version()
        self.empty = at / "empty"

    def unpacked(self, machine: str, name: str) -> Path:
        """Unpacks an archive, whose program, if it has one, needs no library, and returns its folder."""
        (self.at / machine).mkdir(exist_ok=True)
        archive = FILES / f"{name}-{self.version}-{machine}-linux.tar.gz"
        timed(f"unpacking {name} for {machine}", "tar", "-C", self.at / machine, "-xzf", archive)
        found = self.of(machine, name)
        if name != "libwstac" and "NEEDED" in run("readelf", "-d", found / name):
            fail(f"{name} for {machine} needs libraries")
        return found

    def of(self, machine: str, name: str) -> Path:
        return self.at / machine / f"{name}-{self.version}"

    def alone(self, program: Path) -> list[str | Path]:
        """Returns what runs a program as nobody in a root that has nothing else."""
        run("cp", program, self.empty)
        return [*AS_ROOT, "chroot", "--userspec=nobody", self.empty, f"/{program.name}"]

    def programs(self) -> None:
        """Tries the programs: the first in an empty root, the second under qemu, with the same answers."""
        for machine in MACHINES:
            self.unpacked(machine, "wstac")
        self.empty.mkdir()
        for path in (self.at, self.empty):
            path.chmod(0o755)
        demo = run(*self.alone(self.of("x86_64", "wstac") / "wstac"), "demo", quiet=True, why="wstac demo failed in an empty root")
        say(f"release: x86_64, alone in an empty root, as nobody: {demo_is_that_of_the_readme(demo)}")
        first, second = self.at / "of_x86_64", self.at / "of_aarch64"
        same_everywhere(first, self.of("x86_64", "wstac") / "wstac")
        same_everywhere(second, "qemu-aarch64", self.of("aarch64", "wstac") / "wstac")
        run("diff", "-r", first, second, why="aarch64 gives other bytes than x86-64")
        if '"kind":"event"' not in (first / "run.json").read_text(encoding="utf-8"):
            fail("there is nothing to compare")
        files = list(second.iterdir())
        size = sum(file.stat().st_size for file in files)
        say(f"release: aarch64 under qemu: {size} bytes of {len(files)} files as on x86-64")

    def node(self) -> None:
        """Tries wstac-node: a client of Zenoh hears what it publishes of a scene."""
        for machine in MACHINES:
            at = self.unpacked(machine, "wstac-node")
            for package in ("wstac_msgs", "wstac_ros"):
                run("diff", "-r", f"wstac-ros/{package}", at / package, why=f"wstac-node for {machine} has other files of {package}")
            licenses = (at / "licenses/dependencies.txt").read_text(encoding="utf-8")
            if not re.search(r"^zenoh [0-9.]*.*Apache-2.0", licenses, re.MULTILINE):
                fail(f"wstac-node for {machine} has no license of Zenoh")
            for name in NODE_LICENSES:
                if not (at / name).is_file():
                    fail(f"wstac-node for {machine} has no {name}")
        self.heard("of x86_64, alone in an empty root, as nobody", self.alone(self.of("x86_64", "wstac-node") / "wstac-node"))
        self.heard("of aarch64 under qemu", ["qemu-aarch64", self.of("aarch64", "wstac-node") / "wstac-node"])

    def heard(self, where: str, node: list[str | Path]) -> None:
        """Starts wstac-node with a client that hears it."""
        said = run(*node, "--version").strip()
        if said != f"wstac-node {self.version}":
            fail(f"wstac-node {where} is {said}, expected {self.version}")
        python = run("ci/tool", "python", "node").strip()
        start = (python, "tests/node/start.py", self.of("x86_64", "wstac") / "wstac", *node)
        say(f"release: wstac-node {where}: {run(*start, why=f'wstac-node {where} failed').strip()}")

    def library(self) -> None:
        """Tries libwstac: builds its examples in a folder of their own, and of each machine reads for what the library is."""
        x86_64, aarch64 = [self.unpacked(machine, "libwstac") for machine in MACHINES]
        if len({frozenset(path.relative_to(at) for path in at.rglob("*")) for at in (x86_64, aarch64)}) != 1:
            fail("libwstac for aarch64 has other files")
        for at, architecture in ((x86_64, "amd64"), (aarch64, "arm64")):
            library = at / "lib/libwstac.so"
            newest = max(int(number) for number in re.findall(r"GLIBC_2\.(\d+)", run("readelf", "-V", library)))
            if architecture_of(library) != architecture or newest > 17:
                fail(f"libwstac in {at} is for {architecture_of(library)} and glibc 2.{newest}, expected {architecture} and 2.17")
            if not (at / "share/doc/libwstac/licenses/dependencies.txt").is_file():
                fail(f"libwstac in {at} has no licenses of its dependencies")
        made = self.at / "examples"
        shutil.copytree(x86_64 / "share/doc/libwstac/examples", made)
        options = run("pkg-config", "--cflags", "--libs", "wstac", env={**os.environ, "PKG_CONFIG_PATH": str(x86_64 / "lib/pkgconfig")})
        run("cc", "events.c", "-o", "events", *options.split(), cwd=made)
        run("cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={x86_64}", cwd=made)
        run("cmake", "--build", "build", cwd=made)
        for program, source, expected in (("events", "scene:Saw3@150,90deg", "speed=150."), ("build/slip_stop_cpp", f"scene:{ROOT}/tests/firmware/held.toml", "slip since frame ")):
            said = run(made / program, source, cwd=made)
            if expected not in said:
                fail(f"{program} with libwstac says {said!r} of {source}, expected {expected}…")
            say(f"release: {program} with libwstac: {said.splitlines()[0]}")

    def packages(self, root: CleanRoot) -> None:
        """Installs the Debian packages of this machine in a root without Rust; the other ones are looked at."""
        root.copy(*FILES.glob("*_amd64.deb"), *FILES.glob("*x86_64.whl"), to="/tmp")
        for name in ("wstac", "wstac-node"):
            install = root.command("sh", "-c", f"dpkg -i /tmp/{name}_*_amd64.deb")
            timed(f"dpkg -i of {name}", *install, quiet=True, why=f"dpkg -i of {name} failed")
        if root.run("wstac-node", "--version", user="nobody").strip() != f"wstac-node {self.version}":
            fail("the packaged wstac-node has another version")
        for package in ("wstac_msgs", "wstac_ros"):
            if not (root.at / f"usr/share/wstac-node/{package}/package.xml").is_file():
                fail("the package of wstac-node has no packages of ROS 2")
        if '"kind":"event"' not in root.run("wstac", "run", "scene:Saw3@150", "--json", user="nobody"):
            fail("the packaged command finds no event")
        say(f"release: amd64 package in a clean root: {root.run('wstac', '--version', user='nobody').strip()} finds an event")
        for name in ("wstac", "wstac-node"):
            deb = FILES / f"{name}_{self.version}_arm64.deb"
            run("dpkg-deb", "-x", deb, self.at / "arm64")
            if not filecmp.cmp(self.at / "arm64/usr/bin" / name, self.of("aarch64", name) / name, shallow=False):
                fail(f"the arm64 package has another {name} than the archive")
            for field, expected in (("Architecture", "arm64"), ("Package", name)):
                if run("dpkg-deb", "-f", deb, field).strip() != expected:
                    fail(f"{deb} has another {field} than {expected}")
        say("release: arm64 packages: the programs of the archives")

    def wheels(self, root: CleanRoot) -> None:
        """Tries the wheels: installed by pip in the clean root, without Rust and without a compiler; the other under qemu."""
        wheels = list(FILES.glob("*.whl"))
        for wheel in wheels:
            with ZipFile(wheel) as archive:
                if "wstac/licenses/dependencies.txt" not in archive.namelist():
                    fail(f"{wheel} has no licenses of its dependencies")
        # What the index of Python refuses: a page that it cannot show, or metadata that it does not know.
        twine = Path(run("ci/tool", "python", "release").strip()).with_name("twine")
        run(twine, "check", "--strict", *wheels, quiet=True, why="twine refuses a wheel")
        say("release: twine accepts the wheels")
        root.copy(self.numpy("x86_64"), to="/tmp")
        compilers = subprocess.run(root.command("sh", "-c", "command -v cc rustc cargo"), check=False, capture_output=True, text=True)
        if compilers.stdout:
            fail(f"the clean root has a compiler: {compilers.stdout}")
        root.run("python3", "-m", "venv", "/tmp/venv", why="there is no environment for Python in the clean root")
        pip = root.command("/tmp/venv/bin/pip", "install", "--quiet", "--no-index", "--find-links", "/tmp", "wstac")
        timed("pip install, without downloads,", *pip, quiet=True, why="pip install failed")
        said = root.run("/tmp/venv/bin/python", "-c", PYTHON_SAYS, user="nobody")
        if not said.startswith("slide Speed(mm_s=150.1"):
            fail(f"the wheel says {said}, expected a slide of 150.1 mm/s")
        say("release: x86_64 wheel in the clean root, without a compiler: a slide of 150.1 mm/s")
        away = foreign_python(self.at)
        for wheel in (self.numpy("aarch64"), *FILES.glob("*aarch64.whl")):
            with ZipFile(wheel) as archive:
                archive.extractall(away / "site")
        paths = ("-E", f"PYTHONPATH={away / 'site'}", "-E", f"PYTHONHOME={away / 'usr'}")
        other = run("qemu-aarch64", "-L", away, *paths, away / "usr/bin/python3.11", "-c", PYTHON_SAYS)
        if said != other:
            fail(f"the aarch64 wheel says something else:\n{said}{other}")
        say("release: aarch64 wheel under qemu: the same")

    def numpy(self, machine: str) -> Path:
        """Fetches NumPy's wheel, outside of a root, so that proxies and mirrors of this machine hold."""
        at = self.at / f"numpy-{machine}"
        platforms = (f"--platform=manylinux2014_{machine}", f"--platform=manylinux_2_28_{machine}")
        pip = (run("ci/tool", "python", "release").strip(), "-m", "pip", "download", "--quiet", "--disable-pip-version-check")
        run(*pip, "--only-binary=:all:", "--no-deps", "--python-version=3.11", *platforms, "--dest", at, "numpy")
        (wheel,) = at.glob("*.whl")
        return wheel


def same_everywhere(at: Path, *wstac: str | Path) -> None:
    """Writes what is compared between machines: features, events with textures, a data set, a figure, pictures."""
    at.mkdir()
    options = ("--json", "--features", "--motion", "--model", "builtin:path-svm")
    records = run(*wstac, "run", "scene:Saw3@150,90deg", *options)
    records += run(*wstac, "run", Path(wstac[-1]).parent / "board.bin", "--json")
    records += run(*wstac, "run", "scene:Tri3@45,30deg", "--json", "--samples", "--model", "builtin:taxel-path-boosted")
    (at / "run.json").write_text(records, encoding="utf-8")
    run(*wstac, "scene", "render", "Sin2@120", "-o", at / "clip.y4m", quiet=True)
    run(*wstac, "plot", "scene:Saw3@150", "-o", at / "event.svg", quiet=True)
    (at / "sweep.toml").write_text("slides = 6\nseed = 5\n")
    run(*wstac, "dataset", at / "sweep.toml", "-o", at / "set.npz", quiet=True)
    (at / "eval.json").write_text(run(*wstac, "model", "eval", "builtin:svm", at / "set.npz", "--json"), encoding="utf-8")
    (at / "sweep.toml").unlink()


def foreign_python(folder: Path) -> Path:
    """Returns a folder with Debian's Python for arm64, with a list of packages of its own: nothing of this machine changes."""
    lists, away = folder / "lists", folder / "away"
    for path in (lists / "state/lists/partial", lists / "cache/archives/partial", lists / "debs", away):
        path.mkdir(parents=True)
    (lists / "status").touch()
    own = {
        "APT::Architecture": "arm64",
        "APT::Architectures": "arm64",
        "Dir::State": lists / "state",
        "Dir::State::status": lists / "status",
        "Dir::Cache": lists / "cache",
        "APT::Sandbox::User": "root",
    }
    apt = ("apt-get", "-qq", *(word for name, value in own.items() for word in ("-o", f"{name}={value}")))
    run(*apt, "update")
    run(*apt, "download", *FOREIGN, cwd=lists / "debs")
    for deb in (lists / "debs").glob("*.deb"):
        run("dpkg-deb", "-x", deb, away)
    return away


def boards(at: Path) -> None:
    """Reads the firmware's files back with other programs: they have the bytes that objcopy makes of the programs."""
    for name, (chip, target, _, program) in BOARDS.items():
        file, flat = FILES / f"wstac-fw-{version()}-{name}", at / "flat"
        run("arm-none-eabi-objcopy", "-O", "binary", TARGET / target / "release" / program, flat)
        data, expected = file.read_bytes(), flat.read_bytes()
        if file.suffix == ".dfu":
            said = run("dfu-suffix", "-c", file)
            vendor, product = LOADERS[chip][:2]
            if not re.search(rf"Product ID:\s*0x{product:04X}\s*Vendor ID:\s*0x{vendor:04X}", said):
                fail(f"dfu-suffix says of {file.name}: {said}")
            found = data[:-16]
        else:
            # A board takes blocks of its family alone.
            blocks = [data[at : at + 512] for at in range(0, len(data), 512)]
            family = {"pico.uf2": "56ff8be4", "pico2.uf2": "59ff8be4"}[name]
            own = [block for block in blocks if block[28:32].hex() == family]
            if any(struct.unpack_from("<I", block, 12)[0] != 0x10000000 + 256 * number for number, block in enumerate(own)):
                fail(f"{file.name} has gaps")
            found = b"".join(block[32:288] for block in own)
        if found[: len(expected)] != expected or any(found[len(expected) :]):
            fail(f"{file.name} has other bytes than its program")
    say(f"release: {', '.join(BOARDS)}: the programs")


def as_in_readme(stated_version: str) -> None:
    """Checks that each archive and wheel has a line in the README, and a size in its range."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = re.findall(r"^- `((?:lib)?wstac[^`]*)` \(([0-9]+) to ([0-9]+) MB\)", readme, re.MULTILINE)
    # VERSION and MACHINE stand for these; an ellipsis is the rest.
    stated = [(name.replace("VERSION", stated_version).replace("MACHINE", "*").replace("…", "*"), int(low), int(high)) for name, low, high in lines]
    files = [*FILES.glob("*.tar.gz"), *FILES.glob("*.whl")]
    if not files:
        fail(f"{FILES}: no archive and no wheel, expected those of README.md")
    for file in files:
        sizes = [(low, high) for name, low, high in stated if file.match(name)]
        if len(sizes) != 1 or not sizes[0][0] * 1_000_000 <= file.stat().st_size <= sizes[0][1] * 1_000_000:
            fail(f"{file.name} has {file.stat().st_size} bytes, README.md says {sizes} MB")
    say("release: sizes are those of README.md")


def main() -> None:
    run("sha256sum", "--quiet", "--check", "SHA256SUMS", cwd=FILES)
    with folder(TARGET, "release-") as at:
        tried = Tried(at)
        tried.programs()
        tried.node()
        tried.library()
        root = CleanRoot(at / "root", "python3,python3-venv")
        tried.packages(root)
        tried.wheels(root)
        boards(at)
    say("release: sizes in bytes")
    for file in sorted(FILES.iterdir()):
        if file.name != "SHA256SUMS":
            say(f"    {file.name} {file.stat().st_size}")
    as_in_readme(version())


if __name__ == "__main__":
    main()
