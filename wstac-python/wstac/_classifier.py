"""A classifier of samples with the conventions of scikit-learn, which need not be there."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._estimator import Estimator, check_names, feature_names, of_scikit_learn
from ._models import Model, accuracy, answered, classifier_tags, decision, inputs_of
from ._wstac import Error


class TextureClassifier(Estimator):
    """A texture classifier that trains as `wstac train` does, with the conventions of scikit-learn's estimators.

    `input` says which samples are given: "path" (the array X_path of a data set), "taxel-path" (X_taxel_path), "frames"
    (X) or "taxels" (X_taxels). `task` is the kind of the labels, "specimen", "pattern", "depth" or "other"; by default,
    their names decide. `threads` is by default the number of processors. The result is the same with any number.

    After `fit`, `model_` is the `Model`, `classes_` the labels and `n_features_in_` the numbers of a sample; of a
    table, `feature_names_in_` are its columns, which must be the same later.

    >>> import wstac
    >>> data = wstac.dataset({"specimens": ["Fla0", "Saw4"], "slides": 300, "sensors": 30}, input="path")
    >>> train = data["split"] == "train"
    >>> X, y, sensors = data["X_path"], data["y_specimen"], data["sensor"]
    >>> classifier = wstac.TextureClassifier().fit(X[train], y[train], groups=sensors[train])
    >>> classifier.classes_.tolist(), classifier.score(X[~train], y[~train]) > 0.9
    (['Fla0', 'Saw4'], True)
    >>> methods = classifier.predict, classifier.predict_proba, classifier.decision_function, classifier.known
    >>> [method(X[~train]).shape for method in methods]
    [(59,), (59, 2), (59,), (59,)]
    >>> classifier.get_params(), classifier.set_params(threads=2)
    ({'input': 'path', 'task': None, 'threads': None}, TextureClassifier(threads=2))
    """

    _estimator_type = "classifier"

    model_: Model
    classes_: NDArray[Any]
    n_features_in_: int
    feature_names_in_: NDArray[np.object_]

    def __init__(self, *, input: str = "path", task: Optional[str] = None, threads: Optional[int] = None) -> None:
        self.input = input
        self.task = task
        self.threads = threads

    def fit(self, X: Any, y: Any, groups: Any = None) -> TextureClassifier:
        """Trains on samples and their labels. Returns the classifier.

        X is (n, 700) or (n, 10, 70), feature by feature, in units of 1/2048: integers of int16, of any type. Rows of
        zeros are left out. Some `groups`, such as sensors or recordings, are kept aside, so that the model says how
        sure an answer is and what is unknown. Without `groups` every sample is one: then the calibration is too sure of
        itself on other sensors.
        """
        if y is None:
            raise Error("y: is None; TextureClassifier requires y to be passed, but the target y is None")
        labels = np.asarray(y)
        if labels.ndim == 2 and labels.shape[1] == 1:
            words = "A column-vector y was passed when a 1d array was expected, such as y.ravel()"
            warnings.warn(words, of_scikit_learn("DataConversionWarning", UserWarning), stacklevel=2)
            labels = labels[:, 0]
        if labels.dtype.kind == "f" and not (np.isfinite(labels).all() and (labels == np.rint(labels)).all()):
            raise Error("y: Unknown label type: continuous numbers, expected names or integers")
        classes, numbers = np.unique(labels, return_inverse=True)
        if len(classes) == 1:
            raise Error(f"y: one class ({classes[0]}), expected at least 2")
        given, flat = feature_names(X), self._samples(X)
        if labels.ndim != 1 or len(labels) != len(flat):
            raise Error(f"y: shape {np.shape(y)}, expected ({len(flat)},) as of X")
        if not len(flat):
            raise Error("X: no sample, expected at least 1 of each label")
        if groups is None:
            groups = range(len(flat))
        if len(groups) != len(flat):
            raise Error(f"groups: {len(groups)} elements, expected {len(flat)} as of X")
        names = [str(label) for label in classes.tolist()]
        threads = None if self.threads is None else _frames.count("threads", self.threads, 1, 1024)
        made = _wstac.fit(
            flat, [names[k] for k in numbers], [str(group) for group in groups], self.input, self.task, threads
        )
        self.model_ = Model.from_bytes(made, "TextureClassifier")
        self.classes_ = classes
        self.n_features_in_ = inputs_of(self.input)
        vars(self).pop("feature_names_in_", None)
        if given is not None:
            self.feature_names_in_ = given
        return self

    def predict(self, X: Any) -> NDArray[Any]:
        """Returns the label of each sample, (n,). Also a row of zeros has one, and a sample that is unknown."""
        return self._labels(self._given(X))

    def _labels(self, flat: NDArray[np.int16]) -> NDArray[Any]:
        found: NDArray[Any] = self.classes_[self._order()[self.model_._native.classes(flat)]]
        return found

    @property
    def predict_proba(self) -> Callable[[Any], NDArray[np.float64]]:
        """Returns the probability of each class for each sample, (n, classes) in the order of `classes_`.

        Those of a row of zeros, which has no sample, are equal, because scikit-learn takes no NaN. As in scikit-learn,
        there is no such method (AttributeError) if the training had too few groups for a calibration.
        """
        if (
            self.__sklearn_is_fitted__()
            and self.model_._native.probabilities(np.zeros((0, self.n_features_in_), np.int16)) is None
        ):
            message = (
                "TextureClassifier: has no calibration, expected 3 groups of each label and about 35 samples of it"
            )
            raise AttributeError(f"{message} for the training")
        return self._probabilities

    def _probabilities(self, X: Any) -> NDArray[np.float64]:
        flat = self._given(X)
        found = self.model_._native.probabilities(flat)
        assert found is not None
        # The model has none for a row of zeros.
        found = np.where(np.isnan(found), 1.0, found)
        # Each is rounded to a multiple of 2^-15.
        found = found / found.sum(axis=1, keepdims=True)
        in_order: NDArray[np.float64] = found[:, np.argsort(self._order())]
        return in_order

    def decision_function(self, X: Any) -> NDArray[np.float64]:
        """Returns the score of each class for each sample, (n, classes) in the order of `classes_`; the highest is the
        answer's.

        For two classes it is (n,), above 0 for the second. Scores are sums in units of the model.
        """
        flat = self._given(X)
        return decision(self.model_._native.scores(flat)[:, np.argsort(self._order())])

    # scikit-learn looks at a method's name to know what it returns.
    _probabilities.__name__, _probabilities.__qualname__ = "predict_proba", "TextureClassifier.predict_proba"

    def known(self, X: Any) -> NDArray[np.bool_]:
        """Returns whether each sample is like those of the training, (n,). A row of zeros is not.

        Raises `Error` if the training had too few groups for a calibration.
        """
        flat = self._given(X)
        found = self.model_._native.known(flat)
        if found is None:
            raise Error(
                "TextureClassifier: does not tell what is unknown, expected 3 groups of each label for the training"
            )
        return found

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Returns the fraction of samples whose answer is that in y, as `wstac model eval` counts.

        A row of zeros, and a sample that is unknown, has no answer and counts as wrong. (The accuracy of scikit-learn's
        metrics compares labels alone.)
        """
        flat = self._given(X)
        return accuracy(self._labels(flat), answered(flat, self.model_._native.known(flat)), y, sample_weight)

    def get_metadata_routing(self) -> Any:
        """Returns which arguments scikit-learn passes to which method, with its metadata routing."""
        from sklearn.utils.metadata_routing import MetadataRequest  # type: ignore[import-untyped,import-not-found,unused-ignore]

        found = MetadataRequest(owner=type(self).__name__)
        found.fit.add_request(param="groups", alias=None)
        found.score.add_request(param="sample_weight", alias=None)
        return vars(self).get("_metadata_request", found)

    def set_fit_request(self, *, groups: Union[bool, str, None]) -> TextureClassifier:
        """Sets whether scikit-learn passes `groups` to `fit`, or under which name. Returns the classifier.

        >>> import sklearn, wstac
        >>> with sklearn.config_context(enable_metadata_routing=True):
        ...     classifier = wstac.TextureClassifier().set_fit_request(groups=True)
        ...     classifier = classifier.set_score_request(sample_weight=False)
        >>> classifier.get_metadata_routing()
        {'fit': {'groups': True}, 'score': {'sample_weight': False}}
        """
        return self._request("fit", "groups", groups)

    def set_score_request(self, *, sample_weight: Union[bool, str, None]) -> TextureClassifier:
        """Sets whether scikit-learn passes `sample_weight` to `score`, or under which name. Returns the classifier."""
        return self._request("score", "sample_weight", sample_weight)

    def _request(self, method: str, name: str, alias: Union[bool, str, None]) -> TextureClassifier:
        from sklearn import get_config  # type: ignore[import-untyped,import-not-found,unused-ignore]
        from sklearn.utils.metadata_routing import get_routing_for_object

        if not get_config()["enable_metadata_routing"]:
            raise RuntimeError(
                "metadata routing is off, expected sklearn.set_config(enable_metadata_routing=True) before"
            )
        # The name is that of scikit-learn, whose clone copies it.
        self._metadata_request = get_routing_for_object(self)
        getattr(self._metadata_request, method).add_request(param=name, alias=alias)
        return self

    def _order(self) -> NDArray[np.int64]:
        """Returns for each class of the model the number in `classes_`."""
        names = [str(label) for label in self.classes_.tolist()]
        return np.array([names.index(label) for label in self.model_.labels])

    def _given(self, X: Any) -> NDArray[np.int16]:
        """Returns samples for the trained model, of the columns of the training."""
        if not self.__sklearn_is_fitted__():
            raise of_scikit_learn("NotFittedError", Error)(
                "TextureClassifier: is not trained, expected a call of fit before"
            )
        check_names(type(self).__name__, feature_names(X), vars(self).get("feature_names_in_"))
        return self._samples(X)

    def _samples(self, X: Any) -> NDArray[np.int16]:
        """Returns samples as int16 (n, 700), or (n, 1750) of taxels."""
        inputs = inputs_of(self.input)
        rows = inputs // 70
        if type(X).__module__.startswith("scipy.sparse"):
            raise TypeError("X is sparse, expected a NumPy array")
        if isinstance(X, np.ndarray):
            _frames.without_mask("X", X)
        found = np.asarray(X)
        if found.dtype.kind == "c":
            raise Error("X: Complex data not supported, expected integers of int16")
        if found.ndim < 2:
            reshape = "Reshape your data: X.reshape(1, -1) is a single sample"
            raise Error(f"X: shape {found.shape}, expected (n, {inputs}). {reshape}")
        if found.shape[1:] not in ((rows, 70), (inputs,)):
            few = found.ndim == 2 and found.shape[1] < inputs
            words = f"{found.shape[1]} feature(s) (shape={found.shape}) while a minimum of {inputs} is required"
            raise Error(f"X: {words if few else f'shape {found.shape}'}, expected (n, {rows}, 70) or (n, {inputs})")
        if found.dtype != np.int16:
            try:
                real = found.astype(np.float64)
            except (TypeError, ValueError) as error:
                raise type(error)(f"X: {error}") from None
            if not np.isfinite(real).all():
                raise Error("X: has NaN or inf, expected integers of int16 in units of 1/2048")
            whole = real.astype(np.int64)
            if (whole != real).any() or (np.abs(real + 0.5) > 32768).any():
                raise Error(
                    "X: has numbers that are no int16, expected samples in units of 1/2048, not times their scale"
                )
            found = whole.astype(np.int16)
        return np.ascontiguousarray(found.reshape(len(found), inputs))

    def __sklearn_is_fitted__(self) -> bool:
        return "model_" in vars(self)

    def __sklearn_tags__(self) -> Any:
        return classifier_tags()
