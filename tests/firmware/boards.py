"""The boards that QEMU emulates. Programs of wstac-fw are built for them and run on them."""

import os
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "wstac-fw"
# The configuration of a program that is built without one.
CONFIG = FIRMWARE / "wstac.toml"
# The mark behind what a page has of measurements.
END = "<!-- end -->\n"
TARGETS = ("thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv7em-none-eabihf")


@dataclass(frozen=True)
class Board:
    """A core, and the machine that has it."""

    core: str
    machine: str
    target: str


BOARDS = (
    Board("M0", "microbit", TARGETS[0]),
    Board("M3", "mps2-an385", TARGETS[1]),
    Board("M4F", "mps2-an386", TARGETS[2]),
    Board("M7", "mps2-an500", TARGETS[2]),
)


def folder():
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "firmware"


def environment():
    """Returns the environment of this program, without the variables that choose what a board is built with."""
    return {name: value for name, value in os.environ.items() if not name.startswith("WSTAC_")}


def release(target, *what, where=FIRMWARE, variables=None, **how):
    """Runs cargo for programs of a target in the folder of their package, and returns the finished process."""
    command = [ROOT / "ci/tool", "thumb", target, "build", "--quiet", "--locked", "--release", "--target-dir", folder(), *what]
    return subprocess.run(command, cwd=where, env=environment() | (variables or {}), **how)


def cargo(target, *what, model=None, config=None, pixels=None, debug=True, features="emulated", **how):
    """Runs cargo for programs (`--bin NAME`, `--examples`) of a target, and returns the finished process. Without debug
    information this is faster, and the code is the same.
    """
    variables = {} if debug else {"CARGO_PROFILE_RELEASE_DEBUG": "0"}
    named = {"WSTAC_MODEL": model, "WSTAC_CONFIG": config, "WSTAC_PIXELS": pixels}
    variables |= {name: str(value) for name, value in named.items() if value is not None}
    return release(target, "--no-default-features", "--features", features, *what, variables=variables, **how)


def build(target, *what, **named):
    """Builds programs for a target. Returns their folder, which is valid until its next build."""
    cargo(target, *what, **named, check=True)
    return folder() / target / "release"


def refused(**named):
    """Returns the message of a build that is refused, or an empty one."""
    done = cargo(TARGETS[0], "--bin", "cost", **named, check=False, capture_output=True, text=True)
    return done.stderr if done.returncode else ""


def command(board, elf, serial):
    """Returns the command that runs a program. `serial` is QEMU's name of what its UART is connected to."""
    semihosting = ["-semihosting-config", "enable=on,target=native"]
    qemu = ["qemu-system-arm", "-M", board.machine, "-nographic", "-monitor", "none", "-icount", "shift=0"]
    return [*qemu, "-serial", serial, *semihosting, "-kernel", str(Path(elf).resolve())]


def attempt(board, elf, where, serial="none", seconds=900, more=()):
    """Runs a program to its end in a folder that has its files. Returns its exit code, and what it wrote to the console."""
    how = {"cwd": where, "stdin": subprocess.DEVNULL, "capture_output": True, "text": True, "timeout": seconds}
    done = subprocess.run([*command(board, elf, serial), *more], check=False, **how)
    return done.returncode, done.stdout + done.stderr


def run(board, elf, where, **how):
    """Runs a program as `attempt` does, and fails with it. Returns what it wrote to the console."""
    code, said = attempt(board, elf, where, **how)
    if code:
        sys.exit(f"{board.core}: {Path(elf).name} failed ({code}): {said.strip()}")
    return said


@dataclass(frozen=True)
class Sizes:
    """The size of a program, in bytes."""

    flash: int
    ram: int


def sizes(elf):
    """Returns the flash, and the RAM without the stack, of an ELF."""
    data = Path(elf).read_bytes()
    offset, size, count = struct.unpack_from("<I", data, 32)[0], *struct.unpack_from("<HH", data, 46)
    bits, no_bits, exception_index = 1, 8, 0x70000001
    writable, loaded = 1, 2
    flash = ram = 0
    for header in range(offset, offset + size * count, size):
        _, kind, flags, _, _, length = struct.unpack_from("<6I", data, header)
        if not flags & loaded:
            continue
        if kind in (bits, exception_index):
            flash += length
        if flags & writable and kind in (bits, no_bits):
            ram += length
    return Sizes(flash, ram)


def compiler():
    """Returns the compiler's version, on which instructions and sizes depend."""
    return subprocess.check_output([ROOT / "ci/tool", "thumb", "--version"], text=True, cwd=FIRMWARE).strip()


def keep(page, begin, lines):
    """Writes lines between the marks of a page, with the compiler that they belong to."""
    before, rest = page.read_text().split(begin)
    text = "\n".join([*lines, "", f"Compiler: {compiler()}."])
    page.write_text(f"{before}{begin}\n{text}\n\n{END}{rest.split(END, 1)[1]}")
