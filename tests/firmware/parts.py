"""Counts the instructions of motion by a wave on an emulated board, for many touches and part by part.

QEMU runs the program `golden` with parts.c. An instruction is of the part in whose file of wstac-core it is, inlined or not.
Roots, sums of floats and other helpers are of the part that calls them.
"""

import json
import math
import re
import subprocess
from pathlib import Path

import boards
import golden
from disassembly import parse

FILE = re.compile(r"wstac-core/(?:\./)?src/touch/(wave/\w+|motion/(?:axis|edges|shape|shift|live/(?!light)\w+))\.rs")
# The functions that are counted, and the parts of each by their files.
WHOLE = {
    "wstac_core::touch::wave::by_wave": ("wave/light", "wave/fit", "wave/squares", "wave/outline", "wave/extent", "wave/pair", "wave/mod", "motion/"),
    "golden::live_frame": ("motion/live/(track|arrival|level)", "motion/live/alike", "motion/live/whiskers|wave/", "motion/live/mod"),
}


def table(elf):
    """Returns what parts.c reads about a program, and its parts: names of files."""
    program = parse(subprocess.check_output(["arm-none-eabi-objdump", "-d", "--demangle", elf], text=True))
    every = [code for function in program.functions.values() for code in function.instructions]
    command = ["arm-none-eabi-addr2line", "-a", "-i", "-e", elf]
    asked = "\n".join(hex(code.address) for code in every)
    said = subprocess.run(command, input=asked, capture_output=True, text=True, check=True).stdout
    names, bytes_ = [""], bytearray(1 << 20)
    for code, files in zip(every, re.split("^0x", said, flags=re.MULTILINE)[1:], strict=True):
        # The first is the innermost.
        if found := FILE.search(files):
            names += [found[1]] if found[1] not in names else []
            bytes_[code.address] = names.index(found[1])
    for start, function in program.functions.items():
        for code in function.instructions:
            to = re.match("([0-9a-f]+) <", code.operands)
            # On a Cortex-M0, a call within a function is a long jump.
            if code.name in ("bl", "blx") and not (to and start < int(to[1], 16) <= function.instructions[-1].address):
                bytes_[code.address + 1] = 4 if to else 2
        if function.name in WHOLE:
            bytes_[start + 1] |= (1 + list(WHOLE).index(function.name)) << 4
    return bytes_, names


def measure(board, elf, folder):
    """Returns the numbers of a board by their keys in budget.py. The folder has the golden touches."""
    bytes_, names = table(elf)
    (folder / "table").write_bytes(bytes_)
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", folder / "parts.so", Path(__file__).with_suffix(".c")], check=True)
    boards.run(board, elf, folder, more=("-plugin", "./parts.so"))
    numbers = memoryview((folder / "counts").read_bytes()).cast("I").tolist()
    calls = [numbers[at : at + 32] for at in range(0, len(numbers), 32)]
    of_events, of_frames = ([counts for *counts, number in calls if number == which] for which in (1, 2))
    cases = json.loads((golden.GOLDEN / "wave.json").read_text())["cases"]
    # Noise in the dark is no event.
    of_events = [counts for case, counts in zip(cases, of_events, strict=True) if case["name"] != "dark"]
    of_frames = [counts for counts in of_frames if not counts[names.index("wave/light")]]
    events = sorted(map(sum, of_events))
    median, most_of_95 = (events[math.ceil(part * len(events)) - 1] for part in (0.5, 0.95))
    means = [sum(counts) / len(events) for counts in zip(*of_events, strict=True)]
    longest = max(of_frames, key=sum)
    found = {"wave, median": median, "wave, 95 %": most_of_95, "wave, most": events[-1], "wave, live": sum(longest)}
    for key, files, counts in zip(("wave, parts", "wave, live, parts"), WHOLE.values(), (means, longest), strict=True):
        found[key] = tuple(sum(count for name, count in zip(names, counts) if re.match(part, name)) for part in files)
    return found
