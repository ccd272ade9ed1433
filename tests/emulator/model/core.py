"""The core's own registers: interrupt controller and system control block. The interconnect behind it."""

from .registers import Registers

NVIC_PAGE, SCB_PAGE = 0xE000_E000, 0xE000_EC00
ENABLE, DISABLE, LAST = 0x100, 0x180, 0x200
VTOR, AIRCR, CPUID, ICSR = 0x108, 0x10C, 0x100, 0x104
RESET_REQUEST = 0x05FA_0004
CCR, DATA_CACHE, CCSIDR = 0x114, 1 << 16, 0x180
MPU_TYPE, MPU_CTRL, MPU_RNR, MPU_RBAR, MPU_RASR, REGIONS = 0x190, 0x194, 0x198, 0x19C, 0x1A0, 16
# Of the AXI interconnect's registers for target 7, the AXI SRAM (RM0433, 2.2.4).
AXI_TARGET_7, FN_MOD, READ_ISS_OVERRIDE = 0x5100_8000, 0x108, 1
# TEX, S, C and B of memory that is not cached: normal, strongly ordered, device.
UNCACHED = {tex << 3 | shared << 2 | bits for tex, bits in ((1, 0), (0, 0), (0, 1), (2, 0)) for shared in (0, 1)}


class Nvic(Registers):
    """The enabled interrupts. The peripherals know which ones are pending."""

    def __init__(self, machine):
        super().__init__(NVIC_PAGE)
        self.machine = machine

    def read(self, offset):
        """Returns a register. Registers that enable interrupts return the current state."""
        if ENABLE <= offset < LAST:
            first = (offset & 0x7F) * 8
            return sum(1 << bit for bit in range(32) if first + bit in self.machine.enabled)
        return super().read(offset)

    def write(self, offset, value):
        """Enables or disables interrupts."""
        numbers = {(offset & 0x7F) * 8 + bit for bit in range(32) if value >> bit & 1}
        if ENABLE <= offset < DISABLE:
            self.machine.enabled |= numbers
        elif DISABLE <= offset < LAST:
            self.machine.enabled -= numbers
        else:
            super().write(offset, value)


class Scb(Registers):
    """Vectors, the reset that a program can request, caches and memory protection.

    Caches hold nothing here, and are on after a reset if a bootloader has left them so (`caches`). What counts is
    whether the core may keep a copy of an address (`keeps`): then nothing but the core may write there.
    """

    def __init__(self, machine, caches=0):
        # A data cache of 16 KiB has 128 sets of four lines of 32 bytes.
        super().__init__(SCB_PAGE, {CPUID: 0x411F_C271, CCSIDR: 0xF00F_E019, MPU_TYPE: REGIONS << 8, CCR: caches})
        self.machine, self.regions = machine, {}

    def reset(self):
        """Resets the registers: caches and memory protection are off."""
        super().reset()
        self.regions = {}

    def keeps(self, address):
        """Returns whether the data cache may have a copy of an address (ARMv7-M, B3.1 and B3.5)."""
        if not self.values.get(CCR, 0) & DATA_CACHE:
            return False
        if self.values.get(MPU_CTRL, 0) & 1:
            if self.values[MPU_CTRL] & 6 != 6:
                raise ValueError("memory protection is off in handlers of faults, or hides what has no region")
            for base, attributes in sorted(self.regions.items(), reverse=True):
                if attributes[1] & 1 and attributes[0] <= address < attributes[0] + (2 << (attributes[1] >> 1 & 0x1F)):
                    return attributes[1] >> 16 & 0x3F not in UNCACHED
        return not 0x4000_0000 <= address < 0x6000_0000 and address < 0xA000_0000

    def read(self, offset):
        """Returns a register. ICSR has the numbers of the exception that runs and of the first one that is pending."""
        if offset == ICSR:
            numbers = (0 if irq is None else 16 + irq for irq in (self.machine.exception, self.machine.asked()))
            return next(numbers) | next(numbers) << 12
        return super().read(offset)

    def write(self, offset, value):
        """Stores a register, and performs what it requests."""
        if offset in (MPU_TYPE, CCSIDR):
            return
        super().write(offset, value)
        if offset in (MPU_RASR, MPU_CTRL) and self.values.get(CCR, 0) & DATA_CACHE:
            raise ValueError("memory protection changes while the data cache has copies")
        if offset == MPU_RASR:
            number, base = self.values.get(MPU_RNR, 0), self.values.get(MPU_RBAR, 0)
            size = 2 << (value >> 1 & 0x1F)
            if number >= REGIONS or base & 0x10 or base % size:
                raise ValueError(f"region {number} of {size:#x} bytes at {base:#x} cannot be protected")
            self.regions[number] = (base, value)
        if offset == VTOR:
            self.machine.vectors = value
        elif offset == AIRCR and value & 0xFFFF_0004 == RESET_REQUEST:
            self.machine.reset_wanted = True
            self.machine.uc.emu_stop()


class AxiInterconnect(Registers):
    """The part of the interconnect in front of the AXI SRAM."""

    def __init__(self, machine):
        super().__init__(AXI_TARGET_7)
        self.machine = machine

    def write(self, offset, value):
        """Stores a register. READ_ISS_OVERRIDE limits the reads that are under way at a time to one."""
        super().write(offset, value)
        if offset == FN_MOD and value & READ_ISS_OVERRIDE:
            self.machine.limit_axi_reads()
