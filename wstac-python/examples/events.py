"""The events of a recording, or of any other source: python events.py FILE.mcap"""

import sys

import wstac

stream = wstac.open(sys.argv[1], models="builtin")
sys.stderr.writelines(f"{note}\n" for note in stream.notes)
for event in stream:
    speed = f"{event.speed.mm_s:.2f}±{event.speed.sd or 0:.2f}" if event.speed else "-"
    degrees = event.direction and event.direction.deg
    direction = "-" if event.direction is None or degrees is None else f"{degrees:.1f}±{event.direction.sd or 0:.2f}"
    texture = (event.texture.specimen or "-") if event.texture else "-"
    print(f"frame={event.frame} speed={speed} direction={direction} texture={texture}")
