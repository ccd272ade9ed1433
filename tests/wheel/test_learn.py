"""wstac.learn: models of new textures as those of the command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac
from conftest import command

NAMES = {"Saw3": "denim", "Sin4": "cork", "Tri2": "felt"}


@pytest.fixture(scope="module")
def data() -> dict[str, Any]:
    """Returns samples along the path with names of one's own."""
    data = wstac.dataset({"specimens": list(NAMES), "slides": 60, "sensors": 10}, input="taxel-path")
    data["y_specimen"] = np.array([NAMES[name] for name in data["y_specimen"].tolist()])
    return data


def test_a_learned_model_is_that_of_the_command(data: dict[str, Any], tmp_path: Path) -> None:
    train = np.arange(60) % 2 == 0
    slides, theirs, own = tmp_path / "slides.npz", tmp_path / "theirs.wsm", tmp_path / "own.wsm"
    np.savez(slides, **{name: array[train] if len(array.shape) else array for name, array in data.items()})
    command("model", "learn", "builtin:taxel-embedding", str(slides), "-o", str(theirs))
    X, y = data["X_taxel_path"], data["y_specimen"]
    model = wstac.learn("builtin:taxel-embedding", X[train], y[train], path=own, note="two words")
    assert own.read_bytes() == model.to_bytes() and b"two words" in own.read_bytes()
    assert (model.labels, model.task, model.input) == (["cork", "denim", "felt"], "other", "taxel-path")
    expected = wstac.Model.load(theirs)
    for found in ("predict", "predict_proba", "known"):
        np.testing.assert_array_equal(getattr(model, found)(X), getattr(expected, found)(X))
    assert model.score(X[~train], y[~train]) > 0.8
    with pytest.raises(wstac.Error, match="own.wsm: exists, expected a new file, or force=True"):
        wstac.learn("builtin:taxel-embedding", X, y, path=own)
    # A model is a base, too, and zeros are no sample.
    zeros = np.concatenate([X[train], np.zeros((1, 10, 70), np.int16)])
    again = wstac.learn(wstac.Model.load("builtin:taxel-embedding"), zeros, [*y[train], "other"], path=own, force=True)
    assert again.labels == model.labels
    np.testing.assert_array_equal(again.predict_proba(X), model.predict_proba(X))


def test_two_slides_of_each_name_textures_without_probabilities(data: dict[str, Any]) -> None:
    X, y = data["X_taxel_path"], data["y_specimen"]
    few = np.concatenate([np.flatnonzero((y == name) & X.any(axis=(1, 2)))[:2] for name in ("cork", "felt")])
    model = wstac.learn("builtin:taxel-embedding", X[few], y[few].tolist())
    assert model.predict(X[few]).tolist() == y[few].tolist()
    with pytest.raises(wstac.Error, match="learned: has no calibration"):
        model.predict_proba(X)


def test_what_cannot_be_learned_is_refused(data: dict[str, Any], tmp_path: Path) -> None:
    X, y, base = data["X_taxel_path"], data["y_specimen"], "builtin:taxel-embedding"
    for expected, arguments in [
        ("builtin:svm: has no projection, expected a calibrated model", ("builtin:svm", X, y)),
        (r'X and y: slides of 1 texture \("cork"\), expected at least 2', (base, X, ["cork"] * len(X))),
        ("X and y: slides of 0 textures, expected at least 2", (base, X[:0], [])),
        ("y: 2 names, expected 60 as of X", (base, X, y[:2])),
        ("y: None is of NoneType, expected names", (base, X, [None, *y[1:]])),
        ("y: 0.5 is of float", (base, X, [0.5] * len(X))),
        ("expected a name without blanks around it", (base, X, ["cork ", *y[1:]])),
        ("expected int16 in units of 1/2048", (base, X * data["scale"], y)),
        ("all scores of every sample are equal", (base, np.ones((6, 700), np.int16), [*"aaabbb"])),
        ("300 classes", (base, np.ones((300, 700), np.int16), [str(number) for number in range(300)])),
    ]:
        with pytest.raises(wstac.Error, match=expected):
            wstac.learn(*arguments, path=tmp_path / "no.wsm")
    with pytest.raises(wstac.Error, match="no.wsm") as refused:
        wstac.learn(tmp_path / "no.wsm", X, y)
    assert isinstance(refused.value, FileNotFoundError)
