"""A loop that answers each frame before a deadline, and counts those that it could not: bounded_loop.py FRAMES [PASSES]

FRAMES has raw frames: wstac run scene:Saw3@150,90deg --size 640x480 --save-raw FRAMES
"""

import gc
import sys
import time
from typing import NoReturn

import numpy as np
import wstac

WIDTH, HEIGHT, RATE, DEADLINE_MS = 640, 480, 30, 10.0


def refuse(message: str) -> NoReturn:
    print(f"bounded_loop: {message}", file=sys.stderr)
    sys.exit(2)


if len(sys.argv) not in (2, 3):
    refuse("wrong arguments, expected FRAMES [PASSES]")
passes = sys.argv[2] if len(sys.argv) > 2 else "1"
if not passes.isdecimal() or int(passes) < 1:
    refuse(f"PASSES is {passes!r}, expected 1 or more")
try:
    frames = np.fromfile(sys.argv[1], np.uint8)
except OSError as error:
    refuse(f"FRAMES is {sys.argv[1]!r}: {error.strerror or error}, expected a file of raw frames")
frames = frames[: len(frames) // (WIDTH * HEIGHT) * WIDTH * HEIGHT].reshape(-1, HEIGHT, WIDTH)
end = len(frames) * int(passes)
if end == 0:
    refuse("FRAMES has no frame of 640 x 480 GREY")
pipeline = wstac.Pipeline("GREY", size=(WIDTH, HEIGHT), fps=RATE, motion=True)
took: list[float] = []
events = lost = number = 0
# What was imported is not looked through again in the loop.
gc.freeze()
start = time.monotonic()
while number < end:
    # Put the wait for your camera here, and its time stamp: this one has a frame every 1/30 s.
    time.sleep(max(0.0, start + number / RATE - time.monotonic()))
    # Who comes late takes the newest frame: those before it keep their place in time.
    newest = min(max(number, int((time.monotonic() - start) * RATE)), end - 1)
    if newest > number:
        events += pipeline.lose(newest - number) is not None
        lost, number = lost + newest - number, newest
    # Put what your machine does about an event, or about the last of pipeline.slips and pipeline.motions, here.
    events += pipeline.push(frames[number % len(frames)]) is not None
    took.append(1e3 * (time.monotonic() - start - number / RATE))
    number += 1
late = sum(one > DEADLINE_MS for one in took)
median, most, worst = sorted(took)[len(took) // 2], sorted(took)[len(took) * 99 // 100], max(took)
print(f"frames: {len(took)}, lost: {lost}, late: {late}, events: {events}", end="; ")
print(f"stamp to answer in ms: median {median:.3f}, 99 % {most:.3f}, worst {worst:.3f}")
