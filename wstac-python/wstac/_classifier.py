"""A classifier of samples with the conventions of scikit-learn, which need not be there."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._models import INPUTS, Model, accuracy, answered, classifier_tags
from ._wstac import Error


class TextureClassifier:
    """A texture classifier that trains as `wstac train` does, with the conventions of scikit-learn's estimators.

    `input` says which samples are given: "path" (the array X_path of a data set), "taxel-path" (X_taxel_path) or "frames" (X).
    `task` is the kind of the labels, "specimen", "pattern", "depth" or "other"; by default, their names decide. `threads` is by
    default the number of processors. The result is the same with any number.

    After `fit`, `model_` is the `Model`, `classes_` the labels and `n_features_in_` the numbers of a sample.

    >>> import wstac
    >>> data = wstac.dataset({"specimens": ["Fla0", "Saw4"], "slides": 300, "sensors": 30}, input="path")
    >>> train = data["split"] == "train"
    >>> X, y, sensors = data["X_path"], data["y_specimen"], data["sensor"]
    >>> classifier = wstac.TextureClassifier().fit(X[train], y[train], groups=sensors[train])
    >>> classifier.classes_.tolist(), classifier.score(X[~train], y[~train]) > 0.9
    (['Fla0', 'Saw4'], True)
    >>> [array.shape for array in (classifier.predict(X[~train]), classifier.predict_proba(X[~train]), classifier.known(X[~train]))]
    [(59,), (59, 2), (59,)]
    >>> classifier.get_params(), classifier.set_params(threads=2)
    ({'input': 'path', 'task': None, 'threads': None}, TextureClassifier(threads=2))
    """

    _estimator_type = "classifier"

    model_: Model
    classes_: NDArray[Any]
    n_features_in_: int

    def __init__(self, *, input: str = "path", task: Optional[str] = None, threads: Optional[int] = None) -> None:
        self.input = input
        self.task = task
        self.threads = threads

    def fit(self, X: Any, y: Any, groups: Any = None) -> TextureClassifier:
        """Trains on samples and their labels. Returns the classifier.

        X is (n, 700) or (n, 10, 70), feature by feature, in units of 1/2048: integers of int16, of any type. Rows of zeros are left
        out. Some `groups`, such as sensors or recordings, are kept aside, so that the model says how sure an answer is and what is
        unknown. Without `groups` every sample is one: then the calibration is too sure of itself on other sensors.
        """
        if y is None:
            raise Error("y: is None; TextureClassifier requires y to be passed, but the target y is None")
        labels = np.asarray(y)
        if labels.ndim == 2 and labels.shape[1] == 1:
            labels = labels[:, 0]
        if labels.dtype.kind == "f" and not (np.isfinite(labels).all() and (labels == np.rint(labels)).all()):
            raise Error("y: Unknown label type: continuous numbers, expected names or integers")
        flat = self._samples(X)
        if labels.ndim != 1 or len(labels) != len(flat):
            raise Error(f"y: shape {np.shape(y)}, expected ({len(flat)},) as of X")
        if not len(flat):
            raise Error("X: no sample, expected at least 1 of each label")
        if groups is None:
            groups = range(len(flat))
        if len(groups) != len(flat):
            raise Error(f"groups: {len(groups)} elements, expected {len(flat)} as of X")
        classes, numbers = np.unique(labels, return_inverse=True)
        if len(classes) < 2:
            raise Error(f"y: one class ({classes[0]}), expected at least 2")
        names = [str(label) for label in classes.tolist()]
        threads = None if self.threads is None else _frames.count("threads", self.threads, 1, 1024)
        made = _wstac.fit(flat, [names[k] for k in numbers], [str(group) for group in groups], self.input, self.task, threads)
        self.model_ = Model.from_bytes(made, "TextureClassifier")
        self.classes_ = classes
        self.n_features_in_ = INPUTS
        return self

    def predict(self, X: Any) -> NDArray[Any]:
        """Returns the label of each sample, (n,). Also a row of zeros has one, and a sample that is unknown."""
        model, order = self._fitted()
        found: NDArray[Any] = self.classes_[order[model._native.classes(self._samples(X))]]
        return found

    @property
    def predict_proba(self) -> Callable[[Any], NDArray[np.float64]]:
        """Returns the probability of each class for each sample, (n, classes) in the order of `classes_`; NaN for a row of zeros.

        As in scikit-learn, there is no such method (AttributeError) if the training had too few groups for a calibration.
        """
        if self.__sklearn_is_fitted__() and self.model_._native.probabilities(np.zeros((0, INPUTS), np.int16)) is None:
            message = "TextureClassifier: has no calibration, expected 3 groups of each label and about 35 samples of it"
            raise AttributeError(f"{message} for the training")
        return self._probabilities

    def _probabilities(self, X: Any) -> NDArray[np.float64]:
        model, order = self._fitted()
        found = model._native.probabilities(self._samples(X))
        assert found is not None
        # Each is rounded to a multiple of 2^-15.
        found = found / found.sum(axis=1, keepdims=True)
        in_order: NDArray[np.float64] = found[:, np.argsort(order)]
        return in_order

    # scikit-learn looks at a method's name to know what it returns.
    _probabilities.__name__, _probabilities.__qualname__ = "predict_proba", "TextureClassifier.predict_proba"

    def known(self, X: Any) -> NDArray[np.bool_]:
        """Returns whether each sample is like those of the training, (n,). A row of zeros is not.

        Raises `Error` if the training had too few groups for a calibration.
        """
        found = self._fitted()[0]._native.known(self._samples(X))
        if found is None:
            raise Error("TextureClassifier: does not tell what is unknown, expected 3 groups of each label for the training")
        return found

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """Returns the fraction of samples whose answer is that in y, as `wstac model eval` counts.

        A row of zeros, and a sample that is unknown, has no answer and counts as wrong. (The accuracy of scikit-learn's metrics
        compares labels alone.)
        """
        flat = self._samples(X)
        given = answered(flat, self._fitted()[0]._native.known(flat))
        return accuracy(self.predict(flat), given, y, sample_weight)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the arguments of the classifier."""
        return {name: getattr(self, name) for name in _names()}

    def set_params(self, **params: Any) -> TextureClassifier:
        """Sets arguments of the classifier. Returns it."""
        for name, value in params.items():
            if name not in _names():
                raise Error(f"{name}: is no parameter, expected {', '.join(_names())}")
            setattr(self, name, value)
        return self

    def _fitted(self) -> tuple[Model, NDArray[np.int64]]:
        """Returns the model, and for each of its classes the number in `classes_`."""
        if not self.__sklearn_is_fitted__():
            raise _not_fitted()
        names = [str(label) for label in self.classes_.tolist()]
        return self.model_, np.array([names.index(label) for label in self.model_.labels])

    def _samples(self, X: Any) -> NDArray[np.int16]:
        """Returns samples as int16 (n, 700)."""
        if type(X).__module__.startswith("scipy.sparse"):
            raise TypeError("X is sparse, expected a NumPy array")
        if isinstance(X, np.ndarray):
            _frames.without_mask("X", X)
        found = np.asarray(X)
        if found.dtype.kind == "c":
            raise Error("X: Complex data not supported, expected integers of int16")
        if found.ndim == 1:
            raise Error(f"X: shape {found.shape}, expected (n, 700). Reshape your data: X.reshape(1, -1) is a single sample")
        if found.ndim not in (2, 3) or found.shape[1:] not in ((10, 70), (INPUTS,)):
            raise Error(f"X: shape {found.shape}, expected (n, 10, 70) or (n, 700)")
        if found.dtype != np.int16:
            try:
                real = found.astype(np.float64)
            except (TypeError, ValueError) as error:
                raise type(error)(f"X: {error}") from None
            if not np.isfinite(real).all():
                raise Error("X: has NaN or inf, expected integers of int16 in units of 1/2048")
            whole = real.astype(np.int64)
            if (whole != real).any() or (np.abs(real + 0.5) > 32768).any():
                raise Error("X: has numbers that are no int16, expected samples in units of 1/2048, not times their scale")
            found = whole.astype(np.int16)
        return np.ascontiguousarray(found.reshape(len(found), INPUTS))

    def __sklearn_is_fitted__(self) -> bool:
        return "model_" in vars(self)

    def __sklearn_tags__(self) -> Any:
        return classifier_tags()

    def __repr__(self) -> str:
        defaults = {name: parameter.default for name, parameter in _signature().items()}
        changed = [f"{name}={value!r}" for name, value in self.get_params().items() if value != defaults[name]]
        return f"TextureClassifier({', '.join(changed)})"


def _signature() -> dict[str, inspect.Parameter]:
    """Returns the parameters of the classifier."""
    return dict(list(inspect.signature(TextureClassifier.__init__).parameters.items())[1:])


def _names() -> list[str]:
    """Returns the names of the parameters, in order."""
    return sorted(_signature())


def _not_fitted() -> Exception:
    """Returns the error of a classifier before `fit`: scikit-learn's own if it is there, which is a ValueError, too."""
    message = "TextureClassifier: is not trained, expected a call of fit before"
    try:
        from sklearn.exceptions import NotFittedError  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return Error(message)
    made: Exception = NotFittedError(message)
    return made
