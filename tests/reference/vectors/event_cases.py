"""Cases from a stream to events: baseline, windows, samples, gaps, rates, speed, direction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wstac_reference.formats import FORMATS
from wstac_reference.layout import paper_layout
from wstac_reference.rng import SplitMix64, seed_of
from wstac_reference.speed import SpeedConfig
from wstac_reference.trigger import TriggerConfig

from . import SEED
from .case import Case
from .pictures import paint
from .slides import ORDERS, Slide, light

Losses = Sequence[tuple[int, int]]
"""(first lost frame, how many), counted on the camera's own time line."""


def stream(
    name: str,
    about: str,
    frames: int = 98,
    slides: tuple[Slide, ...] = (Slide(40),),
    base: int = 20,
    shake: int = 2,
    lose: Losses = (),
    fmt: str = "Y12",
    side: int = 5,
    pad: int = 0,
    change: Callable[[np.ndarray], None] | None = None,
    **settings,
) -> Case:
    """Returns a stream of painted frames, some of which are lost.

    With the default side of 5 pixels, the taxels of the paper's layout have one pixel.
    """
    rng = SplitMix64(seed_of(name, SEED))
    levels = light(rng, frames, slides, base, shake)
    if change is not None:
        change(levels)
    gone = np.zeros(frames, dtype=bool)
    for first, count in lose:
        assert first + count <= frames and not gone[first : first + count].any()
        gone[first : first + count] = True
    pixel_format, layout = FORMATS[fmt], paper_layout(side, side)
    bytes_per_line = pixel_format.min_bytes_per_line(side) + pad
    data: list[bytes] = []
    lost: list[tuple[int, int]] = []
    missing = 0
    for t in range(frames + 1):
        if t < frames and gone[t]:
            missing += 1
            continue
        if missing:
            lost.append((len(data), missing))
            missing = 0
        if t < frames:
            data.append(paint(rng, pixel_format, side, side, bytes_per_line, layout, levels[t]))
    return Case(name, about, fmt, side, side, bytes_per_line, data, lost=lost, long=True, **settings)


def directions() -> list[Case]:
    """Returns slides in the four directions, between them, and without direction."""
    cases = [
        stream(f"slide-{name}", f"a slide in direction {name}", slides=(Slide(40, order),), with_samples=name == "0deg")
        for name, order in ORDERS.items()
        if name != "press"
    ]
    return cases + [
        stream("slide-diagonal", "rows and columns equally late: unclear",
               slides=(Slide(40, lambda i, j: i + j, step=5),)),
        stream("slide-oblique", "columns three times as late as rows: 0 degrees, half confident",
               slides=(Slide(40, lambda i, j: 3 * j + i, step=3),)),
        stream("slide-oblique-up", "rows from last to first, columns a third: 90 degrees",
               slides=(Slide(40, lambda i, j: 3 * (4 - i) + j, step=3),)),
        stream("slide-zigzag", "columns in no order: unclear by slope",
               slides=(Slide(40, lambda i, j: (0, 3, 1, 3, 1)[j] + (0, 2, 0, 2, 1)[i], step=5),)),
        stream("press-all", "all taxels at once, no noise: both slopes 0, unclear", shake=0,
               slides=(Slide(45, ORDERS["press"], rise=8, fall=20),)),
        stream("press-one", "one taxel, no noise: a row and a column never light", shake=0,
               slides=(Slide(45, ORDERS["press"], rise=8, fall=20, only=lambda i, j: i == 1 and j == 3),)),
        stream("press-two", "two taxels on a diagonal: both slopes known, rows and columns dark", shake=0,
               slides=(Slide(45, lambda i, j: j, rise=8, fall=20, only=lambda i, j: i == j and i in (1, 3)),)),
        stream("slide-one-row", "one row lights, noise free: four rows never light, still 0 degrees", shake=0,
               slides=(Slide(40, only=lambda i, j: i == 2),)),
        stream("slide-grey24", "8 bit grey, 24 x 24, paper taxels of 3 x 3, padded rows", fmt="GREY", side=24,
               pad=3, base=1, shake=0, slides=(Slide(38, ORDERS["180deg"], peak=60),)),
        stream("slide-rgb", "24-bit color, 8 x 8", fmt="BGR24", side=8, base=1, shake=0,
               slides=(Slide(38, ORDERS["270deg"], peak=60),)),
        stream("slide-yuyv", "YUYV, luma only, exact", fmt="YUYV", side=8, base=17, shake=0,
               slides=(Slide(38, ORDERS["90deg"], peak=60),)),
        stream("slide-y16", "16 bits of contrast", fmt="Y16", base=200, shake=9,
               slides=(Slide(38, peak=30000),)),
    ]  # fmt: skip


def speeds() -> list[Case]:
    """Returns cases of durations, laws, thresholds, and the reasons for having no speed."""
    cases = [
        stream(f"speed-step{step}", f"columns {step} frames apart", slides=(Slide(40, step=step),))
        for step in (1, 4, 6, 8, 10)
    ]
    above = SpeedConfig(threshold_on="above_baseline")
    return cases + [
        stream("speed-cut-end", "still lit when the sample ends: a bound", frames=120, slides=(Slide(40, step=14,
               fall=20),)),
        stream("speed-cut-start", "lit from the sample's first frame: a bound", frames=120,
               slides=(Slide(40, step=6, rise=6),), trigger=TriggerConfig(backtrack=0)),
        stream("speed-bright", "the baseline is above the threshold: no speed", base=300, shake=5),
        stream("speed-bright-above", "the same with threshold_on above_baseline: a speed", base=300, shake=5,
               speed=above),
        stream("speed-above", "threshold_on above_baseline in the dark", speed=above),
        stream("speed-dim", "fires, but no frame is valid", base=10, shake=0, slides=(Slide(40, rise=10, fall=20,
               peak=26),)),
        stream("speed-threshold", "a higher threshold shortens the event", speed=SpeedConfig(threshold=0.3)),
        stream("speed-25fps", "25 frames per second: durations scale", fps=(25, 1)),
        stream("speed-ntsc", "30000/1001 frames per second", fps=(30000, 1001)),
        stream("speed-5fps", "5 frames per second: no binning, scaled duration", slides=(Slide(40, step=1),), fps=(5, 1)),
    ]  # fmt: skip


def _step_up(levels: np.ndarray) -> None:
    levels[15:] += 20


def _one_flash(levels: np.ndarray) -> None:
    levels[7] += 900


def triggers() -> list[Case]:
    """Returns cases of rules, margins, extreme windows, baselines, and streams of odd lengths."""
    late = (Slide(60, ORDERS["90deg"], step=7),)
    return [
        stream("quiet-nothing", "no contact: no event", frames=60, slides=()),
        stream("baseline-unquiet", "the light changes within the baseline", base=14, shake=1, change=_step_up),
        stream("baseline-flash", "one bright frame in the baseline", change=_one_flash),
        stream("baseline-black", "a black baseline: features at the floor", base=0, shake=0),
        stream("baseline-positive", "a baseline above full scale: positive eta", base=1500, shake=20,
               slides=(Slide(40, peak=2000),)),
        stream("literal-below", "literal rule, b 0.9", trigger=TriggerConfig(rule="literal", multiplier=0.9)),
        stream("literal-above", "literal rule, b 1.2, negative eta: fires on every window", frames=160, slides=(),
               trigger=TriggerConfig(rule="literal", multiplier=1.2)),
        stream("literal-one", "literal rule, b 1: any noise fires, nothing is quiet",
               trigger=TriggerConfig(rule="literal", multiplier=1.0)),
        stream("literal-positive", "literal rule, positive eta, b 1.2", base=1500, shake=20,
               slides=(Slide(40, peak=2000),), trigger=TriggerConfig(rule="literal", multiplier=1.2)),
        stream("literal-zero", "literal rule, b 0: the threshold is full scale",  base=100,
               slides=(Slide(40, peak=3900),), trigger=TriggerConfig(rule="literal", multiplier=0.0)),
        stream("signed-steep", "b 1.5: the multiplier outweighs the margin", trigger=TriggerConfig(multiplier=1.5),
               slides=(Slide(40, peak=3000),)),
        stream("signed-deaf", "b 3: nothing fires", frames=60, trigger=TriggerConfig(multiplier=3.0)),
        stream("signed-bare", "b 1 and margin 0: fires where W is above eta", frames=120,
               trigger=TriggerConfig(multiplier=1.0, margin=0.0)),
        stream("signed-bare-still", "b 1, margin 0, no noise: W equal to eta does not fire", shake=0,
               trigger=TriggerConfig(multiplier=1.0, margin=0.0)),
        stream("signed-margin", "b 1.05: the margin outweighs the multiplier", trigger=TriggerConfig(multiplier=1.05)),
        stream("signed-margin-only", "b 1, margin 0.1", shake=1, trigger=TriggerConfig(multiplier=1.0, margin=0.1)),
        stream("signed-fraction", "b and margin that 16 bits cannot hold",
               trigger=TriggerConfig(multiplier=1.0333333333, margin=0.1234567)),
        stream("window-1", "m 1, c 0: a baseline of 5 frames", frames=90, slides=(Slide(14),),
               trigger=TriggerConfig(window=1, backtrack=0)),
        stream("window-1-c5", "m 1, c 5: all the backtrack there is", frames=90, slides=(Slide(9, rise=3),),
               trigger=TriggerConfig(window=1, backtrack=5)),
        stream("window-2", "m 2, c 10", frames=90, slides=(Slide(14),), trigger=TriggerConfig(window=2, backtrack=10)),
        stream("window-7", "m 7, c 3", frames=120, slides=(Slide(50),), trigger=TriggerConfig(window=7, backtrack=3)),
        stream("window-12-c58", "m 12, c 58: complete as the window fires", frames=150, slides=(Slide(75),),
               trigger=TriggerConfig(window=12, backtrack=58)),
        stream("window-14-c56", "m 14, c 56, then a second event", frames=260, slides=(Slide(80), Slide(190)),
               trigger=TriggerConfig(window=14, backtrack=56)),
        stream("window-20-c49", "m 20, c 49: one frame of capture", frames=190, slides=(Slide(125),),
               trigger=TriggerConfig(window=20, backtrack=49)),
        stream("window-35", "m 35, c 35", frames=290, slides=(Slide(220),), trigger=TriggerConfig(window=35,
               backtrack=35)),
        stream("window-70", "m 70, c 0: the window is the sample", frames=500, fmt="GREY", base=1, shake=0,
               slides=(Slide(360, step=12, rise=10, fall=12, peak=250),), trigger=TriggerConfig(window=70,
               backtrack=0)),
        stream("events-two", "two events", frames=190, slides=(Slide(40), Slide(130, ORDERS["270deg"])),
               with_samples=True),
        stream("events-adjacent", "a second slide right behind the first: fires in the first window after the sample",
               frames=190, slides=(Slide(40), Slide(100, ORDERS["270deg"], step=12, rise=10, fall=20))),
        stream("events-long", "light for a very long time: event after event", frames=190,
               slides=(Slide(60, ORDERS["press"], rise=20, fall=250),)),
        stream("first-window", "fires in the first window after the baseline", slides=(Slide(28),)),
        stream("end-in-sample", "ends inside a sample", frames=80, slides=late),
        stream("end-one-short", "ends one frame before the sample does", frames=94),
        stream("end-with-sample", "ends with the sample", frames=95),
        stream("end-in-window", "ends inside a window", frames=48, slides=()),
        stream("end-after-baseline", "ends with the baseline", frames=25, slides=()),
        stream("end-in-baseline", "ends one frame before the baseline does", frames=24, slides=()),
        stream("one-frame", "a stream of one frame", frames=1, slides=()),
        stream("no-frame", "a stream of no frames", frames=0, slides=()),
    ]  # fmt: skip


def gaps() -> list[Case]:
    """Returns cases with a single loss: where, and how many frames.

    With the default settings the default slide's window is 35..39, so the sample is
    frames 25..94.
    """
    places = {
        "baseline": (10, "in the baseline"),
        "across": (22, "from the baseline into the first windows"),
        "watch": (28, "while watching, inside a window"),
        "capture": (60, "while capturing"),
        "tail": (90, "around the sample's end"),
    }
    cases = []
    for tag, (first, where) in places.items():
        for count in (1, 7, 8, 100):
            frames = 240 if count == 100 else 108
            slides: tuple[Slide, ...] = (Slide(40),)
            if count == 100 and tag in ("watch", "baseline", "across"):
                slides = (Slide(first + count + 30),)
                frames = first + count + 96
            elif count == 8 and tag in ("watch", "baseline", "across"):
                slides = (Slide(50),)
            elif count == 100:
                frames = first + count + 12
            cases.append(
                stream(f"gap-{tag}-{count}", f"{count} lost {where}", frames=frames, slides=slides, lose=((first,
                       count),))
            )
    ends = {"sample": (80, Slide(40)), "watch": (41, Slide(300)), "baseline": (15, Slide(300))}
    for tag, (first, slide) in ends.items():
        for count in (1, 7, 8, 100):
            cases.append(
                stream(f"gap-end-{tag}-{count}", f"{count} lost at the end, in the {tag}", frames=first + count,
                       slides=(slide,), lose=((first, count),))
            )  # fmt: skip
    long_backtrack = TriggerConfig(window=12, backtrack=30)
    wait = TriggerConfig(window=5, backtrack=25)
    return cases + [
        stream("gap-none-first", "frames lost before the first one are not on the time line", lose=((0, 9),),
               frames=107,
               slides=(Slide(49),)),
        stream("gap-first-second", "only the first frame of the baseline, then a long gap", frames=130,
               slides=(Slide(65),),
               lose=((1, 10),)),
        stream("gap-end-completes", "a short gap at the end completes the sample", frames=95, lose=((90, 5),)),
        stream("gap-end-fires", "filled frames complete a window that fires; then the end", frames=40,
               slides=(Slide(36, rise=2),), lose=((37, 3),)),
        stream("gap-end-long-sample", "a long gap at the end of a sample that lacks one frame", frames=136,
               lose=((94, 42),)),
        stream("gap-exact-baseline", "a long gap ends exactly with the baseline", lose=((15, 10),), slides=(Slide(45),),
               frames=120),
        stream("gap-after-baseline", "a long gap begins right after the baseline", lose=((25, 10),),
               slides=(Slide(50),),
               frames=130),
        stream("gap-backtrack", "the event's backtrack reaches into a long gap", frames=130, lose=((35, 10),),
               slides=(Slide(46, rise=2),)),
        stream("gap-backtrack-long", "a backtrack of 30 with 22 filled frames", frames=180, lose=((65, 22),),
               slides=(Slide(94, rise=4),), trigger=long_backtrack),
        stream("gap-new-event", "a long gap ends a sample; the next window fires", frames=160,
               lose=((50, 9),), slides=(Slide(40, step=12), Slide(62, ORDERS["270deg"], step=8))),
        stream("gap-resting", "a long gap between a sample's end and t + l: no window before t + l", frames=190,
               trigger=wait, slides=(Slide(40), Slide(103, ORDERS["270deg"], rise=5)), lose=((86, 9),)),
        stream("gap-resting-short", "a short gap between a sample's end and t + l", frames=190, trigger=wait,
               slides=(Slide(40), Slide(112, ORDERS["270deg"])), lose=((86, 6),)),
        stream("gap-resting-over", "a long gap from a sample's end to beyond t + l", frames=200, trigger=wait,
               slides=(Slide(40), Slide(125, ORDERS["270deg"])), lose=((86, 30),)),
        stream("gap-two-sevens", "two gaps of 7 with one frame between: both filled, unreliable",
               lose=((60, 7), (68, 7)), frames=108),
        stream("gap-seven-total", "7 filled in three gaps: still reliable", lose=((50, 2), (60, 3), (75, 2)),
               frames=108),
        stream("gap-eight-total", "8 filled in three gaps: unreliable", lose=((50, 2), (60, 3), (75, 3)), frames=108),
        stream("gap-every-other", "every other frame lost", lose=tuple((t, 1) for t in range(1, 108, 2)), frames=108),
        stream("gap-window-short", "a short gap inside the window that fires", lose=((36, 2),), frames=108),
        stream("gap-window-start", "a long gap at a window's first frame", lose=((30, 8),), frames=130,
               slides=(Slide(50),)),
        stream("gap-window-last", "a long gap at a window's last frame", lose=((34, 8),), frames=130,
               slides=(Slide(54),)),
    ]  # fmt: skip


def random_gaps() -> list[Case]:
    """Returns cases of random losses in streams with three slides."""
    cases = []
    for number in range(4):
        name = f"gap-random-{number}"
        rng = SplitMix64(seed_of(f"losses {name}", SEED))
        lose, t = [], 1
        while True:
            t += 3 + int(rng.below(30 + 10 * number, 1)[0])
            count = 1 + int(rng.below((3, 7, 9, 12)[number % 4], 1)[0])
            if t + count > 300:
                break
            lose.append((t, count))
            t += count
        slides = tuple(
            Slide(40 + 88 * turn, list(ORDERS.values())[(number + turn) % 4], step=6 + turn) for turn in range(3)
        )
        cases.append(stream(name, "random losses, three slides", frames=300, slides=slides, lose=lose))
    return cases


def rates() -> list[Case]:
    """Returns cases of fast cameras: frames are added up, and groups may lack some."""

    def fast(n: int, start: int = 40, frames: int = 98, **settings) -> dict[str, Any]:
        slide = Slide(start * n, step=7 * n, rise=4 * n, fall=6 * n, peak=settings.pop("peak", 500))
        return {"frames": frames * n, "slides": (slide,), **settings}

    quick = TriggerConfig(window=2, backtrack=5)
    sixty: dict[str, Any] = {"fps": (60, 1)}
    return [
        stream("fps-45", "45 frames per second: not above 45, no binning", fps=(45, 1)),
        stream("fps-45-above", "45.001: n = round(1.50003) = 2", **fast(2), fps=(45001, 1000)),
        stream("fps-5994", "60000/1001", **fast(2), fps=(60000, 1001)),
        stream("fps-60", "60: n = 2, and half a group at the end", **{**fast(2), "frames": 197}, **sixty),
        stream("fps-75", "75: n = round(2.5) = 3", **fast(3, frames=102), fps=(75, 1)),
        stream("fps-120", "120: n = 4", **fast(4, 38, 100), fps=(120, 1)),
        stream("fps-1000", "1000: n = 33", **fast(33, 14, 82, fmt="GREY", base=2, shake=1, peak=60), fps=(1000, 1),
               trigger=quick),
        stream("fps-60-half", "60, single frames lost: groups with one of two", **fast(2),
               lose=((31, 1), (84, 1), (101, 1), (120, 1)), **sixty),
        stream("fps-60-group", "60, whole groups and halves lost", **fast(2, frames=104),
               lose=((41, 2), (90, 2), (110, 5), (141, 14)), **sixty),
        stream("fps-60-fifteen", "60, 15 lost from a group's second frame: 7 whole groups", **fast(2, frames=104),
               lose=((121, 15),), **sixty),
        stream("fps-60-sixteen", "60, 16 lost from a group's first frame: 8 whole groups", **fast(2, frames=104),
               lose=((120, 16),), **sixty),
        stream("fps-60-sixteen-odd", "60, 16 lost from a group's second frame: 7 whole groups and two halves",
               **fast(2, frames=104), lose=((121, 16),), **sixty),
        stream("fps-60-end", "60, half of the sample's last group is lost at the end: the event comes then",
               **fast(2, frames=95), lose=((189, 1),), **sixty),
        stream("fps-60-end-open", "60, lost at the end, the last group stays open", **{**fast(2, frames=100),
               "frames": 195}, lose=((190, 5),), **sixty),
        stream("fps-60-first", "60, an odd number lost before the first frame", **fast(2), lose=((0, 3),), **sixty),
        stream("fps-60-all-halves", "60, every other frame lost: all groups count as filled", **fast(2),
               lose=tuple((t, 1) for t in range(1, 196, 2)), **sixty),
        stream("fps-120-ties", "120, one to three of four lost", **fast(4, 38, 100),
               lose=((130, 1), (165, 2), (213, 3), (262, 1), (290, 3)), fps=(120, 1)),
        stream("fps-1000-lost", "1000, runs lost", **fast(33, 14, 82, fmt="GREY", base=2, shake=1, peak=60),
               lose=((300, 40), (700, 5), (1200, 66), (1500, 240)), fps=(1000, 1), trigger=quick),
    ]  # fmt: skip


def event_cases() -> list[Case]:
    """Returns all cases of this file."""
    return directions() + speeds() + triggers() + gaps() + random_gaps() + rates()
