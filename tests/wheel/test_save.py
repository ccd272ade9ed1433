"""wstac.save: estimators of scikit-learn as model files, beside their own predict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wstac
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import RidgeClassifier
from sklearn.neighbors import KNeighborsClassifier
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

SWEEP = "slides = 60\nspeeds = [100, 150, 200]\ndirections = [0, 90]\n"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Returns samples over time."""
    sweep = tmp_path_factory.mktemp("save") / "sweep.toml"
    sweep.write_text(SWEEP)
    return wstac.dataset(sweep)


def real(data: dict[str, Any]) -> Any:
    """Returns samples times their scale."""
    return data["X"].reshape(-1, 700) * data["scale"]


@pytest.mark.parametrize(
    "estimator", [RandomForestClassifier(10, random_state=1), RidgeClassifier(), SVC(kernel="linear")]
)
def test_saved_models_answer_as_their_estimators(estimator: Any, data: dict[str, Any], tmp_path: Path) -> None:
    X, file = real(data), tmp_path / "model.wsm"
    estimator.fit(X, data["y_specimen"])
    wstac.save(estimator, X, file, input="frames", note="a note")
    model = wstac.Model.load(file)
    assert (model.predict(data["X"]) == estimator.predict(X)).mean() >= 0.995
    assert model.task == "specimen"
    with pytest.raises(wstac.Error, match="exists, expected a new file, or force=True"):
        wstac.save(estimator, X, file, input="frames")
    assert wstac.save(estimator, X, file, input="frames", force=True).to_bytes() != b""


def test_early_models_and_own_labels(data: dict[str, Any], tmp_path: Path) -> None:
    X = data["X"][:, :, :30].reshape(-1, 300) * data["scale"]
    y = (data["y_specimen"] == "Saw4").astype(int)
    model = RandomForestClassifier(10, random_state=1).fit(X, y)
    saved = wstac.save(model, X, tmp_path / "model.wsm", input="frames", labels=["other", "Saw4"], task="other")
    assert (saved.frames, saved.labels) == (30, ["other", "Saw4"])
    assert (saved.predict(data["X"]) == np.array(["other", "Saw4"])[model.predict(X)]).all()
    with pytest.raises(wstac.Error, match="labels: 1 names, expected 2"):
        wstac.save(model, X, tmp_path / "no.wsm", input="frames", labels=["other"])


def test_what_would_answer_otherwise_is_refused(data: dict[str, Any], tmp_path: Path) -> None:
    X, y, file = real(data), data["y_specimen"], tmp_path / "no.wsm"
    units = data["X"].reshape(-1, 700)
    svm = SVC(kernel="linear").fit(units, y)
    with pytest.raises(wstac.Error, match=r"samples times their scale; help: train the estimator on X \* scale"):
        wstac.save(svm, units, file, input="frames")
    with pytest.raises(wstac.Error, match="names every sample"):
        wstac.save(svm, X, file, input="frames")
    with pytest.raises(wstac.Error, match="numbers from nan"):
        wstac.save(svm, np.full((1, 700), np.nan), file, input="frames")
    # A model of two answers, of which the estimator gives another.
    forest = RandomForestClassifier(5, random_state=1).fit(X, y)
    forest.predict = lambda samples: np.roll(RandomForestClassifier.predict(forest, samples), 1)
    with pytest.raises(wstac.Error, match=r"answers \(.* %\) differ from those of predict, expected at most 0.5 %; "):
        wstac.save(forest, X, file, input="frames")
    with pytest.raises(wstac.Error, match="KNeighborsClassifier"):
        wstac.save(KNeighborsClassifier().fit(X, y), X, file, input="frames")
    with pytest.raises(wstac.Error, match=r"shape \(600, 10, 70\), expected \(n, 700\)"):
        wstac.save(forest, data["X"], file, input="frames")
    assert not file.exists()


@pytest.mark.parametrize(
    "estimator",
    [
        # Numbers of float32 lose answers of the first one, and only samples show the scale of the second one.
        LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"),
        make_pipeline(StandardScaler(), MLPClassifier((32,), max_iter=60, random_state=1)),
    ],
)
def test_estimators_that_need_more_than_their_onnx_of_float32(
    estimator: Any, data: dict[str, Any], tmp_path: Path
) -> None:
    X = real(data)
    estimator.fit(X, data["y_specimen"])
    saved = wstac.save(estimator, X, tmp_path / "model.wsm", input="frames")
    assert (saved.predict(data["X"]) == estimator.predict(X)).mean() >= 0.995


def test_models_of_taxels_answer_as_their_estimators(tmp_path: Path) -> None:
    data = wstac.dataset({"specimens": ["Fla0", "Saw4"], "slides": 40, "sensors": 8}, input="taxels")
    X, y, file = data["X_taxels"].reshape(-1, 1750) * data["scale"], data["y_specimen"], tmp_path / "model.wsm"
    forest = RandomForestClassifier(5, random_state=0).fit(X, y)
    with pytest.raises(wstac.Error, match="1750 inputs, expected 1750 with --input taxels"):
        wstac.save(forest, X, file, input="frames")
    model = wstac.save(forest, X, file, input="taxels")
    own = X.any(axis=1)
    assert (model.input, model.n_features_in_, data["X_taxels"].shape[1:]) == ("taxels", 1750, (25, 70))
    assert (model.predict(data["X_taxels"][own]) == forest.predict(X[own])).all()
    [event] = wstac.simulate("Saw4@150", frames=False, path_samples=True).events
    [sample] = wstac.EventSamples(input="taxels").fit_transform([event])
    assert np.array_equal(sample.reshape(25, 70), event.taxels_sample)
    assert [model.predict_event(event)] == forest.predict(sample[None] * data["scale"]).tolist()
