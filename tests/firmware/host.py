"""Results of the host for the same frames, to compare with those of a board."""

import re
import subprocess
import sys

import boards


def host(wstac, *arguments):
    """Returns what the command prints, but for notes, accelerations and periods, of which a board has none."""
    lines = subprocess.check_output([wstac, *arguments], text=True, stderr=subprocess.DEVNULL).splitlines()
    return [re.sub(r'"(acceleration|period_mm)":\{[^}]*\},', "", line) for line in lines if not line.startswith('{"kind":"note"')]


def same(board, what, got, want):
    if got != want:
        pairs = [pair for pair in zip(got + [""] * len(want), want + [""] * len(got)) if pair[0] != pair[1]]
        sys.exit(f"{board.core}, {what}: {len(pairs)} lines differ, the first: {pairs[0][0]!r}, expected {pairs[0][1]!r}")


def on_board(board, elf, folder, wstac, what, events):
    """Checks that a program's line has the host's records of the frames in a folder. Returns the bytes of its stack."""
    boards.run(board, elf, folder, serial="file:serial")
    same(board, what, host(wstac, "monitor", folder / "serial", "--json"), events)
    return int.from_bytes((folder / "stack").read_bytes(), "little")


def features(folder):
    """Returns the features that a board has written, as the host prints them."""
    numbers = memoryview((folder / "features").read_bytes()).cast("h").tolist()
    return [[number / 2048 for number in numbers[at : at + 10]] for at in range(0, len(numbers), 10)]
