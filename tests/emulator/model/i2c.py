"""I2C1 as master, and a camera sensor on it whose registers are behind an address that is written first."""

from .registers import Registers

I2C1 = 0x4000_5400
CR2, ISR, ICR, RXDR, TXDR = 0x04, 0x18, 0x1C, 0x24, 0x28
READS, START, STOP, AUTOEND = 1 << 10, 1 << 13, 1 << 14, 1 << 25
TXE, TXIS, RXNE, NACKF, STOPF, TC, BUSY = 1, 1 << 1, 1 << 2, 1 << 4, 1 << 5, 1 << 6, 1 << 15


class I2c(Registers):
    """The master. A byte takes no time."""

    def __init__(self, sensors):
        super().__init__(I2C1)
        self.sensors = {sensor.address: sensor for sensor in sensors}
        self.sensor, self.left, self.reads, self.flags = None, 0, False, 0

    def read(self, offset):
        """Returns a register. The status says what a transfer needs next."""
        if offset == ISR:
            wants = (RXNE if self.reads else TXIS) if self.left else 0
            return TXE | self.flags | wants | (BUSY if self.sensor else 0)
        if offset == RXDR:
            value = self.sensor.read() if self.sensor and self.left else 0
            self._moved()
            return value
        return super().read(offset)

    def write(self, offset, value):
        """Begins, feeds or ends a transfer."""
        if offset == CR2:
            super().write(offset, value & ~(START | STOP))
            if value & START:
                self._begin(value)
            if value & STOP:
                self._end()
        elif offset == ICR:
            self.flags &= ~value
        elif offset == TXDR:
            if self.sensor and self.left:
                self.sensor.write(value & 0xFF)
            self._moved()
        else:
            super().write(offset, value)

    def _begin(self, value):
        self.left, self.reads, self.flags = value >> 16 & 0xFF, bool(value & READS), 0
        self.sensor = self.sensors.get((value & 0xFF) >> 1)
        if self.sensor is None or not self.sensor.answers(self.reads):
            self.sensor, self.left = None, 0
            self.flags = NACKF | STOPF

    def _moved(self):
        self.left = max(0, self.left - 1)
        if self.left == 0 and self.sensor:
            if self.values.get(CR2, 0) & AUTOEND:
                self._end()
            else:
                self.flags |= TC

    def _end(self):
        if self.sensor:
            self.sensor.stop()
        self.sensor, self.flags = None, self.flags & ~TC | STOPF


class Sensor:
    """A sensor's registers. `present` is whether it answers, `nack_after` is how often it answers before it fails once,
    and `stuck` is a register that keeps its value. Another object has the pixels.
    """

    def __init__(self, address, identity):
        self.address, self.identity = address, identity
        self.present, self.resets, self.nack_after, self.stuck = True, 0, None, None
        self.registers, self.pointer, self.written = dict(identity), 0, []

    def answers(self, reads):
        """Returns whether it acknowledges its address. It does not accept a repeated start."""
        if self.nack_after == 0:
            self.nack_after = None
            return False
        if self.nack_after is not None:
            self.nack_after -= 1
        self.written = [] if not reads else self.written
        return self.present

    def write(self, value):
        """Accepts a byte."""
        self.written.append(value)

    def read(self):
        """Returns the register whose address was written before the last stop."""
        return self.registers.get(self.pointer, 0)

    def stop(self):
        """Ends a transfer of an address, or of an address and a value."""
        if self.written:
            self.pointer = self.written[0]
        if len(self.written) == 2:
            self._set(*self.written)
        self.written = []

    def power_on(self):
        """Forgets all registers."""
        self.registers = dict(self.identity)

    def is_set_up(self):
        """Returns whether automatic exposure, gain and white balance have been switched off. Then pixels come."""
        return self.present and self.registers.get(0x13) == 0

    def _set(self, register, value):
        if (register, value) == (0x12, 0x80):
            self.resets += 1
            self.power_on()
        elif register not in self.identity and register != self.stuck:
            self.registers[register] = value
