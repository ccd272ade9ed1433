"""The STM32U575 of a Nucleo-U575ZI-Q, where it differs from an STM32H743: clocks, supply, DMA, flash and places of peripherals.

Registers are those of RM0456. Limits of clocks are those of its sections about the supply and the clocks.
"""

from copy import copy

from unicorn.arm_const import UC_CPU_ARM_CORTEX_M33

from . import camera, clocks, flash, ports, timer, usart
from .ports import Wiring
from .registers import Registers

RCC, PWR, FLASH, ICACHE, IWDG = 0x4602_0C00, 0x4602_0800, 0x4002_2000, 0x4003_0400, 0x4000_3000
GPDMA1, DCMI, USART1, GPIOA = 0x4002_0000, 0x4202_C000, 0x4001_3800, 0x4202_0000
GPDMA1_CHANNEL0, TIM2_IRQ, USART1_IRQ, DCMI_PSSI = 29, 45, 61, 119
# What embassy accesses but this program does not need: priorities, DBGMCU, SYSCFG, EXTI.
KEPT = [0xE000_E400, 0xE004_4000, 0x4600_0400, 0x4602_2000]

# RCC.
CR, ICSCR1, CFGR1, CFGR2, PLL1CFGR, PLL1DIVR, BDCR, CSR = 0x00, 0x08, 0x1C, 0x20, 0x28, 0x34, 0xF0, 0xF4
AHB3ENR, PWREN = 0x94, 1 << 2
MSIPLLEN, PLL1ON, MSIRGSEL = 1 << 3, 1 << 24, 1 << 23
LSEON, LSERDY, LSESYSEN, LSESYSRDY = 1, 1 << 1, 1 << 7, 1 << 11
REMOVE_FLAGS, BY_WATCHDOG = 1 << 23, 1 << 29
# Bits of RCC_CR: an oscillator or PLL, and its ready flag: MSIS, MSIK, HSI, HSI48, HSE and the PLLs.
READY = ((0, 2), (4, 5), (8, 10), (12, 13), (16, 17), (24, 25), (26, 27), (28, 29))
MSIS_HERTZ = (48e6, 24e6, 16e6, 12e6, 4e6, 2e6, 1.33e6, 1e6, 3.072e6, 1.536e6, 1.024e6, 768e3, 400e3, 200e3, 133e3, 100e3)
# The multiples of the crystal at the first range of each four, which the others divide by 2, 3 and 4.
LSE_HERTZ, FOLLOWED = 32_768, (1465, 122, 94, 12)
SW_MSIS, SW_PLL1, MCO_MSIS = 0, 3, 2
# The highest clock of a supply range: 4, 3, 2 and 1 (VOS 0 to 3). Above 55 MHz the booster must run.
RANGES, BOOSTED = (25e6, 55e6, 110e6, 160e6), 55e6
# The highest clock of each range by wait states of the flash.
WAIT_STATES = ((12e6, 25e6), (24e6, 48e6, 55e6), (30e6, 60e6, 90e6, 110e6), (32e6, 64e6, 96e6, 128e6, 160e6))
# PWR.
CR3, VOSR, SVMSR, DBPR, REGSEL, DBP = 0x08, 0x0C, 0x3C, 0x28, 1 << 1, 1


class Rcc(Registers):
    """Oscillators are ready when they are on. `has_hse` is whether the crystal works, which corrects the MSIS if it is on before
    (RM0456, 11.4.2). LSESYSEN has no effect before it is ready.
    """

    def __init__(self, core):
        super().__init__(RCC, {CR: 0x35, ICSCR1: 0x4440_0000})
        self.expected, self.has_hse, self.cause, self.pwr, self.flash = core, True, 0, None, None
        self.end = SW_MSIS if core < 48e6 else SW_PLL1

    def reset(self):
        """Resets the registers. The flags of the cause and the backup domain stay."""
        kept = self.values.get(BDCR, 0)
        super().reset()
        self.values |= {CSR: self.cause, BDCR: kept}

    def write(self, offset, value):
        """Stores a register, and checks clocks that change."""
        if offset == CSR:
            self.cause = 0 if value & REMOVE_FLAGS else self.cause
            value = self.cause
        if offset == BDCR and not (self.values.get(AHB3ENR, 0) & PWREN and self.pwr.values.get(DBPR, 0) & DBP):
            return
        if offset == BDCR and not self.read(BDCR) & LSERDY:
            value &= ~LSESYSEN
        if offset == CR and value & MSIPLLEN and not self.read(BDCR) & LSESYSRDY:
            raise ValueError("the MSI is to follow a crystal that is not ready")
        super().write(offset, value)
        if offset == CR and value & PLL1ON:
            self._check_pll()
        if offset == CFGR1 and abs(self.check() / self.expected - 1) > 0.005 and value & 3 == self.end:
            raise ValueError(f"the core runs at {self.core():,.0f} Hz, and is modeled at {self.expected:,}")

    def read(self, offset):
        """Returns a register, with the bits that the hardware sets."""
        value = super().read(offset)
        if offset == CR:
            for on, ready in READY:
                value = value & ~(1 << ready) | (value >> on & 1) << ready
        elif offset == CFGR1:
            value = value & ~0xC | (value & 3) << 2
        elif offset == BDCR:
            runs = value & LSEON and self.has_hse
            value |= (LSERDY if runs else 0) | (LSESYSRDY if runs and value & LSESYSEN else 0)
        return value

    def msis(self):
        """Returns the clock of the MSIS, which is a multiple of the crystal's if it follows it."""
        control = self.values.get(CR, 0)
        range_ = self.values.get(ICSCR1, 0) >> 28 if self.values.get(ICSCR1, 0) & MSIRGSEL else 4
        if control & MSIPLLEN:
            return LSE_HERTZ * FOLLOWED[range_ >> 2] // ((range_ & 3) + 1)
        return MSIS_HERTZ[range_]

    def _vco(self):
        config, divide = self.values.get(PLL1CFGR, 0), self.values.get(PLL1DIVR, 0)
        if config & 3 != 1:
            raise ValueError("the PLL's source is not the MSIS")
        return self.msis() / ((config >> 8 & 15) + 1), self.msis() / ((config >> 8 & 15) + 1) * ((divide & 0x1FF) + 1)

    def _check_pll(self):
        reference, vco = self._vco()
        range_ = self.pwr.range()
        if not 4e6 <= reference <= 16e6 or not 128e6 <= vco <= (330e6 if range_ < 2 else 544e6) or range_ == 0:
            raise ValueError(f"the PLL makes {vco:,.0f} Hz of {reference:,.0f} Hz in supply range {4 - range_}")

    def core(self):
        """Returns the clock of the core."""
        switch = self.values.get(CFGR1, 0) & 3
        if switch == SW_MSIS:
            return self.msis()
        if switch != SW_PLL1 or not self.values.get(CR, 0) & PLL1ON:
            raise ValueError(f"the core's clock {switch} is not modeled")
        return self._vco()[1] / ((self.values.get(PLL1DIVR, 0) >> 24 & 0x7F) + 1)

    def check(self):
        """Checks that supply and flash are for the core's clock."""
        hertz, range_ = self.core(), self.pwr.range()
        waits = self.flash.values.get(0, 0) & 15
        if hertz > RANGES[range_] or hertz >= BOOSTED and not self.pwr.is_boosted():
            raise ValueError(f"the core runs at {hertz:,.0f} Hz in supply range {4 - range_}")
        if hertz > dict(enumerate(WAIT_STATES[range_])).get(waits, 160e6):
            raise ValueError(f"the core runs at {hertz:,.0f} Hz in supply range {4 - range_} with {waits} wait states")
        return hertz

    def mco1(self):
        """Returns the clock at PA8, if it is that of the MSIS."""
        config = self.values.get(CFGR1, 0)
        return self.msis() / (1 << (config >> 28 & 7)) if config >> 24 & 15 == MCO_MSIS else 0


class Pwr(Registers):
    """The supply has what is requested. It may be lowered only for a clock of the core that the lower range has.
    `has_smps` is whether the package has the regulator that switches.
    """

    def __init__(self, rcc):
        super().__init__(PWR)
        self.rcc, self.has_smps = rcc, True
        rcc.pwr = self

    def range(self):
        """Returns VOS: 0 for range 4."""
        return self.values.get(VOSR, 0) >> 16 & 3

    def is_boosted(self):
        """Returns whether the booster runs."""
        return bool(self.values.get(VOSR, 0) >> 18 & 1)

    def write(self, offset, value):
        """Stores a register, and checks a new range."""
        super().write(offset, value)
        if offset == VOSR:
            self.rcc.check()

    def read(self, offset):
        """Returns a register, with the bits that the hardware sets: VOSRDY and BOOSTRDY, the regulator in use, VDDA."""
        value = super().read(offset)
        if offset == VOSR:
            value |= 1 << 15 | (value >> 18 & 1) << 14
        if offset == SVMSR:
            value |= self.values.get(CR3, 0) & REGSEL * self.has_smps | 1 << 26 | 1 << 27
        return value


class Icache(Registers):
    """The cache of the flash. It has copies of damaged words that were read while it was on, and old ones of what was changed, until
    it is invalidated.
    """

    def __init__(self):
        super().__init__(ICACHE, {0: 4})
        self.copies, self.is_stale = set(), False

    def reset(self):
        """Resets the registers, and forgets the copies."""
        super().reset()
        self.copies, self.is_stale = set(), False

    def is_on(self):
        """Returns whether it is on."""
        return bool(self.values.get(0, 0) & 1)

    def write(self, offset, value):
        """Stores a register. An invalidation ends at once, and the bit does not stay."""
        if offset == 0 and value & 2:
            self.copies, self.is_stale = set(), False
        super().write(offset, value & ~2 if offset == 0 else value)


class Flash(flash.Flash):
    """Both banks: pages of 8 KiB, words of 128 bits that are programmed once after an erasure, outside supply range 4. A read of
    a word in `torn` sets ECCD and interrupts the core, unless the cache has a copy.
    """

    KEYR, SR, CONTROL, ECCR = 0x08, 0x20, 0x28, 0x30
    LOCK, PROGRAM, ERASE, START, DOUBLE_ERROR = 1 << 31, 1, 1 << 1, 1 << 16, 1 << 31
    PAGE, NMI = 0x2000, 2 - 16
    BASE, INITIAL, WORD = FLASH, {CONTROL: LOCK}, 16

    def __init__(self, machine, pwr, icache):
        super().__init__(machine)
        self.pwr, self.icache, pwr.rcc.flash = pwr, icache, self

    def _may_change(self, what):
        if self.values[self.CONTROL] & self.LOCK or self.pwr.range() == 0:
            raise ValueError(f"the flash is {what} while it is locked, or in supply range 4")
        self.icache.is_stale |= self.icache.is_on()

    def write(self, offset, value):
        """Stores a register. Two keys unlock it, and a start erases a page."""
        if offset == self.KEYR:
            self.keys = [*self.keys, value][-2:]
            if self.keys == flash.KEYS:
                self.values[self.CONTROL] &= ~self.LOCK
        elif offset == self.SR:
            self.values[offset] = self.values.get(offset, 0) & ~value
        elif offset == self.ECCR:
            self.values[offset] = self.values.get(offset, 0) & ~(value & 3 << 30)
        elif offset != self.CONTROL or not self.values[self.CONTROL] & self.LOCK:
            super().write(offset, value)
            if offset == self.CONTROL and value & self.ERASE and value & self.START:
                self._erase(value)
            if offset == self.CONTROL and value & self.LOCK and self.icache.is_stale:
                self.machine.at(self.machine.now + 10_000, self._must_be_fresh)

    def _must_be_fresh(self):
        if self.icache.is_stale:
            raise ValueError("the cache keeps copies of the flash after a change")

    def _erase(self, control):
        self._may_change("erased")
        page = 0x0800_0000 + (control >> 11 & 1) * flash.BANK2_SIZE + (control >> 3 & 0xFF) * self.PAGE
        if page < flash.BANK2:
            raise ValueError(f"the program is erased at {page:#x}")
        self.machine.uc.mem_write(page, b"\xff" * self.PAGE)
        self.torn -= set(range(page, page + self.PAGE, self.WORD))
        self.values[self.CONTROL] &= ~self.START

    def _written(self, uc, _, address, size, __, ___):
        self._may_change("written")
        if not self.values[self.CONTROL] & self.PROGRAM:
            raise ValueError(f"the flash is written at {address:#x} and not to be programmed")
        self._program(uc, address, size)

    def _read(self, uc, _, address, *__):
        word = address // self.WORD * self.WORD
        # A second error is not noticed before the first one's flag is cleared.
        if word not in self.torn or word in self.icache.copies or self.values.get(self.ECCR, 0) & 3 << 30:
            return
        if self.icache.is_on():
            self.icache.copies.add(word)
        self.values[self.ECCR] = self.values.get(self.ECCR, 0) | self.DOUBLE_ERROR
        self.machine.nmi = True
        uc.emu_stop()


class Gpdma(Registers):
    """Channel 0 of GPDMA1, which moves words from the DCMI to memory, and loads its next block from a list."""

    LBAR, FCR, SR, CCR, TR1, TR2, BR1, SAR, DAR, LLR = 0x50, 0x5C, 0x60, 0x64, 0x90, 0x94, 0x98, 0x9C, 0xA0, 0xCC
    EN, RESET, SUSP = 1, 2, 4
    IDLE, FULL, HALF, ERROR, LINK_ERROR, SUSPENDED = 1, 1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 13
    REQUEST, WORDS = 86, 2
    # The registers that an item of the list may load, in their order.
    LOADS = ((31, TR1), (30, TR2), (29, BR1), (28, SAR), (27, DAR), (16, LLR))

    def __init__(self, machine):
        super().__init__(GPDMA1, {self.SR: self.IDLE})
        self.machine, self.total = machine, 0

    def irqs(self):
        """Returns its interrupt, while an enabled flag is set: both have the same bit."""
        flags = self.values.get(self.SR, 0) & self.values.get(self.CCR, 0) & 0x7F00
        return {GPDMA1_CHANNEL0} if flags else set()

    def _is_on(self):
        return bool(self.values.get(self.CCR, 0) & self.EN)

    def write(self, offset, value):
        """Stores a register. Those of a channel that is on are not to be written, but for its suspension and flags."""
        if offset == self.FCR:
            self.values[self.SR] = self.values.get(self.SR, 0) & ~(value & 0x7F00)
            return
        if offset == self.CCR:
            if value & self.RESET:
                if self._is_on() and not self.values.get(self.SR, 0) & self.SUSPENDED:
                    raise ValueError("a channel of the GPDMA is reset while it runs")
                self.values |= {self.CCR: 0, self.SR: self.IDLE, self.BR1: 0, self.LLR: 0}
                return
            if value & self.SUSP and self._is_on():
                self.values[self.SR] |= self.SUSPENDED | self.IDLE
            if value & self.EN and not self._is_on():
                self.values[self.SR] &= ~self.IDLE
                self.total = (self.values.get(self.BR1, 0) & 0xFFFF) // 4
        elif self._is_on():
            raise ValueError(f"register {offset:#x} of a channel that runs is written")
        super().write(offset, value)

    def take(self, data):
        """Writes words to memory. Returns whether the channel runs."""
        wants = self.values.get(self.TR2, 0) & 0x7F == self.REQUEST and not self.values.get(self.TR2, 0) & 3 << 9
        if not self._is_on() or self.values[self.SR] & self.SUSPENDED or not wants:
            return False
        control, source = self.values.get(self.TR1, 0), self.values.get(self.SAR)
        if control & 3 != self.WORDS or control >> 16 & 3 != self.WORDS or not control >> 19 & 1 or control >> 3 & 1 or source != DCMI + 0x28:
            raise ValueError("the channel does not move words of the DCMI to growing addresses")
        for at in range(0, len(data), 4):
            left = self.values[self.BR1] & 0xFFFF
            if left == 0:
                self.values[self.SR] |= self.LINK_ERROR
                return False
            self.machine.uc.mem_write(self.values[self.DAR], data[at : at + 4])
            self.values[self.DAR] += 4
            self.values[self.BR1] -= 4
            if left - 4 == 2 * self.total:
                self.values[self.SR] |= self.HALF
            if left == 4:
                self.values[self.SR] |= self.FULL
                self._load()
        return True

    def _load(self):
        link = self.values.get(self.LLR, 0)
        if not link & 0xFFFC:
            self.values[self.CCR] &= ~self.EN
            return
        address = self.values.get(self.LBAR, 0) & 0xFFFF_0000 | link & 0xFFFC
        for bit, register in self.LOADS:
            if link >> bit & 1:
                self.values[register] = int.from_bytes(self.machine.uc.mem_read(address, 4), "little")
                address += 4
        self.total = (self.values[self.BR1] & 0xFFFF) // 4


class Watchdog(clocks.Watchdog):
    """IWDG."""

    BASE, CAUSE = IWDG, BY_WATCHDOG


class Usart(usart.Usart):
    """USART1."""

    BASE, IRQ = USART1, USART1_IRQ


class Timer(timer.Timer):
    """TIM2."""

    IRQ = TIM2_IRQ


class Dcmi(camera.Dcmi):
    """The camera interface."""

    BASE, IRQ = DCMI, DCMI_PSSI


class Port(ports.Port):
    """A port."""

    BASE = GPIOA


class Chip:
    """The STM32U575 for `Board`."""

    cpu, has_axi, unique_id = UC_CPU_ARM_CORTEX_M33, False, 0x0BFA_0700
    # Flash; SRAM1, 2 and 3, and a part of their other addresses, for `Machine.crash`; system memory.
    memories = ((0x0800_0000, 0x20_0000), (0x2000_0000, 0xC_0000), (0x3000_0000, 0x1000), (0x0BF9_0000, 0x2_0000))
    serial_divider, Port = 1, Port

    def parts(self, machine, wiring):
        """Creates RCC, DMA, watchdog, timer and flash, and other parts."""
        rcc = Rcc(wiring.clock_hertz)
        pwr, icache = Pwr(rcc), Icache()
        board_flash = Flash(machine, pwr, icache)
        kept = [pwr, icache, Watchdog(machine, rcc, wiring.clock_hertz), Timer(machine), *map(Registers, KEPT)]
        return rcc, Gpdma(machine), board_flash, kept

    Dcmi, Usart = Dcmi, Usart


# UM2861: the debugger's line is USART1 at PA9 (Zephyr's board file, too), and LD3 is red at PG2. The others are at pins of the
# camera. Functions of pins: DS13737.
NUCLEO_U575 = Wiring("PC6 PC7 PC8 PC9 PE4 PD3 PE5 PE6", "PA9", "PB0 PG2", 1, None, False)
NUCLEO_U575.chip, NUCLEO_U575.function = Chip(), {(2, 9): 4, (3, 3): 4, (0, 6): 4, None: 10}
NUCLEO_U575_SLOW = copy(NUCLEO_U575)
NUCLEO_U575_SLOW.clock_hertz = 24_000_000
