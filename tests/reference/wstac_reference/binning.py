"""Turns camera frames into feature frames: fast cameras, and frames that were lost.

The time line counts from the first camera frame that arrived. Frames lost before it
are not on the time line (*decided*).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from .constants import BINNING_ABOVE_FPS, NOMINAL_FPS
from .rational import round_half_up


def frames_added(fps: Fraction) -> int:
    """Returns n, the number of camera frames per feature frame. Exactly 45 frames per second gives 1."""
    if fps <= 0:
        raise ValueError(f"frame rate {fps}")
    return round_half_up(fps / NOMINAL_FPS) if fps > BINNING_ABOVE_FPS else 1


@dataclass(frozen=True)
class Group:
    """A feature frame: the 10 sums R over n camera frames.

    `lost` of the n were lost, and R is scaled up to replace them. `sums` is None if all were lost.
    """

    sums: tuple[int, ...] | None
    lost: int


class Binner:
    """Adds up n consecutive camera frames.

    *Decided*: with k of the n lost, but not all, R is (sum of the present) n / (n - k)
    to nearest, ties up. A group that is still open at the end of the stream is dropped.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self._started = False
        self._present: list[Sequence[int]] = []
        self._lost = 0

    def frame(self, r: Sequence[int]) -> list[Group]:
        """Takes a camera frame. Returns the group that it completes, if any."""
        self._started = True
        self._present.append(r)
        return self._close()

    def lose(self, count: int) -> list[Group]:
        """Counts `count` lost camera frames. Returns the groups that this completes."""
        groups: list[Group] = []
        if self._started:
            for _ in range(count):
                self._lost += 1
                groups += self._close()
        return groups

    def _close(self) -> list[Group]:
        here = len(self._present)
        if here + self._lost < self.n:
            return []
        group = Group(None, self._lost)
        if here:
            totals = [sum(column) for column in zip(*self._present, strict=True)]
            scaled = tuple(round_half_up(Fraction(total * self.n, here)) for total in totals)
            group = Group(scaled, self._lost)
        self._present, self._lost = [], 0
        return [group]
