"""The flash controller of the STM32H743 (RM0433, chapter 4): bank 2, whose words of 256 bits are programmed once after an
erasure. The bytes are the machine's memory.
"""

from unicorn import UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE

from .registers import Registers

FLASH, BANK2, BANK2_SIZE = 0x5200_2000, 0x0810_0000, 0x10_0000
KEYR, CR, SR, CCR = 0x104, 0x10C, 0x110, 0x114
KEYS = [0x4567_0123, 0xCDEF_89AB]
LOCK, PROGRAM, ERASE, START = 1, 1 << 1, 1 << 2, 1 << 7
DOUBLE_ERROR = 1 << 26
SECTOR, WORD = 0x2_0000, 32


class Flash(Registers):
    """Bank 2. A reset in the middle of a word leaves it without a valid error correction: `torn` has such words. Reading
    one is a bus fault, unless the core ignores it, and sets the flag of a double error.
    """

    BASE, INITIAL, WORD = FLASH, {CR: LOCK | 0x30, 0x0C: LOCK | 0x30}, WORD

    def __init__(self, machine):
        super().__init__(self.BASE, self.INITIAL)
        self.machine, self.keys, self.torn, self.partial, self.words = machine, [], set(), None, 0
        self.cut_after = None
        machine.uc.mem_write(BANK2, b"\xff" * BANK2_SIZE)
        machine.uc.hook_add(UC_HOOK_MEM_WRITE, self._written, begin=BANK2, end=BANK2 + BANK2_SIZE - 1)

    def reset(self):
        """Resets the registers, and leaves the word under way torn."""
        super().reset()
        self.keys = []
        if self.partial is not None:
            self.tear([self.partial[0]])
        self.partial = None

    def tear(self, words):
        """Leaves words without a valid error correction.

        Only their reads are looked at: with a load in an IT block that is looked at, the emulator skips a later instruction.
        """
        for word in words:
            self.torn.add(word)
            self.machine.uc.hook_add(UC_HOOK_MEM_READ, self._read, begin=word, end=word + self.WORD - 1)
        # Code that has run does not know of them.
        self.machine.uc.ctl_flush_tb()

    def write(self, offset, value):
        """Stores a register. Two keys unlock the bank, and a start erases a sector."""
        if offset == KEYR:
            self.keys = [*self.keys, value][-2:]
            if self.keys == KEYS:
                self.values[CR] &= ~LOCK
            return
        if offset == CCR:
            self.values[SR] = self.values.get(SR, 0) & ~value
            return
        if offset == SR or offset == CR and self.values[CR] & LOCK:
            return
        super().write(offset, value)
        if offset == CR and value & ERASE and value & START:
            sector = BANK2 + (value >> 8 & 7) * SECTOR
            self.machine.uc.mem_write(sector, b"\xff" * SECTOR)
            self.torn -= set(range(sector, sector + SECTOR, WORD))
            self.values[CR] &= ~START

    def _written(self, uc, _, address, size, __, ___):
        control = self.values[CR]
        if control & (LOCK | PROGRAM) != PROGRAM:
            raise ValueError(f"the flash is written at {address:#x} while it is locked or not to be programmed")
        if self.machine.keeps(address):
            raise ValueError(f"the flash is programmed at {address:#x} while the core keeps copies of it")
        self._program(uc, address, size)

    def _program(self, uc, address, size):
        word = address // self.WORD * self.WORD
        if self.partial is None:
            if bytes(uc.mem_read(word, self.WORD)) != b"\xff" * self.WORD:
                raise ValueError(f"the flash word at {word:#x} is programmed twice")
            self.partial = (word, set())
        if self.partial[0] != word:
            raise ValueError("another flash word is written before the last one is whole")
        self.partial[1].update(range(address, address + size))
        if self.cut_after is not None:
            self.cut_after -= 1
            if self.cut_after == 0:
                self.cut_after, self.machine.reset_wanted = None, True
                uc.emu_stop()
                return
        if len(self.partial[1]) == self.WORD:
            self.partial, self.words = None, self.words + 1

    def _read(self, uc, _, address, size, __, ___):
        if address // WORD * WORD in self.torn:
            if not self.machine.ignores_bus_faults():
                raise ValueError(f"a bus fault: the flash word at {address:#x} has no valid error correction")
            self.values[SR] = self.values.get(SR, 0) | DOUBLE_ERROR
