"""Measures how wstac's cost grows. With an exponent of 1 it grows in proportion, and with 0 not at all."""

import numpy as np

from native import Native

STEPS = (1, 4, 16, 64)


def spread(width, height, taxel):
    """Returns the corners of 25 taxels over a whole frame."""
    return [((width - taxel) * column // 4, (height - taxel) * row // 4) for row in range(5) for column in range(5)]


def exponent(costs):
    """Returns the slope of cost over size, both as logarithms."""
    return float(np.polyfit(np.log(STEPS), np.log(costs), 1)[0])


def streams(library, name):
    """Measures frames that grow under the same taxels, and taxels that grow in the same frame."""
    roots = [round(step**0.5) for step in STEPS]
    yield f"{name}: pixels of the frame, from 240 × 180, under 25 taxels of 32 × 32", 0, [
        Native(library, name, 240 * root, 180 * root, 32, spread(240 * root, 180 * root, 32)) for root in roots
    ]
    yield f"{name}: pixels of a taxel, from 32 × 32, in frames of 1440 × 1280", 1, [
        Native(library, name, 1440, 1280, 32 * root, spread(1440, 1280, 32 * root)) for root in roots
    ]


def rows(library, measure):
    """Returns rows: what grows, the exponent over all steps and over the last step, and the expected one."""
    rng = np.random.default_rng(3)
    for name in ("GREY", "YUYV linear", "YUYV exact"):
        for what, expected, natives in streams(library, name):
            contestants = {}
            for step, native in zip(STEPS, natives, strict=True):
                made = rng.integers(0, 256, native.frame_bytes, dtype=np.uint8)
                contestants[step] = (lambda n=native, m=made: n.features(m, 1, 16), 16)
            yield row(what, expected, measure(contestants, 200))
    native = Native(library, "GREY", 1280, 720, 90, spread(1280, 720, 90))
    made = rng.integers(0, 256, native.frame_bytes, dtype=np.uint8)
    contestants = {step: (lambda s=step: native.features(made, 1, s), 1) for step in STEPS}
    yield row("GREY: frames in one call from Python", 1, measure(contestants, 200))
    # The time to make the forest is subtracted.
    fewer, more = (measure({s: (lambda s=s: Native.forest(library, s, n), 1) for s in STEPS}, 100) for n in (100, 1100))
    yield row("trees with paths of seven splits, from 1", 1, {step: (more[step] - fewer[step]) / 1000 for step in STEPS})


def row(what, expected, least):
    costs = [least[step] for step in STEPS]
    last = float(np.log(costs[-1] / costs[-2]) / np.log(STEPS[-1] / STEPS[-2]))
    return what, exponent(costs), last, expected
