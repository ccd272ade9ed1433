"""Streams of 25 taxels, and when the reference answers them at once."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

from wstac_reference.at_once import AGREE, ALIKE, AtOnce, Limits
from wstac_reference.constants import TAXELS
from wstac_reference.features import Features, row_and_column_sums
from wstac_reference.rng import SplitMix64, seed_of
from wstac_reference.trigger import Trigger, TriggerConfig

from . import SEED
from .stored import stored
from .wave_cases import DARK, PIXELS, Touch, sums_of

BEFORE, BEHIND = 26, 80
"""Dark frames before a touch and behind the last one."""
LEAST_LIGHT = 40
ROD = Touch(mm_s=100.0, deg=33.0, outline="block", fade=1.4)
FLAT = Touch(mm_s=20.0, deg=8.0, outline="edge", fade=4.0)
TURNING, PRESS = Touch(outline="coin", turns=0.5), Touch(mm_s=0.0, outline="edge")
# Its light lasts longer than that of one end.
FAST = Touch(mm_s=50.0, deg=8.0, outline="edge", fade=6.0)
GLOW = 120

Stream = list[list[int] | int | None]
"""Frames; a number is so many dark ones, and None is a lost one."""


def touches() -> dict[str, list[tuple[int, Touch]]]:
    """Every case: touches with the dark frames in front of each; below 0, so many frames that glow, and so does the touch."""
    return {
        "rod": [(BEFORE, replace(ROD, fade=6.0))],
        "ball-fast": [(BEFORE, replace(ROD, outline="ball", mm_s=320.0, fade=6.0, noise=60))],
        "rod-rolling": [(BEFORE, replace(ROD, mm_s=60.0, deg=290.0, readout_ms=25.0))],
        "rod-lost": [(BEFORE, replace(ROD, mm_s=60.0, lost=(15, 18)))],
        "rod-gap-behind": [(BEFORE, replace(ROD, fade=8.0, lost=tuple(range(31, 42))))],
        "rod-gap-before": [(BEFORE, replace(ROD, fade=6.0, lost=tuple(range(25, 36))))],
        "ball": [(BEFORE, Touch(mm_s=160.0, deg=101.0, fade=1.4, offset=-3.0))],
        "edge": [(BEFORE, Touch(mm_s=60.0, deg=33.0, outline="edge", fade=1.4))],
        # 80 mm from end to end, and 170 mm from stroke to stroke.
        "flat-block": [(BEFORE, FLAT), (64, FLAT)],
        "two-strokes": [(BEFORE, FLAT), (199, FLAT)],
        "glowing-block": [(BEFORE, FLAT), (-64, TURNING)],
        "then-turning": [(BEFORE, FLAT), (64, TURNING)],
        # 105 mm from end to end.
        "glowing-middle": [(BEFORE, FLAT), (-20, TURNING), (25, FLAT)],
        "press-in-a-glow": [(BEFORE, FLAT), (-64, PRESS)],
        "long-light": [(BEFORE, FAST), (10, TURNING)],
        "long-light-glows": [(BEFORE, FAST), (-10, TURNING)],
        "turning": [(BEFORE, TURNING)],
        "two-velocities": [(BEFORE, Touch(outline="fingers", second=0.8))],
        "press": [(BEFORE, PRESS)],
    }


def stream_of(name: str, parts: list[tuple[int, Touch]]) -> Stream:
    """The frames of touches, without noise where it is dark."""
    made: Stream = []
    for number, (dark, touch) in enumerate(parts):
        frames = sums_of(touch, SplitMix64(seed_of(f"at-once-{name}-{number}", SEED)))
        if dark < 0:
            made += [[DARK + GLOW] * TAXELS] * -dark
            made += [frame if frame is None else [light + GLOW for light in frame] for frame in frames]
            continue
        made.append(dark)
        for frame in frames:
            if frame is None or max(frame) > DARK + LEAST_LIGHT:
                made.append(frame)
            elif isinstance(made[-1], int):
                made[-1] += 1
            else:
                made.append(1)
    return [*made, BEHIND]


def said_of(stream: Stream, readout_ms: float | None, limits: Limits) -> dict[str, Any]:
    """The answers and ends of a stream, and its incomplete samples."""
    features = Features(255, PIXELS)
    trigger = Trigger(TriggerConfig(per_touch=True))
    follower = AtOnce(trigger, readout_ms=readout_ms)
    follower.limits = limits
    answers, lost = [], 0
    for part in stream:
        if part is None:
            lost += 1
            continue
        for sums in [part] if isinstance(part, list) else [[DARK] * TAXELS] * part:
            # What a gap means is known when the next frame arrives.
            answers += follower.lose(lost)
            lost = 0
            answer = follower.take(features.of(row_and_column_sums(sums)), sums)
            answers += [] if answer is None else [answer]
    said = [[one.frame, one.event_frame, one.frames, stored(one.wave)] for one in answers]
    for *_, wave in said:
        del wave["unevenness"], wave["mm_s2"], wave["mm_s2_sd"]
    ends = [asdict(end) for end in follower.ends()]
    return {"answers": said, "ends": ends, "incomplete": [asdict(one) for one in trigger.interrupted]}


def at_once_cases() -> list[dict[str, Any]]:
    """Every case with its frames and what is said. Limits and deviations that are 6 % off change no decision."""
    made = []
    times = lambda limits, factor: tuple(factor * limit for limit in limits)
    near = [Limits(times(AGREE, factor), times(ALIKE, factor), sd) for factor in (0.94, 1.06) for sd in (0.94, 1.06)]
    for name, parts in touches().items():
        stream, readout_ms = stream_of(name, parts), parts[0][1].readout_ms
        said = said_of(stream, readout_ms, Limits())
        when = lambda said: ([one[:3] for one in said["answers"]], said["ends"], said["incomplete"])
        assert all(when(said_of(stream, readout_ms, limits)) == when(said) for limits in near), name
        made.append({"name": name, "readout_ms": readout_ms, "frames": stream} | said)
    return made
