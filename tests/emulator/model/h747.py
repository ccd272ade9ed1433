"""The STM32H747 of an Arduino Nicla Vision: how its Cortex-M7 differs from an STM32H743, and other parts of the board.

From RM0399, Zephyr's and MicroPython's files of the board, and Arduino's bootloader (mcuboot-arduino-stm32h7, mbed-os).
"""

from emulate import H743
from machine import AXI

from . import clocks, i2c, usart
from .ports import Wiring, pin
from .registers import Registers

USART1, USART1_IRQ = 0x4001_1000, 37
I2C2, I2C3, TIM3 = 0x4000_5800, 0x4000_5C00, 0x4000_0400
# The numbers of alternate functions.
AF_TIM3, AF_I2C = 2, 4
GCR, BOOT_C2, APB1LENR, TIM3EN = 0xA0, 1 << 3, 0xE8, 1 << 1
# PWR_CR3: the regulator that switches, the linear one, and neither of them.
SUPPLIES, SDEN, LDOEN = 7, 4, 2
SCL, SDA, OSCILLATOR = pin("PF1"), pin("PF0"), pin("PH1")
CACHES = 3 << 16
# What the bootloader has in its memory, of which some is at the start of the AXI SRAM.
VARIABLES = 0x8000


class Rcc(clocks.Rcc):
    """RCC. The oscillator runs while PH1 is high, and nothing starts the other core."""

    def write(self, offset, value):
        """Stores a register."""
        if offset == GCR and value & BOOT_C2:
            raise ValueError("the Cortex-M4 is started, and may have no program")
        super().write(offset, value)

    def is_switched_on(self):
        port, number = OSCILLATOR
        return self.ports.ports[port].is_high(number)


class Pwr(clocks.Pwr):
    """PWR. The board's supply is the linear regulator: with another one the chip hangs until power is off."""

    def __init__(self, rcc, syscfg):
        super().__init__(rcc, syscfg)
        self.initial[clocks.CR3] = self.values[clocks.CR3] = SDEN | LDOEN

    def read(self, offset):
        """Returns a register. The voltage is ready when the supply is the board's."""
        if offset == clocks.CSR1 and self.values[clocks.CR3] & SUPPLIES != LDOEN:
            raise ValueError(f"the supply is {self.values[clocks.CR3] & SUPPLIES:#x}, and the board has the linear regulator")
        return super().read(offset)


class Timer3(Registers):
    """TIM3, whose channel 2 is an output."""

    CR1, CCMR1, CCER, PSC, ARR, CCR2 = 0x00, 0x18, 0x20, 0x28, 0x2C, 0x38

    def __init__(self, rcc, clock):
        super().__init__(TIM3)
        self.rcc, self.clock = rcc, clock

    def hertz(self):
        """Returns the frequency of the output in PWM mode 1, which has to be high for half of the time."""
        of = lambda offset: self.values.get(offset, 0)
        runs = self.rcc.read(APB1LENR) & TIM3EN and of(self.CR1) & 1 and of(self.CCER) >> 4 & 1 and of(self.CCMR1) >> 12 & 7 == 6
        period = of(self.ARR) + 1
        return self.clock / (of(self.PSC) + 1) / period if runs and 2 * of(self.CCR2) == period else 0


class Pmic:
    """The PF1550, whose LDO1 and LDO2 are the camera's 2.8 V and 1.8 V. All are off, as a program may leave them."""

    address, holds, shorted, pulls_up = 0x08, 0, (), True
    CAMERA = (0x4D, 0x50)

    def __init__(self):
        self.registers, self.written = {}, []

    def answers(self, reads):
        """Returns whether it acknowledges."""
        return not reads

    def write(self, value):
        """Takes the address of a register, then its value."""
        self.written.append(value)

    def stop(self):
        """Ends a transfer."""
        if len(self.written) == 2:
            self.registers[self.written[0]] = self.written[1]
        self.written = []

    def supplies_camera(self):
        """Returns whether the camera has its voltages."""
        return all(self.registers.get(register, 0) & 1 for register in self.CAMERA)


class Usart(usart.Usart):
    """USART1."""

    BASE, IRQ = USART1, USART1_IRQ


class H747(H743):
    """The STM32H747 for `Board`."""

    Usart = Usart

    def __init__(self, wiring):
        super().__init__(wiring, Pwr, Rcc)
        self.rcc.pmic, self.rcc.timer = Pmic(), Timer3(self.rcc, wiring.clock_hertz)

    def boot(self, machine):
        """Leaves what Arduino's bootloader leaves: the core at 100 MHz, caches on, and its variables in the AXI SRAM. The
        supply is as after power-on, since the program may be started by a debugger.
        """
        self.rcc.values |= {
            clocks.CR: 1 | 1 << 12 | 1 << 16 | clocks.BYPASS | clocks.PLL1_ON,
            clocks.PLLCKSELR: 2 | 5 << 4,
            clocks.PLL1DIVR: 39 | 1 << 9,
            clocks.CFGR: clocks.FROM_PLL1,
        }
        self.pwr.values[clocks.D3CR] = 1 << 14
        machine.uc.mem_write(AXI, b"\xa5" * VARIABLES)

    def parts(self, machine, wiring):
        """Creates the parts of an STM32H743, and those of the board."""
        rcc, dma, flash, others = super().parts(machine, wiring)
        has_pins = lambda: rcc.ports.has(SCL, AF_I2C) and rcc.ports.has(SDA, AF_I2C)
        return rcc, dma, flash, [*others, rcc.timer, i2c.I2c([rcc.pmic], has_pins, I2C2)]


class NiclaWiring(Wiring):
    """The board: TIM3 gives the sensor's clock at PA7, and the supply's chip its voltages."""

    kind, clock_hertz, caches = H747, 96_000_000, CACHES
    bus, scl, sda = I2C3, pin("PA8"), pin("PC9")

    def sensor_hertz(self, ports):
        """Returns the sensor's clock, without a supply none."""
        return ports.rcc.timer.hertz() if ports.has(self.clock, AF_TIM3) and ports.rcc.pmic.supplies_camera() else 0


# Zephyr's arduino_nicla_vision: 25 MHz from an oscillator, TX at PA9, green and red at pins that are low when lit.
NICLA = NiclaWiring("PC6 PC7 PE0 PE1 PE4 PD3 PE5 PE6", "PA9", "PC13 PE3", 0, 25_000_000, True, bootloader=True)
NICLA.vsync, NICLA.clock = pin("PG9"), pin("PA7")
