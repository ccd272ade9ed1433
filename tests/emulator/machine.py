"""A Cortex-M7 with the STM32H743's memories: it runs unmodified programs, with interrupts, sleep, and a clock that
counts instructions.

Time is in cycles, and an instruction is one cycle. A sleeping core skips to the next event. So every run is the same.
Peripherals are objects in `model/` with a `base`, `read(offset)` and `write(offset, value)`. If they interrupt,
`irqs()` returns the numbers of the pending interrupts.
"""

import bisect
import heapq
import itertools
import struct
import sys

from elftools.elf.elffile import ELFFile
from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_HOOK_CODE, UC_HOOK_INTR, UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import (
    UC_ARM_REG_D0,
    UC_ARM_REG_FAULTMASK,
    UC_ARM_REG_FPSCR,
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_PRIMASK,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_R3,
    UC_ARM_REG_R12,
    UC_ARM_REG_SP,
    UC_ARM_REG_XPSR,
    UC_CPU_ARM_CORTEX_M7,
)

FLASH, FLASH_SIZE = 0x0800_0000, 0x20_0000
MEMORIES = [
    (FLASH, FLASH_SIZE),
    (0x2000_0000, 0x2_0000),  # DTCM
    (0x2400_0000, 0x8_0000),  # AXI SRAM, of which nothing is read before `limit_axi_reads`
    (0x3000_0000, 0x4_8000),
    (0x3800_0000, 0x1_0000),
    (0x1FF0_0000, 0x2_0000),  # system memory
]
DTCM, AXI, AXI_SIZE = 0x2000_0000, 0x2400_0000, 0x8_0000
NOWHERE = 0x3000_0100
# The unique number of the chip, and where it is (RM0433, section 61.1).
UNIQUE_ID, CHIP = 0x1FF1_E800, bytes(range(1, 13))
BOOTLOADER_STACK = 0x2000_8000  # in memory that the DMA does not reach
# The byte that the program paints its stack with at its start, too.
PAINT, STACK_PAINTED = b"\xcc", 0x4000
PERIPHERALS, PERIPHERALS_SIZE = 0x4000_0000, 0x2000_0000
# What is counted: an instruction in the memory that it is read from is not.
REGIONS = {
    "flash": (FLASH, FLASH_SIZE),
    "ITCM": (0, 0x1_0000),
    "DTCM": (DTCM, 0xC_0000),  # of an STM32U575, all RAM
    "AXI SRAM": (AXI, AXI_SIZE),
    "other SRAM": (0x3000_0000, 0x900_0000),
    "peripherals": (PERIPHERALS, PERIPHERALS_SIZE),
}
SYSTEM, SYSTEM_SIZE = 0xE000_0000, 0x10_0000
PAGE = 0x400  # peripherals are distinguished in steps of this
STACKED = [UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR]
DOUBLES = [UC_ARM_REG_D0 + k for k in range(8)]
EXC_RETURN = 0xFFFF_FFF9  # return to the thread, main stack, without floating point registers
EXCEPTION_EXIT = 8  # the emulator's name for a jump to such an address
NMI, HARD_FAULT = 2 - 16, 3 - 16  # in place of the number of an interrupt
WFE, WFI = b"\x20\xbf", b"\x30\xbf"
SCB_PAGE = 0xE000_EC00
SLICE, SHORT_SLICE = 1000, 200  # cycles that a busy core runs between two checks, the latter in an interrupt


class Stopped(Exception):
    """The program did something that no program should."""


class Machine:
    """The core, its memories and its clock. Peripherals are added."""

    def __init__(self, elf, bootloader=None, chip=None):
        """`bootloader` leaves the state of one that starts the program. It sets neither stack nor vectors. `chip` is another one."""
        self.bootloader = bootloader
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(chip.cpu if chip else UC_CPU_ARM_CORTEX_M7)
        for base, size in chip.memories if chip else MEMORIES:
            self.uc.mem_map(base, size)
        self.uc.mem_write(chip.unique_id if chip else UNIQUE_ID, CHIP)
        self.has_axi, self.nmi = chip is None or chip.has_axi, False
        with open(elf, "rb") as file:
            image = ELFFile(file)
            self.image = [(s["p_paddr"], s.data()) for s in image.iter_segments() if s["p_type"] == "PT_LOAD"]
            self.axi_bytes = sum(s["sh_size"] for s in image.iter_sections() if s.name in (".axi", ".sram4"))
            symbols = list(image.get_section_by_name(".symtab").iter_symbols())
        self.symbols = {symbol.name: symbol["st_value"] for symbol in symbols}
        functions = [symbol for symbol in symbols if symbol["st_info"]["type"] == "STT_FUNC"]
        self.functions = sorted((symbol["st_value"] & ~1, symbol.name) for symbol in functions)
        for address, data in self.image:
            self.uc.mem_write(address, data)
            # The emulator itself does not stop there.
            for at in (address + at for at in range(0, len(data) - 1, 2) if data[at : at + 2] == WFI):
                self.uc.hook_add(UC_HOOK_CODE, self._waits, begin=at, end=at)
        self.pages = {}
        for base, size in ((PERIPHERALS, PERIPHERALS_SIZE), (SYSTEM, SYSTEM_SIZE)):
            self.uc.mmio_map(base, size, self._read, base, self._write, base)
        self.uc.hook_add(UC_HOOK_INTR, self._interrupted)
        self.now = 0
        self.events, self.order = [], itertools.count()
        self.peripherals = []
        self.instructions = 0
        self.blocks, self.accesses = {}, dict.fromkeys(REGIONS, 0)
        self.stalled_until = 0
        self.partial = self.writing = self.axi_hook = None
        self.reset()

    def sizes(self):
        """Returns the bytes of flash, and of RAM with a fixed place."""
        flash = sum(len(data) for _, data in self.image)
        return flash, self.symbols["__euninit"] - DTCM + self.axi_bytes

    def paint_stack(self):
        """Fills the memory of the stack with a pattern."""
        self.uc.mem_write(self.symbols["_stack_start"] - STACK_PAINTED, PAINT * STACK_PAINTED)

    def deepest_stack(self):
        """Returns the bytes of the painted stack that were used. The part nearest to its beginning is painted."""
        top = self.symbols["_stack_start"]
        memory = bytes(self.uc.mem_read(top - STACK_PAINTED, STACK_PAINTED))
        return STACK_PAINTED - (len(memory) - len(memory.lstrip(PAINT)))

    def crash(self):
        """Sends the core to an address without instructions."""
        self.uc.mem_write(NOWHERE, b"\x00\xde")
        self.pc, self.asleep = NOWHERE | 1, None

    def panic(self):
        """Sends the core into a function of the program that panics. Nothing else calls it."""
        self.pc, self.asleep = self.symbols["__defmt_default_panic"], None

    def interrupt(self, number):
        """Sends the core into the handler of an interrupt, whatever is enabled."""
        self._enter(number)

    def correct_errors(self, name):
        """Lets the memory of a variable have error correction, and arbitrary bytes as after power was off.

        The variable with the highest address is not protected, because its writes serve to empty the buffer.

        It writes whole words of 64 bits. A part of one stays in a buffer until a part of another one is written, and a
        reset loses it.
        """
        places = [address for symbol, address in self.symbols.items() if name in symbol and address >= DTCM]
        start = min(places)
        self.record, self.losses = range(start, max(places)), []
        self.partial, self.writing = None, None
        self.uc.mem_write(start, b"\x5a" * 256)
        self.uc.hook_add(UC_HOOK_MEM_WRITE, self._written, begin=start, end=start + 255)

    def _written(self, uc, _, address, size, value, __):
        word = address & ~7
        if self.keeps(address):
            raise Stopped("the crash record may be lost in a reset: the core keeps copies of its memory")
        if self.writing and self.writing[0] == word:
            self.writing[2].update(range(address, address + size))
            if len(self.writing[2]) == 8:
                # All of the word came at once: it does not wait in the buffer, and empties nothing.
                self.writing = None
            return
        if self.writing:
            self.partial = self.writing
        whole = size == 8
        self.writing = None if whole else (word, bytes(uc.mem_read(word, 8)), set(range(address, address + size)))

    def reset(self):
        """Restarts the core; memory stays as it is, but for a part of a word that was not written yet."""
        lost = self.writing or self.partial
        if lost:
            self.losses += [lost[0]] if lost[0] in self.record else []
            self.uc.mem_write(lost[0], lost[1])
        self.partial = self.writing = None
        self.enabled, self.exception, self.saved, self.outer = set(), None, [], []
        self.event, self.asleep, self.nmi = False, None, False
        self.vectors = FLASH
        if self.has_axi and self.axi_hook is None:
            self.axi_hook = self.uc.hook_add(UC_HOOK_MEM_READ, self._early_read, begin=AXI, end=AXI + AXI_SIZE - 1)
        for register in (UC_ARM_REG_PRIMASK, *STACKED):
            self.uc.reg_write(register, 0)
        stack, self.pc = struct.unpack("<II", self.uc.mem_read(self.image[0][0], 8))
        if self.bootloader:
            self.bootloader(self)
            stack = BOOTLOADER_STACK
        elif self.image[0][0] != FLASH:
            raise Stopped("the program does not begin where the core starts")
        self.uc.reg_write(UC_ARM_REG_SP, stack)
        self.reset_wanted = False

    def ignores_bus_faults(self):
        """Returns whether loads that the bus refuses are ignored: CCR bit 8 with FAULTMASK."""
        control = self.pages[SCB_PAGE // PAGE].read(0x114)
        return bool(control >> 8 & 1 and self.uc.reg_read(UC_ARM_REG_FAULTMASK) & 1)

    def keeps(self, address):
        """Returns whether the core may keep a copy of memory."""
        return self.pages[SCB_PAGE // PAGE].keeps(address)

    def add(self, *peripherals):
        """Maps peripherals."""
        for peripheral in peripherals:
            self.pages[peripheral.base // PAGE] = peripheral
            self.peripherals.append(peripheral)

    def at(self, time, action):
        """Calls `action` at the clock's time `time`."""
        heapq.heappush(self.events, (time, next(self.order), action))

    def stall(self, cycles):
        """Stops the core for some time, as a debugger does. Everything else continues."""
        self.stalled_until = self.now + cycles

    def limit_axi_reads(self):
        """From now on, the AXI SRAM takes one read at a time, which a chip of revision Y needs (ES0392, 2.2.9)."""
        if self.axi_hook is not None:
            self.uc.hook_del(self.axi_hook)
            self.axi_hook = None

    def _early_read(self, _, __, address, *___):
        raise Stopped(f"reads {address:#x} of the AXI SRAM before READ_ISS_OVERRIDE is set, in {self.where()}")

    def count_instructions(self):
        """Counts instructions, which is slower. Must be called before the first run, because code that has run is not
        checked again.
        """
        self.uc.hook_add(UC_HOOK_BLOCK, self._block)

    def count_accesses(self, names):
        """Counts the reads and writes of these memories in `accesses`; those of peripherals are always counted. With reads of
        the DTCM, which has the stack, the emulator ended programs in hard faults that they have not without: not for a run
        that counts more.
        """
        def count(_, __, ___, ____, _____, name):
            self.accesses[name] += 1

        for name in names:
            base, size = REGIONS[name]
            self.uc.hook_add(UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE, count, name, base, base + size - 1)

    def run(self, until):
        """Runs until `until()` is true. It is called after every event."""
        while not until():
            while self.events and self.events[0][0] <= self.now:
                heapq.heappop(self.events)[2]()
            self._reset_if_wanted()
            if self.now < self.stalled_until:
                self.now = min([self.stalled_until, *(time for time, *_ in self.events[:1])])
                continue
            self._interrupt()
            waits = self.asleep or self._run_slice()
            self.asleep = None
            if waits and not self.asked():
                if self.event and waits == WFE:
                    self.event = False
                elif not self.events:
                    raise Stopped(f"asleep for ever in {self.where()}")
                else:
                    self.now, self.asleep = max(self.now, self.events[0][0]), waits
            self._reset_if_wanted()

    def _reset_if_wanted(self):
        if self.reset_wanted:
            for peripheral in self.peripherals:
                if hasattr(peripheral, "reset"):
                    peripheral.reset()
            self.reset()

    def where(self):
        """Returns the function that the core is in."""
        at = bisect.bisect(self.functions, (self.uc.reg_read(UC_ARM_REG_PC), "\uffff")) - 1
        return f"{self.functions[at][1]} at {self.uc.reg_read(UC_ARM_REG_PC):#x}" if at >= 0 else "nowhere"

    def _run_slice(self):
        """Runs for some time. Returns the instruction with which the core went to sleep, or `None`."""
        self.stopped_by = None
        before = self.now
        # The time at which an interrupt returns is not known: a return ends a slice, which counts as a whole one.
        most = SLICE if self.exception is None else SHORT_SLICE
        slice_ = most if not self.events else max(1, min(most, self.events[0][0] - self.now))
        if self.exception is None and self.asked() is not None:
            # It is masked, and entered as soon as it is not.
            slice_ = 1
        try:
            self.uc.emu_start(self.pc | 1, 0xFFFF_FFFE, count=slice_)
        except UcError:
            pc = self.uc.reg_read(UC_ARM_REG_PC)
            if pc >= 0xFFFF_FF00:
                self._leave()
                return None
            if bytes(self.uc.mem_read(pc - 2, 2)) == WFE:
                self.pc = pc
                return WFE
            # There is no instruction, or no memory.
            self.pc = pc
            self._fault()
            return None
        self.pc = self.uc.reg_read(UC_ARM_REG_PC)
        if self.stopped_by == WFI:
            self.pc += len(WFI)
            return WFI
        self.now = before + slice_
        if self.stopped_by == EXCEPTION_EXIT or self.pc >= 0xFFFF_FF00:
            self._leave()
        elif self.stopped_by is not None:
            self._fault()
        return None

    def _fault(self):
        """Handles an invalid instruction or address: a hard fault, or the end if it happens in the hard fault."""
        if self.exception == HARD_FAULT:
            raise Stopped(f"hard fault in a hard fault, in {self.where()}, from {self.uc.reg_read(UC_ARM_REG_LR):#x}")
        self._enter(HARD_FAULT)

    def asked(self):
        """Returns the lowest pending and enabled interrupt."""
        asked = set().union(*(p.irqs() for p in self.peripherals if hasattr(p, "irqs"))) & self.enabled
        return min(asked, default=None)

    def _interrupt(self):
        """Enters a pending interrupt. Interrupts do not nest, because all have one priority, but that which cannot be masked does."""
        if self.nmi:
            self.nmi = False
            self.outer.append((self.exception, self.saved))
            self._enter(NMI)
            return
        if self.exception is not None or self.uc.reg_read(UC_ARM_REG_PRIMASK) & 1:
            return
        irq = self.asked()
        if irq is not None:
            self._enter(irq)

    def _enter(self, irq):
        self.exception, self.asleep = irq, None
        sp = self.uc.reg_read(UC_ARM_REG_SP)
        frame = (sp - 32) & ~7
        xpsr = self.uc.reg_read(UC_ARM_REG_XPSR) | 1 << 24 | (1 << 9 if sp & 4 else 0)
        words = [self.uc.reg_read(register) for register in STACKED] + [self.pc & ~1, xpsr]
        self.uc.mem_write(frame, struct.pack("<8I", *(word & 0xFFFF_FFFF for word in words)))
        self.saved = [self.uc.reg_read(register) for register in (*DOUBLES, UC_ARM_REG_FPSCR)]
        self.uc.reg_write(UC_ARM_REG_SP, frame)
        self.uc.reg_write(UC_ARM_REG_LR, EXC_RETURN)
        (self.pc,) = struct.unpack("<I", self.uc.mem_read(self.vectors + 4 * (16 + irq), 4))

    def _leave(self):
        """Returns from an interrupt."""
        if self.exception is None:
            raise Stopped("return from an interrupt outside one")
        frame = self.uc.reg_read(UC_ARM_REG_SP)
        *words, pc, xpsr = struct.unpack("<8I", self.uc.mem_read(frame, 32))
        for register, word in zip(STACKED, words, strict=True):
            self.uc.reg_write(register, word)
        for register, word in zip((*DOUBLES, UC_ARM_REG_FPSCR), self.saved, strict=True):
            self.uc.reg_write(register, word)
        # The flags, those of four bytes and, in the middle of an IT block, the rest of it.
        self.uc.reg_write(UC_ARM_REG_XPSR, xpsr & 0xFF0F_FC00)
        self.uc.reg_write(UC_ARM_REG_SP, frame + 32 + (4 if xpsr & 1 << 9 else 0))
        self.pc, self.event = pc | 1, True
        self.exception, self.saved = self.outer.pop() if self.exception == NMI else (None, [])

    def _interrupted(self, uc, number, _):
        self.stopped_by = number
        uc.emu_stop()

    def _waits(self, uc, *_):
        self.stopped_by = WFI
        uc.emu_stop()

    def _block(self, uc, address, size, _):
        count = self.blocks.get(address)
        if count is None:
            code, at, count = bytes(uc.mem_read(address, size)), 0, 0
            while at < size:
                # The five highest bits of a Thumb instruction show whether it has four bytes.
                at += 4 if code[at + 1] >= 0xE8 else 2
                count += 1
            self.blocks[address] = count
        self.instructions += count

    def _read(self, uc, offset, size, base):
        address = base + offset
        self.accesses["peripherals"] += base == PERIPHERALS
        peripheral = self.pages.get(address // PAGE)
        if peripheral is None:
            raise Stopped(f"reads {address:#x}, which nothing models, in {self.where()}")
        value = peripheral.read(address % PAGE & ~3) >> 8 * (address & 3)
        return value & ((1 << 8 * size) - 1)

    def _write(self, uc, offset, size, value, base):
        address = base + offset
        self.accesses["peripherals"] += base == PERIPHERALS
        peripheral = self.pages.get(address // PAGE)
        if peripheral is None:
            print(f"writes {address:#x}, which nothing models, in {self.where()}", file=sys.stderr)
            return
        peripheral.write(address % PAGE & ~3, value)
