#!/usr/bin/env python3
"""Checks the map of `wstac trade`: the claim of a budget's choice must be found again, and its price is counted.

    check.py WSTAC            checks the recommended points, and that the pages show the kept map
    check.py WSTAC --pages    checks only that the pages show the kept map, and that its models are those that were counted
    check.py WSTAC --write    writes the kept map's pages: docs/TRADE.md and docs/plots/trade.svg
    check.py WSTAC --sweep    sweeps, and keeps the map; then the command must be built again
    check.py WSTAC --fade     lets the light fade, and writes the table of that in docs/EXTREMES.md
"""

import csv
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import fading

ROOT = Path(__file__).resolve().parents[2]
TRADE = ROOT / "wstac-tradeoff/data"
MODELS = ROOT / "wstac-host/models"
EXTREMES = ROOT / "docs/EXTREMES.md"
PICTURE, PAGE = ROOT / "docs/plots/trade.svg", ROOT / "docs/TRADE.md"
# Name, core, budget, and what decides.
POINTS = (
    ("smallest", "M0", "M0<160k,flash<36K", "specimen"),
    ("balanced", "M4F", "M4F<60k,M4F.event<90k", "specimen"),
    ("most accurate", "M4F", "M4F<2M", "specimen"),
    ("any object", "M4F", "M4F<60k,M4F.event<600k,model=taxel-path-svm", "objects"),
)
# Instructions per event, in thousands, within which budgets choose a law.
EVENTS = (25, 50, 100, 150, 200, 300, 400, 600, 800, 1000, 1500, 2000)
PARAMETERS = ("format", "stride", "ln", "law")
# The largest difference of a published sum of prices from a count, as a fraction. A compiler's output differs a little
# between two paths.
SLACK = 0.02


def run(*command):
    """Returns what a command prints. Ends the check if the command fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))} ended with {done.returncode}: {done.stderr}{done.stdout}")
    return done.stdout


def between(text, name, inside, command="--write"):
    """Returns a page's text with new text between its markers of this name."""
    begin, end = f"<!-- {name}: ci/trade {command} -->", f"<!-- {name} end -->"
    before, rest = text.split(begin)
    return f"{before}{begin}\n\n{inside.strip()}\n\n{end}{rest.split(end)[1]}"


def parameters_table(rows):
    """Returns the rows of the map that differ from the default setting in one parameter, and those of the default settings of other models."""
    def text(number, form):
        return format(float(number), form) if number else "–"

    def setting(row):
        return [row[name] for name in PARAMETERS]

    def model(row):
        return "no model" if row["model"] == "none" else row["model"].removeprefix("builtin:")

    default, published = ["GREY", "1", "fixed", "wave"], ["GREY", "1", "fixed", "published"]
    labels = ("{}", "stride {}", "{} ln", "law {}")
    named = []
    for row in rows:
        other = [label.format(value) for label, value, own in zip(labels, setting(row), default, strict=True) if value != own]
        if model(row) == "path-svm" and len(other) <= 1:
            named.append((other[0] if other else "none", row))
    named += [(model(row), row) for row in rows if setting(row) == default and model(row) != "path-svm"]
    # Of models over time, the best one stands for all: trade.csv has them.
    named += [(f"law published, {model(row)}", row) for row in rows if setting(row) == published and model(row) in ("no model", "svm")]
    lines = [
        "From GREY, stride 1, fixed ln, law wave, path-svm, counted on a Cortex-M4F:", "",
        "| ablation | specimen accuracy, % (95 % interval) | speed error, % | instructions per frame | instructions per event | flash, bytes |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, row in named:
        accuracy = "–"
        if row["specimen"]:
            accuracy = "{:.1f} ({:.1f}…{:.1f})".format(*(float(row[f"specimen{end}"]) for end in ("", "_low", "_high")))
        cells = [name, accuracy, text(row["speed_error"], ".2f"), *(text(row[f"M4F_{what}"], ",.0f") for what in ("frame", "event", "flash"))]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def points_table(wstac):
    """Returns the recommended points as a table: each budget's choice, and the numbers that one chooses by."""
    columns = []
    for name, core, budget, by in POINTS:
        with tempfile.TemporaryDirectory() as folder:
            said = run(wstac, "trade", "--core", core, "--budget", budget, "--by", by, "-o", folder)
            header, claim = [line.split(",") for line in Path(folder, "claim.csv").read_text().splitlines()]
            price = json.loads(Path(folder, "price.json").read_text())[core]
        row = dict(zip(header, claim, strict=True))
        about = re.search(r"^model +([^:\n]+)", said, re.MULTILINE)

        share = "{:.1f} ({:.1f}…{:.1f})".format(*(float(row[f"specimen{end}"]) for end in ("", "_low", "_high")))
        frame, event = price["features"] + price["trigger"], price["texture"] + price["law"]
        columns.append({
            "": name,
            "budget": f"`{budget}`",
            "decided by": by,
            "format, stride, logarithm, law": f"{row['format']}, {row['stride']}, {row['ln']}, {row['law']}",
            "model": about[1],
            "specimen accuracy, % (95 % interval)": share,
            "speed error, 100 to 200 mm/s, mean; 95th percentile, %": f"{row['speed_error']}; {row['speed_error_p95']}",
            "objects reliable and right, %": row["objects"],
            "frames from first touch to answer": row["latency"],
            "instructions per frame": f"{frame:,}",
            "instructions per event": f"{event:,}",
            "flash; RAM, bytes": f"{price['flash']:,}; {price['ram']:,}",
        })
    lines = ["| " + " | ".join([key, *(column[key] for column in columns)]) + " |" for key in columns[0]]
    lines.insert(1, "| --- |" + " ---: |" * len(columns))
    return "\n".join(lines)


def laws_table(wstac, rows):
    """Returns the laws that budgets choose on each core, for specimens and for other objects."""
    lines = ["| core | for specimens | for objects |", "| --- | --- | --- |"]
    for core in ("M0", "M3", "M4F"):
        cells = []
        for by in ("specimen", "objects"):
            laws = []
            for most in EVENTS:
                done = [wstac, "trade", "--core", core, "--budget", f"{core}<4M,{core}.event<{most}k", "--by", by]
                # Exit code 1: nothing fits.
                said = subprocess.run(done, capture_output=True, text=True, check=False).stdout
                law = re.search(r"^setting .* law (\w+)$", said, re.MULTILINE)
                if law and not (laws and laws[-1].startswith(law[1])):
                    laws.append(f"{law[1]} {1000 * most:,}")
            cells.append(", ".join(laws))
        lines.append(f"| {core} | {cells[0]} | {cells[1]} |")
    default = [row for row in rows if [row[name] for name in (*PARAMETERS[:3], "model")] == ["GREY", "1", "fixed", "none"]]
    objects = ", ".join(f"{row['law']} {float(row['objects']):.1f}" for row in default)
    return "\n".join([*lines, "", f"Of objects, {objects} % are reliable and right (GREY, stride 1, fixed ln)."])


def pages(wstac):
    """Returns the expected text of the pages, by file."""
    with tempfile.TemporaryDirectory() as folder:
        run(wstac, "trade", "--map", "kept", "-o", folder)
        rows = list(csv.DictReader(Path(folder, "trade.csv").read_text().splitlines()))
        picture = Path(folder, "trade.svg").read_text()
    page = between(PAGE.read_text(), "points", points_table(wstac))
    page = between(page, "laws", laws_table(wstac, rows))
    page = between(page, "parameters", parameters_table(rows))
    return {PICTURE: picture, PAGE: page}


def models_are_those_that_were_counted():
    fine = True
    for core, prices in json.loads((TRADE / "prices.json").read_text())["cores"].items():
        for name, price in prices["models"].items():
            file = next(file for file in (MODELS / folder / name for folder in ("path", ".", "tradeoff")) if file.exists())
            if hashlib.sha256(file.read_bytes()).hexdigest() != price["sha256"]:
                fine = False
                print(f"{name}: another file than the one counted on {core}: ci/measure prices --keep counts it")
    return fine


def holds(wstac, name, core, budget, by):
    """Returns whether a point's claims hold: accuracy to the digit, and price within the slack."""
    with tempfile.TemporaryDirectory() as folder:
        said = run(wstac, "trade", "--core", core, "--budget", budget, "--by", by, "-o", folder)
        print(f"{name}, {budget}:")
        print(run(wstac, "trade", "--verify", folder), end="")
        pixels = re.search(r"WSTAC_PIXELS=(\w+)", said)[1]
        model = Path(folder, "model.wsm")
        check = [ROOT / "tests/firmware/prices.py", wstac, "--check", Path(folder, "wstac.toml"), model if model.exists() else "-", pixels, core]
        counted = json.loads(run(sys.executable, *check))
        claimed = json.loads(Path(folder, "price.json").read_text())[core]
        # The claims about a frame and about an event as a whole, and what a board counted of their parts.
        totals = {
            "instructions per frame": ("features", "trigger"), "instructions per event": ("texture", "law"),
            "bytes of flash": ("flash",), "bytes of RAM": ("ram",),
        }
        count_of = {"features": "frame", "texture": "event"}
        fine = True
        for what, parts in totals.items():
            counts = [counted.get(count_of.get(part, part)) for part in parts]
            # Only a choice without a model has no count of texture.
            missing = [part for part, count in zip(parts, counts, strict=True) if count is None and not (part == "texture" and not model.exists())]
            if missing:
                fine = False
                print(f"{core} {what}: no count of {', '.join(missing)}")
                continue
            claim, count = sum(claimed[part] for part in parts), sum(count or 0 for count in counts)
            off = claim / count - 1
            fine &= abs(off) <= SLACK
            print(f"{core} {what}: claimed {claim:,}, counted {count:,} ({off:+.2%})")
        if core == "M4F":
            print("M7: runs the M4F's program; the same count")
        return fine


def main():
    match sys.argv[1:]:
        case [wstac] | [wstac, "--pages"]:
            fine = models_are_those_that_were_counted()
            for file, text in pages(wstac).items():
                if file.read_text() != text:
                    fine = False
                    print(f"{file.relative_to(ROOT)} does not show the kept map: ci/trade --write writes it")
            if not sys.argv[2:]:
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
            EXTREMES.write_text(between(EXTREMES.read_text(), "fade", fading.table(wstac), "--fade"))
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
