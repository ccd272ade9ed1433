"""A transformer of scikit-learn's conventions: events to the samples that models take."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._answers import Event
from ._models import INPUTS
from ._wstac import Error

_OF_INPUTS = {"path": "path_sample", "taxel-path": "taxel_path_sample", "frames": "sample"}


class EventSamples:
    """Turns events into an array of samples, (n, 700), as the first step of a pipeline of scikit-learn.

    `input` says which samples: "path" or "taxel-path" along the path, of events that were made with `path_samples`, or "frames"
    over time. An event without such a sample becomes a row of zeros, for which a classifier has no answer.

    >>> import wstac
    >>> events = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
    >>> X = wstac.EventSamples().transform(events)
    >>> X.shape, wstac.Model.load("builtin:path-svm").predict(X).tolist()
    ((1, 700), ['Saw3'])
    >>> samples = wstac.EventSamples(input="path").fit(events)          # learns nothing
    >>> samples.fit_transform(events).tolist() == X.tolist(), samples.get_params(), samples.set_params(input="frames")
    (True, {'input': 'path'}, EventSamples(input='frames'))
    """

    input: str

    def __init__(self, *, input: str = "path") -> None:
        self.input = input

    def fit(self, X: Any = None, y: Any = None) -> EventSamples:
        """Returns the transformer, which learns nothing."""
        return self

    def transform(self, X: Iterable[Event]) -> NDArray[np.int16]:
        """Returns the samples of events, int16 (n, 700)."""
        name = _OF_INPUTS.get(self.input)
        if name is None:
            raise Error(f"input is {self.input!r}, expected {', '.join(_OF_INPUTS)}")
        rows = []
        for number, event in enumerate(X):
            if not isinstance(event, Event):
                raise TypeError(f"X: element {number} is a {type(event).__name__}, expected events")
            sample = getattr(event, name)
            if sample is None:
                raise Error(f"X: event {number} has no {name}, expected events that were made with path_samples = True")
            rows.append(sample.reshape(INPUTS))
        return np.stack(rows) if rows else np.zeros((0, INPUTS), np.int16)

    def fit_transform(self, X: Iterable[Event], y: Any = None) -> NDArray[np.int16]:
        """Returns the samples of events."""
        return self.transform(X)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the arguments of the transformer."""
        return {"input": self.input}

    def set_params(self, **params: Any) -> EventSamples:
        """Sets arguments of the transformer. Returns it."""
        for name, value in params.items():
            if name != "input":
                raise Error(f"{name}: is no parameter, expected input")
            self.input = value
        return self

    def __sklearn_is_fitted__(self) -> bool:
        return True

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import InputTags, Tags, TargetTags, TransformerTags  # type: ignore[import-untyped,import-not-found,unused-ignore]

        return Tags(
            estimator_type="transformer",
            target_tags=TargetTags(required=False),
            transformer_tags=TransformerTags(),
            input_tags=InputTags(two_d_array=False),
            requires_fit=False,
            no_validation=True,
        )

    def __repr__(self) -> str:
        return f"EventSamples(input={self.input!r})"
