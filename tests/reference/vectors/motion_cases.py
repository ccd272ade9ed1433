"""Samples of touches that move at a known speed, and what the reference says of their motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wstac_reference.constants import FEATURES, ROWS, SAMPLE_FRAMES, UNIT
from wstac_reference.motion import measure_motion
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED
from .shutters import SHUTTERS, readout_of
from .stored import stored

DARK = 0.006
BASELINE_FRAMES = 25
TOTALS = np.full(FEATURES, BASELINE_FRAMES * round(UNIT * math.log(DARK)))
MOTIONS = (
    [(speed, angle) for speed, angle in zip((12, 17, 25, 40, 60, 90, 130, 180, 250, 350, 450, 600), range(3, 360, 31))]
    + [(100, angle) for angle in (0, 90, 180, 270, 45)]
)
"""Speed in mm/s and direction in degrees."""


def flashes(rng: SplitMix64) -> list[tuple[float, float, float]]:
    """Three flashes: when in frames, how bright, and how long they fade in frames."""
    numbers = rng.below(1000, (3, 3)) / 1000
    return [(3.0 * k * (1 + when), 0.1 + 0.5 * bright, 1 + 5 * fade) for k, (when, bright, fade) in enumerate(numbers)]


def light(shape: list[tuple[float, float, float]], t: float) -> float:
    """Light of the flashes at a time in frames."""
    total = 0.0
    for when, bright, fade in shape:
        since = t - when
        if since > -15:
            total += bright * math.exp(-max(since, 0.0) / fade) / (1 + math.exp(-since / 0.5))
    return total


Touches = tuple[tuple[float, float, float], ...]
"""When touches reach the middle line, in frames, and their slowness along rows and columns."""


def sample(
    rng: SplitMix64, touches: Touches, shake: int, lines: range = range(FEATURES), weak: int | None = None
) -> np.ndarray:
    """Ten features over 70 frames of flashes that pass rows and columns; other lines stay dark, and one may be weak."""
    shape = flashes(rng)
    gains = 0.7 + rng.below(700, FEATURES) / 1000
    if weak is not None:
        gains[weak] *= 0.25
    noise = rng.below(2 * shake + 1, (FEATURES, SAMPLE_FRAMES)) - shake
    features = np.empty((FEATURES, SAMPLE_FRAMES), dtype=np.int64)
    for k in range(FEATURES):
        line = k % ROWS
        for t in range(SAMPLE_FRAMES):
            bright = 0.0
            for when, *slowness in touches if k in lines else ():
                bright += gains[k] * light(shape, t - when - slowness[k // ROWS] * (line - 2))
            features[k, t] = round(UNIT * math.log(DARK + bright))
    return features + noise


def motion_cases() -> list[dict[str, Any]]:
    """Every case with its numbers and answers."""
    cases: list[tuple[str, Touches, int, range, int | None]] = []
    every = range(FEATURES)
    for speed, angle in MOTIONS:
        each = 120 / speed
        touch = (22.0, -each * math.sin(math.radians(angle)), each * math.cos(math.radians(angle)))
        for shake in (0, 100):
            cases.append((f"slide-{speed}-{angle}-{shake}", (touch,), shake, every, None))
    for shake in (0, 100):
        cases.append((f"press-{shake}", ((22.0, 0.0, 0.0),), shake, every, None))
        cases.append((f"poke-{shake}", ((22.0, 0.0, 0.0),), shake, range(2, FEATURES, 5), None))
        cases.append((f"between-{shake}", ((22.0, 0.0, 0.135),), shake, every, None))
        cases.append((f"dark-{shake}", ((22.0, 0.0, 1.0),), shake, range(0), None))
        # No velocity of these is reliable.
        cases.append((f"two-{shake}", ((12.0, 0.0, 0.8), (44.0, -0.4, 0.7)), shake, every, None))
        cases.append((f"faster-{shake}", ((12.0, 0.0, 1.2), (44.0, 0.0, 0.9)), shake, every, None))
        cases.append((f"uneven-{shake}", ((22.0, 0.5, 0.6),), shake, every, 8))
        cases.append((f"begun-{shake}", ((2.0, 0.0, 1.5), (26.0, 0.0, 1.5)), shake, every, None))
    made = []
    for name, touches, shake, lines, weak in cases:
        rng = SplitMix64(seed_of(f"motion-{name}", SEED))
        features = sample(rng, touches, shake, lines, weak)
        answer = measure_motion(features, TOTALS, BASELINE_FRAMES)
        made.append(case(name, features, motion=stored(answer)))
    return made


def case(name: str, features: np.ndarray, **answers: Any) -> dict[str, Any]:
    """Returns a case as the file has it."""
    return {"name": name, "totals": TOTALS.tolist(), "frames": BASELINE_FRAMES, "features": features.T.tolist(), **answers}


def readout_cases() -> list[dict[str, Any]]:
    """Slides and a press before the first of the shutters, each with the answers for all of them."""
    each = [(speed, 120 / speed, math.radians(angle)) for speed, angle in MOTIONS[2:12]]
    touches = [(f"slide-{speed}", (-s * math.sin(angle), s * math.cos(angle))) for speed, s, angle in each]
    readouts = [readout_of(shutter) for shutter in SHUTTERS]
    made = []
    for name, (row, column) in [*touches, ("press", (0.0, 0.0))]:
        rng = SplitMix64(seed_of(f"readout-{name}", SEED))
        features = sample(rng, ((22.0, row - readouts[0].rows, column),), 20)
        answers = [stored(measure_motion(features, TOTALS, BASELINE_FRAMES, readout=of)) for of in readouts]
        made.append(case(name, features, answers=answers))
    return made
