"""Models and the classifier as scikit-learn uses estimators: clones, pipelines, metrics, pickles."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
import wstac
from sklearn.base import clone, is_classifier
from sklearn.exceptions import NotFittedError
from sklearn.inspection import permutation_importance
from sklearn.metrics import get_scorer
from sklearn.model_selection import GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.utils.estimator_checks import parametrize_with_checks
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
    return wstac.TextureClassifier().fit(data["X_path"][train], data["y_specimen"][train], groups=data["sensor"][train])


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


def test_it_trains_within_scikit_learn(data: dict[str, Any]) -> None:
    X, y, groups = data["X_path"].reshape(-1, 700), data["y_specimen"], data["sensor"]
    scores = cross_val_score(wstac.TextureClassifier(), X, y, groups=groups, cv=GroupKFold(2), scoring="accuracy")
    assert scores.shape == (2,) and scores.min() > 0.8
    # A model stays what it is.
    assert cross_val_score(wstac.Model.load("builtin:path-svm"), X, y, cv=2).min() > 0.85
    fitted = make_pipeline(wstac.TextureClassifier()).fit(X, y)
    assert fitted.score(X, y) > 0.9


def test_it_is_the_training_of_the_command(data: dict[str, Any], classifier: wstac.TextureClassifier, tmp_path) -> None:
    """The same slides give the same answers as `wstac.train`, which is `wstac train`."""
    np.savez(tmp_path / "set.npz", **data)
    trained = wstac.train(tmp_path / "set.npz", output=tmp_path / "a.wsm")
    X = data["X_path"]
    assert classifier.predict(X).tolist() == trained.model.predict(X).tolist()
    assert np.array_equal(classifier.predict_proba(X), trained.model.predict_proba(X), equal_nan=True)
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
        for call in (model.score, lambda X, y: model.score(X[:0], y[:0])):
            if call is not model.score:
                with pytest.raises(ValueError, match="no sample"):
                    call(X, y)


def test_few_groups_give_no_calibration(data: dict[str, Any]) -> None:
    X, y = data["X_path"], data["y_specimen"]
    found = wstac.TextureClassifier().fit(X, y, groups=np.zeros(len(X)))
    assert found.score(X, y) > 0.9
    for call in (found.predict_proba, found.known):
        with pytest.raises(wstac.Error, match="expected 3 groups"):
            call(X)


NO_700 = "a sample has 700 integers of int16; the check gives others"
NO_CHECK = {
    name: NO_700
    for name in """
check_classifier_data_not_an_array check_classifiers_classes check_classifiers_one_label check_classifiers_one_label_sample_weights
check_classifiers_regression_target check_classifiers_train check_dict_unchanged check_dont_overwrite_attributes check_dtype_object
check_estimators_dtypes check_estimators_fit_returns_self check_estimators_nan_inf check_estimators_overwrite_params
check_estimators_pickle check_f_contiguous_array_estimator check_fit1d check_fit2d_1feature check_fit2d_1sample check_fit2d_predict1d
check_fit_check_is_fitted check_fit_idempotent check_fit_score_takes_y check_methods_sample_order_invariance
check_methods_subset_invariance check_n_features_in check_n_features_in_after_fitting check_pipeline_consistency
check_readonly_memmap_input check_supervised_y_2d check_estimator_sparse_array check_estimator_sparse_matrix check_estimator_sparse_tag
check_positive_only_tag_during_fit check_complex_data check_requires_y_none check_estimators_empty_data_messages
check_supervised_y_no_nan check_classifier_multioutput check_sample_weights_pandas_series check_estimators_partial_fit_n_features
check_mixin_order check_dataframe_column_names_consistency check_estimators_unfitted check_set_params check_do_not_raise_errors_in_init_or_set_param
""".split()
}


@parametrize_with_checks([wstac.TextureClassifier()], expected_failed_checks=lambda _: NO_CHECK)
def test_the_checks_of_scikit_learn(estimator: Any, check: Any) -> None:
    check(estimator)
