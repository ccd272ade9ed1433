#!/usr/bin/env python3
"""Worst-case stack of a Cortex-M program's functions, from its disassembly.

    stack.py ELF…            checks the entry points in tests/no_panic's programs, one per core, against budgets.toml
    stack.py --of NAME ELF   prints what one function of any program takes

It follows every path through a function, and computes the depth of the stack at each instruction and in each called
function. Recursion is an error, and so is an instruction that changes the stack pointer in an unknown way. Calls
through a register cannot be followed: they are listed, and an entry point must have none. Interrupts need more stack,
which is not included.

Rows are groups of entry points, with the deepest of each. What creates something (`.new`) or restarts a trigger
(`.restart`) is separate from what runs once per frame or event.
"""

import fnmatch
import functools
import re
import subprocess
import sys
import tomllib
from pathlib import Path

from disassembly import Unclear, parse
from walk import Analysis

OBJDUMP = "arm-none-eabi-objdump"
BUDGETS = Path(__file__).with_name("budgets.toml")
CORES = {"armv6s-m": "M0", "armv7": "M3", "armv7e-m": "M4F"}


def text_of(*arguments):
    """Returns what objdump prints."""
    return subprocess.run([OBJDUMP, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


@functools.cache
def analysis(elf):
    """Returns the analysis of a program."""
    return Analysis(parse(text_of("-d", "--demangle", elf)))


@functools.cache
def symbols(elf):
    """Returns the addresses of a program's names. Several names may have one address."""
    line = re.compile(r"^([0-9a-f]+) .{7} \S+\t[0-9a-f]+ (?:\.hidden )?(.+)$", re.MULTILINE)
    return {name: int(address, 16) & ~1 for address, name in line.findall(text_of("-t", "--demangle", elf))}


def worst(elf, name):
    """Returns the stack of a function with everything that it calls: `bytes`, the deepest `path`, and `indirect` calls."""
    if name not in symbols(elf):
        raise Unclear(f"{elf}: no function {name}")
    return analysis(elf).use(symbols(elf)[name])


def row_of(entry):
    """Returns the table row of an entry point."""
    group, name = entry.split(".")
    kind = re.match(r"(new|restart|rezero|set_trigger)(?:_|$)", name)
    return group if kind is None else f"{group}.new" if kind[1] == "new" else f"{group}.restart"


def rows(elf):
    """Returns the deepest entry point of each row, as (name, stack)."""
    entries = [name for name in symbols(elf) if re.fullmatch(r"[a-z]\w*\.[a-z]\w*", name)]
    found = {}
    for entry in sorted(entries):
        use = worst(elf, entry)
        if use.indirect:
            sys.exit(f"stack.py: {elf}: {entry}: calls through registers: {', '.join(sorted(use.indirect))}")
        row = row_of(entry)
        if row not in found or use.bytes > found[row][1].bytes:
            found[row] = entry, use
    return found


def core(elf):
    """Returns the core of a program."""
    architecture = re.search(r"architecture: ([\w-]+)", text_of("-f", elf))
    if not architecture or architecture[1] not in CORES:
        sys.exit(f"stack.py: {elf}: architecture {architecture and architecture[1]}, expected one of {', '.join(CORES)}")
    return CORES[architecture[1]]


def budgets():
    """Returns the budgets in bytes, by row or by a pattern of rows."""
    rows = {}
    for most, names in tomllib.loads(BUDGETS.read_text())["stack"].items():
        for name in names:
            if name in rows:
                sys.exit(f"stack.py: {BUDGETS.name}: {name} has two budgets")
            rows[name] = int(most)
    return rows


def of_rows(found, patterns):
    """Returns the budgets by row: a row's own, or that of the matching pattern. Patterns without a matching row stay as
    they are.
    """
    most = {}
    for name, bytes_ in sorted(patterns.items(), key=lambda item: "*" not in item[0]):
        most |= {row: bytes_ for row in fnmatch.filter(found, name) or [name]}
    return most


def problems(found, patterns):
    """Returns lines of text about wrong rows, by core: over budget, without a budget, or gone."""
    most = of_rows(found, patterns)
    lines = [f"{row}: no budget, found {found[row]}" for row in sorted(found.keys() - most.keys())]
    lines += [f"{row}: a budget, but no entry point" for row in sorted(most.keys() - found.keys())]
    for row in sorted(found.keys() & most.keys()):
        lines += [f"{row}, {core}: {taken} bytes, at most {most[row]}" for core, taken in found[row].items() if taken > most[row]]
    return lines


def show(tables, most):
    """Prints a table of rows with a column per core, the budget, and the path of the first column's deepest entry
    point.
    """
    print("".join(f"{core:>6}" for core in (*tables, "most")), " deepest")
    for row in sorted(next(iter(tables.values()))):
        numbers = "".join(f"{table[row][1].bytes:6}" for table in tables.values())
        entry, use = list(tables.values())[0][row]
        numbers += f"{most.get(row, '-'):>6}"
        steps = [re.sub(r"<.*>|.*::(?=\w+$)", "", step) for step in use.path[1:]]
        print(numbers, "", " > ".join([entry, *steps]))


def main(elves):
    """Measures, prints and checks."""
    if not elves or elves[0].startswith("-"):
        sys.exit(__doc__)
    tables, patterns = {core(elf): rows(elf) for elf in elves}, budgets()
    show(tables, of_rows(next(iter(tables.values())), patterns))
    every = sorted(set().union(*tables.values()))
    found = {row: {core: table[row][1].bytes for core, table in tables.items() if row in table} for row in every}
    if wrong := problems(found, patterns):
        sys.exit("\n  ".join([f"stack.py: not within {BUDGETS.name}:", *wrong]))
    print(f"stack: {len(found)} rows within their budgets")


if __name__ == "__main__":
    try:
        if len(sys.argv) == 4 and sys.argv[1] == "--of":
            answer = worst(sys.argv[3], sys.argv[2])
            print(answer.bytes, "bytes:", " > ".join(answer.path))
            print("calls through registers, not followed:", *sorted(answer.indirect) or ["none"], sep="\n  ")
        else:
            main(sys.argv[1:])
    except Unclear as error:
        sys.exit(f"stack.py: {error}")
