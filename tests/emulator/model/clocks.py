"""RCC and PWR: everything that is requested is ready at once. The watchdog, which runs on a clock of its own."""

from .registers import Registers

RCC, PWR = 0x5802_4400, 0x5802_4800
CR, CFGR, BDCR, CSR = 0x00, 0x10, 0x70, 0x74
D3CR, CSR1, CR3 = 0x18, 0x04, 0x0C
PLLCKSELR, PLLCFGR, PLL1DIVR, RSR = 0x28, 0x2C, 0x30, 0xD0
PLL1_ON, REMOVE_FLAGS, BY_WATCHDOG = 1 << 24, 1 << 16, 1 << 26
FIXED = 0x3F3  # of PLLCKSELR: the source, and PLL1's divider
BYPASS, FROM_PLL1, MCO1_PLL1_Q = 1 << 18, 3, 3
HSI = 64_000_000
SYSCFG, PWRCR = 0x5800_0400, 0x2C
# The lowest and highest reference and frequency of the PLL's two oscillators.
WIDE, MEDIUM = ((2e6, 16e6), (192e6, 836e6)), ((1e6, 2e6), (150e6, 420e6))
# Bits of RCC_CR: an oscillator or PLL, and its ready flag.
READY = ((0, 2), (7, 8), (12, 13), (16, 17), (24, 25), (26, 27), (28, 29))


class Rcc(Registers):
    """Oscillators and PLLs are ready when they are on, and the clock switch follows its setting. `has_hse` is whether
    the board's clock of `hse` hertz works, which is a crystal unless the program has to `bypass` its oscillator.
    `cause` has the flags of the last reset's cause. A PLL outside its range is an error, and a core at another clock
    than the model's.
    """

    def __init__(self, wiring):
        super().__init__(RCC, {CR: 1})
        self.hse, self.bypass, self.clock, self.has_hse, self.cause = wiring.hse, wiring.bypass, wiring.clock_hertz, True, 0

    def is_switched_on(self):
        """Returns whether the program lets the board's clock run."""
        return True

    def reset(self):
        """Resets the registers. The flags of the cause stay."""
        super().reset()
        self.values[RSR] = self.cause

    def write(self, offset, value):
        """Stores a register, and checks the PLL when it is switched on."""
        if offset == RSR:
            self.cause = 0 if value & REMOVE_FLAGS else self.cause
            value = self.cause
        if offset == PLLCKSELR and self.values.get(CR, 0) & PLL1_ON:
            # Source and divider of a PLL that is on stay as they are.
            value = value & ~FIXED | self.values.get(PLLCKSELR, 0) & FIXED
        if offset == CR and value & PLL1_ON and not self.values.get(CR, 0) & PLL1_ON:
            self._check_pll()
        super().write(offset, value)
        if offset == CFGR and value & 7 == FROM_PLL1 and abs(self.core() / self.clock - 1) > 0.005:
            raise ValueError(f"the core runs at {self.core():,.0f} Hz, and is modeled at {self.clock:,}")

    def _reference(self):
        select = self.values.get(PLLCKSELR, 0)
        return {0: HSI, 2: self.hse}[select & 3] / (select >> 4 & 0x3F)

    def _vco(self):
        return self._reference() * ((self.values.get(PLL1DIVR, 0) & 0x1FF) + 1)

    def core(self):
        """Returns the clock of the core, without a divider behind the switch."""
        if self.values.get(CFGR, 0) & 7 != FROM_PLL1:
            return HSI
        return self._vco() / ((self.values.get(PLL1DIVR, 0) >> 9 & 0x7F) + 1)

    def mco1(self):
        """Returns the clock at PA8, if it is that of the PLL's output Q."""
        config = self.values.get(CFGR, 0)
        divider = config >> 18 & 15
        if config >> 22 & 7 != MCO1_PLL1_Q or not divider or not self.values.get(CR, 0) & PLL1_ON:
            return 0
        return self._vco() / ((self.values.get(PLL1DIVR, 0) >> 16 & 0x7F) + 1) / divider

    def _check_pll(self):
        config = self.values.get(PLLCFGR, 0)
        reference, vco = self._reference(), self._vco()
        (low, high), (slow, fast) = MEDIUM if config & 2 else WIDE
        if not (low <= reference <= high and slow <= vco <= fast):
            raise ValueError(f"the PLL makes {vco:,.0f} Hz of {reference:,.0f} Hz, which its oscillator is not for")

    def read(self, offset):
        value = super().read(offset)
        if offset == CR:
            for on, ready in READY:
                if on == 16 and not (self.has_hse and self.is_switched_on() and bool(value & BYPASS) == self.bypass):
                    value &= ~(1 << ready)
                    continue
                value = value & ~(1 << ready) | (value >> on & 1) << ready
        elif offset == CFGR:
            value = value & ~0x38 | (value & 7) << 3
        elif offset in (BDCR, CSR):
            value |= (value & 1) << 1
        return value


class Pwr(Registers):
    """The supply has the requested voltage. One that is too low for the clock of the core is an error, and one that is
    lowered from the highest range, whose switch is in `syscfg`.
    """

    def __init__(self, rcc, syscfg):
        super().__init__(PWR, {D3CR: 1 << 14})
        self.rcc, self.syscfg = rcc, syscfg

    def write(self, offset, value):
        """Stores a register, and checks a new range."""
        super().write(offset, value)
        most = {1: 200e6, 2: 300e6, 3: 480e6}.get(value >> 14 & 3, 0)
        if offset == D3CR and self.rcc.core() > most:
            raise ValueError(f"the supply is for {most:,.0f} Hz, and the core runs at {self.rcc.core():,.0f}")
        if offset == D3CR and most < 480e6 and self.syscfg.read(PWRCR) & 1:
            raise ValueError("the supply is lowered while its highest range is on")

    def read(self, offset):
        ready = {CSR1: 1 << 13, D3CR: 1 << 13, CR3: 1 << 16 | 1 << 26}
        return super().read(offset) | ready.get(offset, 0)


class Watchdog(Registers):
    """IWDG1, which resets the core when its key is not written in time."""

    BASE, KEY, PRESCALER, RELOAD = 0x5800_4800, 0x00, 0x04, 0x08
    START, FEED, CAUSE = 0xCCCC, 0xAAAA, BY_WATCHDOG
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
                self.rcc.cause = self.CAUSE
                self.machine.stalled_until = 0
                self.machine.reset_wanted = True

        self.machine.at(self.machine.now + counts * self.clock // self.HZ, bite)


def run_bootloader(rcc, pwr, syscfg):
    """Leaves what OpenMV's bootloader leaves: the core at 480 MHz of a PLL of 12 MHz, at the highest supply. It has
    switched its interrupts, its caches and the USB off.
    """
    rcc.values |= {
        CR: 1 | 1 << 12 | 1 << 16 | 1 << 24 | 1 << 26 | 1 << 28,
        PLLCKSELR: 2 | 3 << 4 | 3 << 12 | 3 << 20,
        PLL1DIVR: 239 | 1 << 9 | 19 << 16 | 1 << 24,
        CFGR: FROM_PLL1,
    }
    pwr.values[D3CR] = 3 << 14
    syscfg.values[PWRCR] = 1
