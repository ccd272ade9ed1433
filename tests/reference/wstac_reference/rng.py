"""The generator splitmix64, which is small enough to write down, so that vectors outlive numpy's."""

from __future__ import annotations

import hashlib

import numpy as np

GAMMA = 0x9E3779B97F4A7C15
MASK = (1 << 64) - 1


def seed_of(text: str, seed: int) -> int:
    """Returns a 64-bit seed for a name, independent of the order in which names are used."""
    digest = hashlib.sha256(f"{seed}:{text}".encode()).digest()
    return int.from_bytes(digest[:8], "little")


def mix(z: int) -> int:
    """Applies the splitmix64 output function to one 64-bit state."""
    z &= MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


class SplitMix64:
    """Generates the sequence mix(seed + gamma), mix(seed + 2 gamma), ..."""

    def __init__(self, seed: int) -> None:
        self.state = seed & MASK

    def next(self) -> int:
        """Returns the next 64-bit number."""
        self.state = (self.state + GAMMA) & MASK
        return mix(self.state)

    def words(self, count: int) -> np.ndarray:
        """Returns the next `count` 64-bit numbers, as uint64."""
        steps = np.arange(1, count + 1, dtype=np.uint64)
        z = np.uint64(self.state) + steps * np.uint64(GAMMA)  # wraps modulo 2**64
        self.state = (self.state + count * GAMMA) & MASK
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return z ^ (z >> np.uint64(31))

    def below(self, bound: int, shape: int | tuple[int, ...]) -> np.ndarray:
        """Returns integers 0..bound-1 (bound at most 2**32) from the high 32 bits, int64."""
        count = int(np.prod(shape))
        high = self.words(count) >> np.uint64(32)
        return ((high * np.uint64(bound)) >> np.uint64(32)).astype(np.int64).reshape(shape)
