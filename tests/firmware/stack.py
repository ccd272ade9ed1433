#!/usr/bin/env python3
"""Worst-case stack of a Cortex-M program's functions, from its disassembly.

    stack.py ELF…            of the entry points in tests/no_panic's programs, one a core, compared with the numbers in stack.json
    stack.py --keep ELF…     keeps the numbers
    stack.py --of NAME ELF   of one function in any program

On every path through a function it follows how deep the stack is at each instruction, and at each call what the called function takes
in turn. Recursion is an error, and so is an instruction that changes the stack pointer in an unknown way. Calls through a register
cannot be followed: they are listed, and an entry point must have none. What interrupts take comes on top.

Rows are groups of entry points, with the deepest of each: what makes something (`.new`) apart from what runs once a frame or event.
Numbers are a compiler's: those of one that is not kept may be a quarter and 32 bytes above the largest that are.
"""

import functools
import json
import re
import subprocess
import sys
from pathlib import Path

from disassembly import Unclear, parse
from walk import Analysis

OBJDUMP = "arm-none-eabi-objdump"
KEPT = Path(__file__).with_name("stack.json")
CORES = {"armv6s-m": "M0", "armv7": "M3", "armv7e-m": "M4F"}


def text_of(*arguments):
    """What objdump prints."""
    return subprocess.run([OBJDUMP, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


@functools.cache
def analysis(elf):
    """The analysis of a program."""
    return Analysis(parse(text_of("-d", "--demangle", elf)))


@functools.cache
def symbols(elf):
    """Addresses of what a program's names stand for; several may be one."""
    line = re.compile(r"^([0-9a-f]+) .{7} \S+\t[0-9a-f]+ (?:\.hidden )?(.+)$", re.MULTILINE)
    return {name: int(address, 16) & ~1 for address, name in line.findall(text_of("-t", "--demangle", elf))}


def worst(elf, name):
    """What a function of a program takes of the stack, with all that it calls: `bytes`, the deepest `path`, `indirect` calls."""
    if name not in symbols(elf):
        raise Unclear(f"{elf}: no function {name}")
    return analysis(elf).use(symbols(elf)[name])


def row_of(entry):
    """The row of the table that an entry point is in."""
    group, name = entry.split(".")
    return f"{group}.new" if re.match(r"new(_|$)", name) else group


def rows(elf):
    """The deepest entry point of each row, as (name, what it takes)."""
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
    """The core that a program is for."""
    architecture = re.search(r"architecture: ([\w-]+)", text_of("-f", elf))
    if not architecture or architecture[1] not in CORES:
        sys.exit(f"stack.py: {elf}: architecture {architecture and architecture[1]}, expected one of {', '.join(CORES)}")
    return CORES[architecture[1]]


def compiler(elf):
    """The version of the compiler that made a program."""
    version = re.search(rb"rustc version (\d+\.\d+)", Path(elf).read_bytes())
    if not version:
        sys.exit(f"stack.py: {elf}: its compiler is not named in it")
    return version[1].decode()


def bounds(kept, version):
    """The numbers that a compiler's are compared with, and what to say of them."""
    if version in kept:
        return kept[version], f"those kept of rustc {version}"
    largest = {}
    for table in kept.values():
        for row, numbers in table.items():
            most = largest.setdefault(row, {})
            most.update({core: max(bytes_ * 5 // 4 + 32, most.get(core, 0)) for core, bytes_ in numbers.items()})
    return largest, f"a quarter and 32 bytes above those of rustc {' and '.join(kept)}, for none are kept of {version}"


def compare(found, bound):
    """What got worse, and what got better; both as lines of text."""
    worse, better = [], []
    for row in sorted({*found, *bound}):
        for name in sorted({*found.get(row, {}), *bound.get(row, {})}):
            now, then = found.get(row, {}).get(name), bound.get(row, {}).get(name)
            if now is None or then is None or now > then:
                worse.append(f"{row}, {name}: {now} bytes, kept {then}")
            elif now < then:
                better.append(f"{row}, {name}: {now} bytes, kept {then}")
    return worse, better


def write(kept):
    """Writes the kept numbers, a row a line."""
    tables = []
    for version, table in sorted(kept.items()):
        lines = ",\n".join(f"    {json.dumps(row)}: {json.dumps(numbers)}" for row, numbers in sorted(table.items()))
        tables.append(f"  {json.dumps(version)}: {{\n{lines}\n  }}")
    KEPT.write_text("{\n" + ",\n".join(tables) + "\n}\n")


def show(tables):
    """Prints a table of rows, a column a core, and the path of the last column's deepest entry point."""
    print("".join(f"{core:>6}" for core in tables), " deepest")
    for row in sorted(next(iter(tables.values()))):
        numbers = "".join(f"{table[row][1].bytes:6}" for table in tables.values())
        entry, use = list(tables.values())[0][row]
        steps = [re.sub(r"<.*>|.*::(?=\w+$)", "", step) for step in use.path[1:]]
        print(numbers, "", " > ".join([entry, *steps]))


def main(arguments):
    """Measures, shows and compares."""
    keep = "--keep" in arguments
    elves = [argument for argument in arguments if argument != "--keep"]
    if not elves or elves[0].startswith("-"):
        sys.exit(__doc__)
    versions = {compiler(elf) for elf in elves}
    if len(versions) > 1:
        sys.exit(f"stack.py: programs of several compilers: {', '.join(sorted(versions))}")
    version = versions.pop()
    tables = {core(elf): rows(elf) for elf in elves}
    show(tables)
    every = sorted(set().union(*tables.values()))
    found = {row: {core: table[row][1].bytes for core, table in tables.items() if row in table} for row in every}
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    if keep:
        write(kept | {version: found})
        return
    bound, of_what = bounds(kept, version)
    worse, better = compare(found, bound)
    if better and version in kept:
        print("less than is kept; please keep it (ci/no-panic --keep):", *better, sep="\n  ")
    if worse:
        sys.exit("\n  ".join([f"stack.py: more stack than {of_what}:", *worse]))
    print(f"stack: {len(found)} rows within {of_what}")


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
