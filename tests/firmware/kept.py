"""The numbers of the firmware that are kept in the repository, and their table in docs/FIRMWARE.md."""

import json
from pathlib import Path

import boards
from boards import BOARDS, ROOT

KEPT = Path(__file__).with_name("kept.json")
PAGE = ROOT / "docs/FIRMWARE.md"
BEGIN, END = "<!-- measured: ci/firmware --keep -->\n", "<!-- end -->\n"
# A tick of the boards' timers is 40 or 63 instructions, and a mean is rounded down.
SLACK = 0.002
# A compiler whose numbers are not kept is another compiler.
OTHER_SLACK = 0.1

ROWS = {
    "whole": "whole frame → features, instructions",
    "stripes": "frame → features in 50 stripes of 8 rows, instructions",
    "trigger": "trigger, instructions per frame",
    "speed": "speed, instructions per event",
    "direction": "direction, instructions per event",
    "svm": "texture by the shipped SVM, instructions per event",
    "forest": "texture by the shipped forest, instructions per event",
    "boosted": "texture by the shipped boosted trees, instructions per event",
    "flash": "flash of the whole firmware with its link, without a model, bytes",
    "svm, flash": "flash that the SVM adds, bytes",
    "forest, flash": "flash that the forest adds, bytes",
    "boosted, flash": "flash that the boosted trees add, bytes",
    "ram": "RAM without a model, with the measured stack, without the stripe, bytes",
    "svm, ram": "RAM with the SVM, bytes",
    "forest, ram": "RAM with the forest, bytes",
    "boosted, ram": "RAM with the boosted trees, bytes",
} | {
    f"image {name}": f"image: {what}, bytes"
    for name, what in {
        "features": "only features",
        "trigger": "features and trigger",
        "speed": "features, trigger and speed",
        "direction": "features, trigger, speed and direction",
        "linear_svm": "trigger and SVM, model included",
        "forest": "trigger and forest, model included",
        "boosted": "trigger and boosted trees, model included",
    }.items()
}
# These goals may not be exceeded, whatever is kept.
GOALS = {("M4F", "whole"): 45_000, ("M0", "stripes"): 250_000} | {
    (board.core, key): most for board in BOARDS for key, most in (("flash", 24 * 1024), ("ram", 4 * 1024))
}
FRAMES_A_SECOND = 30
# Cycles an instruction is taken to need: docs/FIRMWARE.md says why.
CYCLES = 1.75
CLOCKS = (64, 168, 480)


def table(numbers):
    """Lines of Markdown."""
    cores = [board.core for board in BOARDS]
    lines = ["| | " + " | ".join(cores) + " |", "| --- |" + " ---: |" * len(cores)]
    for key, what in ROWS.items():
        cells = [numbers[core].get(key) for core in cores]
        lines.append(f"| {what} | " + " | ".join("–" if cell is None else f"{cell:,}" for cell in cells) + " |")
    for clock in CLOCKS:
        cells = []
        for core in cores:
            frame = numbers[core]["stripes"] + numbers[core]["trigger"]
            cells.append(f"{100 * frame * CYCLES * FRAMES_A_SECOND / (clock * 1e6):.2g} %")
        lines.append(f"| fraction of the time at {FRAMES_A_SECOND} frames per second and {clock} MHz | " + " | ".join(cells) + " |")
    return lines


def compare(numbers):
    """Whether nothing is worse than what was kept; says what differs."""
    all_kept = json.loads(KEPT.read_text())
    version = boards.compiler()
    known = all_kept.get(version)
    slack = SLACK if known else OTHER_SLACK
    if not known:
        version, known = next(iter(all_kept.items()))
        print(f"no numbers are kept of {boards.compiler()}: compared with those of {version}, {OTHER_SLACK:.0%} more are let pass")
    fine, better = True, False
    for (core, key), most in GOALS.items():
        if numbers[core][key] > most:
            fine = False
            print(f"{core}, {ROWS[key]}: {numbers[core][key]:,}, above the goal of {most:,}")
    for core, found in numbers.items():
        for key in found.keys() | known[core].keys():
            new, old = found.get(key), known[core].get(key)
            if new is None or old is None:
                fine = False
                print(f"{core}, {key}: found {new}, kept {old}: ci/firmware --keep keeps the new set")
            elif new > old * (1 + slack) + 1:
                fine = False
                print(f"{core}, {ROWS[key]}: {new:,}, worse than the kept {old:,}")
            elif new < old * (1 - slack) - 1 and slack == SLACK:
                better = True
                print(f"{core}, {ROWS[key]}: {new:,}, better than the kept {old:,}")
    if fine and better:
        print("better than kept: ci/firmware --keep keeps it")
    return fine


def keep(numbers):
    """Keeps the numbers, and writes the table."""
    all_kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    all_kept[boards.compiler()] = numbers
    KEPT.write_text(json.dumps(all_kept, indent=1) + "\n")
    before, rest = PAGE.read_text().split(BEGIN)
    after = rest.split(END)[1]
    lines = "\n".join(table(numbers))
    PAGE.write_text(f"{before}{BEGIN}\n{lines}\n\nCompiler: {boards.compiler()}.\n\n{END}{after}")
