#!/usr/bin/env python3
"""Counts the cost of every setting on emulated boards, for `wstac trade`: instructions, flash and RAM.

    prices.py WSTAC                                       counts everything anew; a price that is over 2 % off the published one fails
    prices.py WSTAC --keep [MODEL.wsm … | LAW]            keeps it in wstac-tradeoff/data/prices.json: everything, or these models, or this law
    prices.py WSTAC --check CONFIG.toml MODEL PIXELS CORE     one configuration, whole frames and parts of events; "-" for no file

The price of a setting is what it adds. Formats (with their stride) include the firmware without a model, with the
fixed-point logarithm and the law of coherence. The others are differences. Models over time are counted with the
published law, and models of the path with the laws of arrival times: stacks of a law and of a model are no sum. So the
price of a configuration is a sum, which is compared with four counts. The events and features of every count are the
host's.
"""

import hashlib
import json
import sys
import tempfile
import time
from pathlib import Path

import boards
from boards import BOARDS, ROOT
from counter import FORMATS, Counter, Setting, formats, law_of, over_time

KEPT = ROOT / "wstac-tradeoff/data/prices.json"
STRIDES = (1, 2, 3, 5)
KERNELS = ("fixed", "libm", "micromath")
# The model with which logarithms are counted for models of the path.
PATH_MODEL = "path-svm.wsm"
# The largest error of a sum, as a fraction of the count. A logarithm's part of an answer was counted with another law,
# whose velocity gives the path other steps. The stacks of a law and of a logarithm are no sum. `wstac trade` takes costs
# within this as equal.
SLACK = 0.02
# The largest difference of a count from a published price. A compiler's output differs a little between two paths of a
# checkout.
PUBLISHED_SLACK = 0.02
# The keys of [speed].
LAWS = {"wave": 'estimator = "wave"', "coherence": 'estimator = "coherence"', "edges": 'estimator = "edges"', "published": 'law = "published"'}
# Format, stride, logarithm, law, model.
MIXED = (
    ("RGB565", 2, "libm", "published", "svm.wsm"),
    ("YUYV linear", 3, "micromath", "published", "forest.wsm"),
    ("BAYER8", 5, "libm", "edges", "path-boosted.wsm"),
    ("BAYER8", 2, "micromath", "wave", "taxel-path-svm.wsm"),
)


def models():
    """Returns the models by name: all but embeddings, which say nothing about specimens."""
    files = [file for folder in ("path", ".", "tradeoff") for file in sorted(ROOT.glob(f"wstac-host/models/{folder}/*.wsm")) if "embedding" not in file.name]
    return {file.name: file for file in files}


def laws_of(model):
    """Returns the laws with which the study weighs a model."""
    return ("published",) if over_time(model) else ("wave", "coherence", "edges")


def pick(numbers, *keys):
    return {key: numbers[key] for key in keys}


def less(numbers, base, *keys):
    return {key: numbers[key] - base[key] for key in keys}


def measure(counter, chosen, laws, kept, save):
    """Collects the prices of these models with these laws, and saves each at once. `kept` ones stay if not everything is counted."""
    began, done = time.monotonic(), 0
    cores = json.loads(json.dumps(kept)) if kept else {board.core: {"formats": {}, "ln": {}, "laws": {}, "models": {}} for board in BOARDS}
    # By law, then by core.
    base = {}

    def each(setting, take, **how):
        nonlocal done
        for core, numbers in counter.setting(setting, **how).items():
            take(core, numbers)
        done += 1
        save(cores)
        name = setting.model.name if setting.model else setting.ln
        said = f"{setting.format}, stride {setting.stride}, {name}, {setting.law}"
        print(f"{time.monotonic() - began:5.0f} s: {said}: as on the host", file=sys.stderr, flush=True)

    # Coherence first: the others are compared with it. Of named models and laws, only those laws are counted that they need.
    needed = {"coherence", *(law for file in chosen.values() for law in laws_of(file) if law in laws)} if kept else set(LAWS)
    for law in sorted(needed, key=lambda law: (law != "coherence", law)):

        def of_law(core, numbers):
            base.setdefault(law, {})[core] = numbers
            cores[core] |= {"trigger": base["coherence"][core]["trigger"]}
            cores[core]["laws"][law] = {"event": numbers["laws"][law]} | less(numbers, base["coherence"][core], "flash", "ram")

        each(Setting(law=LAWS[law]), of_law, every_board=True)
    of_path = {}
    for kernel in () if kept else KERNELS:

        def alone(core, numbers):
            cores[core]["ln"][kernel] = less(numbers, base["coherence"][core], "frame", "flash", "ram")

        # The sample along the path has fixed-point logarithms, whatever the features have: less of them can be left out.
        def with_path(core, numbers):
            flash = numbers["flash"] - of_path.setdefault(core, numbers)["flash"]
            cores[core]["ln"][kernel]["path_flash"] = flash

        each(Setting(ln=kernel), alone)
        each(Setting(ln=kernel, model=models()[PATH_MODEL]), with_path)
    for name, file in chosen.items():
        sha256 = hashlib.sha256(file.read_bytes()).hexdigest()

        for law in filter(laws.__contains__, laws_of(file)):

            def model(core, numbers):
                price = cores[core]["models"].setdefault(name, {})
                if price.get("sha256") != sha256:
                    price.clear()
                price |= less(numbers, base[law][core], "frame") | {"sha256": sha256}
                price.setdefault("laws", {})[law] = pick(numbers, "event") | less(numbers, base[law][core], "flash", "ram")

            each(Setting(model=file, law=LAWS[law]), model)
    for format_ in () if kept else formats():
        for stride in STRIDES:

            def front(core, numbers):
                cores[core]["formats"].setdefault(format_, {})[str(stride)] = pick(numbers, "frame", "flash", "ram")

            each(Setting(format_, stride), front)
    print(f"{done} settings in {time.monotonic() - began:.0f} s", file=sys.stderr)
    return cores


def sums(counter, cores):
    """Counts configurations whose settings were counted separately. Returns whether the sums agree."""
    fine = True
    for format_, stride, kernel, law, name in MIXED:
        for core, numbers in counter.setting(Setting(format_, stride, kernel, models()[name], LAWS[law])).items():
            of = cores[core]
            front, ln, model = of["formats"][format_][str(stride)], of["ln"][kernel], of["models"][name]
            ln_flash = ln["flash" if law == "published" else "path_flash"]
            parts = {"frame": front["frame"] + ln["frame"] + model["frame"], "event": model["laws"][law]["event"]}
            parts |= {key: front[key] + own + of["laws"][law][key] + model["laws"][law][key] for key, own in (("flash", ln_flash), ("ram", ln["ram"]))}
            said = []
            for key, by_sum in parts.items():
                off = by_sum / numbers[key] - 1
                fine &= abs(off) <= SLACK
                said.append(f"{key} {by_sum:,} for {numbers[key]:,} ({off:+.2%})")
            print(f"{core}, {format_} stride {stride} {kernel} {law} {name}, the sum for the count: {', '.join(said)}", flush=True)
    return fine


def compare(cores, kept, at=""):
    """Returns whether stored prices agree with the counts. Prints those that do not."""
    fine = True
    for key in cores.keys() | kept.keys():
        new, old, here = cores.get(key), kept.get(key), f"{at} {key}".strip()
        if isinstance(new, dict) and isinstance(old, dict):
            fine &= compare(new, old, here)
        elif new != old and (isinstance(new, str) or None in (new, old) or abs(new - old) > max(PUBLISHED_SLACK * abs(old), 64)):
            fine = False
            print(f"{here}: {new}, kept {old}: ci/measure prices --keep keeps it")
    return fine


def one(counter, config, model, pixels, core):
    """Counts one configuration, as given in files."""
    board = next((board for board in BOARDS if board.core == core), None)
    if board is None or pixels not in FORMATS:
        sys.exit(f"CORE is {core}, PIXELS {pixels}; expected one of {[b.core for b in BOARDS]}, and one of {list(FORMATS)}")
    toml = (boards.CONFIG if config == "-" else Path(config)).read_text()
    model = None if model == "-" else Path(model).resolve()
    programs = counter.build(board.target, pixels, toml, model)
    counted = counter.count(board, programs, pixels, toml, model)
    return pick(counted, "frame", "trigger", "event", "flash", "ram") | {"law": counted["laws"][law_of(toml)]}


def save(cores):
    """Stores prices."""
    found = {"compiler": boards.compiler(), "frame": "400x400, stripes of 8 rows", "cores": cores}
    KEPT.parent.mkdir(exist_ok=True)
    KEPT.write_text(json.dumps(found, indent=1) + "\n")


def main():
    match sys.argv[1:]:
        case [wstac, "--check", config, model, pixels, core]:
            with tempfile.TemporaryDirectory() as folder:
                print(json.dumps(one(Counter(wstac, folder), config, model, pixels, core)))
            return
        case [wstac, *rest] if not rest or rest[0] == "--keep":
            keep, named = bool(rest), rest[1:]
        case _:
            sys.exit(__doc__)
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {"cores": {}}
    laws = [name for name in named if name in LAWS] or LAWS
    chosen = {Path(name).name: Path(name).resolve() for name in named if name not in LAWS} or models()
    with tempfile.TemporaryDirectory() as folder:
        counter = Counter(wstac, folder)
        cores = measure(counter, chosen, laws, kept["cores"] if named else None, save if keep else lambda cores: None)
        fine = bool(named) or sums(counter, cores)
    if keep:
        print(f"kept in {KEPT.relative_to(ROOT)}")
    elif kept.get("compiler") != boards.compiler():
        print(f"kept prices are of {kept.get('compiler')}, this is {boards.compiler()}: not compared")
    else:
        fine &= compare(cores, kept["cores"])
    sys.exit(not fine)


if __name__ == "__main__":
    main()
