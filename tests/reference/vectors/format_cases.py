"""Cases from bytes to sums: every pixel format, layout, stride, matrix and range."""

from __future__ import annotations

from itertools import product

from wstac_reference.formats import FORMATS
from wstac_reference.green import STRIDES, YCbCr
from wstac_reference.layout import Layout
from wstac_reference.rng import SplitMix64, seed_of

from . import SEED
from .case import Case
from .pictures import Picture, black, dark, greenish, noise, saturated

ALL_STRIDES = ("GREY", "Y16", "RGB24", "RGB565", "GRBG10", "RGGB8", "YUYV", "NV12", "YU12")
"""Formats that get a case for every stride; the others share the strides out."""


def scattered(width: int, height: int, taxel: tuple[int, int], seed: str) -> Layout:
    """Returns random corners, odd ones among them, that may overlap."""
    rng = SplitMix64(seed_of(f"layout {seed}", SEED))
    x = rng.below(width - taxel[0] + 1, 25)
    y = rng.below(height - taxel[1] + 1, 25)
    x[0], y[0] = 0, 0
    x[24], y[24] = width - taxel[0], height - taxel[1]
    return Layout(*taxel, tuple((int(a), int(b)) for a, b in zip(x, y, strict=True)))


def picture_case(
    name: str,
    about: str,
    fmt_name: str,
    size: tuple[int, int],
    pictures: tuple[Picture, ...],
    pad: int = 0,
    **settings,
) -> Case:
    """Returns a short stream of unrelated pictures, to compare sums and features."""
    fmt, (width, height) = FORMATS[fmt_name], size
    bytes_per_line = fmt.min_bytes_per_line(width) + pad
    frame_bytes = fmt.frame_bytes(height, bytes_per_line)
    rng = SplitMix64(seed_of(name, SEED))
    data = [picture(rng, fmt, frame_bytes) for picture in pictures]
    return Case(name, about, fmt_name, width, height, bytes_per_line, data, **settings)


def plain_formats() -> list[Case]:
    """Returns cases of formats that hold green itself, in two layouts. The strides are distributed over them."""
    cases = []
    plain = [name for name, fmt in FORMATS.items() if not fmt.is_ycbcr]
    for index, name in enumerate(plain):
        strides = STRIDES if name in ALL_STRIDES else (STRIDES[index % 4], STRIDES[(index + 2) % 4])
        tag = name.lower()
        for turn, stride in enumerate(strides):
            pictures = (noise, dark) if turn else (noise, dark, saturated, black)
            if turn % 2 == 0:
                about = f"{name}, paper layout in an odd frame, stride {stride}"
                cases.append(
                    picture_case(f"{tag}-paper-s{stride}", about, name, (25, 24), pictures, stride=stride)
                )
            else:
                about = f"{name}, explicit odd corners and size, padded rows, stride {stride}"
                layout = scattered(25, 23, (9, 7), f"{tag}{stride}")
                cases.append(
                    picture_case(
                        f"{tag}-corners-s{stride}", about, name, (25, 23), pictures, pad=6, stride=stride,
                        layout=layout,
                    )
                )
    return cases


def ycbcr_formats() -> list[Case]:
    """Returns YCbCr formats with every mode, matrix and range, and three of them with strides."""
    cases = []
    names = [name for name, fmt in FORMATS.items() if fmt.is_ycbcr]
    settings = product(("exact", "linear"), ("bt601", "bt709"), ("limited", "full"))
    for index, (mode, matrix, span) in enumerate(settings):
        for name in names:
            stride = (1, 2, 1, 3, 5, 1, 2, 1)[index]
            odd = (index + names.index(name)) % 2 == 1
            size = (23, 21) if odd else (22, 20)
            case_name = f"{name.lower()}-{mode}-{matrix}-{span}"
            cases.append(
                picture_case(
                    case_name,
                    f"{name}, {mode}, {matrix}, {span} range, {'odd' if odd else 'even'} size, stride {stride}",
                    name,
                    size,
                    (noise, greenish, dark),
                    pad=(0, 0, 5, 0, 4, 0, 3, 8)[index],
                    ycbcr=YCbCr(matrix, span, mode),
                    stride=stride,
                    layout=scattered(*size, (7, 5), case_name) if odd else None,
                )
            )
    for name, stride, mode in product(("YUYV", "NV12", "YU12"), STRIDES, ("exact", "linear")):
        case_name = f"{name.lower()}-{mode}-s{stride}"
        cases.append(
            picture_case(
                case_name, f"{name}, {mode}, stride {stride}, odd corners", name, (27, 25), (noise, greenish),
                ycbcr=YCbCr(mode=mode), stride=stride, layout=scattered(27, 25, (11, 9), case_name),
            )
        )  # fmt: skip
    for name in names:
        for mode in ("exact", "linear"):
            cases.append(
                picture_case(
                    f"{name.lower()}-{mode}-extremes", f"{name}, {mode}: all bytes 0, all bytes 255", name,
                    (11, 9), (black, saturated), pad=1, ycbcr=YCbCr(mode=mode),
                )
            )  # fmt: skip
    return cases


def shapes() -> list[Case]:
    """Returns layouts at their limits, and darkness."""
    whole = Layout(13, 11, ((0, 0),) * 25)
    dim = (dark, black, dark, noise)
    return [
        picture_case("layout-wide", "paper layout in 160 x 90, as 16:9 cameras have", "GREY", (160, 90), (noise,)),
        picture_case("layout-tall", "paper layout in a portrait frame", "GREY", (61, 88), (noise,)),
        picture_case("layout-least", "4 x 4 frame, the smallest with a paper layout", "GREY", (4, 4), (noise,) * 3),
        picture_case("layout-half", "odd and even sides: the square starts at half a pixel", "GREY", (41, 20),
               (noise,)),
        picture_case("layout-whole", "every taxel is the whole frame", "Y10", (13, 11), (noise, dark), layout=whole),
        picture_case("layout-whole-s5", "the whole frame at stride 5", "RGGB12", (13, 11), (noise, dark), stride=5,
                     layout=whole),
        picture_case("floor-none", "floor_levels 0: one raw count is the floor", "GREY", (20, 20), dim,
               floor_levels=0.0),
        picture_case("floor-none-y16", "floor_levels 0 and 16 bits: saturates at -16", "Y16", (100, 100),
                     (black,), floor_levels=0.0),
        picture_case("floor-two", "floor_levels 2", "GREY", (20, 20), dim, floor_levels=2.0),
        picture_case("floor-y16", "half a level of 16 bits", "Y16", (20, 20), dim),
        picture_case("bin-dark", "60 frames per second in the dark: full scale doubles, the floor does not", "GREY", (20, 20),
                     dim * 2, fps=(60, 1)),
    ]  # fmt: skip


def ties() -> list[Case]:
    """Returns pictures whose green is exactly n + 1/2. In full-range BT.601, only two pairs of Cb and Cr have that."""
    cases = []
    for mode in ("exact", "linear"):
        frames = []
        for cb, cr in ((78, 178), (178, 78)):  # 50 (0.344136 - 0.714136) = -18.5, and 18.5
            luma = bytes(range(0, 250, 10))
            frames.append(luma + bytes([cb] * 25) + bytes([cr] * 25))
        about = f"{mode}: every pixel is a tie, and a taxel is a pixel"
        ycbcr = YCbCr("bt601", "full", mode)
        cases.append(Case(f"yuv444p-{mode}-ties", about, "YUV444P", 5, 5, 5, frames, ycbcr=ycbcr))
    return cases


def format_cases() -> list[Case]:
    """Returns all cases of this file."""
    return plain_formats() + ycbcr_formats() + ties() + shapes()
