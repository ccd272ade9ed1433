"""The core's own registers: interrupt controller and system control block."""

from .registers import Registers

NVIC_PAGE, SCB_PAGE = 0xE000_E000, 0xE000_EC00
ENABLE, DISABLE, LAST = 0x100, 0x180, 0x200
VTOR, AIRCR, CPUID, ICSR = 0x108, 0x10C, 0x100, 0x104
RESET_REQUEST = 0x05FA_0004


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
    """Vectors, and the reset that a program can request."""

    def __init__(self, machine):
        super().__init__(SCB_PAGE, {CPUID: 0x411F_C271})
        self.machine = machine

    def read(self, offset):
        """Returns a register. The lowest bits of ICSR have the number of the exception that runs."""
        if offset == ICSR:
            return 0 if self.machine.exception is None else 16 + self.machine.exception
        return super().read(offset)

    def write(self, offset, value):
        """Stores a register, and performs what it requests."""
        super().write(offset, value)
        if offset == VTOR:
            self.machine.vectors = value
        elif offset == AIRCR and value & 0xFFFF_0004 == RESET_REQUEST:
            self.machine.reset_wanted = True
            self.machine.uc.emu_stop()
