"""The ports, and the wires from their pins to the camera, its bus, the lights and the line.

A wire carries something only if the program has given its pin the function that the chip's data sheet lists for it. The
numbers of pins are those of the boards' schematics and public board files, not those of the firmware.
"""

from .registers import Registers

BASE, STEP = 0x5802_0000, 0x400
MODER, PUPDR, IDR, ODR, BSRR, AFRL = 0x00, 0x0C, 0x10, 0x14, 0x18, 0x20
OUTPUT, ALTERNATE, PULL_UP, PULL_DOWN = 1, 2, 1, 2
SCL, SDA = (1, 8), (1, 9)
# Numbers of alternate functions.
MCO, I2C, USART3, DCMI = 0, 4, 7, 13


def pin(name):
    """Returns port and number of a pin, such as PB10."""
    return "ABCDEFGHIJK".index(name[1]), int(name[2:])


class Wiring:
    """A board: its pins, its clock, and where its program begins.

    `data` has D0 to D7, `line` the line's sending pin, `lights` those of events and of trouble, which are lit while
    they are `lit`; `hse` has the crystal's hertz, `bypass` whether that is a clock from outside, and `power` the
    sensor's power-down and reset. Its `chip` is an STM32H743 if it is `None`, and its core has `clock_hertz`.
    `function` has the numbers of the camera interface's function at pins where it is not that of `None`. The sensor's bus is the I2C
    at `bus`. `kind` is the class of a chip like an STM32H743, and `caches` what of CCR a bootloader leaves on.
    """

    chip, kind, clock_hertz, function, caches = None, None, 72_000_000, {None: DCMI}, 0
    bus, scl, sda = 0x4000_5400, SCL, SDA

    def __init__(self, data, line, lights, lit, hse, bypass, power=None, bootloader=False):
        self.data = [pin(name) for name in data.split()]
        self.vsync, self.href, self.pclk, self.clock = pin("PB7"), pin("PA4"), pin("PA6"), pin("PA8")
        self.line, self.lights = pin(line), [pin(name) for name in lights.split()]
        self.lit, self.hse, self.bypass, self.bootloader = lit, hse, bypass, bootloader
        self.power = power and [pin(name) for name in power.split()]

    def function_of(self, one):
        """Returns the number of the camera interface's function at a pin."""
        return self.function.get(one, self.function[None])

    def sensor_hertz(self, ports):
        """Returns the sensor's clock."""
        return ports.rcc.mco1() if ports.has(self.clock, MCO) else 0

    def inputs(self):
        """Returns the pins of the camera interface."""
        return [*self.data, self.vsync, self.href, self.pclk]


# UM2407: the debugger gives 8 MHz and has the line; green LD1 and red LD3.
NUCLEO = Wiring("PC6 PC7 PC8 PC9 PE4 PD3 PE5 PE6", "PD8", "PB0 PB14", 1, 8_000_000, True)
# OpenMV's board file and bootloader: 12 MHz, P4, green and red at pins that are low when lit; power-down and reset.
OPENMV = Wiring(
    "PC6 PC7 PE0 PE1 PE4 PB6 PE5 PE6", "PB10", "PC1 PC0", 0, 12_000_000, False, power="PD7 PA10", bootloader=True
)
# Zephyr's mini_stm32h743.dts: 25 MHz, the blue light at PE3, a socket with power-down at PA7 and no reset. PB12 is free
# on the header, as PB10 is.
WEACT = Wiring("PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6", "PB10", "PE3 PB12", 1, 25_000_000, False, power="PA7")


class Port(Registers):
    """A port. The sensor's bus is on two pins of the board."""

    BASE = BASE

    def __init__(self, number, sensor, changed, wiring):
        super().__init__(self.BASE + STEP * number)
        self.number, self.sensor, self.changed, self.scl, self.sda = number, sensor, changed, wiring.scl, wiring.sda

    def read(self, offset):
        if offset != IDR:
            return super().read(offset)
        lines = [number for port, number in (self.scl, self.sda) if port == self.number]
        return 0xFFFF & ~sum(1 << number for number in lines if not self._bus_level(number))

    def _bus_level(self, number):
        """Returns whether a line of the bus is high: a resistor pulls it up, and nothing holds it low."""
        is_held = self.sensor.holds > 0 and number == self.sda[1] or number in self.sensor.shorted
        pulls_up = self.sensor.pulls_up or self.values.get(PUPDR, 0) >> 2 * number & 3 == PULL_UP
        return pulls_up and not is_held and not self.is_low(number)

    def write(self, offset, value):
        """Stores a register. A clock that rises takes a bit from a sensor that holds the data line."""
        was_low = self.number == self.scl[0] and self.is_low(self.scl[1])
        if offset == BSRR:
            super().write(ODR, (self.values.get(ODR, 0) | value & 0xFFFF) & ~(value >> 16))
        else:
            super().write(offset, value)
        if was_low and not self.is_low(self.scl[1]):
            self.sensor.holds = max(0, self.sensor.holds - 1)
        self.changed()

    def mode(self, number):
        """Returns the mode of a pin."""
        return self.values.get(MODER, 0) >> 2 * number & 3

    def is_low(self, number):
        """Returns whether the port drives a pin low."""
        return self.mode(number) == OUTPUT and not self.values.get(ODR, 0) >> number & 1

    def is_high(self, number):
        """Returns whether the port drives a pin high."""
        return self.mode(number) == OUTPUT and bool(self.values.get(ODR, 0) >> number & 1)

    def has(self, number, function):
        """Returns whether a pin has an alternate function."""
        register = self.values.get(AFRL + 4 * (number // 8), 0)
        return self.mode(number) == ALTERNATE and register >> 4 * (number % 8) & 15 == function


class Ports:
    """All ports of a board."""

    def __init__(self, wiring, sensor, rcc):
        self.wiring, self.sensor, self.rcc = wiring, sensor, rcc
        one = wiring.chip.Port if wiring.chip else Port
        self.ports = [one(number, sensor, self._changed, wiring) for number in range(11)]
        sensor.is_on, rcc.ports, self.was_on = self.sensor_is_on, self, False

    def has(self, pin_, function):
        """Returns whether a pin has an alternate function."""
        port, number = pin_
        return self.ports[port].has(number, function)

    def sensor_is_on(self):
        """Returns whether the sensor has a clock of 24 MHz, and is not switched off by its lines."""
        if abs(self.wiring.sensor_hertz(self) / 24e6 - 1) > 0.01:
            return False
        if self.wiring.power is None:
            return True
        (down, down_pin), *resets = self.wiring.power
        return self.ports[down].is_low(down_pin) and all(self.ports[port].is_high(number) for port, number in resets)

    def has_bus(self):
        """Returns whether the bus has its pins."""
        return self.has(self.wiring.scl, I2C) and self.has(self.wiring.sda, I2C)

    def has_syncs(self):
        """Returns whether the camera interface has its clock and both syncs."""
        return all(self.has(one, self.wiring.function_of(one)) for one in (self.wiring.vsync, self.wiring.href, self.wiring.pclk))

    def mask(self):
        """Returns the bits of a byte that arrive at the camera interface."""
        return sum(1 << bit for bit, one in enumerate(self.wiring.data) if self.has(one, self.wiring.function_of(one)))

    def lit(self):
        """Returns which lights are lit."""
        return [
            self.ports[port].is_high(number) if self.wiring.lit else self.ports[port].is_low(number)
            for port, number in self.wiring.lights
        ]

    def floating(self):
        """Returns the inputs of the camera interface that nothing pulls down."""
        is_pulled = lambda port, number: self.ports[port].read(PUPDR) >> 2 * number & 3 == PULL_DOWN
        inputs = self.wiring.inputs()
        return [f"P{'ABCDEFGHIJK'[port]}{number}" for port, number in inputs if not is_pulled(port, number)]

    def _changed(self):
        was_on, self.was_on = self.was_on, self.sensor_is_on()
        if self.wiring.power and not (was_on and self.was_on):
            self.sensor.power_on()
