"""Touches of 25 taxels by objects of several outlines, and what the reference says of their motion by a wave."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wstac_reference.constants import NOMINAL_FPS, SAMPLE_FRAMES, TAXELS, UNIT
from wstac_reference.features import Features, row_and_column_sums
from wstac_reference.live_taxels import LiveTaxels
from wstac_reference.rng import SplitMix64, seed_of
from wstac_reference.wave import COLUMN, ROW, measure_wave

from . import SEED
from .motion_cases import flashes, light
from .stored import stored

DARK = 300
FULL = 9000
PIXELS = 256
"""Pixels of a taxel."""
FRAMES = 56


@dataclass(frozen=True)
class Touch:
    """What slides, how, and what the camera makes of it."""

    mm_s: float = 90.0
    deg: float = 0.0
    outline: str = "ball"
    offset: float = 0.0
    noise: int = 4
    fps: float = NOMINAL_FPS
    readout_ms: float | None = 0.0
    """The camera's, and the one that is stated unless `is_unknown`."""
    is_unknown: bool = False
    weak: tuple[int, ...] = ()
    gain: float = 1.0
    lost: tuple[int, ...] = ()
    fade: float | None = None
    """Frames in which the light of a single flash fades; None is three flashes; 0 is light that is all in a fifth of a frame."""
    instants: int = 1
    """How many instants a frame is the mean of; an exposure as long as a frame has many."""
    begins: float = 14.0
    faster: float = 0.0
    """How the slowness changes along the sensor, as a fraction."""
    rests: float = 0.0
    """Frames in which it rests before the middle, and again behind it."""
    turns: float = 0.0
    second: float = 1.0
    """The slowness of whiskers on the motion's right, as a fraction."""
    behind: float = 0.0
    """How much later whiskers on the motion's right are, in pitches."""
    corner: tuple[float, float] | None = None
    """The angle of a corner, above 180 if it opens forward, and by how much it is turned, both in degrees."""
    ridge: tuple[float, float] = (1000.0, 0.0)
    """Frames from an edge to a ridge behind it, and the angle between them in degrees."""


def outline_of(name: str, across: np.ndarray) -> np.ndarray:
    """How bright whiskers are by their distance from the object's middle, in mm."""
    widths = {"ball": 5.0, "coin": 7.0, "block": 6.0, "finger": 3.5}
    if name == "edge":
        return np.ones(TAXELS)
    if name == "whisker":
        return np.where(np.arange(TAXELS) == 12, 1.0, 0.0)
    if name == "fingers":
        return outline_of("finger", across - 7) + outline_of("finger", across + 7)
    far = np.abs(across) / widths[name]
    if name == "block":
        return np.clip(2.5 - 2 * far, 0.0, 1.0)
    return np.sqrt(np.maximum(1 - far * far, 0.0))


def sums_of(touch: Touch, rng: SplitMix64) -> list[list[int] | None]:
    """The frames of a touch; None is a lost one."""
    shape = flashes(rng) if touch.fade is None else [(0.0, 0.8, touch.fade)]
    gains = (800 + rng.below(400, TAXELS)) / 1000
    shake = rng.below(2 * touch.noise + 1, (TAXELS, FRAMES)) - touch.noise
    right, up = math.cos(math.radians(touch.deg)), math.sin(math.radians(touch.deg))
    along, across = COLUMN * right - ROW * up, -COLUMN * up - ROW * right
    slowness = 4 * touch.fps / touch.mm_s if touch.mm_s else 0.0
    late = slowness * (along - touch.faster * along**2 / 8 + touch.turns * along * across / 8)
    late = late + touch.rests * np.sign(along) * (np.abs(along) > 0.5)
    if touch.corner is not None:
        open_by, skew = touch.corner
        beside = across - touch.offset / 4
        edges = [along + beside * math.tan(math.radians(skew + side * (90 - open_by / 2))) for side in (1, -1)]
        late = slowness * (np.maximum if open_by < 180 else np.minimum)(*edges)
    late = np.where(across < 0, late * touch.second + slowness * touch.behind, late)
    behind, turned = touch.ridge[0], math.radians(touch.ridge[1])
    ridges = slowness * (along * math.cos(turned) + across * math.sin(turned)) + behind
    late = late - touch.readout_ms / 1000 * touch.fps / 5 * ROW
    peaks = outline_of(touch.outline, 4 * across - touch.offset) * gains * touch.gain
    peaks[list(touch.weak)] *= 0.02
    middle = touch.begins + 2 * slowness * (abs(right) + abs(up))
    frames: list[list[int] | None] = []
    for t in range(FRAMES):
        at = [t - instant / touch.instants - middle for instant in range(touch.instants)]
        lit = (lambda since: 4.0 * (0 <= since < 0.2)) if touch.fade == 0 else lambda since: light(shape, since)
        seen = lambda late: sum(lit((now - late) * NOMINAL_FPS / touch.fps) for now in at) / touch.instants
        of = [peak * (seen(each) + seen(ridge)) for peak, each, ridge in zip(peaks, late, ridges)]
        frame = [min(DARK + round(FULL * value) + int(noise), 65535) for value, noise in zip(of, shake[:, t])]
        frames.append(None if t in touch.lost else frame)
    return frames


def touches() -> dict[str, Touch]:
    """Every case by its name."""
    ball = Touch()
    corner = Touch(outline="edge", corner=(90, 0))
    made = {
        f"{outline}-{speed}-{deg}": Touch(speed, deg, outline, offset)
        for outline, speed, deg, offset in [
            *(("ball", 30, 12, 2), ("ball", 150, 101, -3), ("ball", 290, 200, 0), ("coin", 60, 45, 4)),
            *(("coin", 220, 333, 0), ("block", 45, 0, 0), ("block", 130, 90, 1), ("block", 250, 250, -2)),
            *(("edge", 35, 77, 0), ("edge", 110, 150, 0), ("edge", 400, 300, 0), ("fingers", 80, 20, 0)),
            *(("ball", 440, 160, 0), ("coin", 520, 290, 1), ("edge", 460, 25, 0)),
        ]
    }
    once = replace(ball, fade=1.4)
    edge = replace(once, outline="edge")
    return made | {
        "once-ball": replace(once, deg=12, mm_s=40.0),
        "once-coin": replace(once, outline="coin", deg=205, mm_s=160.0),
        "once-block": replace(once, outline="block", deg=90, mm_s=60.0),
        "once-fingers": replace(once, outline="fingers", deg=20),
        "once-corner": replace(corner, fade=1.2, deg=70),
        "once-lost": replace(once, deg=300, mm_s=60.0, lost=(3, 19, 20)),
        "once-rolling": replace(once, deg=140, readout_ms=25.0),
        "once-40-fps": replace(once, deg=140, fps=40.0),
        "edge-once": replace(edge, deg=33, mm_s=60.0),
        "edge-once-slow": replace(edge, deg=260, mm_s=30.0),
        "edge-once-fast": replace(edge, deg=185, mm_s=220.0),
        "edge-once-dead": replace(edge, deg=100, weak=(3,)),
        "edge-once-lost": replace(edge, deg=350, mm_s=45.0, lost=(2, 12, 18, 19, 24)),
        "edge-once-gap": replace(edge, deg=130, mm_s=45.0, lost=tuple(range(16, 25))),
        "edge-once-15-fps": replace(edge, deg=215, mm_s=40.0, fps=15.0, fade=0.7),
        "edge-once-40-fps": replace(edge, deg=10, mm_s=150.0, fps=40.0),
        "edge-once-rolling": replace(edge, deg=70, readout_ms=25.0),
        "edge-once-unknown": replace(edge, deg=45, mm_s=50.0, readout_ms=15.0, is_unknown=True),
        "edge-once-faster": replace(edge, faster=0.5, deg=10),
        "edge-once-little-faster": replace(edge, faster=0.15, deg=10, mm_s=50.0),
        "edge-once-little-slower": replace(edge, faster=-0.2, deg=280, mm_s=50.0),
        "edge-once-sticks": replace(edge, deg=2, mm_s=30.0, rests=1.5, fade=0.6),
        "once-ball-sticks": replace(once, deg=12, mm_s=50.0, rests=0.4, fade=0.4),
        "slow": replace(ball, mm_s=10.0),
        "slow-steps": replace(edge, mm_s=14.0, deg=45, fade=0.5, begins=8.0),
        "fast": replace(ball, mm_s=600.0),
        "press": replace(ball, mm_s=0.0, outline="edge"),
        "poke": replace(ball, outline="whisker"),
        "dark": replace(ball, gain=0.0),
        "noise": replace(ball, noise=60, deg=30),
        "begun": replace(ball, begins=2.0),
        "late": replace(ball, begins=44.0),
        "saturated": replace(ball, outline="edge", gain=12.0),
        "faster": replace(ball, outline="coin", faster=0.5),
        "turning": replace(ball, outline="coin", turns=0.5),
        "two-velocities": replace(ball, outline="fingers", second=0.8),
        "two-near-velocities": replace(ball, outline="fingers", second=0.955, deg=20),
        "one-behind": replace(ball, outline="fingers", behind=1.5, deg=100, mm_s=160.0),
        "one-ahead": replace(ball, outline="fingers", behind=-1.2, deg=235, readout_ms=20.0),
        "one-ahead-unknown": replace(ball, outline="fingers", behind=-1.2, deg=315, mm_s=50.0, is_unknown=True),
        "two-pokes": replace(ball, outline="fingers", second=0.4, deg=60),
        "corner": replace(corner, deg=70),
        "corner-skewed": replace(corner, corner=(90, -18), offset=3.0, mm_s=140.0, deg=200),
        "corner-slow": replace(corner, corner=(90, 12), offset=-2.0, mm_s=35.0, deg=325),
        "corner-fast": replace(corner, corner=(90, 5), mm_s=240.0, deg=20),
        "corner-rolling": replace(corner, readout_ms=25.0, deg=120),
        "corner-dull": replace(corner, corner=(130, 0), deg=40),
        "corner-open": replace(corner, corner=(270, 5), deg=215),
        "corner-noise": replace(corner, noise=150, gain=0.3, deg=160),
        "corner-narrow": replace(corner, outline="block", corner=(90, 15), deg=33),
        "edge-before-ridge": replace(edge, ridge=(4, 6), deg=20),
        "edge-before-ridge-dead": replace(edge, ridge=(4, -3), deg=110, weak=(12,)),
        "edge-faster": replace(ball, outline="edge", faster=0.5, deg=10),
        "dead": replace(ball, outline="edge", weak=(7,), deg=160),
        "lost": replace(ball, lost=(0, 15, 22, 23), deg=70),
        "lost-two": replace(ball, mm_s=60.0, lost=(0, 17, 22), deg=70),
        "15-fps": replace(ball, fps=15.0, deg=40),
        "40-fps": replace(ball, fps=40.0, deg=40),
        "rolling": replace(ball, readout_ms=25.0, deg=290),
        "rolling-unknown": replace(ball, readout_ms=25.0, deg=290, is_unknown=True),
        "rolling-slow": replace(ball, readout_ms=15.0, mm_s=40.0, deg=250, is_unknown=True),
        "flash": replace(edge, deg=2, mm_s=112.0, fade=0.0, instants=16),
        "flash-oblique": replace(edge, deg=33, mm_s=60.0, fade=0.0, instants=16),
        "block-diagonal": replace(ball, outline="block", deg=45, mm_s=80.0),
        "edge-along": replace(edge, deg=354, mm_s=6.6),
        "ball-aside": replace(ball, offset=8.0, mm_s=60.0),
    }


def live_of(sums: list[list[int] | None], fps: float, readout_ms: float | None) -> list[Any]:
    """Each frame that has a velocity, with what that is known by. All frames before are dark."""
    features = Features(255, PIXELS)
    dark = features.of(row_and_column_sums([DARK] * TAXELS))
    live = LiveTaxels(np.array(dark), 1, fps, readout_ms)
    live.history = [np.array(dark) / UNIT] * SAMPLE_FRAMES
    made = []
    for number, frame in enumerate(sums):
        if frame is None:
            live.lose()
            continue
        answer, basis = live.take(np.array(features.of(row_and_column_sums(frame))), frame)
        if answer is not None and answer.mm_s is not None:
            made.append([number, stored(answer), basis])
    return made


def wave_cases() -> list[dict[str, Any]]:
    """Every case with its frames and the answer."""
    made = []
    for name, touch in touches().items():
        sums = sums_of(touch, SplitMix64(seed_of(f"wave-{name}", SEED)))
        stated = None if touch.is_unknown else touch.readout_ms
        wave = stored(measure_wave(sums, touch.fps, stated))
        del wave["unevenness"]
        case = {"name": name, "fps": touch.fps, "readout_ms": stated, "sums": sums}
        made.append(case | {"wave": wave, "live": live_of(sums, touch.fps, stated)})
    return made
