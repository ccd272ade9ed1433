#!/usr/bin/env python3
"""Counts what a program of an STM32 does per frame time with an HM01B0: untouched, during slides, and at rest.

    power.py WSTAC ELF REST [u575]     WSTAC: the command on the host; REST: the seconds that ELF was built with as WSTAC_REST; u575: it
                                       is for an STM32U575 at 24 MHz, else for an STM32H743

Prints JSON. Accesses per instruction are those of `cost`, in every mode: the emulator begins some blocks twice while it counts them,
so a run of its own would not have those of its instructions. Fails if the program's events are not the host's, or if it does not rest.
"""

import json
import math
import sys
import tempfile

from check import HM01B0_READOUT_MS as READOUT_MS
from check import SCENE, Host
from emulate import WAITS, Board, cost
from model.ports import NUCLEO
from model.sensor import Hm01b0
from model.u575 import NUCLEO_U575_SLOW

# A program that rests takes less than this of what it takes before.
MOST_AT_REST = 0.5


def counted(elf, clip, spans, wiring):
    """Returns what a frame time takes in spans of the clip, each from one frame to another one, and the board."""
    board = Board(elf, clip, Hm01b0, wiring=wiring)
    frame_time = wiring.clock_hertz // 30
    machine, camera = board.machine, board.camera
    bus = board.bus
    # The time of the bus is added up, and nobody waits: the instructions of a wait are no cost.
    bus.clock, bus.byte_time = lambda: math.inf, 9 * wiring.clock_hertz // 100_000
    machine.count_instructions()

    def reach(frame):
        machine.run(lambda: camera.frame is not None and camera.frame >= frame or camera.frame is None and machine.now > 400 * frame_time)
        if camera.frame is None:
            sys.exit(f"{elf}: no frame is used")
        return machine.now, {"instructions": machine.instructions, "bus": bus.busy, "peripherals": machine.accesses["peripherals"]}

    means = []
    for begin, end in spans:
        (began, first), (ended, last) = reach(begin), reach(end)
        means.append({key: (number - first[key]) * frame_time / (ended - began) for key, number in last.items()})
    return means, board


def mode(numbers, each, hertz):
    """Returns the numbers of a mode, whose instructions have so many accesses each."""
    memory = {name: many * numbers["instructions"] for name, many in each.items()} | {"peripherals": numbers["peripherals"]}
    cycles = numbers["instructions"] + sum(memory[name] * more for name, more in WAITS.items()) + numbers["bus"]
    return numbers | {"cycles": cycles, "RAM": memory["DTCM"] + memory["AXI SRAM"], "flash": memory["flash"], "hertz": hertz, "awake": 30 * cycles / hertz}


def main():
    """Counts in each mode."""
    match sys.argv[1:]:
        case [wstac, elf, rest, *chip] if chip in ([], ["u575"]):
            wiring = NUCLEO_U575_SLOW if chip else NUCLEO
        case _:
            sys.exit(__doc__)
    first = 30 * int(rest) + 60
    with tempfile.TemporaryDirectory() as folder:
        host = Host(wstac, folder)
        clip, frames = host.rendered(SCENE.read_text(), "power", READOUT_MS)
        (touched,), board = counted(elf, frames, [(25, len(frames) - 2)], wiring)
        found, expected = host.of_line(board.run()), host.of_file(clip, readout_ms=READOUT_MS)
        events = [[line for line in lines if json.loads(line)["kind"] == "event"] for lines in (found, expected)]
        if not events[1] or events[0] != events[1]:
            sys.exit(f"{elf}: events are {events[0]}, expected {events[1]}")
    (watching, resting), _ = counted(elf, frames[:1] * (first + 70), [(30, 59), (first, first + 60)], wiring)
    _, whole = cost(elf, frames, Hm01b0, wiring)
    each = {name: many / whole["frame"] for name, many in whole["accesses"].items()}
    modes = {name: mode(numbers, each, wiring.clock_hertz) for name, numbers in (("watching", watching), ("touched", touched), ("resting", resting))}
    cycles = {name: numbers["cycles"] for name, numbers in modes.items()}
    if not cycles["touched"] >= cycles["watching"] > cycles["resting"] / MOST_AT_REST:
        sys.exit(f"{elf}: cycles are {cycles}, expected more when touched, and less than {MOST_AT_REST} of them at rest")
    print(json.dumps(modes))


if __name__ == "__main__":
    main()
