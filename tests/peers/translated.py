"""The peers: each writes C for a trained model, and gets a `classify` around it that takes int16 as ours does.

Their code is used as they write it, with two exceptions that help them and are named in their rows: numbers are passed
without a copy to floats, and float is used instead of double.
"""

from __future__ import annotations

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
import tl2cgen
import treelite

from trained import Trained

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
    ):
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


def emlearn_inline(trained: Trained, place: Path):
    model = emlearn.convert(trained.in_units, method="inline", dtype="int16_t")
    model.save(file=str(place / "model.h"), name="model")
    return emlearn_c(), ".c", ("-I", emlearn.includedir)


def emlearn_loadable(trained: Trained, place: Path):
    model = emlearn.convert(trained.in_units, method="inline", dtype="int16_t")
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
