"""Taxel sums in place of frames, and whiskers whose overlaps a program states."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac
from conftest import GLOBAL, command
from numpy.typing import NDArray

SIZE = (400, 400)


def sums_of(frames: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Returns the sums of the taxels of the published layout: of 80 pixels, 50 are counted, 15 from each side."""
    cut = frames.reshape(len(frames), 5, 80, 5, 80)[:, :, 15:65, :, 15:65]
    return cut.sum(axis=(2, 4), dtype=np.float64)


def answers(pipeline: wstac.Pipeline) -> list[str]:
    """Returns what a finished pipeline has said."""
    said = [*pipeline.contact_ends, *pipeline.slips, *pipeline.motions, *pipeline.lost, pipeline.end]
    return [str(one) for one in said]


def test_sums_give_the_answers_of_their_frames() -> None:
    scene = wstac.simulate("Saw3@150,90deg,seed=7", size=SIZE)
    assert scene.frames is not None
    made: dict[str, Any] = {"size": SIZE, "fps": 30, "config": GLOBAL, "models": "builtin", "motion": True}
    by_frame, by_sums = wstac.Pipeline("GREY", **made), wstac.Pipeline("GREY", **made)
    events = []
    for number, (frame, sums) in enumerate(zip(scene.frames, sums_of(scene.frames))):
        if number in (60, 61):
            by_frame.lose(1), by_sums.lose(1)
            continue
        first = by_frame.push(frame)
        second = by_sums.push_sums(sums if number % 2 else sums.astype(np.uint32).reshape(25))
        assert (first and first.to_dict()) == (second and second.to_dict())
        events += [first] if first else []
        assert by_frame.taxels is not None and by_sums.taxels is not None and by_frame.features is not None
        np.testing.assert_array_equal(by_frame.taxels, by_sums.taxels)
        np.testing.assert_array_equal(by_frame.features, by_sums.features)
    by_frame.finish(), by_sums.finish()
    assert answers(by_frame) == answers(by_sums) and [event.contact for event in events] == ["slide"]


def test_sums_are_recorded_as_sums(tmp_path: Path) -> None:
    scene, file = wstac.simulate("Fla0@100,seed=2", size=SIZE), tmp_path / "a.mcap"
    assert scene.frames is not None
    with wstac.Pipeline("GREY", size=SIZE, fps=30, config=GLOBAL, timed=True, record=file) as pipeline:
        timed = enumerate(sums_of(scene.frames))
        events = [event for number, sums in timed if (event := pipeline.push_sums(sums, number * 33_333_333))]
        with pytest.raises(wstac.Error, match="a frame in a pipeline of sums, expected a pipeline for either"):
            pipeline.push(scene.frames[0], 0)
    found = wstac.read(file)
    assert found.frames is None and found.end.frames == len(scene.frames)
    np.testing.assert_array_equal(found.taxels, scene.taxels)
    assert [event.to_dict() for event in found.events] == [event.to_dict() for event in events]
    printed = [line for line in command("run", str(file), "--json") if line["kind"] == "event"]
    assert [event["frame"] for event in printed] == [event.frame for event in events] and len(events) == 1


def test_what_are_no_sums_is_refused() -> None:
    pipeline = wstac.Pipeline("GREY", size=(400, 400), fps=30)
    good = np.full(25, 1000)
    pipeline.push_sums(good)
    for wrong, said in [
        (np.full(24, 1000), r"sums: int64 \(24,\), expected numbers of shape \(25,\) or \(5, 5\)"),
        (np.full((2, 25), 1000), r"sums: int64 \(2, 25\)"),
        (np.full(25, True), r"sums: bool \(25,\)"),
        (np.full(25, np.nan), "row 1, column 1 is NaN, expected a whole number from 0 to 637500"),
        (np.where(np.arange(25) == 7, -1, 1000), "row 2, column 3 is -1, expected a whole number"),
        (np.full(25, 637501), "row 1, column 1 is 637501, expected"),
        (np.full(25, np.inf), "is inf, expected"),
        (np.full(25, 0.5), "is 0.5, expected a whole number"),
        (np.ma.masked_array(good, mask=good > 0), "sums: a masked array"),
    ]:
        with pytest.raises(wstac.Error, match=said):
            pipeline.push_sums(wrong)
    with pytest.raises(TypeError, match="sums is a list, expected a NumPy array"):
        pipeline.push_sums([1000] * 25)  # type: ignore[arg-type]
    with pytest.raises(wstac.Error, match="frame: has a time_ns, expected timed=True for it"):
        pipeline.push_sums(good, 1)
    pipeline.push_sums(np.full(25, 637500))
    assert pipeline.next_frame == 2
    with pytest.raises(wstac.Error, match="a frame in a pipeline of sums"):
        pipeline.push(np.zeros((400, 400), np.uint8))
    of_frames = wstac.Pipeline(fps=30)
    with pytest.raises(wstac.Error, match="sums: format or size is not given, expected both"):
        of_frames.push_sums(good)
    of_frames.push(np.zeros((400, 400), np.uint8))
    with pytest.raises(wstac.Error, match="sums in a pipeline of frames, expected a pipeline for either"):
        of_frames.push_sums(good)


LIMIT = """
import os, pathlib, resource, sys, numpy.ma, wstac
file, good = pathlib.Path(sys.argv[1]), numpy.full(25, 1000)
pipeline = wstac.Pipeline("GREY", size=(400, 400), fps=30, record=file)
limit = resource.getrlimit(resource.RLIMIT_NOFILE)
free = os.dup(0)
os.close(free)
# No other file can be open.
resource.setrlimit(resource.RLIMIT_NOFILE, (free, limit[1]))
for _ in range(2):
    try:
        pipeline.push_sums(good)
    except wstac.Error as error:
        print(pipeline.next_frame, file.exists(), error)
resource.setrlimit(resource.RLIMIT_NOFILE, limit)
pipeline.push_sums(good)
pipeline.finish()
found = wstac.read(file)
print(found.end.frames, found.taxels.shape)
"""


def test_a_recording_of_sums_begins_with_them(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    made: dict[str, Any] = {"size": SIZE, "fps": 30, "record": file}
    # Nothing is left of a pipeline without frames.
    pipeline = wstac.Pipeline("GREY", **made)
    assert file.exists()
    del pipeline
    assert not file.exists()
    # What was lost before says neither frames nor sums.
    with wstac.Pipeline("GREY", **made) as pipeline:
        pipeline.lose(3)
        pipeline.push_sums(np.full(25, 1000))
        with pytest.raises(wstac.Error, match="a frame in a pipeline of sums"):
            pipeline.push(np.zeros(SIZE, np.uint8))
    found = wstac.read(file)
    assert found.frames is None and found.frame_numbers.tolist() == [3]
    assert found.end == pipeline.end and found.lost == pipeline.lost == [wstac.Lost(0, 3, "reported lost")]


def test_a_recording_that_cannot_begin_begins_with_a_later_frame(tmp_path: Path) -> None:
    run = [sys.executable, "-c", LIMIT, str(tmp_path / "a.mcap")]
    done = subprocess.run(run, check=True, capture_output=True, text=True)
    *refused, end = done.stdout.splitlines()
    assert len(refused) == 2 and all(line.startswith("0 False ") and "a.mcap" in line for line in refused), done.stdout
    assert end == "1 (1, 5, 5)"


def pressed(skin: wstac.Skin, depth: float, frames: int = 150) -> list[NDArray[np.float64]]:
    """Presses a plate on for 0.2 s after 2 s, in steps of 1 ms, and returns the light of so many frames."""
    lights: list[NDArray[np.float64]] = []
    step = 0
    while len(lights) < frames:
        moment = step * 1e-3 - 2
        overlap = np.full(25, min(moment, 0.3 - moment) / 0.05 * depth).clip(-1, depth) - skin.whiskers[:, 2]
        light = skin.step(overlap, 0.0, 1e-3)
        step += 1
        if light is not None:
            lights.append(light)
    return lights


def test_a_skin_gives_light_and_its_sums_an_answer() -> None:
    skin = wstac.Skin({"seed": 4, "sensor": {"fps": 60, "size": [640, 480], "format": "Y10"}})
    assert (skin.fps, skin.length_mm, skin.whiskers.shape) == (60.0, 5.0, (25, 3))
    assert skin.whiskers[0].round(3).tolist() == [-8.0, 8.0, 1.489] and not skin.whiskers.flags.writeable
    pipeline = skin.pipeline(motion=True)
    lights = pressed(skin, 3.0, 300)
    events = [event for light in lights if (event := pipeline.push_sums(skin.sums(light)))]
    pipeline.finish()
    assert [event.contact for event in events] == ["press"] and pipeline.end is not None and pipeline.end.frames == 150
    middle = np.array(lights)[:, 12]
    # Dark, the press, dark again, and the release.
    flash = middle[120:130].max()
    assert middle[:120].max() == 0 and middle[134] < flash / 10 and middle[135:144].max() > flash > 0.05
    # Without noise, seeds do not count; another unit is another sensor.
    quiet, other = wstac.Skin({"noise": 0}), wstac.Skin({"noise": 0, "seed": 9})
    np.testing.assert_array_equal(pressed(quiet, 2.0), pressed(other, 2.0))
    assert not np.allclose(pressed(wstac.Skin(), 2.0), pressed(wstac.Skin({"light": {"unit": 1}}), 2.0))


def test_a_skin_without_light_is_dark_and_rubbing_is_bright() -> None:
    skin, far = wstac.Skin({"noise": 0}), np.full((5, 5), -1)
    assert sum(light is not None for light in (skin.step(far, 0.0, 1e-3) for _ in range(1000))) == 30
    dark = skin.sums(np.zeros(25))
    assert dark.dtype == np.uint32 and len(set(dark.tolist())) == 1
    for speeds in (50.0, np.full(25, 50.0), np.float32(50), np.array(50), np.int16(50)):
        rubbed = wstac.Skin({"noise": 0})
        lights = [light for _ in range(600) if (light := rubbed.step(np.full(25, 2.0), speeds, 1e-3)) is not None]
        assert lights[-1].min() > 1e-3
        assert (rubbed.sums(lights[-1]) > dark).all()


def test_the_readout_of_a_skin_is_zero_unless_it_is_given() -> None:
    skin = wstac.Skin()
    held = np.full(25, 1000)
    for config, readout in [
        (None, 0.0),
        ({}, 0.0),
        ("[trigger]\nwindow = 7", 0.0),
        (wstac.Config({"trigger": {"window": 7}}), 0.0),
        ({"sensor": {"readout_ms": 12}}, 12.0),
    ]:
        pipeline = skin.pipeline(config=config)
        pipeline.push_sums(held)
        pipeline.finish()
        assert pipeline.end is not None and pipeline.end.readout_ms == readout, config


def test_what_is_no_step_is_refused() -> None:
    skin, none = wstac.Skin(), np.zeros(25)
    for wrong, said in [
        ((np.full(25, np.nan), 0.0, 1e-3), "skin: overlap_mm is NaN, expected -10000 to 10000"),
        ((np.zeros(24), 0.0, 1e-3), r"overlap_mm: float64 \(24,\), expected numbers of shape"),
        ((none, -1.0, 1e-3), "rubbing_mm_s is -1, expected 0 to 10000"),
        ((none, np.full(25, np.inf), 1e-3), "rubbing_mm_s is inf"),
        ((none, 0.0, 0.0), "seconds is 0, expected above 0 and at most 0.033333"),
        ((none, 0.0, 0.05), "seconds is 0.05"),
    ]:
        with pytest.raises(wstac.Error, match=said):
            skin.step(*wrong)
    for speed in (True, "fast", None):
        with pytest.raises(TypeError, match=f"rubbing_mm_s is a {type(speed).__name__}, expected a NumPy array"):
            skin.step(none, speed, 1e-3)  # type: ignore[arg-type]
    with pytest.raises(wstac.Error, match="light: a number is not 0 to 1e6"):
        skin.sums(np.full(25, -0.1))
    for scene, said in [
        ({"specimen": "Saw3"}, "specimen is there; leave it out"),
        ({"sensor": {"auto_exposure": True}}, r"\[sensor\] auto_exposure is true, expected false for a skin"),
        ({"sensor": {"readout_ms": 10}}, r"\[sensor\] readout_ms is 10, expected 0 for a skin"),
        ({"sensor": {"format": "YUYV"}}, "format is YUYV, expected one that stores green"),
        ({"whisker": {"length_mm": 0}}, "length_mm is 0"),
    ]:
        with pytest.raises(wstac.Error, match=said):
            wstac.Skin(scene)


def test_without_mujoco_its_module_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match=r"mujoco: is not installed\nhelp: pip install wstac\[mujoco\]"):
        import wstac.mujoco  # noqa: F401
