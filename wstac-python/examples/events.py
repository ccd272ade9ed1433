"""The events of a recording, or of any other source: python events.py FILE.mcap"""

import sys

import wstac

stream = wstac.open(sys.argv[1], models="builtin")
sys.stderr.writelines(f"{note}\n" for note in stream.notes)


def number(number: "float | None", sd: "float | None", form: str) -> str:
    return "-" if number is None else f"{number:{form}}" + (f"±{max(sd, 0.01):.2f}" if sd is not None else "")


for event in stream:
    speed = number(event.speed.mm_s, event.speed.sd, ".2f") if event.speed and event.reliable else "-"
    direction = number(event.direction.deg, event.direction.sd, ".1f") if event.direction and event.reliable else "-"
    texture = (event.texture.specimen or "-") if event.texture else "-"
    print(f"frame={event.frame} speed={speed} direction={direction} texture={texture}")
