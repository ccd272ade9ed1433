"""The configuration and texture models."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _wstac
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

    A text in TOML, or tables of keys; all of them have defaults, and unknown ones are errors. `wstac run --help` describes them.

    >>> import wstac
    >>> wstac.Config({"trigger": {"window": 7}}) == wstac.Config("[trigger]\\nwindow = 7")
    True
    >>> wstac.Config({"trigger": {"window": 71}})
    Traceback (most recent call last):
    wstac.Error: configuration: [trigger] window is 71 frames, expected 1 to 70
    """

    _native: _wstac.Config

    def __init__(self, keys: Union[str, Mapping[str, Any]] = "") -> None:
        if isinstance(keys, Mapping):
            self._native = _wstac.Config.from_json(as_json("configuration", keys))
        else:
            self._native = _wstac.Config(keys)

    @classmethod
    def read(cls, path: Path) -> Config:
        """Reads the configuration in a file, such as `wstac calibrate` writes."""
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

    def __repr__(self) -> str:
        return f"wstac.Config({self.toml!r})"


class Model:
    """A texture model: names what slid, from the sample of an event.

    >>> import wstac
    >>> model = wstac.Model.load("builtin:svm")
    >>> model.labels[:3], model.task, model.frames
    (['Fla0', 'Saw2', 'Saw3'], 'specimen', 70)
    >>> [event] = wstac.simulate("Saw3@150", frames=False).events
    >>> model.predict(event.sample[None])
    array(['Saw3'], dtype='<U4')
    """

    def __init__(self) -> None:
        raise TypeError("a model is made by wstac.Model.load")

    _native: _wstac.Model

    @classmethod
    def load(cls, path: Path) -> Model:
        """Loads a model file, or a model that comes with wstac: "builtin:svm", "builtin:forest", "builtin:boosted".

        `wstac model import` makes a model file of what scikit-learn or XGBoost trained.
        """
        model = cls.__new__(cls)
        model._native = _wstac.Model.load(os.fsdecode(path))
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
        """Number of frames of a sample that it reads, from the first on: 1 to 70."""
        return self._native.frames

    def predict(self, X: NDArray[np.int16]) -> NDArray[np.str_]:
        """Returns the label of each sample, (n,).

        X is int16 (n, 10, 70), or (n, 700) feature by feature, in units of 1/2048. The answers are those of a board for the same
        samples. Of a data set, give X (X_path or X_taxel_path, by `input`), not X * scale.
        """
        labels: NDArray[np.str_] = np.array(self.labels)[self._native.classes(self._flat(X))]
        return labels

    @staticmethod
    def _flat(X: NDArray[np.int16]) -> NDArray[np.int16]:
        """Returns samples of either shape as (n, 700)."""
        if not isinstance(X, np.ndarray):
            raise TypeError(f"X is a {type(X).__name__}, expected a NumPy array")
        if X.ndim not in (2, 3) or X.shape[1:] not in ((10, 70), (700,)):
            raise Error(f"X: shape {X.shape}, expected (n, 10, 70) or (n, 700)")
        if X.dtype != np.int16:
            raise Error(f"X: type {X.dtype}, expected int16 in units of 1/2048, as wstac.dataset gives")
        return np.ascontiguousarray(X.reshape(len(X), 700))

    @property
    def input(self) -> str:
        """The sample that it takes: "frames" (the array X), "path" (X_path) or "taxel_path" (X_taxel_path)."""
        return self._native.input

    @property
    def classes_(self) -> NDArray[np.str_]:
        """Names of its classes, as scikit-learn has them."""
        return np.array(self.labels)

    def predict_proba(self, X: NDArray[np.int16]) -> NDArray[np.float64]:
        """Returns the probability of each class for each sample, (n, classes) in the order of `classes_`.

        X is that of `predict`. Raises `Error` for a model without a calibration. Probabilities are multiples of 2^-15, and each
        is rounded. They hold for textures that the model knows.
        """
        found = self._native.probabilities(self._flat(X))
        if found is None:
            raise Error(f"{self.name}: has no calibration, expected a model of wstac train or wstac model calibrate")
        return found

    def score(self, X: NDArray[np.int16], y: Sequence[str]) -> float:
        """Returns the fraction of samples whose label is that in y."""
        if len(y) != len(X):
            raise Error(f"y: {len(y)} labels, expected {len(X)} as of X")
        return float(np.mean(self.predict(X) == np.asarray(y)))

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns what the model was made of, as scikit-learn's estimators do: its name."""
        return {"name": self.name}

    def __repr__(self) -> str:
        return repr(self._native)


Models = Union[Path, Model, Sequence[Union[Path, Model]]]
"""A model, or several with different tasks; paths and names are loaded."""


Configuration = Union[Config, str, Mapping[str, Any], None]
"""A configuration, or what makes one; None for the source's own, or else the default."""


def native_config(config: Configuration) -> Optional[_wstac.Config]:
    """Returns the configuration of an argument; None for None."""
    if config is None:
        return None
    return config._native if isinstance(config, Config) else Config(config)._native


def native_models(models: Models) -> list[_wstac.Model]:
    """Returns the models of an argument."""
    several = [models] if isinstance(models, (str, bytes, os.PathLike, Model)) else models
    return [model._native if isinstance(model, Model) else Model.load(model)._native for model in several]
