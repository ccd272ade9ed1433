"""Compares networks with a linear model on sensors that were not trained: light of 25 taxels along the path."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
from sklearn.neural_network import MLPClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import LinearSVC
from skl2onnx import convert_sklearn
from skl2onnx.common.data_types import FloatTensorType

INPUTS = 280
SETS = {"unseen-train": "slides = 6000\n", "unseen-test": "slides = 3000\nfirst_sensor = 1000\nseed = 2\n"}


def models():
    """Returns untrained models by their descriptions."""

    def network(*widths):
        return make_pipeline(StandardScaler(), MLPClassifier(widths, max_iter=100, early_stopping=True, random_state=0))

    return {
        "`LinearSVC`": LinearSVC(max_iter=3000, random_state=0),
        "network of 32": network(32),
        "network of 64 and 32": network(64, 32),
    }


def unseen(wstac: str, folder: Path) -> str:
    """Returns a table of the accuracy of model files on other sensors than those of their training."""
    for name, sweep in SETS.items():
        (folder / f"{name}.toml").write_text(sweep)
        if not (folder / f"{name}.npz").exists():
            command = [wstac, "dataset", "--input", "taxel-path", folder / f"{name}.toml", "-o", folder / f"{name}.npz"]
            subprocess.run(command, check=True)
    train, test = (folder / f"{name}.npz" for name in SETS)
    with np.load(train) as arrays:
        own = arrays["X_taxel_path"].any(axis=(1, 2))
        X = arrays["X_taxel_path"][own, :, : INPUTS // 10].reshape(-1, INPUTS) * arrays["scale"]
        y = arrays["y_specimen"][own]
    lines = ["| trained on 500 sensors | bytes | right on 500 other sensors, % |", "| --- | --: | --: |"]
    for name, model in models().items():
        onnx, file = folder / "unseen.onnx", folder / "unseen.wsm"
        made = convert_sklearn(model.fit(X.astype(np.float32), y), initial_types=[("X", FloatTensorType([None, INPUTS]))])
        onnx.write_bytes(made.SerializeToString())
        command = [wstac, "model", "import", onnx, "-o", file, "--force", "--input", "taxel-path", "--check", train]
        subprocess.run(command, check=True)
        found = json.loads(subprocess.check_output([wstac, "model", "eval", file, test, "--json"]))
        lines.append(f"| {name} | {file.stat().st_size:,} | {100 * found['accuracy']:.1f} |")
    return "\n".join([*lines, ""])
