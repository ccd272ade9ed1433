"""Turns a frame's bytes into the 25 integer sums of green."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from .formats import PixelFormat
from .layout import Layout
from .rational import ceil_div, round_half_up

STRIDES = (1, 2, 3, 5)
U32_MAX = (1 << 32) - 1

LUMA_WEIGHTS = {
    "bt601": (Fraction(299, 1000), Fraction(114, 1000)),
    "bt709": (Fraction(2126, 10000), Fraction(722, 10000)),
}
"""Kr and Kb of each matrix."""


@dataclass(frozen=True)
class YCbCr:
    """The encoding of a YCbCr source's colors, and the method from YCbCr to green.

    With `mode` exact, every pixel is rounded (nearest, ties up) and clamped. With linear, the sums of Y, Cb and Cr of a
    taxel are converted once, rounded, and clamped to 0..255 A. Both are exact rational arithmetic, so ties are decided,
    and not left to chance.
    """

    matrix: str = "bt601"
    range: str = "limited"
    mode: str = "exact"

    def __post_init__(self) -> None:
        if self.matrix not in LUMA_WEIGHTS:
            raise ValueError(f"matrix {self.matrix!r}")
        if self.range not in ("limited", "full"):
            raise ValueError(f"range {self.range!r}")
        if self.mode not in ("exact", "linear"):
            raise ValueError(f"yuv {self.mode!r}")

    def integer_form(self) -> tuple[int, int, int, int, int]:
        """Returns integers (y, cb, cr, one, d): green = (y Y + cb Cb + cr Cr + one) / d.

        Green is on the scale 0..255. Limited range: Y 16..235, chroma 16..240 around
        128. Full range: Y 0..255, chroma divisor 255.
        """
        kr, kb = LUMA_WEIGHTS[self.matrix]
        kg = 1 - kr - kb
        black, luma_span, chroma_span = (16, 219, 224) if self.range == "limited" else (0, 255, 255)
        y = Fraction(255, luma_span)
        cb = -2 * kb * (1 - kb) / kg * Fraction(255, chroma_span)
        cr = -2 * kr * (1 - kr) / kg * Fraction(255, chroma_span)
        one = -black * y - 128 * (cb + cr)
        d = math.lcm(y.denominator, cb.denominator, cr.denominator, one.denominator)
        return int(y * d), int(cb * d), int(cr * d), int(one * d), d

    def per_pixel(self, y: np.ndarray, cb: np.ndarray, cr: np.ndarray) -> np.ndarray:
        """Returns the exact green of every pixel, 0..255: floor(v + 1/2), decided in int64."""
        ny, ncb, ncr, one, d = self.integer_form()
        assert (abs(ny) + abs(ncb) + abs(ncr)) * 255 * 2 + abs(one) * 2 + d < 1 << 62
        value = ny * y.astype(np.int64) + ncb * cb.astype(np.int64) + ncr * cr.astype(np.int64) + one
        return np.clip((2 * value + d) // (2 * d), 0, 255)

    def per_taxel(self, y: int, cb: int, cr: int, pixels: int) -> int:
        """Returns the green of a taxel from its three sums, 0..255 * pixels."""
        ny, ncb, ncr, one, d = self.integer_form()
        value = round_half_up(Fraction(ny * y + ncb * cb + ncr * cr + one * pixels, d))
        return min(max(value, 0), 255 * pixels)


class GreenSums:
    """Sums green over the taxels of frames of one format and size.

    Stride starts with the taxel's first row and column (*decided*), so a taxel counts A = ceil(w / stride) * ceil(h /
    stride) pixels. Bayer: the layout is snapped to 2 x 2 cells, stride counts cells, and A is 2 green sites per counted
    cell. A word above full scale counts as full scale (*decided*). A frame may be longer than needed.
    """

    def __init__(
        self,
        fmt: PixelFormat,
        width: int,
        height: int,
        bytes_per_line: int,
        layout: Layout,
        stride: int = 1,
        ycbcr: YCbCr | None = None,
    ) -> None:
        layout.check(width, height)
        if stride not in STRIDES:
            raise ValueError(f"stride {stride}")
        if bytes_per_line < fmt.min_bytes_per_line(width):
            raise ValueError(f"bytes_per_line {bytes_per_line} is too short for {width} pixels of {fmt.name}")
        self.fmt, self.width, self.height, self.bytes_per_line = fmt, width, height, bytes_per_line
        self.stride = stride
        self.ycbcr = ycbcr or YCbCr()
        self.layout = layout.snapped_to_cells() if fmt.family == "bayer" else layout
        w, h = self.layout.width, self.layout.height
        if fmt.family == "bayer":
            self.pixels = 2 * ceil_div(w // 2, stride) * ceil_div(h // 2, stride)
        else:
            self.pixels = ceil_div(w, stride) * ceil_div(h, stride)
        self.full_scale = fmt.full_scale
        if 5 * self.pixels * self.full_scale > U32_MAX:
            raise ValueError(f"5 * {self.pixels} * {self.full_scale} does not fit 32 bits")
        self.frame_bytes = fmt.frame_bytes(height, bytes_per_line)

    def sums(self, frame: bytes | np.ndarray) -> list[int]:
        """Returns the 25 sums of one frame, row by row."""
        data = np.frombuffer(frame, dtype=np.uint8)
        if data.size < self.frame_bytes:
            raise ValueError(f"frame has {data.size} bytes, needs {self.frame_bytes}")
        if self.fmt.family == "bayer":
            return self._bayer_sums(self._words(data))
        if self.fmt.is_ycbcr:
            return self._ycbcr_sums(*self._ycbcr_planes(data))
        return self._plain_sums(self._green_plane(data))

    def _rows(self, data: np.ndarray, offset: int, rows: int, bytes_per_line: int, used: int) -> np.ndarray:
        plane = data[offset : offset + rows * bytes_per_line].reshape(rows, bytes_per_line)
        return plane[:, :used]

    def _words(self, data: np.ndarray) -> np.ndarray:
        """Returns one number per pixel, saturated to full scale (little-endian if it has 16 bits)."""
        size = self.fmt.bytes_per_pixel
        rows = self._rows(data, 0, self.height, self.bytes_per_line, self.width * size).astype(np.int64)
        value = rows if size == 1 else rows[:, 0::2] + 256 * rows[:, 1::2]
        return np.minimum(value, self.full_scale)

    def _green_plane(self, data: np.ndarray) -> np.ndarray:
        fmt = self.fmt
        if fmt.family == "gray":
            return self._words(data)
        size = fmt.bytes_per_pixel
        rows = self._rows(data, 0, self.height, self.bytes_per_line, self.width * size).astype(np.int64)
        if fmt.family == "rgb":
            return rows[:, fmt.green_byte :: size]
        word = rows[:, 0::2] + 256 * rows[:, 1::2]
        six = (word >> 5) & 0x3F
        return six << 2 | six >> 4

    def _ycbcr_planes(self, data: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns Y, Cb, Cr of every pixel. Chroma is that of the pixel's own cell."""
        fmt, width, height, stride = self.fmt, self.width, self.height, self.bytes_per_line
        if fmt.family == "packed422":
            rows = self._rows(data, 0, height, stride, 4 * ceil_div(width, 2))
            other = 1 - fmt.luma_byte
            cell = np.arange(width) // 2
            luma = rows[:, fmt.luma_byte :: 2][:, :width]
            return luma, rows[:, other::4][:, cell], rows[:, other + 2 :: 4][:, cell]
        luma = self._rows(data, 0, height, stride, width)
        across, down = fmt.chroma
        columns, lines = ceil_div(width, across), ceil_div(height, down)
        chroma_stride = fmt.chroma_bytes_per_line(stride)
        start = stride * height
        if fmt.interleaved:
            plane = self._rows(data, start, lines, chroma_stride, 2 * columns)
            cb, cr = plane[:, 0::2], plane[:, 1::2]
        else:
            cb = self._rows(data, start, lines, chroma_stride, columns)
            cr = self._rows(data, start + chroma_stride * lines, lines, chroma_stride, columns)
        pick = np.ix_(np.arange(height) // down, np.arange(width) // across)
        return luma, cb[pick], cr[pick]

    def _cut(self, plane: np.ndarray, corner: tuple[int, int]) -> np.ndarray:
        x, y = corner
        taxel = plane[y : y + self.layout.height, x : x + self.layout.width]
        return taxel[:: self.stride, :: self.stride]

    def _plain_sums(self, plane: np.ndarray) -> list[int]:
        return [int(self._cut(plane, corner).sum(dtype=np.int64)) for corner in self.layout.corners]

    def _bayer_sums(self, plane: np.ndarray) -> list[int]:
        w, h, step = self.layout.width, self.layout.height, 2 * self.stride
        sums = []
        for x, y in self.layout.corners:
            taxel = plane[y : y + h, x : x + w]
            sums.append(sum(int(taxel[dy::step, dx::step].sum()) for dx, dy in self.fmt.green_sites))
        return sums

    def _ycbcr_sums(self, luma: np.ndarray, cb: np.ndarray, cr: np.ndarray) -> list[int]:
        sums = []
        for corner in self.layout.corners:
            parts = [self._cut(plane, corner) for plane in (luma, cb, cr)]
            if self.ycbcr.mode == "exact":
                sums.append(int(self.ycbcr.per_pixel(*parts).sum()))
            else:
                total_y, total_cb, total_cr = (int(part.sum(dtype=np.int64)) for part in parts)
                sums.append(self.ycbcr.per_taxel(total_y, total_cb, total_cr, self.pixels))
        return sums
