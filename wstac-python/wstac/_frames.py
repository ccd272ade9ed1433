"""Arrays of frames: the shape and type of each pixel format, checked."""

from __future__ import annotations

import operator
from fractions import Fraction
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _wstac
from ._wstac import Error

Fps = Union[int, float, str, Fraction]
"""Frames per second, such as 30, 29.97, "30000/1001" or a Fraction."""

Frames = Union[NDArray[np.uint8], NDArray[np.uint16]]

_OF_BYTES = {"GREY": (), "RGB3": (3,), "BGR3": (3,), "YUYV": (2,), "UYVY": (2,)}
_OF_BYTES.update({code: (4,) for code in "XR24 AR24 BGR4 XB24 AB24 BX24 BA24 RGB4 RX24 RA24".split()})
_OF_BYTES.update({code: () for code in "RGGB GRBG GBRG BA81".split()})
_WORDS = frozenset("Y10 Y12 Y16 RGBP RG10 BA10 GB10 BG10 RG12 BA12 GB12 BG12".split())


def pixel_shape(code: str) -> Optional[tuple[np.dtype[Any], tuple[int, ...]]]:
    """Returns the type and the last dimensions of a picture in this format; None for planar formats."""
    code = code.rstrip()
    if code in _WORDS:
        return np.dtype("<u2"), ()
    return (np.dtype("u1"), _OF_BYTES[code]) if code in _OF_BYTES else None


def guess(frames: Frames, single: bool) -> str:
    """Returns the format of frames by their shape: 8 bits of gray, or three colors of which the middle one is green."""
    shape = frames.shape if single else frames.shape[1:]
    if frames.dtype == np.uint8:
        if len(shape) == 2:
            return "GREY"
        if len(shape) == 3 and shape[2] == 3:
            return "RGB3"
        if len(shape) == 3 and shape[0] == 3:
            raise Error(f"frames: shape {frames.shape} has colors first, expected them last: give (height, width, 3)")
    hint = "Y10, Y12 or Y16" if frames.dtype == np.uint16 else "one such as YUYV"
    raise Error(f"frames: {frames.dtype} {frames.shape} has no format of its own, expected format = {hint}")


def without_mask(name: str, array: Any) -> None:
    """Refuses a masked array: its mask would be lost."""
    if isinstance(array, np.ma.MaskedArray):
        raise Error(f"{name}: a masked array, expected an array without a mask, such as array.filled(…)")


def array(frames: Any) -> Frames:
    """Returns frames that are an array of bytes or of words."""
    if not isinstance(frames, np.ndarray):
        raise TypeError(f"frames is a {type(frames).__name__}, expected a NumPy array")
    without_mask("frames", frames)
    if frames.dtype not in (np.dtype("u1"), np.dtype("<u2")):
        raise Error(f"frames: type {frames.dtype}, expected uint8, or uint16 for formats of 10 to 16 bits")
    return frames


def size_of(frames: Frames, code: str) -> tuple[int, int]:
    """Returns the width and the height of a stack of pictures."""
    picture = pixel_shape(code)
    if picture is None:
        # One that is unknown is refused.
        _wstac.row_bytes(code, 2)
        raise Error(f"frames: format {code} has planes, expected raw bytes, uint8 (n, bytes), and their size")
    dtype, last = picture
    if frames.dtype != dtype or frames.ndim != 3 + len(last) or frames.shape[3:] != last:
        form = ", ".join(["n", "height", "width", *map(str, last)])
        raise Error(f"frames: {frames.dtype} {frames.shape}, expected {dtype} ({form}) for {code}")
    return frames.shape[2], frames.shape[1]


def rows(frames: Frames, code: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Returns the bytes of each frame as a row, from a stack of pictures of this size or from raw bytes."""
    if frames.ndim == 2 and frames.dtype == np.uint8:
        return np.ascontiguousarray(frames)
    found = size_of(frames, code)
    if found != tuple(size):
        raise Error(f"frames: {found[0]}x{found[1]}, expected {size[0]}x{size[1]} as before")
    width = found[0]
    if _wstac.row_bytes(code, width) != frames[0, :1].nbytes if len(frames) else False:
        raise Error(f"frames: width is {width}, expected an even one for {code}")
    whole = np.ascontiguousarray(frames)
    return whole.view(np.uint8).reshape(len(whole), -1) if len(whole) else np.zeros((0, 0), np.uint8)


def pictures(raw: NDArray[np.uint8], code: str, size: tuple[int, int], bytes_per_row: int) -> Frames:
    """Returns raw bytes (n, bytes) as pictures, without a copy; for a planar format, the bytes themselves."""
    picture = pixel_shape(code)
    (width, height), n = size, len(raw)
    if picture is None:
        return raw
    dtype, last = picture
    row = dtype.itemsize * int(np.prod(last, dtype=int)) * width
    if row > bytes_per_row:
        return raw
    without_padding = raw.reshape(n, height, bytes_per_row)[:, :, :row]
    return without_padding.view(dtype).reshape(n, height, width, *last)


def rate(fps: Fps) -> tuple[int, int]:
    """Returns numerator and denominator of a rate; decimals are thousandths."""
    try:
        exact = Fraction(round(fps * 1000), 1000) if isinstance(fps, float) else Fraction(fps)
        if 0 < exact and max(exact.numerator, exact.denominator) < 1 << 32:
            return exact.numerator, exact.denominator
    except (TypeError, ValueError, ArithmeticError):
        pass
    raise Error(f'fps is {fps!r}, expected a number above 0 such as 30, 29.97 or "30000/1001"')


def count(name: str, value: Any, least: int, most: int) -> int:
    """Returns an integer that is in a range."""
    number = operator.index(value)
    if not least <= number <= most:
        raise Error(f"{name} is {number}, expected {least} to {most}")
    return number


def sides(size: Any) -> tuple[int, int]:
    """Returns width and height."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise Error(f"size is {size!r}, expected (width, height)") from None
    return count("width", width, 1, 16384), count("height", height, 1, 16384)
