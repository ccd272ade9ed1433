#!/usr/bin/env python3
"""Runs the STM32H743's program, unmodified, on a modeled board with a modeled sensor that sends a clip.

    emulate.py ELF CLIP.raw SERIAL     CLIP.raw: frames of 320 x 240 GREY; what comes out of the serial line goes to SERIAL

Modeled: core and interrupts, clocks, watchdog, timer, I2C, a sensor's registers and pins, camera interface, DMA, serial
line, log. Not modeled: caches, electricity, and the time of anything except a byte on the serial line. So this shows
that the program is right, and counts its instructions. It does not show that the program is fast enough.
"""

import math
import sys
from pathlib import Path

from machine import Machine
from model import adc, camera, clocks, core, flash, i2c, ports, rtt, timer, usart
from model.ports import NUCLEO
from model.registers import Registers
from model.sensor import Ov7725

WIDTH, HEIGHT = 320, 240
CLOCK = 72_000_000  # of core and timer
SERIAL_DIVIDER = 2  # cycles of the core per clock of the serial line
FRAME = CLOCK // 30
# What embassy accesses but this program does not need.
KEPT = [
    0xE000_E400,  # priorities of interrupts: all are equal
    0x5800_0000,  # EXTI
    0x5C00_1000,  # DBGMCU
    0x4002_0400,  # DMA2
    0x5802_5400,  # BDMA
    0x5802_5800,  # DMAMUX2
    0x5200_0000,  # MDMA
]


def frames_of(clip):
    """Returns the frames of a file."""
    data, size = Path(clip).read_bytes(), WIDTH * HEIGHT
    return [data[at : at + size] for at in range(0, len(data) - size + 1, size)]


class H743:
    """The STM32H743 for `Board`."""

    serial_divider, Dcmi, Usart = SERIAL_DIVIDER, camera.Dcmi, usart.Usart

    def __init__(self, wiring, supply=clocks.Pwr, rcc=clocks.Rcc):
        self.rcc, self.syscfg = rcc(wiring), Registers(clocks.SYSCFG)
        self.pwr = supply(self.rcc, self.syscfg)

    def boot(self, _):
        """Leaves the state of a bootloader."""
        clocks.run_bootloader(self.rcc, self.pwr, self.syscfg)

    def parts(self, machine, wiring):
        """Creates RCC, DMA, flash, and other parts."""
        mux, rcc, clock = Registers(camera.DMAMUX1), self.rcc, wiring.clock_hertz
        others = [core.AxiInterconnect(machine), self.pwr, self.syscfg, mux, clocks.Watchdog(machine, rcc, clock), timer.Timer(machine)]
        return rcc, camera.Dma(machine, mux), flash.Flash(machine), [*others, adc.Adc3(machine, rcc, clock), *map(Registers, KEPT)]


class Board:
    """The board with a sensor and a clip. `faults` has the faults of the clip's frames, by number."""

    def __init__(self, elf, clip, sensor=Ov7725, faults=(), wiring=NUCLEO):
        chip, self.sensor = wiring.chip or (wiring.kind or H743)(wiring), sensor()
        self.frame_time = wiring.clock_hertz // 30
        self.machine = machine = Machine(elf, chip.boot if wiring.bootloader else None, wiring.chip)
        self.sensor.now = lambda: machine.now / wiring.clock_hertz
        self.rcc, self.dma, self.flash, others = chip.parts(machine, wiring)
        self.ports = ports.Ports(wiring, self.sensor, self.rcc)
        self.dcmi = chip.Dcmi(self.dma, self.ports)
        self.line = chip.Usart(machine, chip.serial_divider, lambda: self.ports.has(wiring.line, ports.USART3))
        machine.add(core.Nvic(machine), core.Scb(machine, wiring.caches), self.rcc, *others, self.dma, self.dcmi, *self.ports.ports, self.flash)
        self.bus = i2c.I2c([self.sensor], self.ports.has_bus, wiring.bus)
        machine.add(self.bus, self.line)
        self.camera = camera.Camera(machine, self.sensor, self.dcmi, clip, (WIDTH, HEIGHT), wiring.clock_hertz, faults)
        self.log = rtt.Log(machine, elf)

    def run(self):
        """Runs until the clip is over and all its results are sent, or until that should have been long ago."""
        latest = self.machine.now + (len(self.camera.clip) + 90) * max(FRAME, self.camera.nominal or 2 * FRAME)
        self.machine.run(lambda: self.camera.is_over() or self.machine.now > latest)
        return bytes(self.line.sent)


# Cycles of the core for an access, beyond the one of its instruction. Caches and DTCM have no wait states (Cortex-M7 TRM).
# - An instruction takes one cycle at most if nothing has to be waited for, and two often go together: measured on an
#   STM32H730, www.quinapalus.com/cm7cycles.html.
# - A peripheral takes 12 cycles: a pulse of 25 ns between two writes of a GPIO by an STM32H743 at 480 MHz, measured by
#   niconiconi (hackers.pub). Here the buses are as fast as the core, or half as fast, and it may be less.
# - Of a read of the AXI SRAM without cache, no public measurement was found: 10 cycles are believed, and at most taken.
WAITS = {"AXI SRAM": 9, "other SRAM": 9, "peripherals": 11}


def cost(elf, clip, sensor=Ov7725, wiring=NUCLEO):
    """Returns the resources that the program uses of the board, as lines and as numbers."""
    board, other = (Board(elf, clip, sensor, wiring=wiring) for _ in range(2))
    clock = wiring.clock_hertz
    machine = board.machine
    bus = board.bus
    # The time of the bus is added up, and nobody waits: the instructions of a wait are no cost.
    bus.clock, bus.byte_time = lambda: math.inf, 9 * clock // 100_000
    machine.paint_stack()
    machine.count_instructions()
    machine.count_accesses(["flash", "ITCM", "AXI SRAM", "other SRAM"])
    other.machine.count_accesses(["DTCM"])
    for each in board, other:
        each.machine.run(lambda: each.camera.frame == 0)
    instructions, busy, before = machine.instructions, bus.busy, machine.accesses | {"DTCM": other.machine.accesses["DTCM"]}
    for each in board, other:
        each.run()
    frame, busy = (machine.instructions - instructions) / len(clip), (bus.busy - busy) / len(clip)
    flash, ram = machine.sizes()
    ring, stack = 4 * board.dma.total, machine.deepest_stack()
    counted = machine.accesses | {"DTCM": other.machine.accesses["DTCM"]}
    accesses = {name: (count - before[name]) / len(clip) for name, count in counted.items()}
    cycles = frame + sum(accesses[name] * more for name, more in WAITS.items())
    words = (
        f"{frame:,.0f} instructions per frame, {flash:,} bytes of flash, {ram - ring:,} of RAM beside the {ring:,} that the DMA writes to, "
        f"{stack:,} of stack\n"
        f"reads and writes per frame: {', '.join(f'{count:,.0f} of {name}' for name, count in accesses.items())}\n"
        f"about {cycles:,.0f} cycles per frame, estimated, and {busy:,.0f} of waiting for the sensor's bus: "
        f"{3000 * (cycles + busy) / clock:.1f} % of the time"
    )
    return words, {"frame": frame, "flash": flash, "ram": ram + stack, "AXI SRAM": accesses["AXI SRAM"], "cycles": cycles + busy, "accesses": accesses}


def main():
    """Runs a clip and prints the result of the program."""
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    _, elf, clip, serial = sys.argv
    board = Board(elf, frames_of(clip))
    Path(serial).write_bytes(board.run())
    print("\n".join(line for _, line in board.log.lines))
    print(cost(elf, board.camera.clip)[0])


if __name__ == "__main__":
    main()
