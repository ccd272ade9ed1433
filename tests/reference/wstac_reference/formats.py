"""Pixel formats: the meaning of a frame's bytes, and their number.

Names give the order of bytes in memory: RGBX32 is the bytes R, G, B, X. The V4L2 names differ for 32-bit RGB: V4L2's
XBGR32, fourcc 'XR24', is the bytes B, G, R, X, which is BGRX32 here. `FOURCC` maps by the bytes.
"""

from __future__ import annotations

from dataclasses import dataclass

from .rational import ceil_div


@dataclass(frozen=True)
class PixelFormat:
    """A pixel format.

    `family` is gray, rgb, rgb565, bayer, packed422 or planar; `full_scale` is G.
    `green_byte` (rgb) is the byte of the pixel that holds green. `green_sites`
    (bayer) are the (x, y) of the two green sites in a 2 x 2 cell. `luma_byte`
    (packed422) is 0 for YUYV and 1 for UYVY. `chroma` (planar) is the horizontal
    and vertical subsampling; `interleaved` says one CbCr plane instead of two.
    """

    name: str
    family: str
    full_scale: int = 255
    bytes_per_pixel: int = 1
    green_byte: int = 0
    green_sites: tuple[tuple[int, int], ...] = ()
    luma_byte: int = 0
    chroma: tuple[int, int] = (1, 1)
    interleaved: bool = False

    @property
    def is_ycbcr(self) -> bool:
        """Returns whether green has to be computed from Y, Cb and Cr."""
        return self.family in ("packed422", "planar")

    def min_bytes_per_line(self, width: int) -> int:
        """Returns the smallest number of bytes of a row."""
        if self.family == "packed422":
            return 4 * ceil_div(width, 2)
        if self.interleaved:
            return 2 * ceil_div(width, 2)  # an odd width's chroma row is one byte longer
        return width * self.bytes_per_pixel

    def chroma_bytes_per_line(self, bytes_per_line: int) -> int:
        """Returns the row length of a planar format's chroma planes (*decided*: halved, rounded up)."""
        if self.interleaved or self.chroma[0] == 1:
            return bytes_per_line
        return ceil_div(bytes_per_line, 2)

    def frame_bytes(self, height: int, bytes_per_line: int) -> int:
        """Returns the bytes of a whole frame. Chroma planes follow the luma plane directly."""
        size = bytes_per_line * height
        if self.family == "planar":
            planes = 1 if self.interleaved else 2
            rows = ceil_div(height, self.chroma[1])
            size += planes * self.chroma_bytes_per_line(bytes_per_line) * rows
        return size


def _all() -> dict[str, PixelFormat]:
    found = [
        PixelFormat("GREY", "gray"),
        PixelFormat("Y10", "gray", 1023, 2),
        PixelFormat("Y12", "gray", 4095, 2),
        PixelFormat("Y16", "gray", 65535, 2),
        PixelFormat("RGB24", "rgb", 255, 3, 1),
        PixelFormat("BGR24", "rgb", 255, 3, 1),
        PixelFormat("RGBX32", "rgb", 255, 4, 1),
        PixelFormat("BGRX32", "rgb", 255, 4, 1),
        PixelFormat("XRGB32", "rgb", 255, 4, 2),
        PixelFormat("XBGR32", "rgb", 255, 4, 2),
        PixelFormat("RGB565", "rgb565", 255, 2),
        PixelFormat("YUYV", "packed422", luma_byte=0, chroma=(2, 1), bytes_per_pixel=2),
        PixelFormat("UYVY", "packed422", luma_byte=1, chroma=(2, 1), bytes_per_pixel=2),
        PixelFormat("NV12", "planar", chroma=(2, 2), interleaved=True),
        PixelFormat("YU12", "planar", chroma=(2, 2)),
        PixelFormat("YUV422P", "planar", chroma=(2, 1)),
        PixelFormat("YUV444P", "planar", chroma=(1, 1)),
    ]
    second_and_third = ((1, 0), (0, 1))
    first_and_fourth = ((0, 0), (1, 1))
    for order in ("RGGB", "GRBG", "GBRG", "BGGR"):
        sites = first_and_fourth if order[0] == "G" else second_and_third
        for bits in (8, 10, 12):
            found.append(
                PixelFormat(
                    f"{order}{bits}", "bayer", (1 << bits) - 1, 1 if bits == 8 else 2, green_sites=sites
                )
            )
    return {fmt.name: fmt for fmt in found}


FORMATS: dict[str, PixelFormat] = _all()

FOURCC: dict[str, str] = {
    "GREY": "GREY", "Y10 ": "Y10", "Y12 ": "Y12", "Y16 ": "Y16",
    "RGB3": "RGB24", "BGR3": "BGR24", "RGBP": "RGB565",
    "XB24": "RGBX32", "XR24": "BGRX32", "BX24": "XRGB32", "RX24": "XBGR32",
    "YUYV": "YUYV", "UYVY": "UYVY", "NV12": "NV12", "YU12": "YU12", "422P": "YUV422P",
    "RGGB": "RGGB8", "GRBG": "GRBG8", "GBRG": "GBRG8", "BA81": "BGGR8",
    "RG10": "RGGB10", "BA10": "GRBG10", "GB10": "GBRG10", "BG10": "BGGR10",
    "RG12": "RGGB12", "BA12": "GRBG12", "GB12": "GBRG12", "BG12": "BGGR12",
}  # fmt: skip
"""V4L2 fourcc to format name."""


def by_fourcc(code: str) -> PixelFormat:
    """Returns the format of a V4L2 fourcc. Trailing spaces may be left out."""
    try:
        return FORMATS[FOURCC[code.ljust(4)]]
    except KeyError:
        raise ValueError(f"unknown fourcc {code!r}; known: {', '.join(FOURCC)}") from None
