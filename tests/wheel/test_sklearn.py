"""Models and the classifier as scikit-learn uses estimators: clones, pipelines, metrics, pickles."""

from __future__ import annotations

import copy
import inspect
import pickle
from typing import Any

import numpy as np
import pytest
import wstac
from sklearn.base import clone, is_classifier
from sklearn.ensemble import StackingClassifier
from sklearn.exceptions import NotFittedError
from sklearn.inspection import permutation_importance
from sklearn.metrics import get_scorer
from sklearn.model_selection import FixedThresholdClassifier, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import parametrize_with_checks
from sklearn.utils.validation import check_is_fitted, validate_data

SWEEP = {"specimens": ["Fla0", "Saw4", "Sin3"], "slides": 360, "sensors": 40}


@pytest.fixture(scope="module")
def data() -> dict[str, Any]:
    """Returns a data set along the path."""
    return wstac.dataset(SWEEP, input="path")


@pytest.fixture(scope="module")
def classifier(data: dict[str, Any]) -> wstac.TextureClassifier:
    """Returns a classifier of the slides for training."""
    train = data["split"] == "train"
    # The names that the command gives to groups decide which of them are kept aside.
    groups = [f"sensor {sensor:.0f}" for sensor in data["sensor"][train]]
    return wstac.TextureClassifier().fit(data["X_path"][train], data["y_specimen"][train], groups=groups)


def both(classifier: wstac.TextureClassifier) -> list[Any]:
    return [classifier, classifier.model_, wstac.Model.load("builtin:path-svm")]


def test_what_scikit_learn_does_with_fitted_estimators(data: dict[str, Any], classifier: wstac.TextureClassifier) -> None:
    test = data["split"] == "test"
    X, y = data["X_path"][test].reshape(-1, 700), data["y_specimen"][test]
    for model in both(classifier):
        assert is_classifier(model) and model.__sklearn_is_fitted__()
        check_is_fitted(model)
        labels = model.predict(X)
        assert get_scorer("accuracy")(model, X, y) == np.mean(labels == y) > 0.85
        assert model.score(X, y) <= np.mean(labels == y)
        assert make_pipeline(model).predict(X).tolist() == labels.tolist()
        found = permutation_importance(model, X[:20], y[:20], n_repeats=1, max_samples=20, random_state=0)
        assert found.importances.shape == (700, 1)
        for again in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model), copy.copy(model)):
            assert again.predict(X).tolist() == labels.tolist()
            assert np.array_equal(again.predict_proba(X), model.predict_proba(X), equal_nan=True)
            assert repr(again) == repr(model)
    # A clone of the classifier is not trained; that of a model is one.
    with pytest.raises(NotFittedError):
        clone(classifier).predict(X)
    assert clone(classifier.model_).predict(X).tolist() == classifier.predict(X).tolist()
    assert pickle.loads(pickle.dumps(classifier.model_)).name == classifier.model_.name


def test_methods_have_the_names_they_are_found_by(classifier: wstac.TextureClassifier) -> None:
    """scikit-learn looks at the name of a method to know what it returns."""
    public = {name: getattr(wstac, name) for name in wstac.__all__ if not name.startswith("_")}
    assert [name for name, found in public.items() if (found.__name__, found.__qualname__) != (name, name)] == []
    classes = [found for found in public.values() if inspect.isclass(found)]
    # A property may return a method, which only an object shows.
    owners = [(one, of) for one in classes for of in one.__mro__ if of.__module__.startswith("wstac")]
    owners += [(one, type(one)) for one in both(classifier)]
    seen = set()
    for one, of in owners:
        for name in vars(of):
            found = None if name.startswith("_") else getattr(one, name)
            if inspect.isroutine(found):
                seen.add(f"{of.__name__}.{name}")
                assert (found.__name__, found.__qualname__) == (name, f"{of.__name__}.{name}")
    assert {"TextureClassifier.predict_proba", "Model.predict_proba", "Config.read", "Stream.frames"} <= seen


def test_scikit_learn_knows_the_probabilities_of_two_classes(data: dict[str, Any]) -> None:
    some = (data["y_specimen"] != "Sin3") & data["X_path"].any(axis=(1, 2))
    X, y = data["X_path"][some].reshape(-1, 700), (data["y_specimen"][some] == "Saw4").astype(int)
    scores = cross_val_score(wstac.TextureClassifier(), X, y, cv=2, scoring="roc_auc")
    assert scores.shape == (2,) and scores.min() > 0.9
    fixed = FixedThresholdClassifier(wstac.TextureClassifier(), threshold=0.4).fit(X, y)
    above = fixed.estimator_.predict_proba(X)[:, 1] >= 0.4
    assert fixed.predict(X).tolist() == above.astype(int).tolist()
    stacked = StackingClassifier([("texture", wstac.TextureClassifier())], cv=2).fit(X, y)
    assert stacked.stack_method_ == ["predict_proba"] and stacked.score(X, y) > 0.9


def test_it_is_the_training_of_the_command(data: dict[str, Any], classifier: wstac.TextureClassifier, tmp_path) -> None:
    """The same slides give the same answers as `wstac.train`, which is `wstac train`."""
    np.savez(tmp_path / "set.npz", **data)
    trained = wstac.train(tmp_path / "set.npz", output=tmp_path / "a.wsm")
    X = data["X_path"]
    assert classifier.predict(X).tolist() == trained.model.predict(X).tolist()
    # Those of the classifier add up to 1; those of the model are rounded.
    assert np.allclose(classifier.predict_proba(X), trained.model.predict_proba(X), atol=2e-4, rtol=0, equal_nan=True)
    test = data["split"] == "test"
    assert classifier.score(X[test], data["y_specimen"][test]) == trained.accuracy


def test_labels_may_be_numbers(data: dict[str, Any]) -> None:
    X, names = data["X_path"], data["y_specimen"]
    numbers = np.select([names == "Fla0", names == "Saw4"], [10, 9], -3)
    found = wstac.TextureClassifier().fit(X, numbers, groups=data["sensor"])
    assert found.classes_.tolist() == [-3, 9, 10]
    assert found.score(X, numbers) > 0.9 and found.predict(X).dtype == numbers.dtype
    probabilities = found.predict_proba(X)
    some = ~np.isnan(probabilities[:, 0])
    assert np.mean(found.classes_[probabilities[some].argmax(axis=1)] == found.predict(X)[some]) > 0.99
    # Integers may come as other types, and nothing else.
    assert found.predict(X.astype(float)).tolist() == found.predict(X).tolist()
    for wrong in (X * data["scale"], X.astype(int) + 40_000, np.ma.masked_array(X)):
        with pytest.raises(wstac.Error, match="X: "):
            found.predict(wrong)


def test_zeros_have_no_answer(data: dict[str, Any], classifier: wstac.TextureClassifier) -> None:
    X = np.concatenate([data["X_path"][:20], np.zeros((1, 10, 70), np.int16)])
    for model in both(classifier)[:2]:
        assert np.isnan(model.predict_proba(X)[20]).all() and not model.known(X)[20] and model.known(X).any()
        y = model.predict(X)
        assert model.score(X, y) == model.known(X).mean() < 1
        with pytest.raises(ValueError, match="no sample"):
            model.score(X[:0], y[:0])


def test_few_groups_give_no_calibration(data: dict[str, Any]) -> None:
    X, y = data["X_path"], data["y_specimen"]
    found = wstac.TextureClassifier().fit(X, y, groups=np.zeros(len(X)))
    assert found.score(X, y) > 0.9
    assert not hasattr(found, "predict_proba")
    with pytest.raises(wstac.Error, match="expected 3 groups"):
        found.known(X)


class Padded(wstac.TextureClassifier):
    """The classifier for the tables of scikit-learn's checks, which have few columns of real numbers.

    They become the first of a sample's 700 numbers, in units of 1/1000. The rest is a constant, so that no row is zero.
    """

    def _samples(self, X: Any) -> Any:
        X = validate_data(self, X, reset=self._resets, ensure_min_samples=1)
        whole = np.full((len(X), 700), 1, np.int16)
        whole[:, : X.shape[1]] = np.rint(np.clip(1000 * X.astype(float), -32_000, 32_000))
        return super()._samples(whole)

    _resets = False

    def fit(self, X: Any, y: Any, groups: Any = None) -> Padded:
        type(self)._resets = True
        try:
            super().fit(X, y, groups)
        finally:
            type(self)._resets = False
        self.n_features_in_ = np.asarray(X).shape[1] if not hasattr(X, "shape") else X.shape[1]
        return self

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        return float(np.average(self.predict(X) == np.asarray(y), weights=sample_weight))


NO_CHECK = {
    "check_supervised_y_2d": "a column of labels is taken without a warning",
}
"""Checks that the classifier does not pass, with the reasons."""


@parametrize_with_checks([Padded()], expected_failed_checks=lambda _: NO_CHECK)
def test_the_checks_of_scikit_learn(estimator: Any, check: Any) -> None:
    check(estimator)
