#!/usr/bin/env python3
"""Compares our texture models with other translations of the same trained models, on an emulated Cortex-M4 and on this
machine, and writes docs/MODELS.md.

    compare.py WSTAC FOLDER [KIND…]    the command, the folder where everything is made and kept, and the kinds of models
                                       whose parts of the page are written, all by default (`ci/measure peers` does it)
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import lightgbm
import numpy as np
import onnxruntime
import xgboost

from trained import KINDS, UNITS, Trained, all_trained
from translated import Peer, peers
from unseen import unseen

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests/m4"))
import board  # noqa: E402 (it is a directory beside this one)

ROUNDS = 15
"""Rounds over the test samples on the host; the fastest counts."""
FLASH = 4 << 20
"""The emulated board's."""
TITLES = {"lightgbm": "LightGBM"}
"""Heads of kinds that are a name."""
PATIENCE = 1800
"""Seconds that a compiler may take over one model."""


@dataclass
class Row:
    """One line of a model's tables."""

    name: str
    setting: str
    cost: board.Cost | None = None
    agreement: float = 0.0
    library: Path | None = None
    by_frame: bool = False
    ns: float | None = None
    why: str = ""

    def measure(self, file: Path, samples: bytes, answers: np.ndarray) -> None:
        """Runs it on the board."""
        self.cost = cost = board.measure(file, samples)
        self.agreement = 100 * statistics.fmean(np.frombuffer(cost.classes, np.uint8) == answers)
        done = f"{cost.mean:,.0f} instructions, {cost.flash:,} bytes, {self.agreement:.2f} %"
        print(f"{self.name}, {self.setting}: {done}", flush=True)


def ours(wstac: str, trained: Trained, folder: Path) -> list[Row]:
    """Returns our backends: the model file, and generated Rust if import writes it."""
    rows = []
    options = ("--check", folder / "train.npz") if trained.kind == "network" else ()
    for setting, suffix in (("table (the model file)", ".wsm"), ("inline (generated Rust)", ".rs")):
        row = Row("WSTac", setting, by_frame=True)
        file = folder / f"{trained.kind}{suffix}"
        command = [wstac, "model", "import", trained.file, "-o", file, "--force", *options]
        done = subprocess.run(command, capture_output=True, text=True)
        print(done.stderr.strip())
        if done.returncode:
            row.why = done.stderr.strip().splitlines()[-1].replace(f"wstac: {trained.file}: ", "")
        else:
            row.library = native(file, folder)
            row.measure(file, trained.by_frame, trained.answers)
        rows.append(row)
    return rows


def native(file: Path, folder: Path) -> Path:
    """Returns our model as a shared library for this machine."""
    environment = os.environ | {board.VARIABLES[file.suffix]: str(file.resolve())}
    target = folder / "native"
    command = ["cargo", "build", "--quiet", "--locked", "--release", "--target-dir", target]
    subprocess.run(command, cwd=HERE / "native", env=environment, check=True)
    return Path(shutil.copy(target / "release/libwstac_peers_native.so", folder / f"ours-{file.stem}{file.suffix}.so"))


def theirs(peer: Peer, trained: Trained, folder: Path) -> Row:
    """Builds a peer's code for the board, and as a library for this machine."""
    row = Row(peer.name, peer.setting, why=peer.why)
    if peer.source is None:
        return row
    made, library = peer.source.with_suffix(".o"), peer.source.with_suffix(".so")
    options = [*peer.options, "-w", "-I", str(peer.source.parent)]
    if peer.source.suffix == ".cpp":
        options += ["-fno-exceptions", "-fno-rtti"]
    row.why = compiled(peer, made, [ROOT / "tests/m4/object", made, peer.source, *options])
    if not row.why and size_of(made) > FLASH:
        row.why = f"{size_of(made):,} bytes, the board has {FLASH:,}"
    if row.why:
        return row
    row.measure(made, trained.by_feature, trained.answers)
    if peer.on_host:
        row.why = compiled(peer, library, ["gcc", "-O2", "-shared", "-fPIC", "-o", library, peer.source, *options, "-lm"])
        row.library = None if row.why else library
    return row


def compiled(peer: Peer, made: Path, command: list) -> str:
    """Compiles a peer's code, unless the same command has compiled the same code before. Returns the error, if any.
    Large code takes a compiler minutes.
    """
    sources = sorted(file for file in peer.source.parent.iterdir() if file.suffix in {".c", ".cpp", ".h"})
    key = hashlib.sha256(b"".join(file.read_bytes() for file in sources) + " ".join(map(str, command)).encode()).hexdigest()
    stamp = made.with_name(f"{made.name}.key")
    if made.exists() and stamp.exists() and stamp.read_text() == key:
        return ""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return f"not compiled within {PATIENCE // 60} minutes"
    if re.search(r"(Terminated|Killed) signal", done.stderr):
        raise SystemExit(f"{peer.name}: the compiler was ended from outside: {done.stderr}")
    if done.returncode:
        return "does not compile: " + next((line for line in done.stderr.splitlines() if "error" in line), "")[:120]
    stamp.write_text(key)
    return ""


def size_of(made: Path) -> int:
    """Returns the bytes of code and constants in an object file."""
    text, data, *_ = subprocess.check_output(["arm-none-eabi-size", made], text=True).splitlines()[1].split()
    return int(text) + int(data)


def time_libraries(rows: list[Row], trained: Trained, folder: Path) -> None:
    """Returns the nanoseconds of one answer. All libraries take turns in every round."""
    timer = folder / "host"
    subprocess.run(["gcc", "-O2", "-o", timer, HERE / "host.c"], check=True)
    files = {True: folder / "by_frame", False: folder / "by_feature"}
    files[True].write_bytes(trained.by_frame)
    files[False].write_bytes(trained.by_feature)
    there = [row for row in rows if row.library]
    words = [str(word) for row in there for word in (row.library, files[row.by_frame])]
    printed = subprocess.check_output([timer, str(ROUNDS), *words], text=True).split()
    for row, ns in zip(there, printed, strict=True):
        row.ns = float(ns)


def time_runtimes(trained: Trained) -> list[Row]:
    """Times the call from a Python program, one sample per call. Returns the fastest of several rounds."""
    logs = np.frombuffer(trained.by_feature, "<i2").reshape(-1, 1, 700).astype(np.float32) / UNITS
    rows = []

    def add(name, setting, call, calls):
        for sample in logs[:5]:
            call(sample)
        times = []
        for _ in range(5):
            start = time.perf_counter_ns()
            for sample in logs[:calls]:
                call(sample)
            times.append((time.perf_counter_ns() - start) / calls)
        rows.append(Row(name, setting, ns=min(times)))

    if trained.kind == "boosted":
        booster = trained.model.get_booster()
        booster.set_param({"nthread": 1})
        add(f"XGBoost {xgboost.__version__}", "`Booster.inplace_predict`, 1 thread", booster.inplace_predict, 300)
    elif trained.kind == "lightgbm":
        call = lambda sample: trained.model.booster_.predict(sample, num_threads=1)  # noqa: E731
        add(f"LightGBM {lightgbm.__version__}", "`Booster.predict`, 1 thread", call, 300)
    else:
        add("scikit-learn 1.9.1", "`predict`", trained.model.predict, 50)
    if trained.onnx:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        session = onnxruntime.InferenceSession(str(trained.onnx), options, providers=["CPUExecutionProvider"])
        names = [output.name for output in session.get_outputs()][:1]
        key = session.get_inputs()[0].name
        call = lambda sample: session.run(names, {key: sample})  # noqa: E731
        add(f"ONNX Runtime {onnxruntime.__version__}", "1 thread", call, 1000)
    return rows


def compare(wstac: str, trained: Trained, folder: Path) -> str:
    """Writes one model's part of the document."""
    rows = ours(wstac, trained, folder)
    rows += (theirs(peer, trained, folder) for peer in peers(trained, folder))
    time_libraries(rows, trained, folder)
    text = tables(trained, rows, time_runtimes(trained))
    if trained.kind != "network":
        return text
    return f"{text}\nAlong the path of other sensors than those of the training, light of 25 taxels:\n\n{unseen(wstac, folder)}"


def tables(trained: Trained, rows: list[Row], runtimes: list[Row]) -> str:
    """Returns Markdown: the board's table, then the host's times."""
    lines = [f"## {TITLES.get(trained.kind, trained.kind.capitalize())}", "", f"{trained.facts}.", ""]
    lines += ["| Cortex-M4 | setting | instructions, mean | maximum | flash, bytes | agreement, % |", "| --- | --- | --: | --: | --: | --: |"]
    for row in rows:
        if row.cost:
            cost = row.cost
            lines.append(f"| {row.name} | {row.setting} | {cost.mean:,.0f} | {cost.most:,} | {cost.flash:,} | {row.agreement:.2f} |")
    times = sorted((row for row in rows + runtimes if row.ns), key=lambda row: row.ns)
    lines += ["", "On a host, ns: " + "; ".join(f"{row.name} ({row.setting}) {row.ns:,.0f}" for row in times) + "."]
    for row in (row for row in rows if row.why):
        print(f"{trained.kind}: {row.name}, {row.setting}: {row.why}", file=sys.stderr)
    return "\n".join([*lines, ""])


def main() -> None:
    if len(sys.argv) < 3 or not set(sys.argv[3:]) <= set(KINDS):
        raise SystemExit(__doc__)
    wstac, folder, page = sys.argv[1], Path(sys.argv[2]).resolve(), ROOT / "docs/MODELS.md"
    found = {trained.kind: compare(wstac, trained, folder) for trained in all_trained(wstac, folder, tuple(sys.argv[3:]) or KINDS)}
    before = {part.split("\n", 1)[0].lower(): f"## {part.rstrip()}\n" for part in page.read_text().split("\n## ")[1:]}
    parts = [part for kind in KINDS if (part := found.get(kind, before.get(kind)))]
    text = (HERE / "head.txt").read_text()
    page.write_text("\n".join([text, *parts]).rstrip() + "\n\n`ci/measure peers` writes this page.\n")


if __name__ == "__main__":
    main()
