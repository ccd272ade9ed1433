"""YUV4MPEG2 files: header and frames of 8-bit video."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import BinaryIO

import numpy as np

from .formats import FORMATS, PixelFormat

MAX_LINE = 4096


@dataclass(frozen=True)
class Header:
    """The content of the first line. `fps` is None for 0:0 (unknown)."""

    width: int
    height: int
    fps: Fraction | None
    format: PixelFormat
    full_range: bool | None

    @property
    def frame_bytes(self) -> int:
        """Returns the bytes of a frame. Y4M has no row padding."""
        return self.format.frame_bytes(self.height, self.format.min_bytes_per_line(self.width))


def _format(tag: str) -> PixelFormat:
    if tag == "mono":
        return FORMATS["GREY"]
    if tag in ("mono10", "mono12", "mono16"):
        return FORMATS[f"Y{tag[4:]}"]
    if tag in ("420", "420jpeg", "420mpeg2", "420paldv"):
        return FORMATS["YU12"]
    if tag in ("422", "444"):
        return FORMATS[f"YUV{tag}P"]
    raise ValueError(f"Y4M color space C{tag} is not supported")


def _line(stream: BinaryIO) -> bytes:
    line = stream.readline(MAX_LINE)
    if line and not line.endswith(b"\n"):
        raise ValueError("Y4M line does not end")
    return line[:-1]


def read_header(stream: BinaryIO) -> Header:
    """Parses the stream header. Without a color space it is C420."""
    words = _line(stream).decode("ascii", "replace").split(" ")
    if words[0] != "YUV4MPEG2":
        raise ValueError("not a YUV4MPEG2 file")
    width = height = 0
    fps: Fraction | None = None
    tag, full = "420", None
    for word in filter(None, words[1:]):
        key, value = word[0], word[1:]
        if key == "W":
            width = int(value)
        elif key == "H":
            height = int(value)
        elif key == "F":
            num, den = (int(part) for part in value.split(":"))
            fps = Fraction(num, den) if num > 0 and den > 0 else None
        elif key == "C":
            tag = value
        elif word.startswith("XCOLORRANGE="):
            full = word.partition("=")[2] == "FULL"
    if width < 1 or height < 1:
        raise ValueError(f"Y4M size {width} x {height}")
    return Header(width, height, fps, _format(tag), full)


def read_frames(stream: BinaryIO, header: Header) -> Iterator[bytes]:
    """Yields the frames, until the end of the file. A cut-off last frame is an error."""
    while True:
        line = _line(stream)
        if not line:
            return
        if line.split(b" ")[0] != b"FRAME":
            raise ValueError("Y4M frame header missing")
        data = stream.read(header.frame_bytes)
        if len(data) < header.frame_bytes:
            raise ValueError("Y4M file ends inside a frame")
        is_limited = header.format.family == "gray" and header.full_range is False
        yield full_gray(data, header.format.full_scale) if is_limited else data


def full_gray(data: bytes, most: int) -> bytes:
    """Makes gray of limited range full."""
    step = (most + 1) // 256
    levels = np.frombuffer(data, "<u1" if most == 255 else "<u2").astype(np.int64)
    full = (2 * np.maximum(levels - 16 * step, 0) * most + 219 * step) // (438 * step)
    return np.minimum(full, most).astype("<u1" if most == 255 else "<u2").tobytes()
