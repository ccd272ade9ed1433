"""Compares training and live motion with the command."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
import wstac
from conftest import WSTAC, command

SWEEP = "specimens = ['Fla0', 'Saw4', 'Sin3']\nslides = 360\nsensors = 40\n"
SCENE = "scene:Saw3@120,30deg,seed=4"


def test_a_model_is_that_of_the_command(tmp_path: Path) -> None:
    sweep, ours, theirs = tmp_path / "sweep.toml", tmp_path / "a.wsm", tmp_path / "b.wsm"
    sweep.write_text(SWEEP)
    trained = wstac.train(sweep, output=ours)
    done = subprocess.run(
        [WSTAC, "train", str(sweep), "-o", str(theirs), "--json"], check=True, capture_output=True, text=True
    )
    report = json.loads(done.stdout)
    assert ours.read_bytes() == theirs.read_bytes()
    assert (trained.slides, trained.groups, trained.left_out) == (report["slides"], report["groups"], report["left_out"])
    test = report["test"]
    assert (trained.accuracy, trained.interval) == (test["accuracy"], tuple(test["interval"]))
    assert trained.confusion is not None and trained.confusion.tolist() == test["counts"]
    assert trained.model.labels == report["labels"] and trained.calibrated == (report["calibration"] is not None)
    with pytest.raises(wstac.Error, match="exists, expected a new file"):
        wstac.train(sweep, output=ours)
    with pytest.raises(wstac.Error, match="is an input"):
        wstac.train(sweep, output=sweep, force=True)


def test_a_model_behaves_like_an_estimator(tmp_path: Path) -> None:
    sweep, data = tmp_path / "sweep.toml", tmp_path / "set.npz"
    sweep.write_text(SWEEP)
    subprocess.run([WSTAC, "dataset", "--input", "path", str(sweep), "-o", str(data)], check=True, capture_output=True)
    model = wstac.train(data, output=tmp_path / "a.wsm").model
    with np.load(data) as arrays:
        X, y = arrays["X_path"], arrays["y_specimen"]
    assert model.input == "path" and model.classes_.tolist() == ["Fla0", "Saw4", "Sin3"]
    found, probabilities = model.predict(X), model.predict_proba(X)
    assert probabilities.shape == (len(X), 3) and np.abs(probabilities.sum(axis=1) - 1).max() < 1e-3
    # Probabilities are rounded, so that two of them may be equal.
    assert np.mean(model.classes_[probabilities.argmax(axis=1)] == found) > 0.99
    assert model.score(X, y) == np.mean(found == y) > 0.9
    assert model.get_params() == {"name": str(tmp_path / "a.wsm")}
    plain = wstac.Model.load("builtin:svm")
    with pytest.raises(wstac.Error, match="builtin:svm: has no calibration"):
        plain.predict_proba(X)
    with pytest.raises(wstac.Error, match="y: 2 labels"):
        model.score(X, ["Fla0", "Saw4"])


def test_one_group_is_refused(recording: Path, tmp_path: Path) -> None:
    with pytest.raises(wstac.Error, match="expected at least 2 groups of each texture"):
        wstac.train(recording, output=tmp_path / "a.wsm")
    for wrong in ({"input": "time"}, {"task": "color"}, {"test": 1.0}):
        with pytest.raises(wstac.Error, match=next(iter(wrong))):
            wstac.train(output=tmp_path / "a.wsm", **wrong)  # type: ignore[arg-type]
    assert not (tmp_path / "a.wsm").exists()


def test_live_motion(tmp_path: Path) -> None:
    expected = [line for line in command("run", SCENE, "--json", "--motion") if line["kind"] == "motion"]
    with wstac.open(SCENE, motion=True) as stream:
        found = [record for record in stream.records() if isinstance(record, wstac.Motion)]
    assert [motion.record for motion in found] == expected and len(expected) > 10
    with wstac.open(SCENE) as stream:
        assert not any(isinstance(record, wstac.Motion) for record in stream.records())
    scene = wstac.simulate("Saw3@120,30deg,seed=4", size=(400, 400))
    pipeline = wstac.Pipeline(motion=True)
    assert scene.frames is not None
    for frame in scene.frames:
        pipeline.push(frame)
    assert pipeline.motions and pipeline.motions[0].speed.sd
