"""Tests of the orders that a stream takes while it is read, of files at their own rate, and of boards."""

from __future__ import annotations

import resource
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


def test_a_full_disk_is_told_before_the_next_recording(tmp_path: Path) -> None:
    scene = tmp_path / "late.toml"
    # Whenever the writer notices that the disk is full, nothing touches the sensor yet.
    scene.write_text('specimen = "Saw3"\nspeed = 150\nlead_in = 100000\n[sensor]\nsize = [400, 400]\n')
    stream = wstac.open(f"scene:{scene}")
    frames = stream.frames()
    stream.start_recording(tmp_path / "a.mcap")
    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, most))
    try:
        while stream.is_recording:
            next(frames)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
    with pytest.raises(wstac.Error, match="a.mcap"):
        stream.start_recording(tmp_path / "b.mcap")
    assert not stream.is_recording and not (tmp_path / "b.mcap").exists()
    stream.start_recording(tmp_path / "b.mcap")
    for _ in range(9):
        next(frames)
    assert stream.end_recording() == (9, "") and stream.end_recording() is None


def test_feature_frames_are_of_the_frames_that_were_added_up(tmp_path: Path) -> None:
    scene = tmp_path / "lost.toml"
    scene.write_text('[[slide]]\nspecimen = "Saw3"\nspeed = 150\n[sensor]\nsize = [200, 200]\ndropped = 0.2\n')
    arrived: dict[int, np.ndarray] = {}
    by_losses = 0
    for frame in wstac.open(f"scene:{scene}", fps=75).frames():
        arrived[frame.number] = frame.sums.astype(np.uint64)
        for one in frame.completed:
            first = min(arrived) + 3 * one.number
            parts = [number for number in range(first, first + 3) if number in arrived]
            whole = sum(arrived[number] for number in parts)
            assert np.array_equal(one.taxel_sums, (6 * whole + len(parts)) // (2 * len(parts)))
            assert one.last_frame == parts[-1]
            by_losses += one.last_frame != frame.number
        own = [one for one in frame.completed if one.last_frame == frame.number]
        assert [one.number for one in own] == ([] if frame.feature_frame is None else [frame.feature_frame])
    assert by_losses > 5


def test_feature_frames_that_losses_at_the_end_complete_follow_the_frames(tmp_path: Path) -> None:
    """A sensor of whose last frames some seeds lose the last one or two."""
    behind = 0
    for seed in range(12):
        scene = tmp_path / f"{seed}.toml"
        slide = '[[slide]]\nspecimen = "Saw3"\nspeed = 400\n'
        scene.write_text(f"seed = {seed}\n{slide}[sensor]\nsize = [200, 200]\ndropped = 0.4\n")
        stream = wstac.open(f"scene:{scene}", fps=75)
        found = [one.number for frame in stream.frames() for one in frame.completed]
        behind += len(stream.completed)
        numbers = found + [one.number for one in stream.completed]
        assert numbers == sorted(set(numbers))
        assert len(numbers) == len(wstac.read(f"scene:{scene}", fps=75).features)
    assert behind > 2


def test_frames_are_added_up_anew_behind_an_order(tmp_path: Path) -> None:
    stream = wstac.open(SCENE, fps=75, size=(400, 400))
    frames = stream.frames()
    for order in (lambda: stream.reconfigure({}), lambda: stream.start_recording(tmp_path / "a.mcap")):
        assert next(frames).completed == []
        order()
        three = [next(frames) for _ in range(3)]
        [one] = three[-1].completed
        assert np.array_equal(one.taxel_sums, sum(frame.sums.astype(np.uint64) for frame in three))


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
    for option in ("every", "keep_controls"):
        with pytest.raises(wstac.Error, match=f"finds events itself; leave {option} out"):
            wstac.open("tcp:127.0.0.1:1", **{option: True})
    with pytest.raises(wstac.Error, match="^tcp:127.0.0.1:1: (?!a board)"):
        wstac.read("tcp:127.0.0.1:1")
    with pytest.raises(wstac.Error, match="is no serial line; leave baud out"):
        wstac.open("tcp:127.0.0.1:1", baud=9600)
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
        with pytest.raises(wstac.Error, match=r"has no messages \(found no bytes, expected those of a board\); help: check "):
            list(stream.frames())
        stream = wstac.open(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        with server.accept()[0] as port:
            port.sendall(b"[    0.000000] Booting Linux\r\n")
        with pytest.raises(wstac.Error, match="found text"):
            list(stream.frames())
