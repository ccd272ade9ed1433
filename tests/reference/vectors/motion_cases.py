"""Samples of touches that move at a known speed, and what the reference says of their motion."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from wstac_reference.constants import FEATURES, ROWS, SAMPLE_FRAMES, UNIT
from wstac_reference.motion import measure_motion
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED

DARK = 0.006
BASELINE_FRAMES = 25
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


def sample(rng: SplitMix64, slowness: tuple[float, float], shake: int, lines: range = range(FEATURES)) -> np.ndarray:
    """Ten features over 70 frames of flashes that pass rows and columns; other lines stay dark."""
    shape = flashes(rng)
    gains = 0.7 + rng.below(700, FEATURES) / 1000
    noise = rng.below(2 * shake + 1, (FEATURES, SAMPLE_FRAMES)) - shake
    features = np.empty((FEATURES, SAMPLE_FRAMES), dtype=np.int64)
    for k in range(FEATURES):
        each, line = (slowness[0], k) if k < ROWS else (slowness[1], k - ROWS)
        for t in range(SAMPLE_FRAMES):
            at = t - 22 - each * (line - 2)
            bright = gains[k] * light(shape, at) if k in lines else 0.0
            features[k, t] = round(UNIT * math.log(DARK + bright))
    return features + noise


def motion_cases() -> list[dict[str, Any]]:
    """Every case with its numbers and answers."""
    cases = []
    for speed, angle in MOTIONS:
        each = 120 / speed
        slowness = (-each * math.sin(math.radians(angle)), each * math.cos(math.radians(angle)))
        for shake in (0, 100):
            cases.append((f"slide-{speed}-{angle}-{shake}", slowness, shake, range(FEATURES)))
    for shake in (0, 100):
        cases.append((f"press-{shake}", (0.0, 0.0), shake, range(FEATURES)))
        cases.append((f"poke-{shake}", (0.0, 0.0), shake, range(2, FEATURES, 5)))
        cases.append((f"between-{shake}", (0.0, 0.135), shake, range(FEATURES)))
        cases.append((f"dark-{shake}", (0.0, 1.0), shake, range(0)))
    made = []
    for name, slowness, shake, lines in cases:
        rng = SplitMix64(seed_of(f"motion-{name}", SEED))
        features = sample(rng, slowness, shake, lines)
        totals = np.full(FEATURES, BASELINE_FRAMES * round(UNIT * math.log(DARK)))
        answer = measure_motion(features, totals, BASELINE_FRAMES)
        made.append(
            {
                "name": name,
                "totals": totals.tolist(),
                "frames": BASELINE_FRAMES,
                "features": features.T.tolist(),
                "motion": asdict(answer),
            }
        )
    return made
