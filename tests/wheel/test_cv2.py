"""Frames and files of OpenCV give the answers of the simulated slide that they show: the same bits without loss, within 1 % with it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import wstac
from conftest import REPOSITORY

SLIDES = ("Saw3@150,90deg,seed=7", "Fla0@100,25deg,seed=1")
BGR = cv2.COLOR_GRAY2BGR
# The simulated camera has a global shutter, which no video states.
GLOBAL = {"sensor": {"readout_ms": 0}}


@pytest.fixture(scope="module", params=SLIDES)
def slide(request: Any) -> wstac.Recording:
    return wstac.simulate(request.param, size=(640, 480))


def answers(file: str) -> list[wstac.Event]:
    """Returns the events of a video that OpenCV reads."""
    capture = cv2.VideoCapture(file)
    pipeline = wstac.Pipeline(fps=capture.get(cv2.CAP_PROP_FPS), config=GLOBAL)
    events = []
    while True:
        found, frame = capture.read()
        if not found:
            return events
        assert frame.shape == (480, 640, 3) and frame.dtype == np.uint8
        if event := pipeline.push(frame):
            events.append(event)


def near(events: list[wstac.Event], slide: wstac.Recording) -> None:
    """Checks that the events are the slide's, with its speed within 1 % and its direction within a degree."""
    [event], [expected] = events, slide.events
    assert event.contact == expected.contact == "slide"
    assert event.speed and expected.speed and event.direction and expected.direction
    assert event.speed.mm_s == pytest.approx(expected.speed.mm_s, rel=0.01)
    assert abs((event.direction.deg - expected.direction.deg + 180) % 360 - 180) <= 1


def test_bgr_arrays_are_the_gray_ones(slide: wstac.Recording) -> None:
    frames = np.stack([cv2.cvtColor(frame, BGR) for frame in slide.frames])
    assert frames.shape[1:] == (480, 640, 3)
    assert np.array_equal(wstac.features(frames), slide.features)
    # A picture that OpenCV cuts out or turns is no contiguous array.
    turned = frames[:, ::-1, ::-1]
    assert np.array_equal(wstac.features(turned), wstac.features(np.ascontiguousarray(turned)))


@pytest.mark.parametrize(("code", "ending"), [("FFV1", "avi"), ("MJPG", "avi"), ("mp4v", "mp4")])
def test_a_video_capture(slide: wstac.Recording, tmp_path: Path, code: str, ending: str) -> None:
    file = str(tmp_path / f"slide.{ending}")
    writer = cv2.VideoWriter(file, cv2.VideoWriter_fourcc(*code), slide.fps, slide.size)
    for frame in slide.frames:
        writer.write(cv2.cvtColor(frame, BGR))
    writer.release()
    events = answers(file)
    near(events, slide)
    [event] = events
    assert event.speed and event.direction
    # The example says the same.
    example = [sys.executable, REPOSITORY / "wstac-python/examples/opencv.py", file, "0"]
    said = subprocess.run(example, check=True, capture_output=True, text=True).stdout
    assert said == f"{event.time_s} s: slide, {event.speed.mm_s} mm/s, {event.direction.deg} degrees\n"
