"""Builds the files that people install, for every machine, in target/files: static programs in archives and in Debian
packages, the library for C, Python wheels, the firmware of boards with USB, and the sums of all.

    build.py
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import tempfile
import time
from pathlib import Path

from common import BOARDS, FILES, MACHINES, ROOT, TARGET, commit_time, run, say, version

LICENSES = ROOT / "wstac-python/wstac/licenses"
# What is in an archive of a program, besides it, its licenses and the texts of the repository: of the package's files.
REST = {
    "wstac": ("lib/udev/rules.d/70-wstac.rules", "share/man", "share/bash-completion", "share/fish", "share/zsh"),
    "wstac-node": ("share/wstac-node/wstac_msgs", "share/wstac-node/wstac_ros", "share/doc/wstac-node/NETWORK.md", "share/doc/wstac-node/ROS.md"),
}
TEXTS = {"wstac": ("LICENSE-MIT", "LICENSE-APACHE", "README.md", "wstac-host/examples/board.bin"), "wstac-node": ("LICENSE-MIT", "LICENSE-APACHE")}


def program(machine: str, name: str = "wstac") -> Path:
    return TARGET / f"{machine}-unknown-linux-musl/release/{name}"


def settings() -> dict[str, str]:
    """Returns the variables of every build, and makes the tools that it needs."""
    installed = run("rustup", "target", "list", "--installed").split()
    wanted = [f"{machine}-unknown-linux-{library}" for machine in MACHINES for library in ("musl", "gnu")]
    for triple in wanted:
        if triple not in installed:
            run("rustup", "target", "add", triple)
    # The compiler and linker of C for every machine: zig, which has the headers of both C libraries.
    tools = Path(run("ci/tool", "python", "release").strip()).parent
    return {
        **os.environ,
        "PATH": f"{tools}:{os.environ['PATH']}",
        "CARGO_TARGET_DIR": str(TARGET),
        "CARGO_INCREMENTAL": "0",
        # Names of functions are for backtraces, and take a third of the room.
        "CARGO_PROFILE_RELEASE_STRIP": "true",
        "SOURCE_DATE_EPOCH": commit_time(),
        "WSTAC": str(program(platform.machine())),
    }


def build(machine: str, variables: dict[str, str]) -> None:
    """Builds the programs and the wheel of a machine."""

    def timed(what: str, *command: str | Path) -> None:
        start = time.monotonic()
        run(*command, env=variables)
        say(f"release: {what} for {machine} built in {time.monotonic() - start:.0f} s")

    zigbuild = ("cargo", "zigbuild", "--quiet", "--locked", "--release", "--target", f"{machine}-unknown-linux-musl")
    timed("program", *zigbuild, "-p", "wstac-cli")
    timed("wstac-node", *zigbuild, "--manifest-path", "wstac-node/Cargo.toml")
    manifest, target = "wstac-python/Cargo.toml", f"{machine}-unknown-linux-gnu"
    try:
        # The licenses of what is in a wheel, which maturin takes along.
        run("python3", "tests/release/notices.py", manifest, target, LICENSES, env=variables)
        # abi3: one wheel for every Python from 3.9 on. maturin checks which C library it asks for.
        options = ("--quiet", "--release", "--locked", "--zig", "--target", target, "--compatibility", "manylinux_2_17")
        timed("wheel", "maturin", "build", *options, "--manifest-path", manifest, "--out", FILES)
    finally:
        shutil.rmtree(LICENSES, ignore_errors=True)


def pack(machine: str, name: str, variables: dict[str, str]) -> None:
    """Makes the Debian package of a program, and an archive of the same files, in one folder."""
    made = Path(run("ci/release", "deb", program(machine, name), env=variables).strip())
    shutil.copy(made, FILES)
    top = f"{name}-{version()}"
    with tempfile.TemporaryDirectory() as root:
        every, chosen = Path(root) / "all", Path(root) / top
        run("dpkg-deb", "-x", made, every)
        chosen.mkdir()
        own = (f"bin/{name}", f"share/doc/{name}/licenses", *REST[name])
        run("cp", "-r", *(every / "usr" / path for path in own), *(ROOT / text for text in TEXTS[name]), chosen)
        archive(machine, chosen, variables)


def archive(machine: str, folder: Path, variables: dict[str, str]) -> None:
    order = ("--sort=name", "--owner=0", "--group=0", f"--mtime=@{variables['SOURCE_DATE_EPOCH']}")
    run("tar", "-C", folder.parent, *order, "-czf", FILES / f"{folder.name}-{machine}-linux.tar.gz", folder.name)


def library(machine: str, variables: dict[str, str]) -> None:
    """Makes an archive of the library for C, as ci/build installs it, with examples and licenses."""
    target = f"{machine}-unknown-linux-gnu"
    with tempfile.TemporaryDirectory() as root:
        top = Path(root) / f"libwstac-{version()}"
        # The C library that the wheel asks for.
        run("ci/build", "libwstac", top, "--quiet", "--release", "--target", f"{target}.2.17", env=variables)
        texts = top / "share/doc/libwstac"
        shutil.copytree(ROOT / "wstac-c/examples", texts / "examples")
        run("python3", "tests/release/notices.py", "wstac-c/Cargo.toml", target, texts / "licenses", env=variables)
        run("cp", *(ROOT / text for text in TEXTS["wstac-node"]), texts)
        archive(machine, top, variables)


def firmware(variables: dict[str, str]) -> None:
    """Builds the programs of boards with USB, and writes them as files for their boot loaders."""
    for name, (chip, target, features, program) in BOARDS.items():
        options = ("--quiet", "--locked", "--release", "--no-default-features", "--features", f"{features},settings,usb")
        tool = (ROOT / "ci/tool", "thumb", target, "build", *options, "--bin", program)
        run(*tool, cwd=ROOT / "wstac-fw", env={**variables, "CARGO_PROFILE_RELEASE_STRIP": "false"})
        file = FILES / f"wstac-fw-{version()}-{name}"
        run("python3", "tests/release/images.py", chip, TARGET / target / "release" / program, file)


def main() -> None:
    variables = settings()
    shutil.rmtree(FILES, ignore_errors=True)
    FILES.mkdir(parents=True)
    for machine in MACHINES:
        build(machine, variables)
    for machine in MACHINES:
        for name in REST:
            pack(machine, name, variables)
        library(machine, variables)
    firmware(variables)
    sums = [f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(FILES.iterdir())]
    (FILES / "SHA256SUMS").write_text("".join(sums))


if __name__ == "__main__":
    main()
