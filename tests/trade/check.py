#!/usr/bin/env python3
"""Checks the map of `wstac trade`: the claim of a budget's choice must be found again, and its price is counted.

    check.py WSTAC            checks the three recommended points, and that the pages show the kept map
    check.py WSTAC --pages    checks only that the pages show the kept map, and that its models are those that were counted
    check.py WSTAC --write    writes the kept map's pages: docs/TRADE.md and docs/plots/trade.svg
    check.py WSTAC --sweep    sweeps, and keeps the map; then the command must be built again
    check.py WSTAC --times    times the settings of the kept map on this machine anew; then the command must be built again
    check.py WSTAC --fade     lets the light fade, and writes the tables of that in docs/EXTREMES.md
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

ROOT = Path(__file__).resolve().parents[2]
TRADE = ROOT / "wstac-tradeoff/data"
MODELS = ROOT / "wstac-host/models"
EXTREMES = ROOT / "docs/EXTREMES.md"
PICTURE, PAGE = ROOT / "docs/plots/trade.svg", ROOT / "docs/TRADE.md"
# Name, core, and budget.
POINTS = (
    ("smallest", "M0", "M0<160k,flash<36K"),
    ("balanced", "M4F", "M4F<60k,M4F.event<90k"),
    ("most accurate", "M4F", "M4F<2M"),
)
# The models that are tested in fading light with the default setting. All other settings are tested with the first of
# them.
FADING = ("svm", "svm-20f", "ovr", "forest", "boosted")
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


def merged(tables):
    """Returns tables of settings in which a row names what differs from the first setting, and equal rows are one."""
    first, lines, rows = None, [], {}
    for line in [*tables.strip().splitlines(), ""]:
        name, _, cells = line.strip("| ").partition(" | ")
        if not line.startswith("| ") or name in ("---", "peak light, gray levels"):
            lines += [f"| {', '.join(names)} | {cells} |" for cells, names in rows.items()]
            rows = {}
            lines.append(line)
            continue
        parts = name.split(", ")
        first = first or parts
        other = [part for part, common in zip(parts, first, strict=True) if part != common]
        rows.setdefault(cells.replace(" (0)", ""), []).append(", ".join(other) or "default")
    return "\n".join([f"The default is {', '.join(first)}; a row names what differs.", "", *lines])


def points_table(wstac):
    """Returns the recommended points as a table: each budget's choice, and the numbers that one chooses by."""
    columns = []
    for name, core, budget in POINTS:
        with tempfile.TemporaryDirectory() as folder:
            said = run(wstac, "trade", "--core", core, "--budget", budget, "-o", folder)
            header, claim = [line.split(",") for line in Path(folder, "claim.csv").read_text().splitlines()]
            price = json.loads(Path(folder, "price.json").read_text())[core]
        row = dict(zip(header, claim, strict=True))
        about = re.search(r"^model +([^:\n]+)(?:: (.+))?$", said, re.MULTILINE)

        share = "{:.1f} ({:.1f} … {:.1f})".format(*(float(row[f"specimen{end}"]) for end in ("", "_low", "_high")))
        frame, event = price["features"] + price["trigger"], price["texture"] + price["law"]
        columns.append({
            "": name,
            "budget": f"`{budget}`",
            "format, stride, logarithm, law": f"{row['format']}, {row['stride']}, {row['ln']}, {row['law']}",
            "model": about[1],
            "what it is": about[2] or "–",
            "specimen accuracy, % (95 % interval)": share,
            "speed error, 100 to 200 mm/s, mean; 95th percentile, %": f"{row['speed_error']}; {row['speed_error_p95']}",
            "frames from first touch to answer": row["latency"],
            "core": f"Cortex-{core}",
            "instructions per frame": f"{frame:,}",
            "instructions per event": f"{event:,}",
            "flash; RAM, bytes": f"{price['flash']:,}; {price['ram']:,}",
        })
    lines = ["| " + " | ".join([key, *(column[key] for column in columns)]) + " |" for key in columns[0]]
    lines.insert(1, "| --- |" + " ---: |" * len(columns))
    return "\n".join(lines)


def pages(wstac):
    """Returns the expected text of the pages, by file."""
    with tempfile.TemporaryDirectory() as folder:
        run(wstac, "trade", "--map", "kept", "-o", folder)
        table, picture = Path(folder, "trade.md").read_text(), Path(folder, "trade.svg").read_text()
    points = points_table(wstac)
    parameters = re.split(r"One (?:knob|parameter) at a time, ", table)[1]
    # Of early models, those of 20 frames stand for those of 30 to 60, and of trees over time the shipped ones: trade.csv has all.
    parameters = "".join(line for line in parameters.splitlines(keepends=True) if not re.search(r"-[3-6]0f \||(?:forest|boosted)-\w", line))
    page = between(PAGE.read_text(), "points", points)
    page = between(page, "parameters", parameters[0].upper() + parameters[1:])
    return {PICTURE: picture, PAGE: page}


def warn_of_times(text):
    """Prints where the host's times cannot be right: a logarithm is a small part of a frame."""
    times = {}
    for row in csv.DictReader(text.splitlines()):
        times.setdefault((row["format"], row["stride"]), {})[row["ln"]] = float(row["host_frame_ns"])
    for (name, stride), of in times.items():
        if max(of.values()) > 1.2 * min(of.values()):
            said = ", ".join(f"{ln} {ns:,.0f}" for ln, ns in of.items())
            print(f"warning: {name}, stride {stride}: {said} ns per frame: the machine was busy, sweep again", file=sys.stderr)


def models_are_those_that_were_counted():
    fine = True
    for core, prices in json.loads((TRADE / "prices.json").read_text())["cores"].items():
        for name, price in prices["models"].items():
            file = next(file for file in (MODELS / folder / name for folder in ("path", ".", "tradeoff")) if file.exists())
            if hashlib.sha256(file.read_bytes()).hexdigest() != price["sha256"]:
                fine = False
                print(f"{name}: another file than the one counted on {core}: ci/measure prices --keep counts it")
    return fine


def holds(wstac, name, core, budget):
    """Returns whether a point's claims hold: accuracy to the digit, and price within the slack."""
    with tempfile.TemporaryDirectory() as folder:
        said = run(wstac, "trade", "--core", core, "--budget", budget, "-o", folder)
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
        case [wstac, "--sweep" | "--times" as what]:
            with tempfile.TemporaryDirectory() as folder:
                again = ["--map", "kept", "--times"] if what == "--times" else []
                subprocess.run([wstac, "trade", *again, "-o", folder], stdout=subprocess.DEVNULL, check=True)
                shutil.copy(Path(folder, "map.csv"), TRADE / "map.csv")
            warn_of_times((TRADE / "map.csv").read_text())
        case [wstac, "--fade"]:
            with tempfile.TemporaryDirectory() as folder:
                models = [word for name in FADING for word in ("--model", f"builtin:{name}")]
                subprocess.run([wstac, "trade", "--fade", "--slides", "2", "--light", "200,100,50,20,10,5,2,1", *models, "-o", folder], stdout=subprocess.DEVNULL, check=True)
                # Events come, and directions fail, as speeds are there or not.
                tables = re.search("Specimen accuracy.*(?=Directions wrong)", Path(folder, "fade.md").read_text(), re.DOTALL)[0]
            EXTREMES.write_text(between(EXTREMES.read_text(), "fade", merged(tables), "--fade"))
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
