"""What scikit-learn asks of every estimator, without its base class: it need not be installed."""

from __future__ import annotations

import inspect
import warnings
from typing import Any, Optional, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._wstac import Error

Kind = TypeVar("Kind", bound="Estimator")


class Estimator:
    """The parameters of an estimator, which are the arguments of its class."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Returns the arguments of the estimator."""
        return {name: getattr(self, name) for name in sorted(self._defaults())}

    def set_params(self: Kind, **params: Any) -> Kind:
        """Sets arguments of the estimator. Returns it."""
        names = sorted(self._defaults())
        for name, value in params.items():
            if name not in names:
                raise Error(f"{name}: is no parameter, expected {', '.join(names)}")
            setattr(self, name, value)
        return self

    @classmethod
    def _defaults(cls) -> dict[str, Any]:
        """Returns the parameters with their defaults."""
        return {name: one.default for name, one in list(inspect.signature(cls.__init__).parameters.items())[1:]}

    def __repr__(self) -> str:
        changed = [f"{name}={value!r}" for name, value in self.get_params().items() if value != self._defaults()[name]]
        return f"{type(self).__name__}({', '.join(changed)})"


def feature_names(X: Any) -> Optional[NDArray[np.object_]]:
    """Returns the names of a table's columns; None for what is no table, and for columns that are no text."""
    names = list(getattr(X, "columns", ()))
    if len({isinstance(name, str) for name in names}) > 1:
        raise TypeError("X: Feature names are only supported if all input features have string names")
    return np.array(names, dtype=object) if names and isinstance(names[0], str) else None


def check_names(estimator: str, given: Optional[NDArray[np.object_]], fitted: Optional[NDArray[np.object_]]) -> None:
    """Refuses columns with other names, or in another order, than those of `fit`, in the words of scikit-learn."""
    if given is None or fitted is None:
        if fitted is not None:
            words = f"X does not have valid feature names, but {estimator} was fitted with feature names"
            warnings.warn(words, stacklevel=4)
        elif given is not None:
            warnings.warn(f"X has feature names, but {estimator} was fitted without feature names", stacklevel=4)
    elif given.tolist() != fitted.tolist():
        unseen, missing = set(given) - set(fitted), set(fitted) - set(given)
        words = "X: The feature names should match those that were passed during fit.\n"
        for head, names in (("unseen at fit time", unseen), ("seen at fit time, yet now missing", missing)):
            words += "\n- ".join([f"Feature names {head}:", *sorted(names)[:5]]) + "\n" if names else ""
        raise Error(
            words + ("" if unseen | missing else "Feature names must be in the same order as they were in fit.\n")
        )


def of_scikit_learn(name: str, otherwise: Any) -> Any:
    """Returns an exception of scikit-learn, or the other one if it is not installed."""
    try:
        from sklearn import exceptions  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return otherwise
    return getattr(exceptions, name)
