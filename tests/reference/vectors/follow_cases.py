"""Cases of a baseline that follows slow drift."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wstac_reference.speed import SpeedConfig
from wstac_reference.trigger import TriggerConfig

from .case import Case
from .event_cases import stream
from .slides import ORDERS, Slide


def ramp(per_thousand: int) -> Callable[[np.ndarray], None]:
    """Adds light from frame to frame, in thousandths of a level; a negative number removes light."""

    def change(levels: np.ndarray) -> None:
        levels += (np.arange(len(levels)) * per_thousand // 1000)[:, None]

    return change


def step(levels: np.ndarray) -> None:
    """A lamp that is switched on and stays on."""
    levels[60:] += 150


def flicker(levels: np.ndarray) -> None:
    """Adds a single level to one row sometimes. It is below every threshold, but the baseline follows it."""
    levels[40::9, 5:10] += 1


def follow_cases() -> list[Case]:
    """Returns all cases of this file."""
    sixteen = TriggerConfig(follow=16)
    above = SpeedConfig(threshold_on="above_baseline")
    rise = {"base": 100, "shake": 4, "change": ramp(100), "speed": above}
    late = (Slide(500), Slide(620, ORDERS["90deg"]))
    return [
        stream("follow-not", "light rises by half, nothing follows: it fires", frames=620, slides=(), **rise),
        stream("follow-rise", "the same, followed: only two slides fire", frames=750, slides=late, trigger=sixteen,
               **rise),
        stream("follow-fall", "light falls by half, then two slides", frames=750, slides=late, trigger=sixteen,
               base=200, shake=4, change=ramp(-140), speed=above),
        stream("follow-fast", "light rises faster than the margin within N windows: it fires", frames=300, slides=(),
               trigger=sixteen, base=100, shake=4, change=ramp(2000)),
        stream("follow-slower", "a longer time constant: the same rise fires", frames=700, slides=(),
               trigger=TriggerConfig(follow=512), **rise),
        stream("follow-longest", "the longest time constant: remainders alone", frames=300, slides=(),
               trigger=TriggerConfig(follow=32768), base=300, shake=0, change=flicker),
        stream("follow-still", "a level of one row now and then: remainders add up", frames=300, slides=(),
               trigger=sixteen, base=300, shake=0, change=flicker),
        stream("follow-step", "a step fires again and again and is not followed", frames=400, slides=(), base=200,
               shake=5, change=step, trigger=sixteen),
        stream("follow-literal", "the literal rule, whose margin goes with the baseline", frames=600,
               slides=(Slide(500),), trigger=TriggerConfig(rule="literal", multiplier=0.9, follow=16), **rise),
        stream("follow-bare", "b 1 and margin 0: nothing moves", frames=160,
               trigger=TriggerConfig(multiplier=1.0, margin=0.0, follow=16)),
        stream("follow-window-1", "windows of one frame, 35 left out after an event", frames=260,
               slides=(Slide(40), Slide(180)), trigger=TriggerConfig(window=1, backtrack=5, follow=32), **rise),
        stream("follow-window-12", "windows of twelve frames, three left out after an event", frames=500,
               slides=(Slide(90), Slide(350)), trigger=TriggerConfig(window=12, backtrack=20, follow=16), **rise),
        stream("follow-gaps", "short gaps fill windows that are followed; a long one is in no window", frames=420,
               slides=(Slide(340),), lose=((62, 3), (118, 7), (171, 40), (260, 8)), trigger=sixteen, **rise),
        stream("follow-interrupted", "a long gap ends a sample: windows after it are left out as after an event",
               frames=300, slides=(Slide(60), Slide(200)), lose=((90, 12),), trigger=sixteen, **rise),
        stream("follow-60fps", "two camera frames a feature frame", frames=800, fps=(60, 1), trigger=sixteen,
               slides=(Slide(600, step=14, rise=8, fall=12),), base=100, shake=4, change=ramp(50), speed=above),
        stream("speed-range", "an answer within a law's own range", speed=SpeedConfig(range_mm_s=(40.0, 600.0)),
               slides=(Slide(40, step=4),)),
        stream("speed-range-outside", "an answer outside a law's own range",
               speed=SpeedConfig(range_mm_s=(130.5, 130.75))),
    ]  # fmt: skip
