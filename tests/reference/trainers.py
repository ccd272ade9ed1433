"""Trains the models of table 2, and measures their accuracy. Needs scikit-learn (requirements-train.txt).

Each fit has one thread, so that the same data give the same model on any number of processors.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.exceptions import ConvergenceWarning
from sklearn.feature_selection import VarianceThreshold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC, LinearSVC
from xgboost import XGBClassifier

TABLE = ("Linear-SVM", "random forest", "XGBoost")
"""The models of the paper's table 2."""
OTHER_SVMS = ("SVC, lit features scaled", "SVC, unscaled", "LinearSVC, unscaled")
"""Other readings of "Linear-SVM"."""
DARK_DEVIATION = 0.02
"""Features that deviate less than this from slide to slide are those of frames without light, or before it."""


BINS = 64
"""XGBoost's, of a feature: a quarter of its default, and of the time."""


def new_model(name: str, seed: int) -> Any:
    """A model to be trained. Hyperparameters are its library's defaults unless they are given here."""
    if name == "Linear-SVM":
        return make_pipeline(StandardScaler(), SVC(kernel="linear", C=1))
    if name == "SVC, lit features scaled":
        return make_pipeline(VarianceThreshold(DARK_DEVIATION**2), StandardScaler(), SVC(kernel="linear", C=1))
    if name == "SVC, unscaled":
        return SVC(kernel="linear", C=1)
    if name == "LinearSVC, unscaled":
        return LinearSVC(C=1, random_state=seed)
    if name == "random forest":
        return RandomForestClassifier(n_estimators=100, random_state=seed, n_jobs=1)
    if name == "XGBoost":
        return XGBClassifier(n_estimators=100, tree_method="hist", max_bin=BINS, random_state=seed, n_jobs=1)
    raise ValueError(f"no model {name!r}")


def fit(model: Any, x: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Trains a model to distinguish labels, which it gets as numbers. Returns it with the labels in their order.

    XGBoost takes no other labels. A solver that stops at its default number of iterations is used as it is.
    """
    classes, numbers = np.unique(labels, return_inverse=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(x, numbers)
    return classes
