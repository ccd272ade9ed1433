"""Models that may be shipped, and how they are trained and saved. Needs scikit-learn, XGBoost, skl2onnx."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import skl2onnx
from skl2onnx.common.data_types import FloatTensorType
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.exceptions import ConvergenceWarning
from sklearn.svm import SVC
from xgboost import XGBClassifier

from scenes import SPECIMENS


@dataclass(frozen=True)
class Candidate:
    """A model that may be shipped as `kind`.wsm: its name in Python, its parameters, and options of its import."""

    kind: str
    words: str
    make: Callable[[], Any]
    options: Sequence[str] = ()

    def train(self, x: np.ndarray, specimen: np.ndarray) -> Any:
        """Trains the model to name specimens."""
        model = self.make()
        # XGBoost takes numbers as labels, and saves none.
        labels = np.searchsorted(LABELS, specimen) if isinstance(model, XGBClassifier) else specimen
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            model.fit(x.astype(np.float32), labels)
        if isinstance(model, ExtraTreesClassifier):
            vote_for_one(model)
        return model

    def save(self, model: Any, folder: Path, inputs: int = 700) -> tuple[Path, list[str]]:
        """Returns the trainer's file of a model with this many inputs, and all options that its import needs."""
        if isinstance(model, XGBClassifier):
            path = folder / f"{self.kind}.json"
            model.save_model(path)
            return path, ["--labels", ",".join(LABELS), *self.options]
        path = folder / f"{self.kind}.onnx"
        with warnings.catch_warnings():
            # The converter reads attributes that scikit-learn will drop.
            warnings.simplefilter("ignore", FutureWarning)
            onnx = skl2onnx.convert_sklearn(model, initial_types=[("X", FloatTensorType([None, inputs]))])
        path.write_bytes(onnx.SerializeToString())
        return path, list(self.options)


def answers(model: Any, x: np.ndarray) -> np.ndarray:
    """Returns the names that the trained model itself gives."""
    found = model.predict(x.astype(np.float32))
    return LABELS[found] if isinstance(model, XGBClassifier) else found


LABELS = np.array(sorted(SPECIMENS))
"""Classes in their order: scikit-learn's is the alphabet's."""

CANDIDATES = (
    Candidate("svm", "SVC(kernel=\"linear\", C=1)", lambda: SVC(kernel="linear", C=1)),
    Candidate("svm", "SVC(kernel=\"linear\", C=1)", lambda: SVC(kernel="linear", C=1), ("--weights", "int8")),
    Candidate(
        "forest",
        "ExtraTreesClassifier(50, max_leaf_nodes=320, max_features=60), leaves of one class",
        lambda: ExtraTreesClassifier(50, max_leaf_nodes=320, max_features=60, random_state=0, n_jobs=1),
    ),
    Candidate("boosted", "XGBClassifier(100, max_depth=3)", lambda: boosted(100, 3)),
)
"""What is compared; of each kind the most accurate that is small enough is shipped."""


def vote_for_one(forest: ExtraTreesClassifier) -> None:
    """Makes every leaf vote only for its most frequent class, because a leaf of shares takes ten times the bytes."""
    for tree in forest.estimators_:
        votes = tree.tree_.value[:, 0, :]
        votes[:] = np.eye(votes.shape[1])[votes.argmax(axis=1)]


def boosted(rounds: int, depth: int) -> XGBClassifier:
    """Returns an XGBoost model that trains fast and is small."""
    return XGBClassifier(
        n_estimators=rounds,
        max_depth=depth,
        learning_rate=0.5,
        subsample=0.8,
        colsample_bytree=0.5,
        colsample_bynode=0.1,
        tree_method="hist",
        max_bin=64,
        random_state=0,
        n_jobs=1,
    )
