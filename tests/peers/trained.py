"""The data and the trained models that are compared. All of it is made once and kept in one folder."""

from __future__ import annotations

import copy
import json
import pickle
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import lightgbm
import numpy as np
import xgboost
from onnxmltools import convert_lightgbm, convert_xgboost
from onnxmltools.convert.common.data_types import FloatTensorType as Floats
from sklearn.ensemble import RandomForestClassifier
from sklearn.neural_network import MLPClassifier
from sklearn.svm import LinearSVC
from skl2onnx import convert_sklearn
from skl2onnx.common.data_types import FloatTensorType

UNITS = 2048
"""A feature's integer is its natural logarithm times this. Being a power of two it scales float thresholds exactly."""
SWEEP = "speeds = [100, 150, 200]\ndirections = [0, 90, 180, 270]\nslides = {slides}\nseed = {seed}\n"
TRAIN, TEST = {"slides": 100, "seed": 1}, {"slides": 200, "seed": 100_001}
KINDS = ("linear", "boosted", "lightgbm", "forest", "network")


@dataclass
class Trained:
    """A model as it was trained on logarithms, and the same model for integers, which suit the peers best."""

    kind: str
    model: object
    in_units: object
    file: Path
    """What `wstac model import` reads."""
    onnx: Path | None
    answers: np.ndarray
    """What the trained model itself says of the test samples."""
    facts: str
    by_frame: bytes = field(repr=False, default=b"")
    """The test samples as Wstac has them, frame by frame."""
    by_feature: bytes = field(repr=False, default=b"")
    """The same as the models were trained on them, feature by feature."""


def samples(wstac: str, folder: Path, name: str, sweep: dict[str, int]) -> tuple[np.ndarray, np.ndarray]:
    """Returns a sweep's samples, int16 (n, 10, 70), and their classes."""
    file = folder / f"{name}.npz"
    if not file.exists():
        (folder / f"{name}.toml").write_text(SWEEP.format(**sweep))
        subprocess.run([wstac, "dataset", folder / f"{name}.toml", "-o", file], check=True)
    with np.load(file) as arrays:
        return arrays["X"], np.unique(arrays["y_specimen"], return_inverse=True)[1]


def kept(path: Path, make):
    """Returns the result of `make`, which is stored in a file the first time."""
    if not path.exists():
        path.write_bytes(pickle.dumps(make()))
    return pickle.loads(path.read_bytes())


def all_trained(wstac: str, folder: Path, kinds: tuple[str, ...]) -> list[Trained]:
    """Trains what is not stored yet, and checks that the models for integers answer like the trained ones."""
    folder.mkdir(parents=True, exist_ok=True)
    X, y = samples(wstac, folder, "train", TRAIN)
    test, truth = samples(wstac, folder, "test", TEST)
    logs = (X.reshape(len(X), -1) / UNITS).astype(np.float32)
    flat = test.reshape(len(test), -1)
    test_logs = (flat / UNITS).astype(np.float32)
    makers = {"forest": forest, "boosted": boosted, "lightgbm": gradient_boosted, "linear": linear, "network": network}
    found = []
    # A library that is imported here makes an underflow of exp an error.
    np.seterr(under="ignore")
    for kind in kinds:
        model = kept(folder / f"{kind}.pickle", lambda: makers[kind](logs, y))
        in_units = UNITED[kind](model)
        answers = model.predict(test_logs)
        if not np.array_equal(in_units.predict(flat.astype(np.float32)), answers):
            raise SystemExit(f"{kind}: the model for integers is not the same")
        file, onnx = save(kind, model, folder)
        right = 100 * float((answers == truth).mean())
        facts = f"{describe(kind, model, test_logs)}; {right:.1f} % of the test samples correct"
        frames = np.ascontiguousarray(test.transpose(0, 2, 1)).astype("<i2").tobytes()
        found.append(Trained(kind, model, in_units, file, onnx, answers, facts, frames, flat.astype("<i2").tobytes()))
    return found


def forest(X, y):
    return RandomForestClassifier(100, random_state=0).fit(X, y)


def boosted(X, y):
    # 64 bins per feature train four times as fast. The weight makes the trees as large as they are on recorded data.
    return xgboost.XGBClassifier(n_estimators=100, max_bin=64, min_child_weight=0.4, n_jobs=1).fit(X, y)


def gradient_boosted(X, y):
    # As many splits as the trees of XGBoost have, for C compilers take very long over code of much larger trees.
    options = {"num_leaves": 7, "max_bin": 64, "random_state": 0, "n_jobs": 1, "verbose": -1}
    return lightgbm.LGBMClassifier(n_estimators=100, **options).fit(X, y)


def linear(X, y):
    return LinearSVC(C=0.01, max_iter=20_000, random_state=0).fit(X, y)


def network(X, y):
    return MLPClassifier((32,), max_iter=100, random_state=0).fit(X, y)


def network_in_units(model):
    model = copy.deepcopy(model)
    model.coefs_[0] = model.coefs_[0] / np.float32(UNITS)
    return model


def forest_in_units(model):
    model = copy.deepcopy(model)
    for tree in model.estimators_:
        tree.tree_.threshold[:] *= UNITS
    return model


def boosted_in_units(model):
    raw = json.loads(bytes(model.get_booster().save_raw("json")))
    for tree in raw["learner"]["gradient_booster"]["model"]["trees"]:
        # The same list has the value of a leaf.
        split = [left >= 0 for left in tree["left_children"]]
        tree["split_conditions"] = [t * UNITS if s else t for t, s in zip(tree["split_conditions"], split, strict=True)]
    scaled = xgboost.XGBClassifier()
    scaled.load_model(bytearray(json.dumps(raw).encode()))
    return scaled


def gradient_boosted_in_units(model):
    def in_units(found: re.Match) -> str:
        return "threshold=" + " ".join(repr(float(threshold) * UNITS) for threshold in found[1].split())

    text = re.sub(r"^threshold=(.*)$", in_units, model.booster_.model_to_string(), flags=re.MULTILINE)
    model = copy.deepcopy(model)
    # Without the sizes of the former trees, they are read one after the other.
    model._Booster = lightgbm.Booster(model_str=re.sub(r"^tree_sizes=.*\n", "", text, flags=re.MULTILINE))
    return model


def linear_in_units(model):
    model = copy.deepcopy(model)
    model.coef_ = model.coef_ / UNITS
    return model


UNITED = {
    "forest": forest_in_units, "boosted": boosted_in_units, "lightgbm": gradient_boosted_in_units,
    "linear": linear_in_units, "network": network_in_units,
}


def save(kind: str, model, folder: Path) -> tuple[Path, Path | None]:
    """Writes the files that Wstac imports and that ONNX Runtime runs."""
    onnx = folder / f"{kind}.onnx"
    inputs = [("X", FloatTensorType([None, 700]))]
    if kind == "lightgbm":
        onnx.write_bytes(convert_lightgbm(model, initial_types=[("X", Floats([None, 700]))]).SerializeToString())
        return onnx, onnx
    if kind == "boosted":
        file = folder / "boosted.ubj"
        model.save_model(file)
        try:
            onnx.write_bytes(convert_xgboost(model, initial_types=[("X", Floats([None, 700]))]).SerializeToString())
        except Exception as error:  # whatever error a converter has, there is no file for ONNX Runtime
            print(f"onnxmltools cannot convert the boosted trees: {error}")
            return file, None
        return file, onnx
    options = {id(model): {"zipmap": False}} if kind in ("forest", "network") else None
    onnx.write_bytes(convert_sklearn(model, initial_types=inputs, options=options).SerializeToString())
    return onnx, onnx


def leaf_depths(node: dict, depth: int = 0) -> Iterator[tuple[int, int]]:
    """Returns each leaf of a tree of LightGBM, and how many splits lead to it."""
    if "split_feature" not in node:
        yield node.get("leaf_index", 0), depth
        return
    for side in ("left_child", "right_child"):
        yield from leaf_depths(node[side], depth + 1)


def describe(kind: str, model, test) -> str:
    """Describes its size."""
    if kind == "linear":
        return f"`LinearSVC`, {model.coef_.shape[0]} × {model.coef_.shape[1]} weights"
    if kind == "network":
        return "`MLPClassifier`, " + " × ".join(map(str, [700, *(len(bias) for bias in model.intercepts_)]))
    if kind == "forest":
        trees = [tree.tree_ for tree in model.estimators_]
        splits = sum(int((tree.children_left >= 0).sum()) for tree in trees)
        visits = sum(tree.decision_path(test).sum() - len(test) for tree in trees) / len(test)
        return f"`RandomForestClassifier`, {len(trees)} trees, {splits:,} splits, {visits:,.0f} of them visited per sample"
    if kind == "lightgbm":
        trees = [tree["tree_structure"] for tree in model.booster_.dump_model()["tree_info"]]
        depths = [dict(leaf_depths(tree)) for tree in trees]
        leaves = model.booster_.predict(test, pred_leaf=True)
        visits = sum(depths[k][leaf] for row in leaves for k, leaf in enumerate(row)) / len(test)
        splits = sum(len(depth) - 1 for depth in depths)
        return f"`LGBMClassifier`, 100 rounds of 10 trees, {splits:,} splits, {visits:,.0f} of them visited per sample"
    booster = model.get_booster()
    raw = json.loads(bytes(booster.save_raw("json")))["learner"]["gradient_booster"]["model"]["trees"]
    leaves = booster.predict(xgboost.DMatrix(test), pred_leaf=True).astype(int).reshape(len(test), -1)
    visits, splits = 0.0, 0
    for k, tree in enumerate(raw):
        left, right = tree["left_children"], tree["right_children"]
        splits += sum(child >= 0 for child in left)
        depth = np.zeros(len(left))
        for node, child in enumerate(left):
            if child >= 0:
                depth[child] = depth[right[node]] = depth[node] + 1
        visits += depth[leaves[:, k]].mean()
    return f"`XGBClassifier`, 100 rounds of 10 trees, {splits:,} splits, {visits:,.0f} of them visited per sample"
