"""USART3: bytes are sent to a buffer, each in its time, and received from a queue."""

from .registers import Registers

USART3, IRQ = 0x4000_4800, 39
CR1, BRR, ISR, RDR, TDR = 0x00, 0x0C, 0x1C, 0x24, 0x28
RXNE, TC, TXE = 1 << 5, 1 << 6, 1 << 7


class Usart(Registers):
    """The serial line. `sent` has the bytes that came out, which only do so if `has_pin()`, and `receive` sends it
    some. `speed` is how many times as fast it is as its registers say, for cases that would take long. Until the time
    `storm_until`, another byte is there as soon as one was read: an interrupt that never rests.
    """

    BASE, IRQ = USART3, IRQ

    def __init__(self, machine, cycles_per_clock, has_pin):
        super().__init__(self.BASE)
        self.has_pin = has_pin
        self.machine, self.cycles_per_clock = machine, cycles_per_clock
        self.sent, self.arrived, self.busy_until, self.speed = bytearray(), [], 0, 1
        self.storm_until = 0

    def reset(self):
        """Resets the registers. Bytes that were sent stay in `sent`."""
        super().reset()
        self.arrived, self.busy_until = [], 0

    def receive(self, data):
        """Delivers bytes, one after another."""
        self.arrived += data

    def irqs(self):
        return {self.IRQ} if self._state() & self.values.get(CR1, 0) & (RXNE | TXE) else set()

    def read(self, offset):
        if offset == ISR:
            return self._state()
        if offset == RDR:
            return self.arrived.pop(0) if self.arrived else 0xFF
        return super().read(offset)

    def write(self, offset, value):
        """Stores a register; a byte is sent."""
        if offset != TDR:
            super().write(offset, value)
            return
        if self.has_pin():
            self.sent.append(value & 0xFF)
        # Ten bits pass before there is room again.
        self.busy_until = self.machine.now + 10 * self.values.get(BRR, 0) * self.cycles_per_clock // self.speed
        self.machine.at(self.busy_until, lambda: None)

    def _state(self):
        free = TXE | TC if self.machine.now >= self.busy_until else 0
        return free | (RXNE if self.arrived or self.machine.now < self.storm_until else 0)
