#!/usr/bin/env python3
"""Measures the signal path and its peers on an emulated Cortex-M0 and M4F: logarithms and sums. ci/bench prints it.

    signal_path.py CMSIS [--keep]    CMSIS: a folder with CMSIS-DSP's sources, or "-"; --keep writes the tables to docs/SIGNAL.md

An instruction is not a cycle. Peers in C are built by arm-none-eabi-gcc -O2 with newlib, as `ci/setup peers` installs them.
"""

import json
import math
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import boards
from boards import BOARDS, ROOT

HERE = Path(__file__).resolve().parent
PAGE = ROOT / "docs/SIGNAL.md"
BEGIN = "<!-- measured: ci/bench --keep, boards -->\n"
CORES = {"M0": ["-mcpu=cortex-m0"], "M4F": ["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]}
ON = [board for board in BOARDS if board.core in CORES]
NUMBERS = 4096  # the number of integers whose logarithms every kernel computes


def peers(core, cmsis, folder):
    """Compiles the peers in C to one object that exports only its own names. So the program's arithmetic is not
    replaced by C's.
    """
    flags = ["-mthumb", *CORES[core]]
    sources, more = [HERE / "signal_path/peers.c"], []
    if cmsis is not None:
        sources += [cmsis / f"Source/FastMathFunctions/arm_vlog_{kind}.c" for kind in ("f32", "q31")]
        more = ["-DCMSIS_DSP", "-I", HERE / "signal_path", "-I", cmsis / "Include", "-I", cmsis / "PrivateInclude"]
    objects = []
    for source in sources:
        objects.append(folder / f"{source.stem}.o")
        subprocess.run(["arm-none-eabi-gcc", "-w", "-O2", *flags, *more, "-c", source, "-o", objects[-1]], check=True)
    whole = folder / f"{core}.o"
    libraries = ["-Wl,--start-group", "-lm", "-lc", "-lgcc", "-Wl,--end-group"]
    subprocess.run(["arm-none-eabi-gcc", *flags, "-nostdlib", "-r", *objects, *libraries, "-o", whole], check=True)
    subprocess.run(["arm-none-eabi-objcopy", "-w", "--keep-global-symbol=peer_*", whole], check=True)
    return whole


def measure(board, cmsis, folder):
    """Returns the board's lines in their order, and every logarithm's largest error in units of 1/2048."""
    variables = {"WSTAC_PEERS": str(peers(board.core, cmsis, folder)), "CARGO_PROFILE_RELEASE_DEBUG": "0"}
    boards.release(board.target, where=HERE / "signal_path", variables=variables, check=True)
    said = boards.run(board, boards.folder() / board.target / "release/signal", folder)
    lines = [json.loads(line) for line in said.splitlines()]
    words = struct.unpack(f"<{(folder / 'ln').stat().st_size // 4}i", (folder / "ln").read_bytes())
    exact = [math.log(number) for number in words[:NUMBERS]]
    kernels = [line for line in lines if line["what"] == "ln"]
    for k, line in enumerate(kernels, 1):
        logs = words[k * NUMBERS :][:NUMBERS]
        line["error"] = 2048 * max(abs(log / 2**26 - true) for log, true in zip(logs, exact, strict=True))
    return lines


def tables(said):
    """Returns lines of Markdown from the boards' results, by core."""
    cores = list(said)
    rows = lambda what: [[line for line in said[core] if line["what"] == what] for core in cores]
    lines = ["| natural logarithm of an integer below 2^31 | " + " | ".join(f"{core}, instructions" for core in cores) + " | largest error, 1/2048 |"]
    lines.append("| --- |" + " ---: |" * (len(cores) + 1))
    for each in zip(*rows("ln"), strict=True):
        # What is not linked is not measured.
        if all(line["instructions"] for line in each):
            cells = [f"{line['instructions']:,.0f}" for line in each] + [f"{max(line['error'] for line in each):.2g}"]
            lines.append(f"| {each[0]['of']} | " + " | ".join(cells) + " |")
    lines += ["", "| taxel sums of 400 × 400 GREY in stripes of 8 rows, instructions per frame | " + " | ".join(cores) + " |"]
    lines.append("| --- |" + " ---: |" * len(cores))
    for each in zip(*rows("sums"), strict=True):
        lines.append(f"| {each[0]['of']} | " + " | ".join(f"{line['instructions']:,.0f}" for line in each) + " |")
    return lines


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--keep"]):
        sys.exit(__doc__)
    cmsis = None if sys.argv[1] == "-" else Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        said = {board.core: measure(board, cmsis, Path(folder)) for board in ON}
    lines = tables(said)
    print("\n".join(lines))
    if sys.argv[2:]:
        boards.keep(PAGE, BEGIN, lines)


if __name__ == "__main__":
    main()
