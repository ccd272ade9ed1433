#!/usr/bin/env python3
"""Whether the map of `wstac trade` holds: what a budget's choice claims is found again, and its price is counted.

    check.py WSTAC            checks the three recommended points, and that the pages show the kept map
    check.py WSTAC --write    writes the kept map's pages: docs/TRADE.md, docs/plots/trade.svg, the points in README.md
    check.py WSTAC --sweep    sweeps, and keeps the map; then the command must be built again
    check.py WSTAC --fade     lets the light fade, and writes the tables of that in docs/EXTREMES.md
"""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TRADE = ROOT / "wstac-linux/trade"
EXTREMES = ROOT / "docs/EXTREMES.md"
PICTURE, PAGE, README = ROOT / "docs/plots/trade.svg", ROOT / "docs/TRADE.md", ROOT / "README.md"
# Name, the core that it is for, and what may be spent.
POINTS = (
    ("smallest", "M0", "M0<160k,flash<96K"),
    ("balanced", "M4F", "M4F<60k,M4F.event<90k"),
    ("most accurate", "M4F", "M4F<2M"),
)
# Models that fade in the default setting; the first of them in all others.
FADING = ("svm", "svm-int8", "svm-20f", "ovr", "forest", "boosted")
# As a share: how far a sum of prices may be from a count.
SLACK = 0.01


def run(*command):
    """What a command prints; ends the check where it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))} ended with {done.returncode}: {done.stderr}{done.stdout}")
    return done.stdout


def between(text, name, inside, command="--write"):
    """A page's text with something else between its markers of this name."""
    begin, end = f"<!-- {name}: ci/trade {command} -->", f"<!-- {name} end -->"
    before, rest = text.split(begin)
    return f"{before}{begin}\n\n{inside.strip()}\n\n{end}{rest.split(end)[1]}"


def points_table(wstac):
    """The recommended points as a table: what each budget's choice is, and its numbers."""
    lines = ["| | budget | setting | specimens right, % (95 %) | instructions a frame, an event | flash, RAM, bytes |", "| --- | --- | --- | ---: | ---: | ---: |"]
    for name, core, budget in POINTS:
        said = run(wstac, "trade", "--core", core, "--budget", budget)
        line = dict(re.findall(r"^(\w+) +(.+)$", said, re.MULTILINE))
        model = line["model"].split(":")[0]
        right = re.match(r"([\d.]+) % right, 95 % interval ([\d.]+) … ([\d.]+)", line["specimen"])
        shares = "{:.1f} ({:.1f} … {:.1f})".format(*map(float, right.groups()))
        frame, event, flash, ram = re.findall(r"[\d,]+(?= instructions| an event| bytes| of RAM)", line[core])
        lines.append(f"| {name} | `{budget}` | {line['setting']}, {model} | {shares} | {core}: {frame}; {event} | {flash}; {ram} |")
    return "\n".join(lines)


def pages(wstac):
    """What the pages should say, by file."""
    with tempfile.TemporaryDirectory() as folder:
        run(wstac, "trade", "--map", "kept", "-o", folder)
        table, picture = Path(folder, "trade.md").read_text(), Path(folder, "trade.svg").read_text()
    points = points_table(wstac)
    page = between(between(PAGE.read_text(), "table", table), "points", points)
    return {PICTURE: picture, PAGE: page, README: between(README.read_text(), "points", points)}


def models_are_those_that_were_counted():
    fine = True
    for core, prices in json.loads((TRADE / "prices.json").read_text())["cores"].items():
        for name, price in prices["models"].items():
            file = next(file for file in (TRADE.parent / "models" / name, TRADE / "models" / name) if file.exists())
            if hashlib.sha256(file.read_bytes()).hexdigest() != price["sha256"]:
                fine = False
                print(f"{name}: another file than the one counted on {core}: ci/prices --keep counts it")
    return fine


def holds(wstac, name, core, budget):
    """Whether a point's claims hold: accuracy to the digit, price within the slack."""
    with tempfile.TemporaryDirectory() as folder:
        said = run(wstac, "trade", "--core", core, "--budget", budget, "-o", folder)
        print(f"{name}, {budget}:")
        print(run(wstac, "trade", "--verify", folder), end="")
        pixels = re.search(r"WSTAC_PIXELS=(\w+)", said)[1]
        model = Path(folder, "model.wsm")
        check = [ROOT / "tests/firmware/prices.py", wstac, "--check", Path(folder, "wstac.toml"), model if model.exists() else "-", pixels, core]
        counted = json.loads(run(sys.executable, *check))
        claimed = json.loads(Path(folder, "price.json").read_text())[core]
        fine = True
        for key, claim in (("frame", "features"), ("event", "texture"), ("flash", "flash"), ("ram", "ram")):
            off = claimed[claim] / counted[key] - 1 if counted.get(key) else 0.0
            fine &= abs(off) <= SLACK
            print(f"{core} {claim}: claimed {claimed[claim]:,}, counted {counted[key] or 0:,} ({off:+.2%})")
        return fine


def main():
    match sys.argv[1:]:
        case [wstac]:
            fine = models_are_those_that_were_counted()
            for file, text in pages(wstac).items():
                if file.read_text() != text:
                    fine = False
                    print(f"{file.relative_to(ROOT)} does not show the kept map: ci/trade --write writes it")
            fine &= all([holds(wstac, *point) for point in POINTS])
            sys.exit(not fine)
        case [wstac, "--write"]:
            PICTURE.touch()
            for file, text in pages(wstac).items():
                file.write_text(text)
        case [wstac, "--sweep"]:
            with tempfile.TemporaryDirectory() as folder:
                subprocess.run([wstac, "trade", "-o", folder], stdout=subprocess.DEVNULL, check=True)
                shutil.copy(Path(folder, "map.csv"), TRADE / "map.csv")
        case [wstac, "--fade"]:
            with tempfile.TemporaryDirectory() as folder:
                models = [word for name in FADING for word in ("--model", f"builtin:{name}")]
                subprocess.run([wstac, "trade", "--fade", *models, "-o", folder], stdout=subprocess.DEVNULL, check=True)
                tables = Path(folder, "fade.md").read_text()
            EXTREMES.write_text(between(EXTREMES.read_text(), "fade", tables, "--fade"))
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
