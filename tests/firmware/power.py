#!/usr/bin/env python3
"""Counts what boards do while they watch, are touched, and rest, estimates what they draw (power.toml), and prints a table.

    power.py WSTAC [PROGRAM…]              compares it with that of docs/FIRMWARE.md
    power.py WSTAC --write [PROGRAM…]      writes it there

It builds five programs, and takes half an hour. With PROGRAMs, such as "u575", it builds these, and takes the other columns as they
are.
"""

import json
import shutil
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import boards
from budget import CYCLES, PAGE

HERE = Path(__file__).resolve().parent
PICO = HERE.parent / "pico"
BEGIN, END = "<!-- measured: ci/measure power --write -->\n", "<!-- end -->"
MODES = ("watching", "touched", "resting")
FPS = 30
# The seconds without light after which the programs rest.
REST = "5"
# The programs: target, features, name and MHz. USB needs more than 48 MHz.
PROGRAMS = {
    "pico 120": ("thumbv6m-none-eabi", "rp2040,settings,usb", "pico", "120"),
    "pico 72": ("thumbv6m-none-eabi", "rp2040,settings,usb", "pico", "72"),
    "pico 48": ("thumbv6m-none-eabi", "rp2040,settings", "pico", "48"),
    "h743": ("thumbv7em-none-eabihf", "h743,settings", "h743", ""),
    "u575": ("thumbv7em-none-eabihf", "u575,settings", "nucleo_u575zi_q", "24"),
}
# Numbers that are more off than this are another program's.
SLACK = 0.05


def build(target, features, name, mhz):
    """Builds a program, and returns its path."""
    variables = {"WSTAC_REST": REST, "WSTAC_DATA_WIRES": "8", "WSTAC_MHZ": mhz}
    boards.release(target, "--no-default-features", "--features", features, "--bin", name, variables=variables, check=True)
    return Path(shutil.copy(boards.folder() / target / "release" / name, boards.folder() / f"power.{name}{mhz}"))


def output(*command, **how):
    """Runs a command, and returns the JSON that it prints."""
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True, **how).stdout)


def counts(wstac, names):
    """Returns the numbers of each of these programs by mode."""
    if any(name.startswith("pico") for name in names):
        if not shutil.which("npm"):
            sys.exit("ci/measure power: npm is missing, which ci/boards pico installs")
        subprocess.run(["npm", "ci", "--silent", "--no-audit", "--no-fund"], cwd=PICO, check=True)
    programs = {name: build(*PROGRAMS[name]) for name in names}
    with ThreadPoolExecutor(2) as pool:

        def count(name):
            if name in ("h743", "u575"):
                chip = [] if name == "h743" else [name]
                return output(sys.executable, HERE.parent / "emulator/power.py", wstac, programs[name], REST, *chip)
            return output("node", "power.mjs", wstac, programs[name], REST, cwd=PICO)

        return dict(zip(programs, pool.map(count, programs), strict=True))


def column(inputs, of, found):
    """Returns the cells of a column."""
    core, sensor = inputs["cores"][of["core"]], inputs["sensors"][of["sensor"]]
    cells = {"instructions": [], "cycles": [], "awake": [], "current": [], "power": []}
    for mode in MODES:
        number = dict(found[mode])
        if "hertz" in of:
            number["cycles"] = CYCLES * number["instructions"] + number["bus"] * of["hertz"] / number["hertz"]
            number |= {"hertz": of["hertz"], "awake": number["cycles"] * FPS / of["hertz"]}
        megahertz, awake = number["hertz"] / 1e6, number["awake"]
        current = core["more"] + megahertz * (awake * core["run"] + (1 - awake) * core["sleep"]) / 1000
        light = sensor["rest"] if mode == "resting" else FPS * sensor["frame"]
        cells["instructions"].append(f"{number['instructions'] / 1000:.0f}")
        cells["cycles"].append(f"{number['cycles'] / 1000:.0f}")
        cells["awake"].append(f"{100 * awake:.1f}")
        cells["current"].append(f"{current:.2g}" if current < 1 else f"{current:.1f}")
        cells["power"].append(f"{core['volts'] * current + light:.1f}")
    touched = found["touched"]
    memory = "/".join(f"{touched[name] / 1000:.1f}" for name in ("RAM", "flash", "peripherals"))
    return {name: "/".join(three) for name, three in cells.items()} | {"memory": memory}


ROWS = {
    "instructions": "instructions, thousands",
    "cycles": "cycles awake, thousands",
    "awake": "time awake, %",
    "memory": "RAM/flash/peripherals, touched, thousands",
    "current": "core, mA, estimated",
    "power": "core and sensor, mW, estimated",
}


def kept(page):
    """Returns the cells of the page's columns, by title."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line.startswith("|")]
    names = {what: name for name, what in ROWS.items()}
    return {title: {names[row[0]]: row[at] for row in rows[2:]} for at, title in enumerate(rows[0]) if at}


def table(inputs, found, page):
    """Returns lines of Markdown: the table, and which columns meet the goal. What was not found is that of the page."""
    old = kept(page)
    columns = {
        of["title"]: column(inputs, of, found[of["counts"]]) if of["counts"] in found else old[of["title"]] for of in inputs["columns"]
    }
    lines = ["| watching/touched/resting | " + " | ".join(columns) + " |", "| --- |" + " ---: |" * len(columns)]
    lines += [f"| {what} | " + " | ".join(cells[name] for cells in columns.values()) + " |" for name, what in ROWS.items()]
    goal, power = inputs["goal"], {title: map(float, cells["power"].split("/")) for title, cells in columns.items()}
    meet = [title for title, modes in power.items() if all(has <= goal.get(mode, has) for mode, has in zip(MODES, modes, strict=True))]
    said = " and ".join(f"{most} mW {mode}" for mode, most in goal.items())
    return [*lines, "", f"At most {said}, the goal: {', '.join(meet) or 'none'}."]


def numbers(lines):
    """Returns the numbers of a table's lines."""
    table = [line for line in lines if line.startswith("|")]
    return [float(cell) for line in table[2:] for cells in line.split("|")[2:-1] for cell in cells.strip().split("/")]


def main():
    match sys.argv[1:]:
        case [wstac, "--write", *names]:
            write = True
        case [wstac, *names]:
            write = False
        case _:
            sys.exit(__doc__)
    if unknown := set(names) - set(PROGRAMS):
        sys.exit(f"ci/measure power: {', '.join(sorted(unknown))} is no program, expected {', '.join(PROGRAMS)}")
    inputs = tomllib.loads((HERE / "power.toml").read_text())
    found = counts(wstac, names or list(PROGRAMS))
    before, behind = PAGE.read_text().split(BEGIN)
    page, after = behind.split(END, 1)
    lines = table(inputs, found, page)
    print("\n".join(lines))
    if write:
        text = "\n".join(lines)
        PAGE.write_text(f"{before}{BEGIN}\n{text}\n\n{END}{after}")
        return
    said, now = numbers(page.splitlines()), numbers(lines)
    if len(said) != len(now) or lines[-1] not in page or any(abs(a - b) > max(SLACK * a, 0.11) for a, b in zip(said, now, strict=True)):
        sys.exit(f"{PAGE.name} has another table (ci/measure power --write corrects it)")


if __name__ == "__main__":
    main()
