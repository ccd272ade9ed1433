"""Frames as they come: taxels, features and events, also in asyncio; rows for tables, copies and figures."""

from __future__ import annotations

import asyncio
import copy
import os
import pickle
import subprocess
import threading
import time
from pathlib import Path
from typing import Any

import matplotlib.pyplot
import numpy as np
import pandas
import pytest
import wstac
from conftest import WSTAC
from sklearn.base import clone
from sklearn.pipeline import make_pipeline

matplotlib.use("Agg")
SCENE = "scene:Saw3@150,90deg"


@pytest.fixture(scope="module")
def whole() -> wstac.Recording:
    return wstac.read(SCENE)


def test_version() -> None:
    said = subprocess.run([WSTAC, "--version"], check=True, capture_output=True, text=True).stdout
    assert said == f"wstac {wstac.__version__}\n"


def test_frames_are_those_of_the_recording(whole: wstac.Recording) -> None:
    with wstac.open(SCENE) as stream:
        frames = list(stream.frames(pictures=True))
        assert stream.end == whole.end and stream.contact_ends == whole.contact_ends
    assert [frame.number for frame in frames] == whole.frame_numbers.tolist()
    assert [frame.timestamp for frame in frames] == whole.timestamps.tolist()
    assert np.array_equal([frame.taxels for frame in frames], whole.taxels)
    assert np.array_equal([frame.features for frame in frames], whole.features)
    assert [frame.feature_frame for frame in frames] == whole.feature_frames.tolist()
    assert whole.frames is not None and np.array_equal(np.stack([frame.picture for frame in frames]), whole.frames)
    assert [frame.event for frame in frames if frame.event] == whole.events
    # Those without pictures cost none.
    assert all(frame.picture is None for frame in wstac.open(SCENE).frames())


def test_records_and_frames_take_turns(whole: wstac.Recording) -> None:
    stream = wstac.open(SCENE)
    first = next(stream.frames())
    assert first.number == 0
    # Events of frames that nobody took come as records.
    assert next(stream) == whole.events[0]
    rest = list(stream.frames())
    assert rest[0].number == whole.events[0].frame + 70 and rest[-1].number == whole.frame_numbers[-1]


def test_a_failure_comes_after_all_records(tmp_path: Path) -> None:
    file = tmp_path / "a.y4m"
    subprocess.run([WSTAC, "scene", "render", "Saw3@150", "-o", file], check=True, capture_output=True)
    file.write_bytes(file.read_bytes()[:-100])
    frames = []
    with pytest.raises(wstac.Error, match="a.y4m"):
        for frame in wstac.open(file).frames():
            frames.append(frame)
    assert sum(frame.event is not None for frame in frames) == 1


async def gathered(source: Any) -> list[Any]:
    return [item async for item in source]


def test_asyncio_gives_the_same(whole: wstac.Recording) -> None:
    assert asyncio.run(gathered(wstac.open(SCENE))) == whole.events
    kinds = [type(record) for record in asyncio.run(gathered(wstac.open(SCENE).arecords()))]
    assert kinds == [type(record) for record in wstac.open(SCENE).records()]
    assert len(asyncio.run(gathered(wstac.open(SCENE).aframes()))) == len(whole.frame_numbers)

    async def both() -> list[list[Any]]:
        return await asyncio.gather(gathered(wstac.open(SCENE)), gathered(wstac.open("scene:Tri3@120")))

    assert [len(events) for events in asyncio.run(both())] == [1, 1]


def test_a_task_that_is_cancelled_leaves_no_thread(tmp_path: Path) -> None:
    """A pipe that gives nothing is like a camera without frames."""
    pipe = tmp_path / "pipe.y4m"
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.open("wb").write(b"YUV4MPEG2 W40 H40 F30:1 Cmono\n" + (b"FRAME\n" + bytes(1600)) * 2))
    writer.start()

    async def main() -> None:
        with wstac.open(pipe) as stream, pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(gathered(stream.arecords()), 0.5)

    held = os.open(pipe, os.O_RDWR)
    try:
        begun = time.monotonic()
        asyncio.run(main())
        assert time.monotonic() - begun < 20
    finally:
        os.close(held)
        writer.join()


def test_rows_for_pandas() -> None:
    scene = {"touch": [{"kind": "press"}], "fidelity": "taxel"}
    events = [*wstac.open(SCENE, models="builtin:path-svm"), *wstac.simulate(scene).events]
    table = pandas.DataFrame(event.to_dict() for event in events)
    assert table["contact"].tolist() == ["slide", "press"]
    assert table["speed_mm_s"][0] == events[0].speed.mm_s and np.isnan(table["speed_mm_s"][1])
    assert table["specimen"][0] == "Saw3" and pandas.isna(table["specimen"][1]) and "does not slide" in table["why_speed"][1]
    motions = wstac.open(SCENE, motion=True)
    list(motions)
    rows = pandas.DataFrame(motion.to_dict() for motion in motions.motions)
    assert len(rows) > 10 and rows["speed_mm_s"].between(100, 200).all()
    assert [end.to_dict()["frame"] for end in motions.contact_ends] == [end.frame for end in motions.contact_ends]


def test_copies_and_pickles(whole: wstac.Recording) -> None:
    for make in (copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))):
        again = make(whole)
        assert again.events == whole.events and again.config == whole.config and again.end == whole.end
        assert np.array_equal(again.features, whole.features) and np.array_equal(again.events[0].sample, whole.events[0].sample)
        assert make(wstac.EventSamples(input="frames")).input == "frames"
    frame = next(wstac.open(SCENE).frames())
    assert np.array_equal(pickle.loads(pickle.dumps(frame)).features, frame.features)


def test_events_are_the_first_step_of_a_pipeline() -> None:
    events = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
    samples = clone(wstac.EventSamples(input="taxel-path"))
    model = make_pipeline(samples, wstac.Model.load("builtin:taxel-path-svm"))
    assert model.predict(events).tolist() == ["Saw3"]
    with pytest.raises(wstac.Error, match="event 0 has no path_sample"):
        wstac.EventSamples().transform(wstac.open(SCENE))
    with pytest.raises(TypeError, match="element 0 is a str"):
        wstac.EventSamples().transform(["Saw3"])
    with pytest.raises(wstac.Error, match="input is 'x', expected path, taxel-path, frames"):
        wstac.EventSamples(input="x").transform(events)
    assert wstac.EventSamples().transform([]).shape == (0, 700)


def test_figures_draw_on_given_axes(whole: wstac.Recording) -> None:
    figure, axes = matplotlib.pyplot.subplots(2)
    assert wstac.plot_event(whole.events[0], axes[0]) is axes[0]
    assert wstac.plot_features(whole, ax=axes[1]) is axes[1]
    with pytest.raises(TypeError, match="found ndarray, expected wstac.Recording"):
        wstac.plot_features(whole.features)  # type: ignore[arg-type]
    drawn = axes[1].get_lines()[3]
    assert drawn.get_label() == "r4" and np.allclose(drawn.get_ydata(), whole.features[:, 3] / 2048)
    figure.canvas.draw()
