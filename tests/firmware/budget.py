"""The budgets of the firmware (budgets.toml), and the table of measured costs in docs/FIRMWARE.md."""

import re
import tomllib
from pathlib import Path

import boards
from boards import BOARDS, ROOT

BUDGETS = Path(__file__).with_name("budgets.toml")
PAGE = ROOT / "docs/FIRMWARE.md"
BEGIN = "<!-- measured: ci/firmware --write -->\n"
# The allowed difference of a published number from a measured one. A compiler's output differs a little between two
# paths of a checkout.
SLACK = 0.02
# The most instructions of a tick of the boards' timers. A count is not known better than that.
TICK = 63

ROWS = {
    "whole": "whole frame → features",
    "stripes": "frame → features in 50 stripes of 8 rows",
    "logs": "logarithms (a part of these)",
    "trigger": "trigger",
    "speed": "speed",
    "direction": "direction",
    "edges": "motion by edges",
    "motion": "motion by coherence",
    "wave, median": "motion by a wave, median",
    "wave, 95 %": "motion by a wave, 95th percentile",
    "wave, most": "motion by a wave, largest",
    "wave, parts": "its mean: light/delays, gains/least squares/outline/place, width/corners/doubts/coherence, thousands",
    "live": "live motion in the longest frame",
    "wave, live": "live motion by a wave in the longest frame",
    "wave, live, parts": "this frame: lines/likeness/whiskers/answer, thousands",
    "svm": "texture by `svm`",
    "forest": "texture by `forest`",
    "boosted": "texture by `boosted`",
    "path-svm": "texture by `path-svm`",
    "taxel-path-svm": "texture by `taxel-path-svm`",
    "flash": "flash without a model, bytes",
    "wave, flash": "flash for a wave, bytes",
    "svm, flash": "flash for `svm`, bytes",
    "forest, flash": "flash for `forest`, bytes",
    "boosted, flash": "flash for `boosted`, bytes",
    "path-svm, flash": "flash for `path-svm`, bytes",
    "taxel-path-svm, flash": "flash for `taxel-path-svm`, bytes",
    "ram": "RAM without a model, bytes",
    "wave, ram": "RAM by a wave, bytes",
    "svm, ram": "RAM with `svm`, bytes",
    "forest, ram": "RAM with `forest`, bytes",
    "boosted, ram": "RAM with `boosted`, bytes",
    "path-svm, ram": "RAM with `path-svm`, bytes",
    "taxel-path-svm, ram": "RAM with `taxel-path-svm`, bytes",
} | {
    f"image {name}": f"image `{name}`, bytes"
    for name in ("features", "trigger", "speed", "direction", "edges", "motion", "live", "linear_svm", "forest", "boosted")
}
FRAMES_A_SECOND = 30
# The cycles that an instruction is assumed to take. docs/FIRMWARE.md gives the reason.
CYCLES = 1.75
CLOCK = 64


def table(numbers):
    """Returns lines of Markdown. Cores with the same numbers share a column."""
    same = {}
    for board in BOARDS:
        if board.core in numbers:
            same.setdefault(tuple(sorted(numbers[board.core].items())), []).append(board.core)
    cores = [alike[0] for alike in same.values()]
    lines = ["| | " + " | ".join(map(", ".join, same.values())) + " |", "| --- |" + " ---: |" * len(cores)]
    for key, what in ROWS.items():
        cells = [numbers[core].get(key) for core in cores]
        if not any(cells):
            continue
        lines.append(f"| {what} | " + " | ".join(map(cell_of, cells)) + " |")
    cells = []
    for core in cores:
        frame = numbers[core]["stripes"] + numbers[core]["trigger"]
        cells.append(f"{100 * frame * CYCLES * FRAMES_A_SECOND / (CLOCK * 1e6):.2g} %")
    lines.append(f"| fraction of the time at {FRAMES_A_SECOND} frames per second and {CLOCK} MHz | " + " | ".join(cells) + " |")
    return lines


def is_part(key):
    """Returns whether numbers are parts of one in a row above them, which has the budget."""
    return key.endswith(", parts")


def cell_of(number):
    """Returns the text of a number, or of a tuple of parts."""
    if isinstance(number, tuple):
        return "/".join(f"{part / 1000:.1f}" for part in number)
    return "–" if number is None else f"{number:,}"


def budgets():
    """Returns the budget of each number, by core and key."""
    rows = tomllib.loads(BUDGETS.read_text())["firmware"]
    cores = [board.core for board in BOARDS]
    return {core: {key: most if isinstance(most, int) else most[core] for key, most in rows.items() if isinstance(most, int) or core in most} for core in cores}


def within(numbers, keys=ROWS):
    """Returns whether every number of these keys exists for each measured core and is within its budget. Prints those that are not."""
    wrong, every = [], budgets()
    for core, found in numbers.items():
        found = {key: number for key, number in found.items() if not is_part(key)}
        limits = {key: most for key, most in every[core].items() if key in keys}
        wrong += [f"{core}, {key}: no budget in {BUDGETS.name}, found {found[key]:,}" for key in found.keys() - limits.keys()]
        wrong += [f"{core}, {key}: a budget in {BUDGETS.name}, but no number" for key in limits.keys() - found.keys()]
        over = [key for key in found.keys() & limits.keys() if found[key] > limits[key]]
        wrong += [f"{core}, {ROWS[key]}: {found[key]:,}, above the budget of {limits[key]:,}" for key in over]
    print(*sorted(wrong), sep="\n", end="\n" if wrong else "")
    return not wrong


def published():
    """Returns the numbers of docs/FIRMWARE.md by core and key, and the compiler that they belong to."""
    text = PAGE.read_text().split(BEGIN)[1].split(boards.END)[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    keys = {what: key for key, what in ROWS.items()}
    columns = [cell.split(", ") for cell in rows[0][1:]]
    numbers = {core: {} for cores in columns for core in cores}
    for what, *cells in rows[2:]:
        for cores, cell in zip(columns, cells, strict=True):
            if what in keys and cell != "–":
                for core in cores:
                    parts = tuple(1000 * float(part) for part in cell.split("/")) if "/" in cell else None
                    numbers[core][keys[what]] = parts or int(cell.replace(",", ""))
    return numbers, re.search(r"^Compiler: (.*)\.$", text, re.MULTILINE)[1]


def differences(numbers, page, keys=ROWS):
    """Returns lines of text about the page's numbers of the measured cores that differ by more than the slack."""
    lines = []
    for core, found in sorted(numbers.items()):
        said = page.get(core, {})
        for key in sorted((found.keys() | said.keys()) & set(keys)):
            new, old = found.get(key), said.get(key)
            # A mean is rounded down.
            least = 1 if "bytes" in ROWS[key] else TICK
            pairs = zip(new, old, strict=True) if isinstance(new, tuple) and old else [(new, old)]
            if None in (new, old) or any(abs(new - old) > max(SLACK * old + 1, least) for new, old in pairs):
                lines.append(f"{core}, {ROWS[key]}: measured {new}, published {old}")
    return lines


def check(numbers, keys=ROWS):
    """Returns whether the numbers of these keys are within their budgets, and the page is true of this compiler."""
    fine = within(numbers, keys)
    page, compiler = published()
    apart = differences(numbers, page, keys)
    if apart and compiler == boards.compiler():
        print(f"{PAGE.relative_to(ROOT)} is more than {SLACK:.0%} off (ci/firmware --write corrects it):", *apart, sep="\n  ")
        return False
    if apart:
        print(f"{PAGE.relative_to(ROOT)} has numbers of {compiler}, this is {boards.compiler()}: {len(apart)} of them differ by more than {SLACK:.0%}")
    return fine
