"""The events of a recording, or of any other source: python events.py FILE.mcap"""

import sys

import wstac

for event in wstac.open(sys.argv[1], models="builtin"):
    speed = f"{event.speed.mm_s:.2f}" if event.speed else "-"
    degrees = event.direction and event.direction.deg
    direction = "-" if degrees is None else f"{degrees:.1f}"
    texture = (event.texture.specimen or "-") if event.texture else "-"
    print(f"frame={event.frame} speed={speed} direction={direction} texture={texture}")
