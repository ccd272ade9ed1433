"""Cases with one event per touch: where touches begin and end, and what holds the trigger."""

from __future__ import annotations

from wstac_reference.trigger import TriggerConfig

from .case import Case
from .event_cases import stream
from .slides import ORDERS, Slide

PER_TOUCH = TriggerConfig(per_touch=True)


def flash(start: int, rise: int = 3, fall: int = 5) -> Slide:
    """Returns a press whose light rises and falls."""
    return Slide(start, ORDERS["press"], rise=rise, fall=fall)


def touch_cases() -> list[Case]:
    """Returns streams of touches that are short, long, or close to each other."""
    bare = TriggerConfig(per_touch=True, backtrack=0)
    follow = TriggerConfig(per_touch=True, follow=16)
    return [
        stream("touch-slide", "a slide that ends within its sample", trigger=PER_TOUCH),
        stream("touch-long", "light for a very long time is one event", frames=300, trigger=PER_TOUCH,
               slides=(Slide(60, ORDERS["press"], rise=20, fall=150), Slide(240))),
        stream("touch-held", "the stream ends before the light does", frames=190, trigger=PER_TOUCH,
               slides=(Slide(60, ORDERS["press"], rise=20, fall=250),)),
        stream("touch-twice", "two flashes in one sample are one touch", frames=130, trigger=PER_TOUCH,
               slides=(flash(42), flash(75))),
        stream("touch-adjacent", "the second touch begins just behind the end of the first, in the rest",
               frames=220, trigger=PER_TOUCH, slides=(flash(42), flash(112))),
        stream("touch-touching", "the second touch begins before the first has been dark for five frames",
               frames=260, trigger=PER_TOUCH,
               slides=(Slide(60, ORDERS["press"], rise=20, fall=80), Slide(146, ORDERS["press"], rise=2, fall=30))),
        stream("touch-bare", "without a backtrack, windows start at the touch's end", frames=260, trigger=bare,
               slides=(Slide(40, ORDERS["press"], rise=4, fall=100), Slide(170))),
        stream("touch-follow", "a baseline that follows drift stands still while a touch is held", frames=300,
               trigger=follow, slides=(Slide(60, ORDERS["press"], rise=20, fall=100), Slide(220))),
        stream("touch-gap", "a long gap while a touch is held", frames=260, trigger=PER_TOUCH, lose=((130, 20),),
               slides=(Slide(60, ORDERS["press"], rise=20, fall=120), Slide(220))),
        stream("touch-gap-dark", "a long gap takes the touch's end with it", frames=260, trigger=PER_TOUCH,
               lose=((110, 60),), slides=(Slide(60, ORDERS["press"], rise=20, fall=80), Slide(220))),
        stream("touch-gap-capture", "a long gap ends a sample, and the same light is an event behind it",
               frames=260, trigger=PER_TOUCH, lose=((70, 12),),
               slides=(Slide(60, ORDERS["press"], rise=20, fall=120),)),
        stream("touch-gap-rest", "a long gap in the rest behind a sample", frames=220, trigger=PER_TOUCH,
               lose=((102, 9),), slides=(flash(42), flash(150))),
        stream("touch-first", "a touch begins with the first frame behind the baseline", frames=120,
               trigger=PER_TOUCH, slides=(flash(26),)),
        stream("touch-fps-60", "two camera frames each", frames=280, fps=(60, 1), trigger=PER_TOUCH,
               slides=(Slide(100, ORDERS["press"], rise=10, fall=100),)),
    ]  # fmt: skip
