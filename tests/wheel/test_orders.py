"""Tests of the orders that a stream takes while it is read, of files at their own rate, and of boards."""

from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import wstac

SCENE = "scene:Saw3@150,90deg"


def test_a_recording_has_labels_and_all_frames_behind_the_order(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    stream = wstac.open(SCENE, size=(400, 400))
    frames = stream.frames(pictures=True)
    first = [next(frames).number for _ in range(5)]
    with pytest.raises(wstac.Error, match="no recording in progress"):
        stream.stop_recording()
    stream.start_recording(file, {"specimen": "Saw3"})
    assert stream.is_recording
    for order in (stream.restart_baseline, lambda: stream.reconfigure({}), lambda: stream.use_models("builtin")):
        with pytest.raises(wstac.Error, match="recording in progress; stop it first"):
            order()
    kept = [next(frames) for _ in range(60)]
    assert stream.stop_recording() == 60 and not stream.is_recording
    recording = wstac.read(file)
    assert first == [0, 1, 2, 3, 4] and recording.labels == {"specimen": "Saw3"}
    assert all(np.array_equal(one, frame.picture) for one, frame in zip(recording.frames, kept, strict=True))
    with pytest.raises(wstac.Error, match="a.mcap"):
        stream.start_recording(file)
    with pytest.raises(wstac.Error, match="speed"):
        stream.start_recording(tmp_path / "b.mcap", {"speed": "fast"})
    assert not (tmp_path / "b.mcap").exists()


def test_close_ends_a_recording_as_a_whole(tmp_path: Path) -> None:
    with wstac.open(SCENE, size=(400, 400)) as stream:
        stream.start_recording(tmp_path / "a.mcap", features_only=True)
        frames = stream.frames()
        for _ in range(40):
            next(frames)
    assert stream.stop_recording() == 40
    assert len(wstac.read(tmp_path / "a.mcap").features) == 40
    with pytest.raises(wstac.Error, match="has ended"):
        stream.restart_baseline()


def test_a_configuration_and_a_model_are_used_from_then_on() -> None:
    stream = wstac.open(SCENE)
    stream.reconfigure({"trigger": {"window": 7}})
    assert stream.config == wstac.Config({"trigger": {"window": 7}})
    with pytest.raises(wstac.Error, match="expected 1 to 70"):
        stream.reconfigure({"trigger": {"window": 71}})
    stream.use_models("builtin")
    [event] = stream
    assert event.texture is not None and event.texture.specimen == "Saw3"


def test_an_order_waits_for_no_frame_of_another_thread() -> None:
    stream = wstac.open(SCENE, paced=True)
    seen: list[float] = []

    def read() -> None:
        seen.extend(time.monotonic() for _ in stream.frames())

    reader, begun = threading.Thread(target=read), time.monotonic()
    reader.start()
    waits = []
    for _ in range(20):
        before = time.monotonic()
        stream.restart_baseline()
        waits.append(time.monotonic() - before)
        time.sleep(0.01)
    reader.join()
    # 140 frames at their own rate take 4.6 s, however fast they can be read.
    assert len(seen) == 140 and seen[-1] - begun > 4.5
    assert max(waits) < 1, waits


def test_what_follows_the_last_frame_comes_from_records() -> None:
    frames = list(wstac.open(SCENE).frames())
    stream = wstac.open(SCENE)
    assert len(list(stream.frames())) == len(frames)
    assert [type(record) for record in stream.records()] == [wstac.End]
    assert stream.end is not None and stream.end.frames == len(frames)


def test_frames_have_the_sums_of_their_taxels() -> None:
    for frame in wstac.open(SCENE).frames():
        assert frame.sums.shape == (5, 5) and frame.sums.dtype == np.uint32 and frame.stamp is None
        assert (frame.sums > 0).all() or (frame.taxels == 0).any()
        brightest = np.unravel_index(frame.taxels.argmax(), (5, 5))
        assert frame.sums[brightest] == frame.sums.max()


def test_a_board_that_says_nothing_is_none_and_follows_no_option() -> None:
    with pytest.raises(wstac.Error, match="finds events itself; leave config out"):
        wstac.open("tcp:127.0.0.1:1", config={})
    with pytest.raises(wstac.Error, match="is no board; leave baud out"):
        wstac.open(SCENE, baud=115_200)
    with pytest.raises(wstac.Error, match="tcp:127.0.0.1:1"):
        wstac.open("tcp:127.0.0.1:1")
    with socket.create_server(("127.0.0.1", 0)) as server:
        stream = wstac.open(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        with pytest.raises(wstac.Error, match="wstac board changes its settings"):
            stream.restart_baseline()
        assert (stream.format, stream.size, stream.ros_encoding) == ("", (0, 0), None)
        server.accept()[0].close()
        with pytest.raises(wstac.Error, match="expected those of a board"):
            list(stream.frames())
