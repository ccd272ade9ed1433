"""RCC and PWR: everything that is requested is ready at once. The watchdog, which runs on a clock of its own."""

from .registers import Registers

RCC, PWR = 0x5802_4400, 0x5802_4800
CR, CFGR, BDCR, CSR = 0x00, 0x10, 0x70, 0x74
D3CR, CSR1, CR3 = 0x18, 0x04, 0x0C
PLLCKSELR, PLLCFGR, PLL1DIVR, RSR = 0x28, 0x2C, 0x30, 0xD0
PLL1_ON, REMOVE_FLAGS, BY_WATCHDOG = 1 << 24, 1 << 16, 1 << 26
HSI, HSE = 64_000_000, 8_000_000
# The lowest and highest reference and frequency of the PLL's two oscillators.
WIDE, MEDIUM = ((2e6, 16e6), (192e6, 836e6)), ((1e6, 2e6), (150e6, 420e6))
# Bits of RCC_CR: an oscillator or PLL, and its ready flag.
READY = ((0, 2), (7, 8), (12, 13), (16, 17), (24, 25), (26, 27), (28, 29))


class Rcc(Registers):
    """Oscillators and PLLs are ready when they are on, and the clock switch follows its setting. `has_hse` is whether the
    debugger gives its clock, and `cause` has the flags of the last reset's cause. A PLL outside its range is an error.
    """

    def __init__(self):
        super().__init__(RCC, {CR: 1})
        self.has_hse, self.cause = True, 0

    def reset(self):
        """Resets the registers. The flags of the cause stay."""
        super().reset()
        self.values[RSR] = self.cause

    def write(self, offset, value):
        """Stores a register, and checks the PLL when it is switched on."""
        if offset == RSR:
            self.cause = 0 if value & REMOVE_FLAGS else self.cause
            value = self.cause
        if offset == CR and value & PLL1_ON and not self.values.get(CR, 0) & PLL1_ON:
            self._check_pll()
        super().write(offset, value)

    def _check_pll(self):
        select, config = self.values.get(PLLCKSELR, 0), self.values.get(PLLCFGR, 0)
        reference = {0: HSI, 2: HSE}[select & 3] / (select >> 4 & 0x3F)
        vco = reference * ((self.values.get(PLL1DIVR, 0) & 0x1FF) + 1)
        (low, high), (slow, fast) = MEDIUM if config & 2 else WIDE
        if not (low <= reference <= high and slow <= vco <= fast):
            raise ValueError(f"the PLL makes {vco:,.0f} Hz of {reference:,.0f} Hz, which its oscillator is not for")

    def read(self, offset):
        """Returns a register, with the bits that the hardware sets."""
        value = super().read(offset)
        if offset == CR:
            for on, ready in READY:
                if on == 16 and not self.has_hse:
                    continue
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


class Watchdog(Registers):
    """IWDG1, which resets the core when its key is not written in time."""

    BASE, KEY, PRESCALER, RELOAD = 0x5800_4800, 0x00, 0x04, 0x08
    START, FEED = 0xCCCC, 0xAAAA
    HZ = 32_000

    def __init__(self, machine, rcc, clock):
        super().__init__(self.BASE, {self.RELOAD: 0xFFF})
        self.machine, self.rcc, self.clock = machine, rcc, clock
        self.runs, self.plan = False, 0

    def reset(self):
        """Resets the registers, and stops."""
        super().reset()
        self.runs = False
        self.plan += 1

    def write(self, offset, value):
        """Stores a register, and begins to count anew at a key."""
        super().write(offset, value)
        if offset == self.KEY and value in (self.START, self.FEED):
            self.runs |= value == self.START
            self._count()

    def _count(self):
        self.plan += 1
        plan = self.plan
        counts = (self.values[self.RELOAD] + 1) * (4 << (self.values.get(self.PRESCALER, 0) & 7))

        def bite():
            if plan == self.plan and self.runs:
                self.rcc.cause = BY_WATCHDOG
                self.machine.stalled_until = 0
                self.machine.reset_wanted = True

        self.machine.at(self.machine.now + counts * self.clock // self.HZ, bite)


def all_of_them():
    """Creates RCC and PWR."""
    return [Rcc(), Pwr()]
