"""Tests the package on the golden vectors of the independent reference, case by case, from bytes."""

from __future__ import annotations

import json
from typing import Any, Optional

import numpy as np
import pytest
import wstac
from conftest import REPOSITORY

GOLDEN = REPOSITORY / "tests" / "golden"
CASES: list[dict[str, Any]] = json.loads((GOLDEN / "manifest.json").read_text())["cases"]
EXPECTED: dict[str, dict[str, Any]] = json.loads((GOLDEN / "expected.json").read_text())
FRAMES = np.fromfile(GOLDEN / "frames.raw", np.uint8)
CODES = {
    "RGB24": "RGB3",
    "BGR24": "BGR3",
    "RGBX32": "XB24",
    "BGRX32": "XR24",
    "XRGB32": "BX24",
    "XBGR32": "RX24",
    "RGB565": "RGBP",
    "YUV422P": "422P",
    "YUV444P": "444P",
    "BGGR8": "BA81",
    "RGGB10": "RG10",
    "GRBG10": "BA10",
    "GBRG10": "GB10",
    "BGGR10": "BG10",
    "RGGB12": "RG12",
    "GRBG12": "BA12",
    "GBRG12": "GB12",
    "BGGR12": "BG12",
}
"""Four-character codes, where the manifest has another name."""
UNIT = 1
"""Most that a feature may differ from the reference's, as everywhere: SPEC's bound of the logarithm."""


def config(case: dict[str, Any]) -> wstac.Config:
    speed, trigger = dict(case["speed"]), dict(case["trigger"])
    if trigger.pop("per_touch", False):
        # The law with one event per touch. Its speeds are compared elsewhere.
        speed["law"] = "arrival"
    return wstac.Config(
        {
            "layout": case["layout"],
            "green": {"yuv": case["yuv"], "stride": case["stride"]},
            "features": {"floor_levels": case["floor_levels"]},
            "trigger": trigger,
            "speed": speed,
        }
    )


def check_event(event: wstac.Event, expected: dict[str, Any]) -> None:
    assert (event.frame, event.frames, event.frames_filled) == (expected["frame"], 70, expected["frames_filled"])
    check_sample(event, expected)
    if event.contact is not None:
        assert [event.touch_frame, event.end_frame] == expected["touch"]
        return
    assert (event.reliable, event.duration_frames) == (expected["reliable"], expected["duration_frames"])
    speed = expected["speed"]
    assert (event.speed is None) == (speed["mm_s"] is None), event.why
    if event.speed:
        # Printed to one decimal, or four digits.
        assert event.speed.mm_s == pytest.approx(speed["mm_s"], abs=0.051, rel=5.1e-4)
        assert event.speed.extrapolated == speed["extrapolated"]
    assert event.direction.deg == expected["direction"]["deg"], event


def check_sample(event: wstac.Event, expected: dict[str, Any]) -> None:
    if "sample" in expected:
        off = np.abs(event.sample.astype(int) - np.array(expected["sample"]))
        assert event.sample.shape == (10, 70) and off.max() <= UNIT


@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_case(case: dict[str, Any]) -> None:
    expected = EXPECTED[case["name"]]
    shape = (case["frames"], case["frame_bytes"])
    raw = FRAMES[case["at"] :][: shape[0] * shape[1]].reshape(shape)
    format = case["format"]
    code = CODES.get(format, format.removesuffix("8") if format[:4] in ("RGGB", "GRBG", "GBRG") else format)
    stream: dict[str, Any] = {
        "format": code,
        "size": (case["width"], case["height"]),
        "fps": f"{case['fps'][0]}/{case['fps'][1]}",
        "bytes_per_row": case["bytes_per_line"],
        "matrix": case["matrix"],
        "range": case["range"],
        "config": config(case),
    }
    pipeline = wstac.Pipeline(**stream)
    features: list[Any] = []
    events: list[wstac.Event] = []

    def take(event: Optional[wstac.Event]) -> None:
        if pipeline.features is not None:
            features.append(pipeline.features)
        if event:
            events.append(event)

    for at in range(case["frames"] + 1):
        for _, count in (lost for lost in case["lost"] if lost[0] == at):
            take(pipeline.lose(count))
        if at < case["frames"]:
            take(pipeline.push(raw[at]))
    last = pipeline.finish()
    events += [last] if last else []
    theirs = np.array(expected["features"]).reshape(-1, 10)
    ours = np.array(features).reshape(-1, 10)
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).max(initial=0) <= UNIT
    end = pipeline.end
    assert end is not None and (end.frames, end.dropped) == (expected["end"]["frames"], expected["end"]["dropped"])
    if not case["lost"]:
        assert np.array_equal(wstac.features(raw, **stream), ours), "all at once and one by one"
    # Only if the reference says that one unit more or less changes no decision.
    if expected["robust"]:
        assert len(events) == len(expected["events"])
        for event, one in zip(events, expected["events"]):
            check_event(event, one)
        ends = [{"frame": end.frame, "event_frame": end.event_frame} for end in pipeline.contact_ends]
        assert ends == expected.get("contact_ends", [])
