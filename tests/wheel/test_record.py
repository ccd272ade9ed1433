"""Recordings of frames that a program pushes, read by the command."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any, Optional

import numpy as np
import pytest
import wstac
from conftest import GLOBAL, WSTAC, command


def slide() -> Any:
    """Returns a scene of one slide."""
    return wstac.simulate("Saw3@150,90deg,seed=7", size=(200, 200))


def test_pushed_frames_are_read_as_they_were_pushed(tmp_path: Path) -> None:
    scene, file = slide(), tmp_path / "a.mcap"
    pictures = np.stack([scene.frames, np.full_like(scene.frames, 128)], axis=-1)
    made = {"fps": 60, "config": GLOBAL, "models": "builtin:svm", "range": "full"}
    labels = {"specimen": "Saw3", "who": "me"}
    with wstac.Pipeline("YUYV", size=(200, 200), record=file, labels=labels, **made) as pipeline:
        events = [event for frame in pictures[:50] if (event := pipeline.push(frame))]
        pipeline.lose(3)
        events += [event for frame in pictures[53:] if (event := pipeline.push(frame))]
    assert pipeline.end is not None and pipeline.end.dropped == 3
    found = wstac.read(file, models="builtin:svm")
    assert (found.format, found.fps, found.labels, found.models) == ("YUYV", 60, labels, ["builtin:svm"])
    np.testing.assert_array_equal(found.frames, np.delete(pictures, slice(50, 53), axis=0))
    assert found.frame_numbers.tolist() == [*range(50), *range(53, len(pictures))]
    assert [event.to_dict() for event in found.events] == [event.to_dict() for event in events]
    with pytest.raises(wstac.Error, match="a.mcap"):
        wstac.Pipeline("YUYV", size=(200, 200), record=file, **made)
    # At once, though the format is not known yet.
    with pytest.raises(wstac.Error, match="a.mcap: exists, expected a new file") as refused:
        wstac.Pipeline(record=file, **made)
    assert refused.value.kind == "already_exists"


def test_a_recording_has_the_answers_of_that_of_the_command(tmp_path: Path) -> None:
    own, theirs, config = (tmp_path / name for name in ("own.mcap", "theirs.mcap", "wstac.toml"))
    config.write_text(GLOBAL)
    sized = ("--size", "200x200", "--config", str(config))
    command("record", "scene:Saw3@150,90deg,seed=7", *sized, "-o", str(theirs), "--json")
    recorded = wstac.read(theirs)
    pipeline = wstac.Pipeline(fps=30, config=recorded.config, record=own)
    for frame in recorded.frames:
        pipeline.push(frame)
    pipeline.finish()
    assert command("run", str(own), "--json") == command("run", str(theirs), "--json")
    drawn = tmp_path / "own.svg"
    subprocess.run([WSTAC, "plot", str(own), "-o", str(drawn)], check=True, capture_output=True)
    assert drawn.stat().st_size > 1000


def test_times_of_frames_are_recorded(tmp_path: Path) -> None:
    scene, file, start = slide(), tmp_path / "a.mcap", 5_000_000_000
    times = [start + 33_400_000 * number for number in range(len(scene.frames))]
    with wstac.Pipeline(fps=30, config=GLOBAL, timed=True, record=file) as pipeline:
        events = [event for frame, at in zip(scene.frames, times) if (event := pipeline.push(frame, at))]
        with pytest.raises(wstac.Error, match="frame: has no time_ns, expected its time with timed=True"):
            pipeline.push(scene.frames[0])
    found = wstac.read(file)
    np.testing.assert_allclose(found.timestamps, np.array(times) / 1e9, rtol=0, atol=1e-9)
    assert found.end.clock == "driver" and found.events[0].time_ns == events[0].time_ns == times[46]
    with pytest.raises(wstac.Error, match="frame: has a time_ns, expected timed=True for it"):
        wstac.Pipeline(fps=30).push(scene.frames[0], 0)


def test_times_that_are_not_those_of_the_rate_are_found(tmp_path: Path) -> None:
    scene = wstac.simulate("Saw3@60,90deg,seed=7", size=(200, 200))

    def pushed(rate: float, record: Optional[Path] = None) -> tuple[wstac.Pipeline, list[wstac.Event]]:
        times = (round(number * 1e9 / rate) for number in range(len(scene.frames)))
        with wstac.Pipeline(fps=30, config=GLOBAL, timed=True, record=record) as pipeline:
            events = [event for frame, at in zip(scene.frames, times) if (event := pipeline.push(frame, at))]
        return pipeline, events

    right, [event] = pushed(30)
    assert event.reliable and event.speed.mm_s == pytest.approx(60, rel=0.02) and not right.faults
    # At 15 frames per second each second one is missing, and the speed is half as much.
    half, [event] = pushed(15)
    assert half.end.dropped == len(scene.frames) - 1 and "are missing" in half.faults[-1].message
    assert event.speed.mm_s == pytest.approx(30, rel=0.02)
    # At 28 and at 60, frames are no whole steps apart.
    for rate in (28, 60):
        other, events = pushed(rate, tmp_path / f"{rate}.mcap")
        assert other.faults[0].fault == "uneven" and events and not any(event.reliable for event in events), rate
        again = wstac.read(tmp_path / f"{rate}.mcap")
        assert [fault.fault for fault in again.faults] == [fault.fault for fault in other.faults]
        assert not any(event.reliable for event in again.events)


def test_times_do_not_go_back() -> None:
    frame = np.zeros((200, 200), np.uint8)
    pipeline = wstac.Pipeline(fps=30, timed=True)
    for number in (0, 1, 2):
        pipeline.push(frame, number * 33_333_333)
    with pytest.raises(ValueError, match="frame 3 is wrong .found 66666665 ns, expected a time above 66666666 ns"):
        pipeline.push(frame, 66_666_665)
    with pytest.raises(ValueError, match="frame 3 is wrong"):
        pipeline.push(frame, 66_666_666)
    # Neither was taken. Four seconds are lost frames.
    assert pipeline.next_frame == 3
    pipeline.push(frame, 4_066_666_666)
    assert [(lost.at, lost.frames) for lost in pipeline.lost] == [(3, 119)] and pipeline.next_frame == 123


def test_what_cannot_be_recorded_is_refused(tmp_path: Path) -> None:
    frame = np.zeros((200, 200), np.uint8)
    with pytest.raises(wstac.Error, match="labels: are those of a recording"):
        wstac.Pipeline(fps=30, labels={"specimen": "Saw3"})
    with pytest.raises(wstac.Error, match='label speed is "fast", expected mm/s'):
        wstac.Pipeline(fps=30, record=tmp_path / "a.mcap", labels={"speed": "fast"}).push(frame)
    with pytest.raises(wstac.Error, match="none/a.mcap"):
        wstac.Pipeline(fps=30, record=tmp_path / "none/a.mcap").push(frame)
    assert not list(tmp_path.iterdir())


FULL = """
import numpy, resource, sys, wstac
resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
pipeline, failed = wstac.Pipeline(fps=30, record=sys.argv[1]), []
for _ in range(600):
    try:
        pipeline.push(numpy.full((200, 200), 9, numpy.uint8))
    except wstac.Error as error:
        failed.append(str(error))
pipeline.finish()
print(len(failed), pipeline.end.frames, *failed)
"""


def test_a_file_that_cannot_grow_is_reported_once_and_answers_go_on(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path / "a.mcap")], check=True, capture_output=True, text=True
    )
    assert done.stdout.startswith("1 600 ") and "a.mcap" in done.stdout, done.stdout
