"""Energies of objects of several cuts on sensors of several domes, and what the reference says of their extent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wstac_reference.constants import TAXELS
from wstac_reference.extent import FAR, measure_extent
from wstac_reference.rng import SplitMix64, seed_of
from wstac_reference.wave import COLUMN, ROW

from . import SEED
from .stored import stored

BRIGHT = 40_000
CUTS = {
    "rod": (lambda far: np.where(far < 0, 1.0, 0.0)),
    "block": (lambda far: np.clip(-far, 0.0, 1.0)),
    "ball": (lambda far: np.clip(-far / 3, 0.0, 1.0) * np.clip(2 + far / 3, 1.0, 2.0)),
}
"""Height of an object by the distance from its border in mm, below 0 inside."""


def energies_of(cut: str, deg: float, place: float, width: float, dome: float, rng: SplitMix64) -> list[int]:
    """Energies of an object between whiskers whose gains differ by up to a tenth."""
    n = 4 * (-COLUMN * math.sin(math.radians(deg)) - ROW * math.cos(math.radians(deg)))
    height = CUTS[cut](np.abs(n - place) - width / 2)
    height = np.where(height > 0, np.maximum(height - dome * FAR, 0), 0)
    gains = (900 + rng.below(200, TAXELS)) / 1000
    shake = rng.below(201, TAXELS) - 100
    return [int(value) for value in np.rint(BRIGHT * height**0.8 * gains) + shake]


def extent_cases() -> list[dict[str, Any]]:
    """Every case with its energies and the answer."""
    rng = SplitMix64(seed_of("extent", SEED))
    made: list[tuple[str, list[int], float]] = []
    for number, deg in enumerate((0, 14, 45, 71, 95, 123, 160, 205, 251, 284, 301, 340)):
        for cut in CUTS:
            place, width = (int(rng.below(81, 1)[0]) - 40) / 10, (50 + int(rng.below(91, 1)[0])) / 10
            made.append((f"{cut}-{deg}", energies_of(cut, deg, place, width, (0.0, 0.35, 0.5)[number % 3], rng), float(deg)))
    rod = energies_of("rod", 25, 0, 9, 0.4, rng)
    dead = [0 if taxel == 12 else energy for taxel, energy in enumerate(rod)]
    pair = [a + b for a, b in zip(energies_of("ball", 33, 8, 8, 0.2, rng), energies_of("ball", 33, -7, 7, 0.2, rng))]
    made += [
        ("dead", dead, 25.0),
        ("two", pair, 33.0),
        ("wide", energies_of("rod", 60, 0, 60, 0.5, rng), 60.0),
        ("end", energies_of("rod", 60, 16, 30, 0.5, rng), 60.0),
        ("dark", [0] * TAXELS, 10.0),
        ("below-dark", [-5] * TAXELS, 10.0),
        ("equal", [1] * TAXELS, 10.0),
        ("one", [BRIGHT if taxel == 7 else 0 for taxel in range(TAXELS)], 10.0),
        ("saturated", [1 << 19] * TAXELS, 200.0),
        ("chess", [BRIGHT * (taxel % 2) for taxel in range(TAXELS)], 45.0),
    ]
    return [
        {"name": name, "energies": energies, "deg": deg, "deg_sd": 0.5, "extent": stored(measure_extent(energies, deg, 0.5))}
        for name, energies, deg in made
    ]
