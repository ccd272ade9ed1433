"""Checks the results of guest/doctor.sh: check_doctor.py RESULTS."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

from results import Run, verdict


def report(run: Run) -> dict:
    """Returns the one JSON object that was printed."""
    (only,) = run.records
    return only


def controls(run: Run) -> dict[str, int]:
    """Returns the controls that v4l2-ctl read afterwards."""
    text = (run.directory / f"{run.name}.controls").read_text()
    return {name: int(value) for name, value in re.findall(r"^(\w+): (-?\d+)", text, re.MULTILINE)}


def kinds(found: dict) -> set[str]:
    """Returns the kinds of the verdict."""
    return {finding["kind"] for finding in found["verdict"]}


def of(found: dict, name: str) -> dict:
    """Returns one control of a report."""
    (only,) = (control for control in found["controls"] if control["name"] == name)
    return only


def drifting(run: Run) -> tuple[list[str], str]:
    """An automatic control that is left alone is reported to drift."""
    found = report(run)
    gain, automatic = of(found, "gain"), of(found, "gain_automatic")
    problems = [] if gain["drifts"] and gain["value"] != gain["value_at_end"] else [f"gain does not drift: {gain}"]
    problems += [] if automatic["locked"] is False and automatic["why"] == "left as it was" else [f"{automatic}"]
    problems += [] if {"unlocked", "drifting_control"} <= kinds(found) and not found["healthy"] else [f"verdict {kinds(found)}"]
    problems += [] if controls(run) == {"gain_automatic": 1} else [f"--keep-controls changed {controls(run)}"]
    return problems, f"gain {gain['value']} to {gain['value_at_end']}"


def locked(run: Run) -> tuple[list[str], str]:
    """Everything automatic is off, the rest is as before, and the driver agrees."""
    found = report(run)
    open_ = [f"{control['name']}: {control['why']}" for control in found["controls"] if control["locked"] is False]
    problems = [f"not locked: {open_}"] if open_ else []
    moved = [control for control in found["controls"] if control["drifts"]]
    problems += [f"drifts though locked: {moved}"] if moved else []
    said = {name: of(found, name)["value"] for name in ("gain_automatic", "gain")}
    problems += [] if said == controls(run) and said["gain_automatic"] == 0 else [f"said {said}, v4l2-ctl reads {controls(run)}"]
    camera, rate = found["camera"], found["rate"]
    offered = set(re.findall(r"\[\d+\]: '(.{4})'", (run.directory / "offered").read_text()))
    listed = {mode["fourcc"].ljust(4) for mode in camera["modes"]}
    problems += [] if offered and offered <= listed else [f"formats {sorted(offered - listed)} are not listed"]
    problems += [] if (camera["path"], camera["driver"], camera["format"]) == ("/dev/video0", "vivid", "GREY") else [f"{camera}"]
    # A busy machine is sometimes late, but its mean rate is the camera's.
    problems += [] if abs(rate["measured"] - rate["stated"]) < 0.5 else [f"{rate}"]
    problems += [] if rate["jitter_ms"] >= 0 and rate["longest_ms"] > 30 and rate["frames"] >= 10 else [f"{rate}"]
    problems += [] if {"unlocked", "drifting_control"}.isdisjoint(kinds(found)) else [f"verdict {kinds(found)}"]
    # The pattern does not move and has no noise. This is reported, and no signal is lost in it.
    problems += [] if "frozen" in kinds(found) and found["noise"]["worst_taxel"] == 0 else [f"{found['noise']}"]
    return problems, f"{len(found['controls'])} controls, {rate['measured']} fps, jitter {rate['jitter_ms']} ms"


def set_(run: Run) -> tuple[list[str], str]:
    """A user's values are set after the automatic is off, and stay."""
    now, found = controls(run), report(run)
    problems = [] if now == {"gain_automatic": 0, "gain": 77, "brightness": 140} else [f"v4l2-ctl reads {now}"]
    problems += [] if of(found, "gain")["locked"] and of(found, "brightness")["value"] == 140 else [f"{found['controls']}"]
    return problems, ""


def refused(part: str) -> Callable[[Run], tuple[list[str], str]]:
    """The error names the control and lists the existing ones. The exit code is 2, and standard output is empty."""

    def check(run: Run) -> tuple[list[str], str]:
        problems = [] if run.exit == 2 and not run.stdout else [f"exit code {run.exit}, {run.stdout!r}"]
        problems += [] if part in run.stderr and "brightness 0 to 255" in run.stderr else [run.stderr]
        return problems, part

    return check


def text(run: Run) -> tuple[list[str], str]:
    """The text output has the same content."""
    problems = [part for part in ("/dev/video0", "rate  ", "controls ", "signal ", "To change:") if part not in run.stdout]
    return [f"{problems} missing in {run.stdout!r}"] if problems else [], ""


def run_(run: Run) -> tuple[list[str], str]:
    """Any command that opens the camera locks it, and prints this in its first line."""
    first = run.stderr.splitlines()[0]
    problems = [] if re.search(r"; \d+ controls locked", first) and "NOT" not in first else [first]
    return problems + ([] if controls(run) == {"gain_automatic": 0} else [f"{controls(run)}"]), first


def dropped(run: Run) -> tuple[list[str], str]:
    """Frames that never arrive are counted, and do not make the camera look slower."""
    found = report(run)
    rate, lost = found["rate"], sum(found["rate"]["lost"].values())
    share = lost / (lost + rate["frames"])
    problems = [] if abs(rate["measured"] - rate["stated"]) < 0.5 else [f"{rate}"]
    # A busy machine loses more frames than the driver was set to lose.
    problems += [] if share > 0.15 and "lost" in kinds(found) else [f"{share:.0%} lost: {rate}"]
    return problems, f"{share:.0%} lost, {rate['measured']} fps"


CHECKS = {
    "drifting": drifting, "locked": locked, "set": set_, "text": text, "run": run_, "dropped": dropped,
    "unknown": refused("control exposure is not there"), "range": refused("control gain is 1000, expected 0 to 255"),
}  # fmt: skip

for name, check in CHECKS.items():
    try:
        watched = Run(Path(sys.argv[1]), name)
        watched.name = name
        trouble = watched.crash() if name in ("unknown", "range") else watched.trouble()
        verdict(f"doctor {name}", *((trouble, "") if trouble else check(watched)))
    except Exception as error:  # a broken report must fail one check, and not the rest
        verdict(f"doctor {name}", [f"{type(error).__name__}: {error}"])
