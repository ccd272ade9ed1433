"""What is left of each answer as the light of simulated slides fades: the table of docs/EXTREMES.md."""

import json
import subprocess
import tempfile
from pathlib import Path

# Peak light in gray levels of 255, and that of the slide Saw3@150 with the simulator's own light.
LEVELS, OWN = (200, 100, 50, 20, 10, 5, 2, 1), 60
SPECIMENS = ("Fla0", *(f"{pattern}{depth}" for pattern in ("Sin", "Saw", "Tri") for depth in (2, 3, 4)))
MODELS = ("path-svm", "taxel-path-svm")
SLIDES = 40


def event(wstac, folder, number, level, model):
    """Returns the true speed, direction and specimen of a slide, and its first event, or None."""
    specimen, degrees, speed = SPECIMENS[number % 10], 90 * (number // 10), 50 + 25 * (number * 3 % 11)
    light = level / OWN
    scene = Path(folder, "scene.toml")
    scene.write_text(
        f'specimen = "{specimen}"\nspeed = {speed}\ndirection = {degrees}\nseed = {number}\n'
        f"[light]\nunit = {3000 + number}\nflash_ms = {11 * light}\nrubbing_ms = {0.01 * light}\n[sensor]\nsize = [400, 400]\n"
    )
    command = [wstac, "run", f"scene:{scene}", "--json", "--model", f"builtin:{model}"]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    events = (record for record in map(json.loads, lines) if record["kind"] == "event")
    return speed, degrees, specimen, next(events, None)


def column(wstac, folder, level):
    """Returns the cells of one level of light."""
    cells = {}
    for model in MODELS:
        found = [event(wstac, folder, number, level, model) for number in range(SLIDES)]
        named = sum((event or {}).get("texture", {}).get("specimen") == specimen for *_, specimen, event in found)
        cells[f"specimen is right, {model}, %"] = f"{100 * named / SLIDES:.0f}"
    speeds = [abs(event["speed"]["mm_s"] / speed - 1) for speed, _, _, event in found if event and event.get("speed")]
    near = sum(
        abs((event["direction"]["deg"] - degrees + 180) % 360 - 180) <= 5
        for _, degrees, _, event in found if event and event.get("direction")
    )
    return {
        "slide has an event, %": f"{100 * sum(event is not None for *_, event in found) / SLIDES:.0f}",
        "direction is right within 5°, %": f"{100 * near / SLIDES:.0f}",
        "slide has a speed, %": f"{100 * len(speeds) / SLIDES:.0f}",
        "mean error of these speeds, %": f"{100 * sum(speeds) / len(speeds):.1f}" if speeds else "–",
        **cells,
    }


def table(wstac):
    """Returns the table: a line for each answer, a column for each level of light."""
    with tempfile.TemporaryDirectory() as folder:
        columns = [column(wstac, folder, level) for level in LEVELS]
    head = ["| peak light, gray levels | " + " | ".join(map(str, LEVELS)) + " |", "| --- |" + " ---: |" * len(LEVELS)]
    return "\n".join([*head, *(f"| {name} | " + " | ".join(cells[name] for cells in columns) + " |" for name in columns[0])])
