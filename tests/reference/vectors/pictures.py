"""Frames as bytes: random, dark, saturated, and painted with 25 levels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wstac_reference.constants import TAXELS
from wstac_reference.formats import PixelFormat
from wstac_reference.layout import Layout
from wstac_reference.rng import SplitMix64

Picture = Callable[[SplitMix64, PixelFormat, int], bytes]
"""From a generator, a format and a number of bytes to a frame."""


def noise(rng: SplitMix64, fmt: PixelFormat, size: int) -> bytes:
    """Returns any bytes, padding included: words above full scale, illegal chroma."""
    return rng.below(256, size).astype(np.uint8).tobytes()


def dark(rng: SplitMix64, fmt: PixelFormat, size: int) -> bytes:
    """Returns a nearly black picture: levels 0..2, and for YCbCr luma near black and neutral chroma."""
    value = rng.below(3, size)
    if fmt.is_ycbcr:
        value = np.where(_luma_mask(fmt, size), 15 + value, 127 + value)
    elif fmt.family == "rgb565":
        value = rng.below(2, size) << 5
        value[1::2] = 0
    elif fmt.bytes_per_pixel == 2:
        value[1::2] = 0
    return value.astype(np.uint8).tobytes()


def black(rng: SplitMix64, fmt: PixelFormat, size: int) -> bytes:
    """Returns bytes that are all 0, which for YCbCr is green instead of black."""
    return bytes(size)


def saturated(rng: SplitMix64, fmt: PixelFormat, size: int) -> bytes:
    """Returns bytes that are all 255. For 10 and 12 bits that is above full scale."""
    return b"\xff" * size


def greenish(rng: SplitMix64, fmt: PixelFormat, size: int) -> bytes:
    """Returns YCbCr of a dim green light: legal, not clipped, and with rounding."""
    value = np.where(_luma_mask(fmt, size), 20 + rng.below(60, size), 105 + rng.below(20, size))
    return value.astype(np.uint8).tobytes()


def _luma_mask(fmt: PixelFormat, size: int) -> np.ndarray:
    """Returns which bytes are luma: exactly for packed formats, and the first part for planar ones."""
    index = np.arange(size)
    if fmt.family == "packed422":
        return index % 2 == fmt.luma_byte
    share = {(2, 2): 1.5, (2, 1): 2.0, (1, 1): 3.0}[fmt.chroma]
    return index < size / share


def paint(
    rng: SplitMix64,
    fmt: PixelFormat,
    width: int,
    height: int,
    bytes_per_line: int,
    layout: Layout,
    levels: np.ndarray,
) -> bytes:
    """Returns a frame whose taxels have the given green levels. Everything else is noise.

    Supports GREY and 10..16-bit gray, 24- and 32-bit RGB, and YUYV (luma, with neutral chroma).
    """
    size = fmt.frame_bytes(height, bytes_per_line)
    rows = rng.below(256, size).reshape(height, bytes_per_line)
    x0 = np.array([corner[0] for corner in layout.corners])
    y0 = np.array([corner[1] for corner in layout.corners])
    levels = np.clip(levels, 0, fmt.full_scale)
    for index in range(TAXELS):
        for y in range(y0[index], y0[index] + layout.height):
            for x in range(x0[index], x0[index] + layout.width):
                level = levels[index]
                if fmt.family == "packed422":
                    assert fmt.luma_byte == 0
                    rows[y, 2 * x] = level
                    cell = 4 * (x // 2)
                    rows[y, cell + 1] = rows[y, cell + 3] = 128
                elif fmt.family == "rgb":
                    rows[y, fmt.bytes_per_pixel * x + fmt.green_byte] = level
                elif fmt.bytes_per_pixel == 2:
                    rows[y, 2 * x : 2 * x + 2] = level & 255, level >> 8
                else:
                    rows[y, x] = level
    return rows.astype(np.uint8).tobytes()
