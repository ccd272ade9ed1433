"""The places of the 25 taxels in a frame."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from .constants import COLUMNS, ROWS, TAXELS
from .rational import round_half_up

TACTILE = 400
"""Side of the published tactile image in pixels (*paper*)."""
SIDE = 50
"""Side of a taxel in it (*paper*)."""
PITCH = 80
FIRST = 15


@dataclass(frozen=True)
class Layout:
    """One taxel size and 25 corners (x, y), row by row.

    *Decided*: taxels may overlap, and may be as large as the whole frame.
    """

    width: int
    height: int
    corners: tuple[tuple[int, int], ...]

    def check(self, frame_width: int, frame_height: int) -> None:
        """Refuses an empty taxel, a wrong count, or a taxel that leaves the frame."""
        if self.width < 1 or self.height < 1:
            raise ValueError(f"taxel size {self.width} x {self.height} is empty")
        if len(self.corners) != TAXELS:
            raise ValueError(f"{len(self.corners)} corners, not {TAXELS}")
        for index, (x, y) in enumerate(self.corners):
            outside = x < 0 or y < 0 or x + self.width > frame_width or y + self.height > frame_height
            if outside:
                raise ValueError(f"taxel {index} at ({x}, {y}) leaves the {frame_width} x {frame_height} frame")

    def snapped_to_cells(self) -> Layout:
        """Returns the layout with corners and size rounded down to even pixels, for Bayer. An empty taxel is an error.

        *Decided*: the layout is checked against the frame before it is snapped.
        """
        snapped = Layout(
            self.width & ~1, self.height & ~1, tuple((x & ~1, y & ~1) for x, y in self.corners)
        )
        if snapped.width == 0 or snapped.height == 0:
            raise ValueError(f"taxel size {self.width} x {self.height} holds no 2 x 2 cell")
        return snapped


def paper_layout(width: int, height: int) -> Layout:
    """Returns the published layout, scaled into the centered largest square of the frame.

    *Decided*: with s = min(width, height), the corner x of column j = 0..4 is the one
    number (width - s)/2 + (15 + 80 j) s/400 rounded to nearest, ties up; y likewise;
    the side is 50 s/400 rounded the same way. A side of 0 is an error.
    """
    s = min(width, height)

    def corner(extent: int, index: int) -> int:
        return round_half_up(Fraction(extent - s, 2) + Fraction((FIRST + PITCH * index) * s, TACTILE))

    side = round_half_up(Fraction(SIDE * s, TACTILE))
    corners = tuple(
        (corner(width, j), corner(height, i)) for i in range(ROWS) for j in range(COLUMNS)
    )
    layout = Layout(side, side, corners)
    layout.check(width, height)
    return layout
