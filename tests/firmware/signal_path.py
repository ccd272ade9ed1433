#!/usr/bin/env python3
"""Measures the signal path and its peers on an emulated Cortex-M0 and M4F: logarithms, sums, and how the cost grows.
ci/bench prints it.

    signal_path.py WSTAC CMSIS [--keep]    CMSIS: a folder with CMSIS-DSP's sources, or "-"; --keep writes the tables to docs/SIGNAL.md

An instruction is not a cycle. Peers in C are built by arm-none-eabi-gcc -O2 with newlib, as `ci/setup peers` installs them.
"""

import json
import math
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import boards
from boards import BOARDS, ROOT
from counter import Counter, Setting

HERE = Path(__file__).resolve().parent
PAGE = ROOT / "docs/SIGNAL.md"
BEGIN, END = "<!-- measured: ci/bench --keep, boards -->\n", "<!-- end -->\n"
CORES = {"M0": ["-mcpu=cortex-m0"], "M4F": ["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]}
ON = [board for board in BOARDS if board.core in CORES]
NUMBERS = 4096  # the number of integers whose logarithms every kernel computes
GROWTH = (1, 4, 16, 64)
# What grows, and the expected exponent.
SCALING = {
    "frame pixels with the paper's taxels": "0.5 to 1",
    "frame pixels, taxels of 16 × 16": "near 0",
    "taxel area, frames of 400 × 400": "below 1",
    "frames": "1",
    "trees": "toward 1",
}


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
    where = boards.folder()
    command = [ROOT / "ci/tool", "thumb", board.target, "build", "--quiet", "--locked", "--release", "--target-dir", where]
    environment = boards.environment() | {"WSTAC_PEERS": str(peers(board.core, cmsis, folder)), "CARGO_PROFILE_RELEASE_DEBUG": "0"}
    subprocess.run(command, cwd=HERE / "signal_path", env=environment, check=True)
    said = boards.run(board, where / board.target / "release/signal", folder)
    lines = [json.loads(line) for line in said.splitlines()]
    words = struct.unpack(f"<{(folder / 'ln').stat().st_size // 4}i", (folder / "ln").read_bytes())
    exact = [math.log(number) for number in words[:NUMBERS]]
    kernels = [line for line in lines if line["what"] == "ln"]
    for k, line in enumerate(kernels, 1):
        logs = words[k * NUMBERS :][:NUMBERS]
        line["error"] = 2048 * max(abs(log / 2**26 - true) for log, true in zip(logs, exact, strict=True))
    return lines


def forest(trees):
    """Returns the shipped forest with this many trees, which repeats its own ones."""
    data = (ROOT / "wstac-host/models/forest.wsm").read_bytes()
    half = lambda at: struct.unpack_from("<H", data, 2 * at)[0]
    begin, shift, end = 20 + half(18), half(14) & 0xFF, half(12) | half(13) << 16
    every, at = [], begin
    while at < end:
        length = 1 + (half(at) << shift)
        every.append(data[2 * at : 2 * (at + length)])
        at += length
    if (at, len(every)) != (end, half(11)):
        sys.exit(f"forest.wsm: {len(every)} trees end at half {at}, expected {half(11)} at {end}")
    body = bytearray(data[: 2 * begin] + b"".join(every[k % len(every)] for k in range(trees)))
    labels = len(body) // 2
    body += data[2 * end :].rstrip(b"\0")
    body += b"\0" * (-len(body) % 4)
    struct.pack_into("<I", body, 8, len(body) // 4)
    struct.pack_into("<H", body, 22, trees)
    struct.pack_into("<I", body, 24, labels)
    struct.pack_into("<I", body, 4, zlib.crc32(body[8:]))
    return bytes(body)


def exponent(costs):
    """Returns the slope of a line through the logarithms of four costs, and that of its last step."""
    x, y = [math.log(growth) for growth in GROWTH], [math.log(cost) for cost in costs]
    mean_x, mean_y = sum(x) / 4, sum(y) / 4
    slope = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True)) / sum((a - mean_x) ** 2 for a in x)
    return slope, (y[3] - y[2]) / (x[3] - x[2])


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


def scaling(said):
    """Returns lines of text about how the cost grows."""
    lines = ["exponents of the cost of what grows 1, 4, 16, 64 times, over all steps and the last one:"]
    for what, expected in SCALING.items():
        of_cores = []
        for core, of in said.items():
            slope, last = exponent([line["instructions"] for line in of if line["what"] == what])
            of_cores.append(f"{core} {slope:.2f}, {last:.2f}")
        lines.append(f"{what}: {'; '.join(of_cores)}; expected {expected}")
    return lines


def keep(lines):
    """Writes the tables between their marks, or at the end if there are none."""
    page = PAGE.read_text() if PAGE.exists() else "# The signal path beside its peers\n"
    if BEGIN not in page:
        page += f"\n## On boards\n\n{BEGIN}{END}"
    before, rest = page.split(BEGIN)
    after = rest.split(END, 1)[1]
    text = "\n".join(lines)
    PAGE.write_text(f"{before}{BEGIN}\n{text}\n\nCompiler: {boards.compiler()}.\n\n{END}{after}")


def main():
    if len(sys.argv) not in (3, 4) or sys.argv[3:] not in ([], ["--keep"]):
        sys.exit(__doc__)
    cmsis = None if sys.argv[2] == "-" else Path(sys.argv[2]).resolve()
    said = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        counter = Counter(sys.argv[1], folder)
        for board in ON:
            said[board.core] = measure(board, cmsis, folder)
        for trees in GROWTH:
            model = folder / f"{trees}.wsm"
            model.write_bytes(forest(trees))
            for core, numbers in counter.setting(Setting(model=model), cores=CORES).items():
                said[core].append({"what": "trees", "of": str(trees), "instructions": numbers["event"]})
    lines = tables(said)
    print("\n".join([*lines, *scaling(said)]))
    if sys.argv[3:]:
        keep(lines)


if __name__ == "__main__":
    main()
