"""Tests wrong arguments of the package. Each is refused with a message, and none causes a panic."""

from __future__ import annotations

import random
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac

GREY = np.zeros((2, 80, 80), np.uint8)
SAMPLE = np.zeros((1, 10, 70), np.int16)
SAMPLES = np.arange(4 * 700, dtype=np.int16).reshape(4, 700)
LABELS = ["a", "b", "a", "b"]
WRONG = [
    (lambda: wstac.open("scene:Saw3@150", model="builtin", models="builtin"), TypeError, "model and models are both given"),
    (lambda: wstac.Pipeline(fps=30, model="builtin", models=["builtin"]), TypeError, "model and models are both given"),
    (lambda: wstac.features([[1, 2]]), TypeError, "frames is a list, expected a NumPy array"),
    (lambda: wstac.features(GREY.astype(float)), wstac.Error, "type float64, expected uint8, or uint16"),
    (lambda: wstac.features(GREY.astype("<u2")), wstac.Error, "expected format = Y10, Y12 or Y16"),
    (lambda: wstac.features(GREY, "YUYV"), wstac.Error, "uint8 (2, 80, 80), expected uint8 (n, height, width, 2) for YUYV"),
    (lambda: wstac.features(GREY, "NV12"), wstac.Error, "format NV12 has planes, expected raw bytes"),
    (lambda: wstac.features(GREY, "XXXX"), wstac.Error, "\"XXXX\""),
    (lambda: wstac.Pipeline(fps=30).push(np.zeros((3, 80, 80), np.uint8)), wstac.Error, "give (height, width, 3)"),
    (lambda: wstac.Pipeline(fps=30, config=__file__), wstac.Error, "TOML line 1"),
    (lambda: wstac.Pipeline(fps=30, config=Path("/dev/null")), wstac.Error, "give wstac.Config.read('/dev/null')"),
    (lambda: wstac.Pipeline(fps=30, config="a/c.toml"), FileNotFoundError, "a/c.toml: no such file"),
    (lambda: wstac.Pipeline(fps=30, config="[trigger]\nwindow"), wstac.Error, "configuration: TOML line 2"),
    (lambda: wstac.simulate({"lead_in": "x"}), wstac.Error, 'scene: lead_in: found "x", expected a whole number'),
    (lambda: wstac.save(None, SAMPLES, "no.wsm"), wstac.Error, 'input: is not given, expected "frames" for X of a data set'),
    (lambda: wstac.save(None, SAMPLE[:, 0], "no.wsm", input="frames"), wstac.Error, "X: shape (1, 70), expected (n, 700)"),
    (lambda: wstac.Pipeline(fps=30, config=3), TypeError, "config is a int, expected a wstac.Config"),
    (lambda: wstac.Pipeline(fps=30, models=None), TypeError, "models is a NoneType, expected a wstac.Model"),
    (lambda: wstac.Pipeline(fps=30, record="x.txt"), wstac.Error, "x.txt: its name ends in .txt, expected .mcap"),
    (lambda: wstac.features(GREY[:, 0], "MJPG", size=(80, 80)), wstac.Error, "format is MJPG, expected pixels"),
    (lambda: wstac.features(GREY[:, 0], "GREY", size=(80, 80)), wstac.Error, "frame has 80 bytes, expected 6400"),
    (lambda: wstac.features(GREY, size=(81, 80)), wstac.Error, "80x80, expected 81x80"),
    (lambda: wstac.features(GREY, size=3), wstac.Error, "size is 3, expected (width, height)"),
    (lambda: wstac.features(GREY, fps=0), wstac.Error, "fps is 0, expected a number above 0"),
    (lambda: wstac.features(GREY, bytes_per_row=79), wstac.Error, "bytes per row are 79, expected at least 80"),
    (lambda: wstac.features(GREY, matrix="bt2020"), wstac.Error, 'matrix is "bt2020", expected "bt601" or "bt709"'),
    (lambda: wstac.Config({"trigger": {"window": None}}), wstac.Error, "configuration: "),
    (lambda: wstac.Config({"layout": object()}), wstac.Error, "expected numbers, text, lists and tables"),
    (lambda: wstac.Pipeline(fps=30).finish(), wstac.Error, "no frame was pushed"),
    (lambda: wstac.Pipeline(fps=30).lose(-1), wstac.Error, "frames is -1"),
    (lambda: wstac.Model.load("builtin:svm").predict(SAMPLE.astype(float)), wstac.Error, "type float64, expected int16"),
    (lambda: wstac.Model.load("builtin:svm").predict(np.ma.masked_array(SAMPLE)), wstac.Error, "X: a masked array"),
    (lambda: wstac.Model.load("builtin:svm").known(SAMPLE), wstac.Error, "builtin:svm: does not tell what is unknown"),
    (lambda: wstac.Model.from_bytes(b"none"), wstac.Error, "expected a model file"),
    (lambda: wstac.dataset({}, input="time"), wstac.Error, 'input is "time", expected "frames", "path", "taxel-path"'),
    (lambda: wstac.TextureClassifier(input="time").fit(SAMPLES, LABELS), wstac.Error, 'input is "time"'),
    (lambda: wstac.TextureClassifier().fit(SAMPLES, LABELS[:3]), wstac.Error, "y: shape (3,), expected (4,)"),
    (lambda: wstac.TextureClassifier().fit(SAMPLES, ["a"] * 4), wstac.Error, "y: one class (a), expected at least 2"),
    (lambda: wstac.TextureClassifier().predict(SAMPLES), ValueError, "is not trained"),
    (lambda: wstac.TextureClassifier().set_params(C=1), wstac.Error, "C: is no parameter, expected input, task, threads"),
    (lambda: wstac.Model(), TypeError, "wstac.Model.load"),
    (lambda: wstac.simulate({"specimen": "Saw3"}), wstac.Error, "scene: speed is missing"),
    (lambda: wstac.open("scene:Saw3@150", controls={"gain": 1}), wstac.Error, "control gain=1 is set, expected only with a camera"),
    (lambda: wstac.read("/dev/null"), wstac.Error, "a camera has no end"),
    (lambda: wstac.read("a\0b"), wstac.Error, "a\\u0000b: file name contained an unexpected NUL byte"),
    (lambda: wstac.dataset("/", input="path"), wstac.Error, "/: is a folder, expected the file of a sweep"),
]


@pytest.mark.parametrize(("call", "error", "words"), WRONG, ids=range(len(WRONG)))
def test_wrong_things_are_refused_with_words(call: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=re.escape(words)):
        call()


def test_model_is_another_name_of_models() -> None:
    scene = {"specimen": "Saw3", "speed": 150, "fidelity": "taxel"}
    expected = wstac.simulate(scene, models="builtin").events[0].texture
    assert expected is not None and wstac.simulate(scene).events[0].texture is None
    assert wstac.simulate(scene, model="builtin").events[0].texture == expected
    assert wstac.simulate(scene, models=[], model=["builtin"]).events[0].texture == expected
    read = wstac.read("scene:Saw3@150", models=(), model="builtin", frames=False).events[0]
    opened = next(wstac.open("scene:Saw3@150", models=[], model="builtin"))
    assert read.texture == opened.texture is not None
    wstac.Pipeline(fps=30, models=[], model="builtin")


def test_a_rate_that_is_not_given_is_said_to_be_assumed() -> None:
    with pytest.warns(UserWarning, match="speeds are those of 30 frames per second") as warned:
        wstac.Pipeline("GREY", size=(400, 400))
    assert [warning.filename for warning in warned] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wstac.Pipeline("GREY", size=(400, 400), fps=30)


def test_a_refused_frame_was_not_taken() -> None:
    pipeline = wstac.Pipeline(fps=30)
    assert (pipeline.next_frame, pipeline.features, pipeline.taxels) == (0, None, None)
    pipeline.push(GREY[0])
    for other in (GREY[0, :40], GREY[0].astype("<u2"), GREY):
        with pytest.raises(wstac.Error):
            pipeline.push(other)
    assert pipeline.next_frame == 1
    assert pipeline.lose(3) is None and pipeline.next_frame == 4
    assert pipeline.features is None and pipeline.taxels is None
    assert pipeline.lost == [wstac.Lost(1, 3, "reported lost")]
    assert pipeline.finish() is None
    end = wstac.End(4, 3, "incomplete", None, "frames", 100_000_000, dropped_by={"reported lost": 3})
    assert pipeline.end == end and len({pipeline.end, end}) == 1
    for call in (lambda: pipeline.push(GREY[0]), lambda: pipeline.lose(), pipeline.finish):
        with pytest.raises(wstac.Error, match="the pipeline is finished"):
            call()


def test_arrays_of_any_order_are_read_as_they_look() -> None:
    some = np.random.default_rng(1)
    color = some.integers(0, 256, (3, 81, 80, 3), np.uint8)
    expected = wstac.features(color)
    assert np.array_equal(wstac.features(color[..., ::-1]), expected), "green is in the middle"
    assert np.array_equal(wstac.features(np.asfortranarray(color)), expected)
    assert np.array_equal(wstac.features(color[::-1])[::-1], expected)
    assert not np.array_equal(wstac.features(color[:, ::-1]), expected)
    assert np.array_equal(wstac.features(np.ascontiguousarray(color[..., 1])), expected)
    words = (some.integers(0, 1024, (2, 80, 80))).astype("<u2")
    assert not np.array_equal(wstac.features(words, "Y10"), wstac.features(words, "Y16"))
    assert wstac.features(GREY[:0]).shape == (0, 10)
    frozen = GREY.copy()
    frozen.flags.writeable = False
    assert np.array_equal(wstac.features(frozen), wstac.features(GREY))


def test_padded_rows_and_pictures_are_the_same() -> None:
    some = np.random.default_rng(2)
    padded = some.integers(0, 256, (4, 60, 90), np.uint8)
    raw = {"format": "GREY", "size": (80, 60), "bytes_per_row": 90}
    expected = wstac.features(padded[:, :, :80])
    assert np.array_equal(wstac.features(padded.reshape(4, -1), **raw), expected)
    assert np.array_equal(wstac.features(padded.reshape(4, -1)[:, :-10], **raw), expected), "without the last row's padding"


def test_arguments_by_chance_give_an_answer_or_words() -> None:
    """Any shape, type and format gives an array, or an error with a message."""
    chance = random.Random(8)
    codes = [None, "GREY", "YUYV", "Y10", "RGB3", "NV12", "422P", "444P", "RG10", "XR24", "BA81", "RGBP", "JPEG", "", "Y10 ", "é"]
    shapes = [(2, 8, 8), (2, 8, 8, 2), (2, 8, 8, 3), (2, 8, 8, 4), (2, 64), (2, 96), (2, 128), (2, 192), (), (8,)]
    answered = 0
    for _ in range(20_000):
        shape = list(chance.choice(shapes))
        if shape and chance.random() < 0.3:
            shape[chance.randrange(len(shape))] = chance.choice([0, 1, 2, 3, 9, 63, 97])
        frames = np.zeros(shape, chance.choice([np.uint8, np.uint8, np.uint8, np.uint16, np.uint16, np.int16, np.float32, bool, "S1", object]))
        size = chance.choice([None, (8, 8), (8, 8), (9, 9), (16384, 1), (1, 1)])
        more = {"bytes_per_row": chance.choice([None, None, None, 8, 9, 16, 1 << 31]), "fps": chance.choice([30, 60, 1e9, 0.01])}
        try:
            answered += wstac.features(frames, chance.choice(codes), size=size, **more).shape[1] == 10
        except wstac.Error as refused:
            assert str(refused)
    assert answered > 100


def test_a_stream_of_weeks_keeps_the_last_of_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    from wstac import _answers

    monkeypatch.setattr(_answers, "MOST", 3)
    records = _answers.Records()
    for frame in range(10):
        records.take([wstac.Fault(frame, "slow", "x")])
        records.forget()
    assert [fault.frame for fault in records.faults] == [7, 8, 9]
