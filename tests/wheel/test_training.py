"""Compares training and live motion with the command."""

from __future__ import annotations

import json
import subprocess
import threading
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
    # The command's numbers: what is unknown has no right answer.
    [report] = command("model", "eval", str(tmp_path / "a.wsm"), str(data), "--json")
    assert model.known(X).tolist() == report["known"] and found.tolist() == report["predictions"]
    assert model.score(X, y) == report["accuracy"] == np.mean((found == y) & model.known(X)) > 0.9
    assert np.mean(found[model.known(X)] == y[model.known(X)]) == report["accuracy_of_answered"]
    assert model.get_params() == {"name": str(tmp_path / "a.wsm")}
    plain = wstac.Model.load("builtin:svm")
    with pytest.raises(wstac.Error, match="builtin:svm: has no calibration"):
        plain.predict_proba(X)
    with pytest.raises(wstac.Error, match="y: 2 labels"):
        model.score(X, ["Fla0", "Saw4"])


@pytest.mark.parametrize("name", ["path", "taxel-path"])
def test_data_sets_along_the_path_are_those_of_the_command(name: str, tmp_path: Path) -> None:
    sweep, data = tmp_path / "sweep.toml", tmp_path / "set.npz"
    sweep.write_text("specimens = ['Fla0', 'Saw4']\nslides = 20\nsensors = 5\nfirst_sensor = 300\n")
    subprocess.run([WSTAC, "dataset", "--input", name, str(sweep), "-o", str(data)], check=True, capture_output=True)
    with np.load(data) as arrays:
        for made in (
            wstac.dataset(sweep, input=name),
            wstac.dataset(
                {"specimens": ["Fla0", "Saw4"], "slides": 20, "sensors": 5, "first_sensor": 300},
                input=name.replace("-", "_"),
                threads=1,
            ),
        ):
            assert sorted(made) == sorted(arrays.files)
            for array in arrays.files:
                assert made[array].dtype == arrays[array].dtype
                assert np.array_equal(made[array], arrays[array], equal_nan=made[array].dtype.kind == "f")


def test_samples_along_the_path_are_those_of_data_sets(recording: Path, tmp_path: Path) -> None:
    events = wstac.read(recording, frames=False, path_samples=True).events
    for name, of in (("path", "path_sample"), ("taxel-path", "taxel_path_sample")):
        data = tmp_path / f"{name}.npz"
        subprocess.run([WSTAC, "dataset", "--input", name, str(recording), "-o", str(data)], check=True, capture_output=True)
        with np.load(data) as arrays:
            assert np.array_equal(np.array([getattr(event, of) for event in events]), arrays[f"X_{name.replace('-', '_')}"])
    assert any(event.path_sample.any() for event in events)
    # The record is that of the command, with or without them.
    plain = wstac.read(recording, frames=False).events
    assert [event.record for event in plain] == [event.record for event in events]
    assert all(event.path_sample is None and event.taxel_path_sample is None for event in plain)


def test_a_model_gets_the_sample_that_it_takes() -> None:
    scene = wstac.simulate({"specimen": "Saw3", "speed": 150, "fidelity": "taxel"}, path_samples=True)
    [event], [plain] = scene.events, wstac.simulate("Saw3@150", frames=False).events
    for name in ("builtin:path-svm", "builtin:taxel-path-svm", "builtin:svm"):
        model = wstac.Model.load(name)
        assert model.predict_event(event) == "Saw3"
        if model.input != "frames":
            for call in (model.predict, model.predict_proba, model.known):
                with pytest.raises(wstac.Error, match="X: row 0 is no sample along a path, expected those of the array X_"):
                    call(event.sample[None])
            with pytest.raises(wstac.Error, match="path_samples=True"):
                model.predict_event(plain)
    [press] = wstac.simulate({"touch": [{"kind": "press"}], "fidelity": "taxel"}, path_samples=True).events
    assert not press.path_sample.any() and wstac.Model.load("builtin:path-svm").predict_event(press) is None
    pipeline = wstac.Pipeline(fps=30, path_samples=True)
    frames = wstac.simulate("Saw3@150", size=(200, 200)).frames
    [pushed] = [event for frame in frames if (event := pipeline.push(frame))]
    assert pushed.path_sample is not None and pushed.path_sample.any() and pushed.taxel_path_sample.any()


def test_a_closed_stream_is_no_ended_stream(tmp_path: Path) -> None:
    scene_file = tmp_path / "slow.toml"
    scene_file.write_text('specimen = "Saw3"\nspeed = 1\nlead_in = 100000\n')
    with wstac.open(SCENE) as stream:
        pass
    with pytest.raises(wstac.Error, match="the stream is closed"):
        list(stream)
    with wstac.open(SCENE) as ended:
        assert len(list(ended)) == 1
    assert list(ended) == []
    # Another thread may close it meanwhile.
    slow = wstac.open(f"scene:{scene_file}")
    closer = threading.Timer(0.3, slow.close)
    closer.start()
    with pytest.raises(wstac.Error, match="the stream is closed"):
        list(slow.records())
    closer.join()


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
    pipeline = wstac.Pipeline(fps=30, motion=True)
    assert scene.frames is not None
    for frame in scene.frames:
        pipeline.push(frame)
    assert pipeline.motions and pipeline.motions[0].speed.sd
