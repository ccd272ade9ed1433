"""What comes from outside of the package: signals, names of files, missing files, and arrays that others write to."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import wstac


@pytest.mark.parametrize(
    "call",
    [
        lambda path: wstac.open(path),
        lambda path: wstac.read(path),
        lambda path: wstac.simulate(path + ".toml"),
        lambda path: wstac.Config.read(path),
        lambda path: wstac.Model.load(path),
        lambda path: wstac.Pipeline(fps=30, models=path),
    ],
)
def test_a_missing_file_is_a_file_not_found_error(call, tmp_path) -> None:
    path = str(tmp_path / "none")
    with pytest.raises(FileNotFoundError) as raised:
        call(path)
    assert isinstance(raised.value, wstac.Error) and isinstance(raised.value, ValueError)
    assert raised.value.kind == "not_found" and wstac.Error("other").kind is None
    assert "none" in str(raised.value) and raised.value.errno == 2


def test_a_file_that_is_there_and_wrong_is_no_file_not_found_error(tmp_path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text("a = 1")
    with pytest.raises(wstac.Error) as raised:
        wstac.Config.read(path)
    assert not isinstance(raised.value, FileNotFoundError)


def test_names_of_files_need_not_be_utf_8(tmp_path) -> None:
    folder = os.fsencode(tmp_path)

    def put(ending: bytes, content: bytes) -> bytes:
        name = folder + b"/caf\xe9" + ending
        with open(name, "wb") as file:
            file.write(content)
        return name

    y4m = put(b".y4m", b"YUV4MPEG2 W40 H40 F30:1 Cmono\n" + (b"FRAME\n" + bytes(1600)) * 3)
    config = put(b".toml", b"[trigger]\nwindow = 7\n")
    scene = put(b".scene.toml", b'specimen = "Saw3"\nspeed = 150\nfidelity = "taxel"\n')
    sweep = put(b".sweep.toml", b'specimens = ["Saw3"]\nslides = 2\n')
    model = put(b".wsm", (Path(__file__).parents[2] / "wstac-host/models/svm.wsm").read_bytes())
    for kind in (lambda name: name, os.fsdecode, lambda name: Path(os.fsdecode(name))):
        assert wstac.read(kind(y4m)).end.frames == 3
        assert "window = 7" in wstac.Config.read(kind(config)).toml
        assert wstac.simulate(kind(scene)).events
        assert len(wstac.dataset(kind(sweep))["X"]) == 2
        assert wstac.Model.load(kind(model)).frames == 70
        with pytest.raises(FileNotFoundError):
            wstac.read(kind(folder + b"/none-\xe9.y4m"))


def test_texts_from_outside_are_one_short_line(tmp_path) -> None:
    name = str(tmp_path / "x\x1b]52;c;aGk=\x07\nevent at frame 3")
    with pytest.raises(wstac.Error) as raised:
        wstac.open(name)
    text = str(raised.value)
    assert "\x1b" not in text and "\n" not in text and len(text.encode()) <= 1000
    with pytest.raises(wstac.Error) as raised:
        wstac.Config("[trigger]\n" + "a" * 100_000 + " = 1")
    assert len(str(raised.value).encode()) <= 1000


INTERRUPTED = {
    "open": "wstac.open(pipe)",
    "read": "wstac.read(pipe)",
    "scene": "wstac.simulate(toml)",
    "sweep": "wstac.dataset({'slides': 90000, 'specimens': ['Saw3'], 'scene': {'fidelity': 'rendered'}})",
    "features": "frames = numpy.zeros((5000, 200, 200), 'u1')\n            while True: wstac.features(frames)",
    "predict": "model, samples = wstac.Model.load('builtin:forest'), numpy.zeros((300000, 700), 'i2')\n            while True: model.predict(samples)",
    "stream": "[_ for _ in wstac.open(slow)]",
}


@pytest.mark.parametrize("name", INTERRUPTED)
def test_ctrl_c_is_a_keyboard_interrupt(name, tmp_path) -> None:
    """In a process of its own: whatever it waits for, Ctrl-C ends the wait within a second and some room for a busy machine."""
    os.mkfifo(tmp_path / "pipe")
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "slow.toml").write_text('specimen = "Saw3"\nspeed = 1\nlead_in = 100000\n')
    program = f"""
        import numpy, os, sys, time, wstac
        pipe, toml, slow = {str(tmp_path / "pipe")!r}, {str(tmp_path / "pipe.toml")!r}, {"scene:" + str(tmp_path / "slow.toml")!r}
        print("ready", flush=True)
        try:
            {INTERRUPTED[name]}
        except KeyboardInterrupt:
            sys.exit(77)
        sys.exit(1)
    """
    child = subprocess.Popen([sys.executable, "-c", textwrap.dedent(program)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        assert child.stdout is not None and child.stdout.readline() == b"ready\n"
        time.sleep(1.5 if name in ("features", "predict") else 0.5)
        child.send_signal(signal.SIGINT)
        started = time.monotonic()
        _, said = child.communicate(timeout=20)
        assert child.returncode == 77, said.decode()
        assert time.monotonic() - started < 2.5
    finally:
        child.kill()


def test_arrays_that_another_thread_writes_to_are_copied() -> None:
    """A frame is taken as it was at one moment: while the library computes, another thread writes to the array."""
    frames = np.full((300, 400, 400), 51, np.uint8)
    over = threading.Event()

    def write() -> None:
        while not over.is_set():
            frames[:] = 51

    thread = threading.Thread(target=write)
    thread.start()
    try:
        found = wstac.features(frames)
    finally:
        over.set()
        thread.join()
    assert found.shape == (300, 10) and not found.any()
    # What is given is not changed, and may be read-only.
    frames.flags.writeable = False
    assert not wstac.features(frames).any()
    model = wstac.Model.load("builtin:svm")
    samples = np.zeros((600, 700), np.int16)
    samples.flags.writeable = False
    assert len(model.predict(samples)) == 600


def test_the_lock_is_released_while_it_computes() -> None:
    """Another thread runs meanwhile."""
    counts = [0]
    over = threading.Event()
    frames = np.zeros((2000, 400, 400), np.uint8)

    def count() -> None:
        while not over.is_set():
            counts[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        # A busy machine may run the other thread in few of the calls. With the lock held, it runs once at the end of nearly all.
        many = 0
        for _ in range(200):
            before = counts[0]
            wstac.features(frames)
            many += counts[0] - before >= 3
            if many == 5:
                break
        assert many == 5
    finally:
        over.set()
        thread.join()
