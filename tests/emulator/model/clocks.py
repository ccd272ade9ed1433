"""RCC, PWR and FLASH: everything that is requested is ready at once."""

from .registers import Registers

RCC, PWR, FLASH = 0x5802_4400, 0x5802_4800, 0x5200_2000
CR, CFGR, BDCR, CSR = 0x00, 0x10, 0x70, 0x74
D3CR, CSR1, CR3 = 0x18, 0x04, 0x0C
# Bits of RCC_CR: an oscillator or PLL, and its ready flag.
READY = ((0, 2), (7, 8), (12, 13), (16, 17), (24, 25), (26, 27), (28, 29))


class Rcc(Registers):
    """Oscillators and PLLs are ready when they are on, and the clock switch follows its setting."""

    def __init__(self):
        super().__init__(RCC, {CR: 1})

    def read(self, offset):
        """Returns a register, with the bits that the hardware sets."""
        value = super().read(offset)
        if offset == CR:
            for on, ready in READY:
                value = value & ~(1 << ready) | (value >> on & 1) << ready
        elif offset == CFGR:
            value = value & ~0x38 | (value & 7) << 3
        elif offset in (BDCR, CSR):
            value |= (value & 1) << 1
        return value


class Pwr(Registers):
    """The supply has the requested voltage."""

    def __init__(self):
        super().__init__(PWR)

    def read(self, offset):
        """Returns a register, with the bits that the hardware sets."""
        ready = {CSR1: 1 << 13, D3CR: 1 << 13, CR3: 1 << 16 | 1 << 26}
        return super().read(offset) | ready.get(offset, 0)


def all_of_them():
    """Creates RCC, PWR and the flash controller, which stores its wait states."""
    return [Rcc(), Pwr(), Registers(FLASH)]
