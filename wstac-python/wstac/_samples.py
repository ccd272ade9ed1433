"""A transformer of scikit-learn's conventions: events to the samples that models take."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterable
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._answers import Event
from ._estimator import Estimator
from ._models import inputs_of, sample_names
from ._wstac import Error

_OF_INPUTS = {"path": "path_sample", "taxel-path": "taxel_path_sample", "frames": "sample", "taxels": "taxels_sample"}


class EventSamples(Estimator):
    """Turns events into an array of samples, (n, 700), as the first step of a pipeline of scikit-learn.

    `input` says which samples: "path" or "taxel-path" along the path, "taxels" (n, 1750) of events that were made with
    `path_samples`, or "frames" over time. An event without such a sample becomes a row of zeros, for which a classifier
    has no answer.

    >>> import wstac
    >>> events = wstac.simulate("Saw3@150", frames=False, path_samples=True).events
    >>> X = wstac.EventSamples().transform(events)
    >>> X.shape, wstac.Model.load("builtin:path-svm").predict(X).tolist()
    ((1, 700), ['Saw3'])
    >>> samples = wstac.EventSamples(input="path").fit(events)          # learns nothing
    >>> samples.fit_transform(events).tolist() == X.tolist(), samples.get_params(), samples.set_params(input="frames")
    (True, {'input': 'path'}, EventSamples(input='frames'))
    >>> table = wstac.EventSamples().set_output(transform="pandas").transform(events)     # or "polars", or "default"
    >>> table.columns.tolist() == wstac.EventSamples().get_feature_names_out().tolist(), table.columns[699]
    (True, 'path699')
    """

    input: str

    def __init__(self, *, input: str = "path") -> None:
        self.input = input

    def fit(self, X: Any = None, y: Any = None) -> EventSamples:
        """Returns the transformer, which learns nothing."""
        return self

    def transform(self, X: Iterable[Event]) -> Any:
        """Returns the samples of events, int16 (n, 700): an array, or what `set_output` or `sklearn.set_config` asks
        for."""
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
            rows.append(sample.reshape(-1))
        found = np.stack(rows) if rows else np.zeros((0, inputs_of(self.input)), np.int16)
        # The default for all transformers is set in scikit-learn, if it is loaded.
        sklearn = sys.modules.get("sklearn")
        default = sklearn.get_config()["transform_output"] if sklearn else None
        kind = vars(self).get("_sklearn_output_config", {"transform": default})["transform"]
        columns = self.get_feature_names_out().tolist()
        options = {"pandas": {"columns": columns}, "polars": {"schema": columns, "orient": "row"}}.get(kind)
        return found if options is None else importlib.import_module(kind).DataFrame(found, **options)

    def fit_transform(self, X: Iterable[Event], y: Any = None) -> Any:
        """Returns the samples of events."""
        return self.transform(X)

    def get_feature_names_out(self, input_features: Any = None) -> NDArray[np.object_]:
        """Returns the names of the columns: `input` and the number in the sample, such as "path0"."""
        return sample_names(self.input)

    def set_output(self, *, transform: Optional[str] = None) -> EventSamples:
        """Sets what `transform` returns: "default", which is an array, "pandas" or "polars". None leaves it."""
        if transform not in (None, "default", "pandas", "polars"):
            raise Error(f"transform is {transform!r}, expected default, pandas or polars")
        if transform is not None:
            # The name is that of scikit-learn, whose clone copies it.
            self._sklearn_output_config = {"transform": transform}
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
