"""An I2C as master, by default I2C1. The sensors on it are objects of `sensor.py`."""

from .registers import Registers

I2C1 = 0x4000_5400
CR2, ISR, ICR, RXDR, TXDR = 0x04, 0x18, 0x1C, 0x24, 0x28
READS, START, STOP, AUTOEND = 1 << 10, 1 << 13, 1 << 14, 1 << 25
TXE, TXIS, RXNE, NACKF, STOPF, TC, BUSY = 1, 1 << 1, 1 << 2, 1 << 4, 1 << 5, 1 << 6, 1 << 15


class I2c(Registers):
    """The master. A byte only arrives if `has_pins()`. It takes `byte_time` of `clock()`, which is no time unless a case sets
    both; `busy` adds it up.
    """

    byte_time, clock, busy, ready_at = 0, staticmethod(lambda: 0), 0, 0

    def __init__(self, sensors, has_pins, base=I2C1):
        super().__init__(base)
        self.has_pins = has_pins
        self.sensors = {sensor.address: sensor for sensor in sensors}
        self.sensor, self.left, self.reads, self.flags = None, 0, False, 0

    def read(self, offset):
        """Returns a register. The status says what a transfer needs next."""
        if offset == ISR and self.clock() < self.ready_at:
            return BUSY
        if offset == ISR:
            wants = (RXNE if self.reads else TXIS) if self.left else 0
            return TXE | self.flags | wants | (BUSY if self.sensor else 0)
        if offset == RXDR:
            value = self.sensor.read() if self.sensor and self.left else 0
            self._moved(self.left > 1)
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
        # The address, and the first byte that the sensor sends.
        self._takes(2 if self.reads else 1)
        if any(sensor.holds or sensor.shorted or not sensor.pulls_up for sensor in self.sensors.values()):
            # A line is low, or stays so: no start is possible.
            self.sensor, self.left = None, 0
            return
        self.sensor = self.sensors.get((value & 0xFF) >> 1) if self.has_pins() else None
        if self.sensor is None or not self.sensor.answers(self.reads):
            self.sensor, self.left = None, 0
            self.flags = NACKF | STOPF

    def _takes(self, count):
        self.ready_at = self.clock() + count * self.byte_time
        self.busy += count * self.byte_time

    def _moved(self, is_followed=True):
        self._takes(int(is_followed))
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

