"""Frames of touches, some of which change their speed, and what the reference says of each frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wstac_reference.constants import FEATURES, ROWS, SAMPLE_FRAMES, UNIT
from wstac_reference.live import Live
from wstac_reference.readout import GLOBAL, Readout
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED
from .shutters import SHUTTERS, readout_of
from .stored import stored

DARK = 0.012
BASELINE_FRAMES = 25
FADES = 0.45
PITCH = 4.0
PARTS = 8
"""Moments of a frame's exposure."""
SLIDES = ((600, 20), (400, 123), (250, 251), (150, 0), (120, 90), (90, 305), (60, 47), (40, 180), (25, 222), (18, 275))
"""Speed in mm/s and direction in degrees."""
ROLLING = ((350, 20), (250, 123), (150, 251), (90, 40), (60, 305), (40, 180), (120, 90), (50, 215), (700, 300), (400, 0))
"""Slides of which each is before one of the shutters, in their order."""
CHANGES = ((60, 130), (50, 30))
"""Speed in mm/s before and after 45 mm of path; texture is weak."""


def surface(path: float, length: float, texture: float) -> float:
    """Light of a place `path` mm behind the leading edge: a ramp, then a texture of two periods."""
    if not 0 < path < length:
        return 0.0
    ripple = math.sin(path * math.tau / 23) + 0.6 * math.sin(path * math.tau / 14 + 1)
    return min(path / 2.5, 1.0) * (0.3 + texture * ripple)


def frames_of(
    rng: SplitMix64,
    speeds: tuple[float, float],
    degrees: float,
    texture: float,
    lines: range,
    outer: float = 1.0,
    readout: Readout = GLOBAL,
    turned: float = 0.0,
) -> np.ndarray:
    """Frames of ten features. Lines that are not in `lines` stay dark; those at the rim have `outer` times the light. The trailing edge
    is `turned` degrees from the leading one."""
    gains = 0.8 + rng.below(400, FEATURES) / 1000
    gains[[0, ROWS - 1, ROWS, FEATURES - 1]] *= outer
    delays = [of * (k - 2) for of in (readout.rows, readout.columns) for k in range(ROWS)]
    of_edges = []
    for angle in (math.radians(degrees), math.radians(degrees + turned)):
        lags = [PITCH * (k - 2) * way for way in (-math.sin(angle), math.cos(angle)) for k in range(ROWS)]
        of_edges.append([lag - delay * speeds[0] / 30 for lag, delay in zip(lags, delays)])
    lags, ends = of_edges
    length, start = 70.0, -14.0
    path, light, made = start, np.zeros(FEATURES), []
    count = 40 + int(30 * (-start + length + 20) / min(speeds)) if max(speeds) > 0 else 40
    for _ in range(min(count, 190)):
        emitted = np.zeros(FEATURES)
        for _ in range(PARTS):
            speed = speeds[0] if path < 45 else speeds[1]
            path += speed / 30 / PARTS
            for line in lines:
                emitted[line] += gains[line] * surface(path - lags[line], math.inf if path - ends[line] < length else 0.0, texture) * speed / speeds[0] / PARTS
        light = FADES * light + (1 - FADES) * emitted
        made.append(DARK + light)
    return np.array(made)


def flash(rng: SplitMix64, lines: range) -> np.ndarray:
    """Frames of one flash of some lines at once."""
    gains = 0.5 + rng.below(500, FEATURES) / 1000
    light = np.zeros((40, FEATURES))
    for t in range(8, 40):
        light[t, list(lines)] = 0.3 * gains[list(lines)] * FADES ** (t - 8)
    return DARK + light


def live_cases() -> list[dict[str, Any]]:
    """Every case with its frames, the number of its shutter and answers. Frames before those of a case are dark."""
    made = []
    every = range(FEATURES)
    cases = [(f"slide-{speed}-{angle}", ((speed, speed), angle, 0.05, every)) for speed, angle in SLIDES]
    cases += [(f"change-{before}-{after}", ((before, after), 30.0, 0.0, every)) for before, after in CHANGES]
    cases.append(("narrow-60-47", ((60, 60), 47, 0.05, every, 0.4)))
    cases.append(("oblique-60-47", ((60, 60), 47, 0.05, every, 1.0, GLOBAL, 25.0)))
    cases += [("press", every), ("poke", range(1, FEATURES, 5)), ("dark", range(0))]
    cases = [(name, how, None) for name, how in cases]
    for number, (speed, angle) in enumerate(ROLLING):
        how = ((speed, speed), angle, 0.05, every, 1.0, readout_of(SHUTTERS[number]))
        cases.append((f"rolling-{speed}-{angle}", how, number))
    cases.append(("rolling-change", ((60, 130), 30.0, 0.0, every), 3))
    cases += [("rolling-press", every, 7), ("rolling-poke", range(1, FEATURES, 5), 5)]
    for name, how, shutter in cases:
        rng = SplitMix64(seed_of(f"live-{name}", SEED))
        light = flash(rng, how) if isinstance(how, range) else frames_of(rng, *how)
        noise = rng.below(9, light.shape) - 4
        features = np.round(UNIT * np.log(light)).astype(np.int64) + noise
        dark = round(UNIT * math.log(DARK))
        readout = GLOBAL if shutter is None else readout_of(SHUTTERS[shutter])
        live = Live(np.full(FEATURES, BASELINE_FRAMES * dark), BASELINE_FRAMES, readout)
        live.history = [np.full(FEATURES, dark / UNIT)] * SAMPLE_FRAMES
        said = [live.push(frame) for frame in features]
        if not isinstance(how, range):
            # What is left of the light after the last velocity is noise, or an edge at another angle.
            moving = (t for t, one in enumerate(said) if one is not None and one.mm_s is not None)
            said = said[: max(moving, default=len(said)) + (3 if name.startswith("oblique") else 1)]
        made.append(
            {
                "name": name,
                "dark": dark,
                "frames": BASELINE_FRAMES,
                "shutter": shutter,
                "features": features[: len(said)].tolist(),
                "said": [None if one is None else stored(one) for one in said],
            }
        )
    return made
