"""Models of other libraries as model files."""

from __future__ import annotations

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
SCALE = 1 / 2048
ALONG_PATH = {390: "path", 280: "taxel-path"}
"""Inputs of samples along a path that are cut as the command's help says."""


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

    The estimator is one of scikit-learn or a `Pipeline`, of XGBoost, LightGBM or CatBoost; `wstac model --help` lists the kinds.
    Those of scikit-learn need the package skl2onnx, and those of LightGBM onnxmltools. X has samples as the estimator takes them,
    (n, 700) or ten numbers for each of the first frames: best not those of the training, times their scale. `input` is the sample:
    "frames", "path" or "taxel-path". `labels` are the names of `estimator.classes_`, which XGBoost numbers.

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
    real, samples = _samples(X)
    width = real.shape[1]
    if input is None and width in ALONG_PATH:
        along = ALONG_PATH[width]
        raise Error(f"X: {width} numbers are those of input={along!r}, or of the first {width // 10} frames, expected input of save")
    classes = [str(label) for label in np.asarray(getattr(estimator, "classes_", [])).tolist()]
    if labels is not None and len(labels) != len(classes):
        raise Error(f"labels: {len(labels)} names, expected {len(classes)} as of the estimator's classes_")
    names = classes if labels is None else [str(label) for label in labels]
    expected = np.asarray(estimator.predict(real)).reshape(-1).astype(str)
    if labels is not None:
        expected = np.array([dict(zip(classes, names)).get(label, label) for label in expected.tolist()])
    named = type(estimator).__name__
    file = os.fsdecode(path)
    changed, reason = len(expected) + 1, ""
    best: Optional[Model] = None
    for content in _contents(estimator, width):
        try:
            made = _wstac.import_model(named, content, names or None, task, input or "frames", real.mean(axis=0).tolist(), note)
        except Error as error:
            reason = str(error)
            continue
        model = Model.from_bytes(made, file)
        found = model.classes_[model._native.classes(samples)]
        if int((found != expected).sum()) < changed:
            changed, best = int((found != expected).sum()), model
    if best is None:
        raise Error(reason)
    if changed > MOST_CHANGED * len(expected):
        raise Error(
            f"{named}: {changed} of {len(expected)} answers ({100 * changed / len(expected):.1f} %) differ from those of predict, expected "
            "at most 0.5 %; help: train a linear model without a StandardScaler and with more regularization, or train trees"
        )
    try:
        with open(file, "wb" if force else "xb") as output:
            output.write(best.to_bytes())
    except FileExistsError:
        raise Error(f"{file}: exists, expected a new file, or force=True") from None
    return best


def _samples(X: Any) -> tuple[NDArray[np.float64], NDArray[np.int16]]:
    """Returns samples as real numbers (n, inputs), and as int16 (n, 700)."""
    real = np.asarray(X, dtype=np.float64)
    if real.ndim != 2 or not len(real) or real.shape[1] % 10 or not 10 <= real.shape[1] <= 700:
        raise Error(f"X: shape {real.shape}, expected (n, 700), or ten numbers for each of the first frames")
    units = np.rint(real / SCALE)
    if not (np.abs(units + 0.5) < 32769).all() or (np.abs(real / SCALE - units) > 1e-3).any():
        help = "help: train the estimator on X * scale (scale is 1/2048), and give X * scale here"
        raise Error(f"X: numbers from {real.min():g} to {real.max():g}, expected samples times their scale; {help}")
    whole = np.zeros((len(real), 10, 70), np.int16)
    frames = real.shape[1] // 10
    whole[:, :, :frames] = units.reshape(-1, 10, frames)
    return real, whole.reshape(-1, 700)


def _contents(estimator: Any, width: int) -> Iterator[bytes]:
    """Yields the files of an estimator that can be imported, the most exact one first."""
    library = type(estimator).__module__.split(".")[0]
    if library == "xgboost":
        yield bytes(estimator.get_booster().save_raw("json"))
    elif library == "catboost":
        with tempfile.TemporaryDirectory() as folder:
            file = File(folder, "model.onnx")
            estimator.save_model(str(file), format="onnx")
            yield file.read_bytes()
    else:
        package, convert = ("onnxmltools", "convert_lightgbm") if library == "lightgbm" else ("skl2onnx", "convert_sklearn")
        try:
            converter = __import__(package)
            types = __import__(f"{package}.convert.common.data_types" if library == "lightgbm" else "skl2onnx.common.data_types", fromlist=["x"])
        except ImportError:
            raise Error(f"{type(estimator).__name__}: needs the package {package}, expected pip install {package}") from None
        made, why = False, ""
        # Weights of float32 lose answers of some linear models. Trees have the same thresholds in both.
        for kind in (types.DoubleTensorType, types.FloatTensorType):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    onnx = getattr(converter, convert)(estimator, initial_types=[("X", kind([None, width]))], **_options(estimator))
            except Exception as error:  # A converter raises what it likes.
                why = f"{type(error).__name__}: {error}"
                continue
            made = True
            yield onnx.SerializeToString()
        if not made:
            raise Error(f"{type(estimator).__name__}: {package} cannot convert it: {why}")


def _options(estimator: Any) -> dict[str, Any]:
    """Returns options of the conversion: skl2onnx needs one for a LinearSVC behind other steps."""
    last = estimator.steps[-1][1] if hasattr(estimator, "steps") else estimator
    return {"options": {type(last): {"raw_scores": True}}} if type(last).__name__ == "LinearSVC" else {}
