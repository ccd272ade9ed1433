"""The peers: each writes C for a trained model, and gets a `classify` around it that takes int16 as ours does.

Their code is used as they write it, with two exceptions that help them and are named in their rows: numbers are passed
without a copy to floats, and float is used instead of double.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import emlearn
import emlearn.trees
import m2cgen
import micromlgen
import numpy as np
import tl2cgen
import treelite

from trained import Trained

TFLITE = Path(os.environ.get("TFLITE", "none"))
"""The sources of TensorFlow Lite Micro, with its helpers."""
BEST = """
    int best = 0;
    for (int k = 1; k < 10; k++) if (out[k] > out[best]) best = k;
    return best;
}
"""


@dataclass
class Peer:
    """The C code of one peer, or the reason why there is none."""

    name: str
    setting: str
    source: Path | None = None
    options: tuple[str, ...] = ()
    why: str = ""

    @property
    def on_host(self) -> bool:
        """Returns whether it is timed on the host as well. Only the best one on the board is."""
        return self.setting.startswith("inline")

    @property
    def slug(self) -> str:
        return re.sub(r"\W+", "-", f"{self.name} {self.setting}".lower()).strip("-")


def peers(trained: Trained, folder: Path) -> Iterator[Peer]:
    """Returns every peer's C for a model. A peer raises an exception if it cannot translate the model."""
    sys.setrecursionlimit(100_000)  # m2cgen nests as deep as a sum has terms
    warnings.filterwarnings("ignore")
    for name, setting, write in (
        ("emlearn 0.23.2", "inline, int16", emlearn_inline),
        ("emlearn 0.23.2", "loadable, int16; its limit of 127 features lifted", emlearn_loadable),
        ("micromlgen 1.1.28", "int16 in, float constants", micromlgen_short),
        ("m2cgen 0.10.0", "int16 in, float for double", m2cgen_float),
        # Its option `quantize` takes more: 156,509 instead of 120,441 instructions for the boosted trees.
        ("tl2cgen 1.0.0", "as written: float", tl2cgen_c),
        ("emlearn 0.23.2", "network, as written: float", emlearn_network),
        ("TensorFlow Lite Micro of tfmicro 0.1.0", "its reference kernel, int16 in, int8 weights", tflite_micro),
        ("plain C", "loops, float weights", plain_c),
    ):
        if trained.kind != "network" and write in (emlearn_network, tflite_micro, plain_c):
            continue
        peer = Peer(name, setting)
        place = folder / trained.kind / peer.slug
        place.mkdir(parents=True, exist_ok=True)
        try:
            text, suffix, peer.options = write(trained, place)
            peer.source = place / f"classify{suffix}"
            peer.source.write_text(text)
        except Exception as error:  # a peer's own refusal, of any type
            peer.why = f"{type(error).__name__}: {error}".splitlines()[0][:120]
        yield peer


def of_trees(trained: Trained):
    if trained.kind == "network":
        raise ValueError("is no tree")
    return trained.in_units


def emlearn_inline(trained: Trained, place: Path):
    model = emlearn.convert(of_trees(trained), method="inline", dtype="int16_t")
    model.save(file=str(place / "model.h"), name="model")
    return emlearn_c(), ".c", ("-I", emlearn.includedir)


def emlearn_loadable(trained: Trained, place: Path):
    model = emlearn.convert(of_trees(trained), method="inline", dtype="int16_t")
    model.save(file=str(place / "model.h"), name="model", inference=["loadable"])
    # A node's feature is an int8 followed by a byte of padding, so int16 costs nothing and counts to 700.
    for header in Path(emlearn.includedir).glob("*.h"):
        wider = re.sub(r"\bint8_t (feature|n_features|features_length)\b", r"int16_t \1", header.read_text())
        (place / header.name).write_text(wider)
    return emlearn_c(), ".c", ()


def emlearn_c() -> str:
    return '#include <stdint.h>\n#include "model.h"\nint classify(const int16_t *x) { return model_predict(x, 700); }\n'


def m2cgen_float(trained: Trained, place: Path):
    text = m2cgen_c(trained).replace("void score(double * input", "void score(const int16_t * input")
    text = re.sub(r"\bdouble\b", "float", text).replace("exp(", "expf(")
    text += "int classify(const int16_t *x) {\n    float out[10];\n    score(x, out);" + BEST
    return text, ".c", ("-fsingle-precision-constant",)


def m2cgen_c(trained: Trained) -> str:
    model = trained.in_units
    if trained.kind == "boosted":
        # It reads both of the arguments of training. It cannot have a start for each class, but one for all changes no
        # answer.
        model.num_parallel_tree, model.base_score = 1, 0.5
    return "#include <stdint.h>\n" + m2cgen.export_to_c(model)


def micromlgen_short(trained: Trained, place: Path):
    text = micromlgen_c(trained).replace("predict(float *x)", "predict(const int16_t *x)")
    text += 'extern "C" int classify(const int16_t *x) { return model.predict(x); }\n'
    return text, ".cpp", ("-fsingle-precision-constant",)


def micromlgen_c(trained: Trained) -> str:
    text = micromlgen.port(trained.in_units).replace("#include <cstdarg>", "#include <stdarg.h>")
    name = re.search(r"class (\w+)", text)[1]
    return f"#include <stdint.h>\n{text}\nstatic Eloquent::ML::Port::{name} model;\n"


def tl2cgen_c(trained: Trained, place: Path):
    if trained.kind == "boosted":
        model = treelite.frontend.from_xgboost(trained.in_units.get_booster())
    elif trained.kind == "lightgbm":
        model = treelite.frontend.from_lightgbm(trained.in_units.booster_)
    elif trained.kind == "forest":
        model = treelite.sklearn.import_model(trained.in_units)
    else:
        raise ValueError("Treelite has no linear models")
    # As one function, the forest is too long for the assembler's branches.
    parameters = {"parallel_comp": 10} if trained.kind == "forest" else {}
    tl2cgen.generate_c_code(model, dirpath=str(place), params=parameters)
    header = (place / "header.h").read_text()
    (place / "header.h").write_text("#pragma once\n" + header)  # all of it is one file here
    number = re.search(r"predict\(.*int pred_margin, (\w+)\* result", header)[1]
    includes = "".join(f'#include "{file.name}"\n' for file in sorted(place.glob("*.c")) if file.stem != "classify")
    return (
        f"#include <stdint.h>\n{includes}"
        "int classify(const int16_t *x) {\n    union Entry in[700];\n    for (int i = 0; i < 700; i++) {\n"
        "        in[i].missing = 0;\n        in[i].fvalue = x[i];\n    }\n"
        f"    {number} out[10] = {{0}};\n    predict(in, 1, out);" + BEST
    ), ".c", ()


def layers(trained: Trained):
    """Returns the weights, one row a sum, and biases of each layer of a network."""
    if trained.kind != "network":
        raise ValueError("is no network")
    model = trained.in_units
    return [(weights.T, bias) for weights, bias in zip(model.coefs_, model.intercepts_, strict=True)]


def emlearn_network(trained: Trained, place: Path):
    layers(trained)
    # Its weights have six decimals, too few for integers.
    # It writes into the folder where it is called.
    with contextlib.chdir(place):
        emlearn.convert(trained.model).save(file=str(place / "model.h"), name="model")
    text = (
        '#include <stdint.h>\n#include "model.h"\nint classify(const int16_t *x) {\n    float in[700];\n'
        "    for (int i = 0; i < 700; i++) in[i] = x[i] / 2048.0f;\n    return model_predict(in, 700);\n}\n"
    )
    return text, ".c", ("-I", emlearn.includedir, "-fsingle-precision-constant")


def listed(kind: str, name: str, numbers: np.ndarray) -> str:
    return f"static const {kind} {name}[] = {{{', '.join(map(str, np.ravel(numbers)))}}};\n"


def plain_c(trained: Trained, place: Path):
    (first, start), (second, end) = layers(trained)
    text = "#include <stdint.h>\n"
    for name, numbers in (("first", first), ("start", start), ("second", second), ("end", end)):
        text += listed("float", name, numbers.astype(np.float32))
    width = len(start)
    text += f"""int classify(const int16_t *x) {{
    float in[700], hidden[{width}], out[10];
    for (int i = 0; i < 700; i++) in[i] = x[i];
    for (int k = 0; k < {width}; k++) {{
        float sum = start[k];
        for (int i = 0; i < 700; i++) sum += first[700 * k + i] * in[i];
        hidden[k] = sum > 0 ? sum : 0;
    }}
    for (int k = 0; k < 10; k++) {{
        float sum = end[k];
        for (int i = 0; i < {width}; i++) sum += second[{width} * k + i] * hidden[i];
        out[k] = sum;
    }}"""
    return text + BEST, ".c", ("-fsingle-precision-constant",)


def tflite_micro(trained: Trained, place: Path):
    """Its kernel of int16 values and int8 weights, which has int64 biases. Values have the range of the test samples."""
    if not TFLITE.exists():
        raise ValueError("its sources are not there")
    values = np.frombuffer(trained.by_feature, "<i2").reshape(-1, 700).astype(float)
    text = '#include "tensorflow/lite/kernels/internal/reference/integer_ops/fully_connected.h"\n'
    calls, unit, inputs = "", 1.0, "x"
    for number, (weights, bias) in enumerate(layers(trained)):
        scale = np.abs(weights).max() / 127
        values = values @ weights.T + bias
        values = np.maximum(values, 0) if number == 0 else values
        out = np.abs(values).max() / 32_767
        factor, shift = np.frexp(unit * scale / out)
        name, count, before = f"layer{number}", len(bias), weights.shape[1]
        text += listed("int8_t", f"weights{number}", np.rint(weights / scale).astype(int))
        text += listed("int64_t", f"biases{number}", np.rint(bias / (unit * scale)).astype(int))
        calls += f"""
    int16_t {name}[{count}];
    params.output_multiplier = {min(round(factor * 2**31), 2**31 - 1)};
    params.output_shift = {shift};
    params.quantized_activation_min = {0 if number == 0 else -32768};
    params.quantized_activation_max = 32767;
    tflite::reference_integer_ops::FullyConnected(
        params, tflite::RuntimeShape({{1, {before}}}), {inputs}, tflite::RuntimeShape({{{count}, {before}}}), weights{number},
        tflite::RuntimeShape({{{count}}}), biases{number}, tflite::RuntimeShape({{1, {count}}}), {name});"""
        inputs, unit = name, out
    text += 'extern "C" int classify(const int16_t *x) {\n    tflite::FullyConnectedParams params = {};' + calls
    text += f"\n    const int16_t *out = {inputs};" + BEST
    gemmlowp = TFLITE / "tensorflow/lite/micro/tools/make/downloads/gemmlowp"
    return text, ".cpp", ("-std=c++14", "-DNDEBUG", "-I", str(TFLITE), "-I", str(gemmlowp))
