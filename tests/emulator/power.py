#!/usr/bin/env python3
"""Counts what a program of the STM32H743 does per frame time with an HM01B0: untouched, during slides, and at rest.

    power.py ELF CLIP.raw REST     CLIP.raw: slides, as frames of 320 x 240 GREY, of which the first are dark; REST: the seconds that
                                   the program was built with as WSTAC_REST

Prints JSON. Instructions and accesses are counted in runs of their own: see `count_accesses`.
"""

import json
import math
import sys

from emulate import CLOCK, FRAME, WAITS, Board, frames_of
from model import i2c
from model.sensor import Hm01b0


def counted(elf, clip, spans, accesses):
    """Returns what a frame time takes in spans of the clip, each from one frame to another one: reads and writes of memories, or all
    else."""
    board = Board(elf, clip, Hm01b0)
    machine, camera = board.machine, board.camera
    (bus,) = (part for part in machine.peripherals if part.base == i2c.I2C1)
    # The time of the bus is added up, and nobody waits: the instructions of a wait are no cost.
    bus.clock, bus.byte_time = lambda: math.inf, 9 * CLOCK // 100_000
    machine.count_accesses() if accesses else machine.count_instructions()

    def reach(frame):
        machine.run(lambda: camera.frame is not None and camera.frame >= frame or camera.frame is None and machine.now > 400 * FRAME)
        if camera.frame is None:
            sys.exit(f"{elf}: no frame is used")
        found = machine.accesses if accesses else {"instructions": machine.instructions, "bus": bus.busy, "peripherals": machine.accesses["peripherals"]}
        return machine.now, dict(found)

    means = []
    for begin, end in spans:
        (began, first), (ended, last) = reach(begin), reach(end)
        means.append({key: (number - first[key]) * FRAME / (ended - began) for key, number in last.items()})
    return means


def mode(numbers, memory):
    """Returns the numbers of a mode."""
    memory = memory | {"peripherals": numbers["peripherals"]}
    cycles = numbers["instructions"] + sum(memory[name] * more for name, more in WAITS.items()) + numbers["bus"]
    return numbers | {"cycles": cycles, "RAM": memory["DTCM"] + memory["AXI SRAM"], "flash": memory["flash"], "hertz": CLOCK, "awake": cycles / FRAME}


def main():
    """Counts in each mode."""
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    _, elf, file, rest = sys.argv
    clip, first = frames_of(file), 30 * int(rest) + 60
    dark, spans, slides = clip[:1] * (first + 70), [(30, 59), (first, first + 60)], [(25, len(clip) - 2)]
    (watching, resting), (touched,) = counted(elf, dark, spans, False), counted(elf, clip, slides, False)
    (quiet,), (busy,) = counted(elf, dark[:70], spans[:1], True), counted(elf, clip, slides, True)
    # The emulator runs some blocks twice while it counts accesses, and what is written to the sensor between frames goes wrong. So
    # accesses at rest are taken to be as many per instruction as before.
    few = {name: number * resting["instructions"] / watching["instructions"] for name, number in quiet.items()}
    print(json.dumps({"watching": mode(watching, quiet), "touched": mode(touched, busy), "resting": mode(resting, few)}))


if __name__ == "__main__":
    main()
