"""Models of other libraries as model files."""

from __future__ import annotations

import importlib
import os
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path as File
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from . import _wstac
from ._models import Model, Path
from ._wstac import Error

MOST_CHANGED = 0.005
"""Largest fraction of answers that may differ."""
UNITS = 2048
"""Units in a feature of 1."""
TAXELS = 1750
"""Inputs of samples of taxels."""
ARRAYS = '"frames" for X of a data set, "path" for X_path, "taxel-path" for X_taxel_path, "taxels" for X_taxels'
ONNX = {"lightgbm": ("onnxmltools", "convert_lightgbm"), "sklearn": ("skl2onnx", "convert_sklearn")}
"""What writes ONNX for a library."""


def save(
    estimator: Any,
    X: Any,
    path: Path,
    *,
    input: Optional[str] = None,
    labels: Optional[Sequence[str]] = None,
    task: Optional[str] = None,
    note: Optional[str] = None,
    force: bool = False,
) -> Model:
    """Writes a trained classifier as the model file `path`, and compares its answers with `estimator.predict(X)`.

    The estimator is one of scikit-learn or a `Pipeline`, of XGBoost, LightGBM or CatBoost; `wstac model --help` lists
    the kinds. Those of scikit-learn need the package skl2onnx, and those of LightGBM onnxmltools. X has samples as the
    estimator takes them, times their scale, best not those of the training: (n, 700), or ten numbers for each of the
    first 8 frames or more, or (n, 1750) of taxels. `input` has to say which samples they are: "frames", "path",
    "taxel-path" or "taxels". `labels` are the names of `estimator.classes_`, which XGBoost numbers.

    Raises `Error`, a `ValueError`, if more than 0.5 % of the answers differ; there is no file then. Returns the model.

    >>> import numpy, pathlib, tempfile, wstac
    >>> from sklearn.svm import SVC
    >>> data = wstac.dataset({"specimens": ["Fla0", "Saw4"], "slides": 100, "sensors": 20}, input="path")
    >>> own = data["X_path"].any(axis=(1, 2))
    >>> X, y = data["X_path"][own].reshape(-1, 700) * data["scale"], data["y_specimen"][own]
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "svm.wsm"
    >>> model = wstac.save(SVC(kernel="linear").fit(X, y), X, file, input="path")
    >>> model.labels, wstac.Model.load(file).input
    (['Fla0', 'Saw4'], 'path')
    """
    if input is None:
        raise Error(f"input: is not given, expected {ARRAYS}")
    real, samples = _samples(X)
    width = real.shape[1]
    if not hasattr(estimator, "predict") or not hasattr(estimator, "classes_"):
        raise Error(f"estimator: {type(estimator).__name__} lacks predict or classes_, expected a trained classifier")
    answers = np.asarray(estimator.predict(real)).reshape(-1).astype(str)
    classes = np.asarray(estimator.classes_).astype(str).tolist()
    names = classes if labels is None else [str(label) for label in labels]
    if len(names) != len(classes):
        raise Error(f"labels: {len(names)} names, expected {len(classes)} as of the estimator's classes_")
    name_of = dict(zip(classes, names))
    if other := sorted(set(answers.tolist()) - set(name_of)):
        raise Error(f"estimator: predict returns {other[0]!r}, expected one of classes_: {', '.join(classes)}")
    expected = np.array([name_of[answer] for answer in answers.tolist()])
    # A row of zeros is a slide without a sample, which has no answer.
    own = samples.any(axis=1)
    if not own.any():
        raise Error("X: all numbers are 0, expected samples to compare answers on")
    samples, expected = samples[own], expected[own]
    kind, file = type(estimator).__name__, os.fsdecode(path)
    best: Optional[Model] = None
    fewest, reason = len(expected) + 1, ""
    for content in _contents(estimator, width):
        try:
            made = _wstac.import_model(kind, content, names, task, input, samples, note)
        except Error as error:
            reason = str(error)
            continue
        model = Model.from_bytes(made, file)
        changed = int((model.classes_[model._native.classes(samples)] != expected).sum())
        if changed < fewest:
            best, fewest = model, changed
    if best is None:
        raise Error(reason)
    if fewest > MOST_CHANGED * len(expected):
        found = f"{fewest} of {len(expected)} answers ({100 * fewest / len(expected):.1f} %)"
        raise Error(
            f"{kind}: {found} differ from those of predict, expected at most 0.5 %; help: train a linear model without "
            "a StandardScaler and with more regularization, or train trees"
        )
    write(best, file, force)
    return best


def write(model: Model, file: str, force: bool) -> None:
    """Writes a model to a file, which is new without `force`."""
    try:
        with open(file, "wb" if force else "xb") as output:
            output.write(model.to_bytes())
    except FileExistsError:
        raise Error(f"{file}: exists, expected a new file, or force=True") from None


def _samples(X: Any) -> tuple[NDArray[np.float64], NDArray[np.int16]]:
    """Returns samples as real numbers (n, inputs), and as int16 (n, 700), or (n, 1750) of taxels."""
    real = np.asarray(X, dtype=np.float64)
    # In fewer than eight frames, a touch has hardly begun.
    if real.ndim != 2 or not len(real) or real.shape[1] not in (*range(80, 701, 10), TAXELS):
        expected = f"(n, 700), or ten numbers for each of the first 8 frames or more, or (n, {TAXELS}) of taxels"
        raise Error(f"X: shape {real.shape}, expected {expected}")
    units = np.rint(real * UNITS)
    # NaN fails both comparisons.
    if not ((np.abs(units + 0.5) < 32769) & (np.abs(real * UNITS - units) < 1e-3)).all():
        raise Error(
            f"X: numbers from {real.min():g} to {real.max():g}, expected samples times their scale; "
            "help: train the estimator on X * scale (scale is 1/2048), and give X * scale here"
        )
    if real.shape[1] == TAXELS:
        return real, units.astype(np.int16)
    frames = real.shape[1] // 10
    whole = np.zeros((len(real), 10, 70), np.int16)
    whole[:, :, :frames] = units.reshape(-1, 10, frames)
    return real, whole.reshape(-1, 700)


def _contents(estimator: Any, width: int) -> Iterator[bytes]:
    """Yields the files of an estimator that its library can write."""
    library = type(estimator).__module__.split(".")[0]
    if library == "xgboost":
        yield bytes(estimator.get_booster().save_raw("json"))
    elif library == "catboost":
        with tempfile.TemporaryDirectory() as folder:
            file = File(folder, "model.onnx")
            estimator.save_model(str(file), format="onnx")
            yield file.read_bytes()
    else:
        yield from _converted(estimator, width, *ONNX.get(library, ONNX["sklearn"]))


def _converted(estimator: Any, width: int, package: str, convert: str) -> Iterator[bytes]:
    """Yields an estimator as ONNX of float64, and of float32, which loses answers of some models."""
    kind = type(estimator).__name__
    try:
        converter = getattr(importlib.import_module(package), convert)
        # The types of onnxmltools are its own.
        types = importlib.import_module(f"{package}.{'convert.' if package == 'onnxmltools' else ''}common.data_types")
    except ImportError:
        raise Error(f"{kind}: needs the package {package}; help: pip install {package}") from None
    last = estimator.steps[-1][1] if hasattr(estimator, "steps") else estimator
    # skl2onnx needs this for a LinearSVC behind other steps.
    options = {"options": {type(last): {"raw_scores": True}}} if type(last).__name__ == "LinearSVC" else {}
    made, reason = 0, ""
    for number in (types.DoubleTensorType, types.FloatTensorType):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                onnx = converter(estimator, initial_types=[("X", number([None, width]))], **options)
        except Exception as error:  # A converter raises what it likes.
            reason = f"{type(error).__name__}: {error}"
            continue
        made += 1
        yield onnx.SerializeToString()
    if not made:
        raise Error(f"{kind}: {package} cannot write it: {reason}")
