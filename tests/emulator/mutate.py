#!/usr/bin/env python3
"""Changes every setting of every sensor's table, bit by bit, and asks whether the firmware notices.

    mutate.py ELF [SENSOR …]

A changed setting acts in the modeled sensor, while the firmware reads back what it wrote. So it acts like a table with
that value in it, or like a sensor that takes a setting in another way than its table says. What a bit changes is
computed from the model. One of the bits of a register that change the same things runs on the modeled board.

Whatever changes the pins, the size, the format or the rate of frames, or switches an automatic control on, must be
noticed before frames are used or within a second. The firmware cannot know the right light, the right view or the right
picture: a constant change of these is named, and only a calibration sees it.
"""

import sys

from emulate import FRAME, HEIGHT, WIDTH, Board
from model.larger import Gc2145, Mt9m114, Ov2640, Ov5640
from model.sensor import Hm01b0, Hm0360, Ov7670, Ov7690, Ov7692, Ov7725, WordSensor

MUST = ("pins", "size", "format", "chroma", "rate", "automatic")
MAY = {
    "light": "another light, which stays as it is",
    "view": "another view, which a calibration sees",
    "picture": "color bars or noise in place of the picture",
}
LATEST = 60 * FRAME


def board_of(elf, sensor, slips):
    """Returns a board whose sensor takes settings in another way."""
    board = Board(elf, [bytes(range(64, 192)) * (WIDTH * HEIGHT // 128)] * 90, sensor)
    board.sensor.slips = slips
    return board


def notices(elf, sensor, slips):
    """Returns what the firmware says first, or None."""
    board = board_of(elf, sensor, slips)
    said = lambda: [line for _, line in board.log.lines if not line.startswith("info: sensor")]
    board.machine.run(lambda: said() or board.machine.now > LATEST)
    return said()[0].split(": ", 1)[1] if said() else None


def changes(before, after):
    """Returns the parts that differ. A rate may differ by 2 %."""
    parts = {part for part in {*before, *after} if before.get(part) != after.get(part)}
    if "rate" in parts and "rate" in after and abs(after["rate"] / before["rate"] - 1) < 0.02:
        parts.remove("rate")
    return {"pins"} if "pins" in parts and after["pins"] == "silent" else parts


def check(elf, sensor, name):
    """Checks the table of a sensor. Returns its lines and the number of failures."""
    board = board_of(elf, sensor, {})
    board.machine.run(lambda: board.camera.frame == 0)
    right, history = board.sensor.acts(), list(board.sensor.history)
    lines, failures, last = [], 0, dict(history)
    for place, value in last.items():
        kinds = {}
        for bit in range(8):
            trial = sensor()
            trial.registers, trial.history = dict(board.sensor.registers), history
            trial.slips = {place: value ^ 1 << bit}
            kinds.setdefault(frozenset(changes(right, trial.acts())), []).append(bit)
        said = []
        for parts, bits in sorted(kinds.items(), key=lambda kind: kind[1]):
            named = "bits " + ", ".join(map(str, bits)) if len(bits) > 1 else f"bit {bits[0]}"
            must = [part for part in MUST if part in parts]
            if must:
                notice = notices(elf, sensor, {place: value ^ 1 << bits[0]})
                failures += notice is None
                said.append(f"{named}: {', '.join(must)}: {notice or 'NOT NOTICED'}")
            elif parts:
                said.append(f"{named}: {', '.join(MAY[part] for part in MAY if part in parts)}")
        bank, register = divmod(place, 256)
        where = f"0x{register:02X}" + (f" of bank {bank}" if bank else "")
        where = f"0x{place:04X}" if issubclass(sensor, WordSensor) else where
        lines.append(f"{name} {where} = 0x{value:02X}: " + ("; ".join(said) or "no effect on the pins is known"))
    return lines, failures


def main():
    """Checks all sensors, or those that are named."""
    all_of_them = (Ov7725, Ov7690, Ov7692, Ov7670, Ov2640, Gc2145, Ov5640, Mt9m114, Hm0360, Hm01b0)
    sensors = {sensor.__name__.upper(): sensor for sensor in all_of_them}
    if len(sys.argv) < 2 or any(name not in sensors for name in sys.argv[2:]):
        sys.exit(__doc__)
    failed = 0
    for name in sys.argv[2:] or sensors:
        lines, failures = check(sys.argv[1], sensors[name], name)
        failed += failures
        print("\n".join(lines), flush=True)
    print(f"{failed} changes were not noticed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
