"""Models and the classifier as scikit-learn uses estimators: clones, pipelines, metrics, pickles."""

from __future__ import annotations

import copy
import inspect
import pickle
import subprocess
import sys
import warnings
from typing import Any

import numpy as np
import pandas
import pytest
import sklearn
import wstac
from sklearn.base import clone, is_classifier
from sklearn.ensemble import StackingClassifier
from sklearn.exceptions import NotFittedError
from sklearn.inspection import permutation_importance
from sklearn.metrics import get_scorer
from sklearn.model_selection import FixedThresholdClassifier, GroupKFold, cross_val_score, cross_validate
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import check_dataframe_column_names_consistency, check_estimator, parametrize_with_checks
from sklearn.utils.validation import check_is_fitted

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
        assert model.classes_[model.decision_function(X).argmax(axis=1)].tolist() == labels.tolist()
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
    second = fixed.estimator_.decision_function(X) > 0
    assert second.astype(int).tolist() == fixed.estimator_.predict(X).tolist()
    with_zeros = np.concatenate([X, np.zeros((4, 700), X.dtype)]), np.concatenate([y, [0, 1, 0, 1]])
    scores = cross_val_score(wstac.TextureClassifier(), *with_zeros, cv=2, scoring="neg_log_loss")
    assert np.isfinite(scores).all() and scores.min() > -np.log(2)
    stacked = StackingClassifier([("texture", wstac.TextureClassifier())], cv=2).fit(X, y)
    assert stacked.stack_method_ == ["predict_proba"] and stacked.score(X, y) > 0.9


def test_it_is_the_training_of_the_command(data: dict[str, Any], classifier: wstac.TextureClassifier, tmp_path) -> None:
    """The same slides give the same answers as `wstac.train`, which is `wstac train`."""
    np.savez(tmp_path / "set.npz", **data)
    trained = wstac.train(tmp_path / "set.npz", output=tmp_path / "a.wsm")
    X = data["X_path"]
    assert classifier.predict(X).tolist() == trained.model.predict(X).tolist()
    # Those of the classifier add up to 1; those of the model are rounded.
    some = X.any(axis=(1, 2))
    assert np.allclose(classifier.predict_proba(X)[some], trained.model.predict_proba(X)[some], atol=2e-4, rtol=0)
    test = data["split"] == "test"
    assert classifier.score(X[test], data["y_specimen"][test]) == trained.accuracy


def test_labels_may_be_numbers(data: dict[str, Any]) -> None:
    X, names = data["X_path"], data["y_specimen"]
    numbers = np.select([names == "Fla0", names == "Saw4"], [10, 9], -3)
    found = wstac.TextureClassifier().fit(X, numbers, groups=data["sensor"])
    assert found.classes_.tolist() == [-3, 9, 10]
    assert found.score(X, numbers) > 0.9 and found.predict(X).dtype == numbers.dtype
    probabilities = found.predict_proba(X)
    some = X.any(axis=(1, 2))
    assert np.mean(found.classes_[probabilities[some].argmax(axis=1)] == found.predict(X)[some]) > 0.99
    assert found.classes_[found.decision_function(X).argmax(axis=1)].tolist() == found.predict(X).tolist()
    # Integers may come as other types, and nothing else.
    assert found.predict(X.astype(float)).tolist() == found.predict(X).tolist()
    for wrong in (X * data["scale"], X.astype(int) + 40_000, np.ma.masked_array(X)):
        with pytest.raises(wstac.Error, match="X: "):
            found.predict(wrong)


def test_zeros_have_no_answer(data: dict[str, Any], classifier: wstac.TextureClassifier) -> None:
    X = np.concatenate([data["X_path"][:20], np.zeros((1, 10, 70), np.int16)])
    for model in both(classifier)[:2]:
        assert not model.known(X)[20] and model.known(X).any()
        y = model.predict(X)
        assert model.score(X, y) == model.known(X).mean() < 1
        with pytest.raises(ValueError, match="no sample"):
            model.score(X[:0], y[:0])
    assert np.isnan(classifier.model_.predict_proba(X)[20]).all()
    probabilities = classifier.predict_proba(X)
    assert np.ptp(probabilities[20]) == 0 and np.ptp(probabilities[0]) > 0.5
    assert np.allclose(probabilities.sum(axis=1), 1)


def test_few_groups_give_no_calibration(data: dict[str, Any]) -> None:
    X, y = data["X_path"], data["y_specimen"]
    found = wstac.TextureClassifier().fit(X, y, groups=np.zeros(len(X)))
    assert found.score(X, y) > 0.9
    assert not hasattr(found, "predict_proba")
    with pytest.raises(wstac.Error, match="expected 3 groups"):
        found.known(X)


def test_groups_reach_the_training_in_a_cross_validation(data: dict[str, Any]) -> None:
    X, y, sensors = data["X_path"].reshape(-1, 700), data["y_specimen"], data["sensor"]
    with pytest.raises(RuntimeError, match="enable_metadata_routing"):
        wstac.TextureClassifier().set_fit_request(groups=True)
    with sklearn.config_context(enable_metadata_routing=True):
        asked = wstac.TextureClassifier().set_fit_request(groups="sensors").set_score_request(sample_weight=True)
        for one in (asked, clone(asked), pickle.loads(pickle.dumps(asked))):
            assert str(one.get_metadata_routing()) == "{'fit': {'groups': 'sensors'}, 'score': {'sample_weight': True}}"
        params = {"sensors": sensors, "groups": sensors, "sample_weight": np.ones(len(y))}
        found = cross_validate(asked, X, y, cv=GroupKFold(2), params=params, return_estimator=True, return_indices=True)
        with pytest.raises(sklearn.exceptions.UnsetMetadataPassedError, match="groups.* TextureClassifier"):
            cross_validate(wstac.TextureClassifier(), X, y, params={"groups": sensors})
    for trained, train in zip(found["estimator"], found["indices"]["train"]):
        again = wstac.TextureClassifier().fit(X[train], y[train], groups=sensors[train])
        assert trained.model_.to_bytes() == again.model_.to_bytes()
        assert trained.model_.to_bytes() != wstac.TextureClassifier().fit(X[train], y[train]).model_.to_bytes()


def test_a_table_has_the_columns_of_the_training(data: dict[str, Any]) -> None:
    table = pandas.DataFrame(data["X_path"].reshape(-1, 700)).rename(columns="n{}".format)
    y = data["y_specimen"]
    found = wstac.TextureClassifier().fit(table, y, groups=data["sensor"])
    assert found.feature_names_in_.tolist() == table.columns.tolist()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert found.score(table, y) > 0.9
    methods = [found.predict, found.predict_proba, found.decision_function, found.known, lambda X: found.score(X, y)]
    for columns, words in (
        (table.columns[::-1], "Feature names must be in the same order"),
        (["other", *table.columns[1:]], "unseen at fit time:\n- other\nFeature names seen at fit time, yet now missing:\n- n0\n"),
    ):
        for method in methods:
            with pytest.raises(wstac.Error, match=words):
                method(table.set_axis(columns, axis=1))
    for method in methods:
        with pytest.warns(UserWarning, match="X does not have valid feature names, but TextureClassifier was fitted"):
            method(table.to_numpy())
    assert not hasattr(found.fit(table.to_numpy(), y), "feature_names_in_")
    with pytest.warns(UserWarning, match="fitted without feature names"):
        found.predict(table)
    with pytest.raises(TypeError, match="string names"):
        found.fit(table.rename(columns={"n0": 0}), y)
    # It is not among the checks for estimators of others.
    check_dataframe_column_names_consistency("Padded", Padded())


def test_events_become_tables() -> None:
    events = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
    model, array = wstac.Model.load("builtin:path-svm"), wstac.EventSamples().transform(events)
    with sklearn.config_context(transform_output="pandas"):
        assert isinstance(wstac.EventSamples().transform(events), pandas.DataFrame)
        assert isinstance(wstac.EventSamples().set_output(transform="default").transform(events), np.ndarray)
    pipeline = clone(make_pipeline(wstac.EventSamples(), model).set_output(transform="pandas"))
    table = pipeline[:-1].transform(events)
    assert table.columns.tolist() == pipeline[:-1].get_feature_names_out().tolist() == [f"path{k}" for k in range(700)]
    assert np.array_equal(table, array) and pipeline.predict(events).tolist() == model.predict(array).tolist() == ["Saw3"]
    with pytest.raises(wstac.Error, match="same order"):
        model.predict(table[table.columns[::-1]])
    with pytest.raises(wstac.Error, match="transform is 'x'"):
        wstac.EventSamples().set_output(transform="x")


WITHOUT = """
import sys, warnings
sys.modules["sklearn"] = None
import pandas, pytest, wstac
data = wstac.dataset({"specimens": ["Fla0", "Saw4"], "slides": 100, "sensors": 10}, input="path")
table, y = pandas.DataFrame(data["X_path"].reshape(-1, 700)).rename(columns="n{}".format), data["y_specimen"]
with pytest.raises(wstac.Error, match="is not trained"):
    wstac.TextureClassifier().predict(table)
with pytest.warns(UserWarning, match="column-vector y"):
    found = wstac.TextureClassifier().fit(table, y[:, None])
with pytest.raises(wstac.Error, match="same order"):
    found.predict(table[table.columns[::-1]])
assert found.score(table, y) > 0.9 and wstac.EventSamples().transform([]).shape == (0, 700)
"""


def test_scikit_learn_need_not_be_there() -> None:
    subprocess.run([sys.executable, "-c", WITHOUT], check=True)


class Padded(wstac.TextureClassifier):
    """The classifier for the tables of scikit-learn's checks, which have few columns of real numbers.

    They become the first of a sample's 700 numbers, in units of 1/1000. The rest is a constant, so that no row is zero.
    """

    def fit(self, X: Any, y: Any, groups: Any = None) -> Padded:
        vars(self).pop("n_features_in_", None)
        super().fit(X, y, groups)
        self.n_features_in_ = np.asarray(X).shape[1]
        return self

    def _samples(self, X: Any) -> Any:
        found = np.asarray(X)
        if found.ndim != 2 or 0 in found.shape or found.dtype.kind == "c":
            return super()._samples(X)
        columns = found.shape[1]
        if columns != vars(self).get("n_features_in_", columns):
            raise ValueError(f"X has {columns} features, but Padded is expecting {self.n_features_in_} features as input")
        whole = np.ones((len(found), 700), object)
        whole[:, :columns] = found
        try:
            real = 1000 * found.astype(float)
            whole[:, :columns] = np.where(np.isfinite(real), np.rint(np.clip(real, -32_000, 32_000)), real)
        except (TypeError, ValueError):
            pass  # The classifier says it.
        return super()._samples(whole)


BY_SHAPE = """
    check_fit_score_takes_y check_estimators_overwrite_params check_dont_overwrite_parameters check_estimators_fit_returns_self
    check_readonly_memmap_input check_n_features_in_after_fitting check_positive_only_tag_during_fit check_estimators_dtypes
    check_dtype_object check_pipeline_consistency check_estimators_nan_inf check_estimators_pickle check_f_contiguous_array_estimator
    check_classifier_data_not_an_array check_classifiers_classes check_classifiers_train check_supervised_y_2d
    check_methods_sample_order_invariance check_methods_subset_invariance check_dict_unchanged check_fit_idempotent
    check_fit_check_is_fitted check_n_features_in check_fit2d_predict1d check_decision_proba_consistency
"""
"""Checks that train on few columns, which the classifier refuses. `Padded` passes them."""


@parametrize_with_checks([Padded()])
def test_the_checks_of_scikit_learn(estimator: Any, check: Any) -> None:
    check(estimator)


def test_the_classifier_fails_checks_by_the_shape_alone() -> None:
    reasons = dict.fromkeys(BY_SHAPE.split(), "the table has few columns, a sample has 700 numbers")
    found = check_estimator(wstac.TextureClassifier(), expected_failed_checks=reasons, on_fail=None, on_skip=None)
    failed = [one for one in found if one["status"] in ("failed", "xfail")]
    assert {one["check_name"] for one in failed} == set(reasons) and sum(one["status"] == "passed" for one in found) > 25
    for one in failed:
        assert "while a minimum of 700 is required" in f"{one['exception']} {one['exception'].__cause__}", one
