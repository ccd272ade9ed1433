"""The configuration and texture models."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _frames, _wstac
from ._answers import Event
from ._estimator import check_names, feature_names
from ._wstac import Error

Path = Union[str, bytes, "os.PathLike[str]", "os.PathLike[bytes]"]


def as_json(what: str, table: Mapping[str, Any]) -> str:
    """Returns tables of keys as JSON. Numbers and arrays of NumPy become numbers and lists."""

    def plain(value: Any) -> Any:
        if isinstance(value, (np.ndarray, np.generic)):
            return value.tolist()
        if isinstance(value, Mapping):
            return dict(value)
        raise Error(f"{what}: {value!r} is a {type(value).__name__}, expected numbers, text, lists and tables")

    return json.dumps(dict(table), default=plain)


class Config:
    """How frames become features and events: the configuration of `wstac run --config`.

    A text in TOML, or tables of keys; all of them have defaults, and unknown ones are errors. `wstac help config`
    describes them.

    >>> import wstac
    >>> wstac.Config({"trigger": {"window": 7}}) == wstac.Config("[trigger]\\nwindow = 7")
    True
    >>> wstac.Config({"trigger": {"window": 71}})
    Traceback (most recent call last):
    wstac.Error: configuration: [trigger] window is 71 frames, expected 1 to 70
    >>> "window = 7" in wstac.Config({"trigger": {"window": 7}}).toml
    True
    """

    _native: _wstac.Config

    def __init__(self, keys: Union[str, Mapping[str, Any]] = "") -> None:
        given: Any = keys
        # A text in TOML has a key, a table or a comment.
        is_text = isinstance(given, str) and (set("=[#") & set(given) or not given.strip())
        if isinstance(given, os.PathLike) or (isinstance(given, str) and (not is_text or os.path.isfile(given))):
            Config.read(given)  # Raises what is wrong with the file.
            hint = f"give wstac.Config.read({os.fsdecode(given)!r})"
            raise Error(f"config is the name of a file, expected what it says: {hint}")
        if isinstance(keys, Mapping):
            self._native = _wstac.Config.from_json(as_json("configuration", keys))
        elif isinstance(keys, str):
            self._native = _wstac.Config(keys)
        else:
            raise TypeError(f"config is a {type(keys).__name__}, expected a wstac.Config, text in TOML or tables")

    @classmethod
    def read(cls, path: Path) -> Config:
        """Reads the configuration in a file, such as `wstac calibrate` writes.

        >>> import pathlib, tempfile, wstac
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "wstac.toml"
        >>> _ = file.write_text("[trigger]\\nwindow = 7")
        >>> wstac.Config.read(file) == wstac.Config({"trigger": {"window": 7}})
        True
        """
        return cls._of(_wstac.Config.read(os.fsdecode(path)))

    @classmethod
    def _of(cls, native: _wstac.Config) -> Config:
        config = cls.__new__(cls)
        config._native = native
        return config

    @property
    def toml(self) -> str:
        """Returns all of it as TOML, defaults included."""
        return self._native.toml

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Config) and self.toml == other.toml

    def __hash__(self) -> int:
        return hash(self.toml)

    def __reduce__(self) -> tuple[Any, ...]:
        return Config, (self.toml,)

    def __repr__(self) -> str:
        return f"wstac.Config({self.toml!r})"


class Model:
    """A texture model: names what slid, from the sample of an event.

    Give it the sample that it takes (`input`); `predict_event` chooses it. It behaves as a fitted classifier of
    scikit-learn: `fit` leaves it as it is, and `sklearn.base.clone` copies it. `TextureClassifier` is one that trains.

    >>> import wstac
    >>> model = wstac.Model.load("builtin:path-svm")
    >>> model.labels[:3], model.task, model.input
    (['Fla0', 'Saw2', 'Saw3'], 'specimen', 'path')
    >>> [event] = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
    >>> model.predict_event(event), model.predict(event.path_sample[None])
    ('Saw3', array(['Saw3'], dtype='<U4'))
    >>> model.name, model.frames, model.n_features_in_, model.classes_.tolist() == model.labels
    ('builtin:path-svm', 39, 700, True)
    >>> model.fit() is model, model.get_params()
    (True, {'name': 'builtin:path-svm'})
    """

    _estimator_type = "classifier"

    def __init__(self) -> None:
        raise TypeError("a model is made by wstac.Model.load")

    _native: _wstac.Model

    @classmethod
    def load(cls, path: Path) -> Model:
        """Loads a model file, or a model that comes with wstac: "builtin" is the best one, "builtin:taxel-path-svm".

        They are, for any speed, direction and length:

        - "builtin:path-svm", "builtin:path-forest" and "builtin:path-boosted", of ten sums;
        - "builtin:taxel-path-svm", "builtin:taxel-path-forest" and "builtin:taxel-path-boosted", of 25 taxels;
        - "builtin:path-svm-16mm" and "builtin:taxel-path-svm-16mm", which read 16 mm of the path instead of 28 mm;
        - "builtin:embedding" and "builtin:taxel-embedding", from which `wstac.learn` makes models of new textures;

        and for the slides of the publication "builtin:svm", "builtin:forest" and "builtin:boosted".

        `wstac train` and `wstac.train` make a model file, and `wstac model import` makes one of what scikit-learn or
        XGBoost trained.
        """
        return cls._of(_wstac.Model.load(os.fsdecode(path)))

    @classmethod
    def from_bytes(cls, content: bytes, name: str = "model") -> Model:
        """Returns the model of a file's bytes, such as `to_bytes` gives; `name` is its name for messages.

        >>> import wstac
        >>> content = wstac.Model.load("builtin:path-svm").to_bytes()
        >>> wstac.Model.from_bytes(content, "mine").name
        'mine'
        """
        return cls._of(_wstac.Model.from_bytes(name, content))

    def to_bytes(self) -> bytes:
        """Returns the bytes of the model's file."""
        return self._native.to_bytes()

    @classmethod
    def _of(cls, native: _wstac.Model) -> Model:
        model = cls.__new__(cls)
        model._native = native
        return model

    @property
    def name(self) -> str:
        """The path or name that it was loaded from."""
        return self._native.name

    @property
    def labels(self) -> list[str]:
        """Names of its classes."""
        return self._native.labels

    @property
    def task(self) -> str:
        """The kind of its classes: "specimen", "pattern", "depth" or "other"."""
        return self._native.task

    @property
    def frames(self) -> int:
        """Number of frames of a sample that it reads, from the first on: 1 to 70. Along the path they are tens of
        numbers."""
        return self._native.frames

    @property
    def input(self) -> str:
        """The sample that it takes.

        - "frames": the array X of a data set, and `Event.sample`;
        - "path": X_path, and `Event.path_sample`;
        - "taxel-path": X_taxel_path, and `Event.taxel_path_sample`;
        - "taxels": X_taxels, and `Event.taxels_sample`.
        """
        return self._native.input

    @property
    def classes_(self) -> NDArray[np.str_]:
        """Names of its classes, as scikit-learn has them."""
        return np.array(self.labels)

    @property
    def n_features_in_(self) -> int:
        """Numbers of a sample: 700, or 1750 of taxels."""
        return inputs_of(self.input)

    def predict(self, X: NDArray[np.int16]) -> NDArray[np.str_]:
        """Returns the label of each sample, (n,).

        X is int16 (n, 10, 70), or (n, 700) feature by feature, or (n, 25, 70) or (n, 1750) of taxels, in units of
        1/2048. The answers are those of a board for the same samples. Of a data set, give the array that `input` names,
        not times its scale. Raises `Error` for samples over time if the model takes those along a path.

        Also a row of zeros has a label, and a sample that is unknown: `known` tells them.
        """
        labels: NDArray[np.str_] = self.classes_[self._native.classes(self._samples(X))]
        return labels

    def predict_event(self, event: Event) -> Optional[str]:
        """Returns the label of an event by the sample that the model takes.

        It is None if there is no answer: without a velocity, for too little of the path, and for what is unknown.
        Raises `Error` if the event was made without `path_samples` and the model needs them.
        """
        by_input: dict[str, Optional[NDArray[np.int16]]] = {
            "frames": event.sample,
            "path": event.path_sample,
            "taxel-path": event.taxel_path_sample,
            "taxels": event.taxels_sample,
        }
        sample = by_input[self.input]
        if sample is None:
            message = f"event: has no {self.input} sample, which {self.name} needs"
            raise Error(f"{message}: open its source with path_samples=True")
        return str(self.predict(sample[None])[0]) if self._answered(sample[None])[0] else None

    def known(self, X: NDArray[np.int16]) -> NDArray[np.bool_]:
        """Returns whether each sample is like those of the training, (n,): `known` of `wstac model eval --json`.

        A row of zeros is not: it has no sample. Raises `Error` for a model that does not tell.

        >>> import numpy, wstac
        >>> events = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
        >>> X = numpy.stack([events[0].path_sample, numpy.zeros((10, 70), numpy.int16)])
        >>> wstac.Model.load("builtin:path-svm").known(X).tolist()
        [True, False]
        """
        found = self._native.known(self._samples(X))
        if found is None:
            raise Error(
                f"{self.name}: does not tell what is unknown, expected a model of wstac train or wstac model calibrate"
            )
        return found

    def predict_proba(self, X: NDArray[np.int16]) -> NDArray[np.float64]:
        """Returns the probability of each class for each sample, (n, classes) in the order of `classes_`.

        X is that of `predict`. Raises `Error` for a model without a calibration. Probabilities are multiples of 2^-15,
        and each is rounded. They hold for textures that the model knows. A row of zeros has none: NaN.

        >>> import wstac
        >>> [event] = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
        >>> model = wstac.Model.load("builtin:path-svm")
        >>> probabilities = model.predict_proba(event.path_sample[None])
        >>> probabilities.shape, model.labels[probabilities[0].argmax()]
        ((1, 10), 'Saw3')
        """
        found = self._native.probabilities(self._samples(X))
        if found is None:
            raise Error(f"{self.name}: has no calibration, expected a model of wstac train or wstac model calibrate")
        return found

    def decision_function(self, X: NDArray[np.int16]) -> NDArray[np.float64]:
        """Returns the score of each class for each sample, (n, classes) in the order of `classes_`; the highest is the
        answer's.

        For two classes it is (n,), above 0 for the second. Scores are in units of the model: sums, or numbers of votes.
        No calibration is needed.

        >>> import wstac
        >>> [event] = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
        >>> model = wstac.Model.load("builtin:path-svm")
        >>> model.labels[model.decision_function(event.path_sample[None])[0].argmax()]
        'Saw3'
        """
        return decision(self._native.scores(self._samples(X)))

    def score(self, X: NDArray[np.int16], y: Sequence[str], sample_weight: Optional[Sequence[float]] = None) -> float:
        """Returns the fraction of samples whose answer is that in y: the accuracy of `wstac model eval`.

        A row of zeros, and a sample that is unknown, has no answer and counts as wrong. (The accuracy of scikit-learn's
        metrics compares labels alone.)

        >>> import wstac
        >>> data = wstac.dataset({"specimens": ["Saw3", "Fla0"], "slides": 8, "sensors": 4}, input="path")
        >>> wstac.Model.load("builtin:path-svm").score(data["X_path"], data["y_specimen"]) > 0.8
        True
        """
        return accuracy(self.predict(X), self._answered(X), y, sample_weight)

    def _answered(self, X: NDArray[np.int16]) -> NDArray[np.bool_]:
        """Returns whether each sample has an answer."""
        flat = self._samples(X)
        return answered(flat, self._native.known(flat))

    def _samples(self, X: NDArray[np.int16]) -> NDArray[np.int16]:
        """Returns samples of either shape, or a table of them, as (n, inputs). Refuses those over time if the model
        takes a path."""
        table: Any = X
        given = feature_names(table)
        if given is not None:
            check_names(self.name, given, sample_names(self.input))
        flat = samples(X if given is None else table.to_numpy(), self.input)
        # The first numbers along a path are a speed, a direction and products of them, all of which are from -1 to 1.
        facts = flat[:, 0:280:70]
        if self.input.endswith("path") and ((facts < -2048) | (facts > 2048)).any():
            row = int(((facts < -2048) | (facts > 2048)).any(axis=1).argmax())
            array = {"path": "X_path", "taxel-path": "X_taxel_path"}[self.input]
            event = {"path": "path_sample", "taxel-path": "taxel_path_sample"}[self.input]
            raise Error(
                f"X: row {row} is no sample along a path, expected those of the array {array}, or of Event.{event}"
            )
        return flat

    def fit(self, X: Any = None, y: Any = None, **_: Any) -> Model:
        """Returns the model as it is, like `sklearn.frozen.FrozenEstimator`: it is trained already."""
        return self

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns what the model was made of, as scikit-learn's estimators do: its name."""
        return {"name": self.name}

    def set_params(self, **params: Any) -> Model:
        """Returns the model; nothing of it can be set.

        >>> import wstac
        >>> wstac.Model.load("builtin:path-svm").set_params(name="mine")
        Traceback (most recent call last):
        wstac.Error: name: cannot be set: the model is trained already; train another one
        """
        if params:
            raise Error(f"{next(iter(params))}: cannot be set: the model is trained already; train another one")
        return self

    def __sklearn_is_fitted__(self) -> bool:
        return True

    def __sklearn_clone__(self) -> Model:
        return self._of(self._native)

    def __sklearn_tags__(self) -> Any:
        return classifier_tags()

    def __reduce__(self) -> tuple[Any, ...]:
        return _model_of, (self.to_bytes(), self.name)

    def __repr__(self) -> str:
        return repr(self._native)


INPUTS = 700
"""Numbers of a sample."""


def inputs_of(input: str) -> int:
    """Returns the numbers of a sample of this input."""
    return 1750 if input == "taxels" else INPUTS


def sample_names(input: str) -> NDArray[np.object_]:
    """Returns the names of a sample's numbers as columns of a table."""
    return np.array([f"{input}{number}" for number in range(inputs_of(input))], dtype=object)


def _model_of(content: bytes, name: str) -> Model:
    """Returns the model of a file's bytes; what pickle calls."""
    return Model.from_bytes(content, name)


def samples(X: Any, input: str) -> NDArray[np.int16]:
    """Returns samples (n, 10, 70) or (n, 700) of int16 as (n, 700), or those of taxels as (n, 1750)."""
    inputs = inputs_of(input)
    if not isinstance(X, np.ndarray):
        raise TypeError(f"X is a {type(X).__name__}, expected a NumPy array")
    _frames.without_mask("X", X)
    if X.ndim not in (2, 3) or X.shape[1:] not in ((inputs // 70, 70), (inputs,)):
        raise Error(f"X: shape {X.shape}, expected (n, {inputs // 70}, 70) or (n, {inputs})")
    if X.dtype != np.int16:
        raise Error(f"X: type {X.dtype}, expected int16 in units of 1/2048, as wstac.dataset gives")
    return np.ascontiguousarray(X.reshape(len(X), inputs))


def answered(flat: NDArray[np.int16], known: Optional[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """Returns whether each sample has an answer: it is not zero, and not said to be unknown."""
    some: NDArray[np.bool_] = np.asarray(flat.any(axis=1))
    return some if known is None else known


def decision(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns scores of classes as scikit-learn has them: one column for two classes."""
    return scores[:, 1] - scores[:, 0] if scores.shape[1] == 2 else scores


def accuracy(found: NDArray[Any], answered: NDArray[np.bool_], y: Any, sample_weight: Any = None) -> float:
    """Returns the fraction of samples that are answered and right."""
    if len(y) != len(found):
        raise Error(f"y: {len(y)} labels, expected {len(found)} as of X")
    if not len(found):
        raise Error("X: no sample, expected at least 1")
    return float(np.average((found == np.asarray(y)) & answered, weights=sample_weight))


def classifier_tags() -> Any:
    """Returns what scikit-learn asks of a classifier of samples. Only scikit-learn calls it."""
    from sklearn.utils import ClassifierTags, InputTags, Tags, TargetTags  # type: ignore[import-untyped,import-not-found,unused-ignore]

    return Tags(
        estimator_type="classifier",
        target_tags=TargetTags(required=True),
        classifier_tags=ClassifierTags(),
        input_tags=InputTags(two_d_array=True, three_d_array=True),
    )


Models = Union[Path, Model, Sequence[Union[Path, Model]]]
"""A model, or several with different tasks; paths and names are loaded."""


Configuration = Union[Config, str, Mapping[str, Any], None]
"""A configuration, or what makes one; None for the source's own, or else the default."""


def native_config(config: Configuration) -> Optional[_wstac.Config]:
    """Returns the configuration of an argument; None for None."""
    if config is None:
        return None
    return config._native if isinstance(config, Config) else Config(config)._native


def native_models(models: Models, model: Optional[Models] = None) -> list[_wstac.Model]:
    """Returns the models of an argument that has two names."""
    if model is not None:
        if models not in ((), []):
            raise TypeError("model and models are both given, expected one of them")
        models = model
    several = [models] if isinstance(models, (str, bytes, os.PathLike, Model)) else models
    if not isinstance(several, Iterable):
        raise TypeError(f"models is a {type(models).__name__}, expected a wstac.Model, its name, or a list of them")
    return [one._native if isinstance(one, Model) else Model.load(one)._native for one in several]
