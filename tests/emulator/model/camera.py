"""A parallel sensor, the DCMI that captures its pixels, and DMA1's stream 0 that moves the DCMI's words.

Every second byte is dropped if the program asks for that, and the words are written to the ring. The clip's first frame
is the first one that is captured and not measured. Before that, the sensor is dark.
"""

from .registers import Registers

DCMI, DCMI_IRQ = 0x4802_0000, 78
CR, RIS, IER, ICR, CWSTRT, CWSIZE = 0x00, 0x08, 0x0C, 0x14, 0x20, 0x24
CAPTURE, CROP, ENABLE = 1, 1 << 2, 1 << 14
EVERY_SECOND_BYTE, THE_SECOND = 1 << 16, 1 << 18
OVERRUN, VSYNC, LINE = 2, 8, 16

DMA1, DMA_IRQ, DMAMUX1 = 0x4002_0000, 11, 0x4002_0800
LISR, LIFCR, SCR, NDTR, PAR, M0AR = 0x00, 0x08, 0x10, 0x14, 0x18, 0x1C
ON, TEIE, HTIE, TCIE, CIRCULAR = 1, 1 << 2, 1 << 3, 1 << 4, 1 << 8
HALF, FULL = 1 << 4, 1 << 5
REQUEST = 75
ERROR = 1 << 3
# What of DMA1's bus matrix is memory: AXI SRAM and SRAM1 to SRAM4. ITCM and DTCM are not there (RM0433, 2.1).
RING_MEMORY = [range(0x2400_0000, 0x2408_0000), range(0x3000_0000, 0x3004_8000), range(0x3800_0000, 0x3801_0000)]


class Dma(Registers):
    """Stream 0, which moves words from the DCMI into a ring."""

    def __init__(self, machine, mux):
        super().__init__(DMA1)
        self.machine, self.mux, self.total = machine, mux, 0

    def irqs(self):
        control, flags = self.values.get(SCR, 0), self.values.get(LISR, 0)
        asked = flags & HALF and control & HTIE or flags & FULL and control & TCIE or flags & ERROR and control & TEIE
        return {DMA_IRQ} if asked else set()

    def write(self, offset, value):
        """Stores a register. A length that is written while the stream is off becomes the ring's."""
        if offset == LIFCR:
            self.values[LISR] = self.values.get(LISR, 0) & ~value
            return
        if offset == NDTR:
            self.total = value
        super().write(offset, value)

    def take(self, data):
        """Writes words into the ring. Returns whether the stream is on. An address out of reach ends it (RM0433, errors
        of the DMA)."""
        wants = CIRCULAR | ON
        if self.values.get(SCR, 0) & wants != wants or self.mux.read(0) & 0x7F != REQUEST:
            return False
        if self.values.get(PAR) != DCMI + 0x28:
            raise ValueError("the DMA stream does not begin at the DCMI")
        first, last = self.values[M0AR], self.values[M0AR] + 4 * self.total - 1
        if not any(first in memory and last in memory for memory in RING_MEMORY):
            self.values[SCR] &= ~ON
            self.values[LISR] = self.values.get(LISR, 0) | ERROR
            return False
        if self.machine.keeps(first) or self.machine.keeps(last):
            raise ValueError("the DMA writes to memory of which the core keeps copies")
        half, words = self.total // 2, len(data) // 4
        done = 0
        while done < words:
            at = self.total - self.values[NDTR]
            run = min(words - done, half - at % half)
            self.machine.uc.mem_write(self.values[M0AR] + 4 * at, data[4 * done : 4 * (done + run)])
            done, at = done + run, at + run
            self.values[NDTR] = self.total - at % self.total
            if at % half == 0:
                self.values[LISR] = self.values.get(LISR, 0) | (HALF if at == half else FULL)
        return True


class Dcmi(Registers):
    """The camera interface."""

    BASE, IRQ = DCMI, DCMI_IRQ

    def __init__(self, dma, ports):
        super().__init__(self.BASE)
        self.ports = ports
        self.dma, self.capturing, self.row, self.rest = dma, False, 0, b""

    def reset(self):
        super().reset()
        self.capturing = False

    def irqs(self):
        return {self.IRQ} if self.values.get(RIS, 0) & self.values.get(IER, 0) else set()

    def write(self, offset, value):
        if offset == ICR:
            self.values[RIS] = self.values.get(RIS, 0) & ~value
            return
        super().write(offset, value)
        if offset == CR:
            self.capturing &= self.enabled()

    def _window(self):
        """Returns first and last line of the window, the clocks of a line before it, and those in it (RM0433,
        DCMI_CWSTRT)."""
        start, size = self.values.get(CWSTRT, 0), self.values.get(CWSIZE, 0)
        first = start >> 16 & 0x1FFF
        return first, first + (size >> 16 & 0x3FFF), start & 0x3FFF, (size & 0x3FFF) + 1

    def enabled(self):
        return bool(self.values.get(CR, 0) & ENABLE)

    def uses_frames(self):
        """Returns whether the next frame is captured, and not measured line by line."""
        wants = ENABLE | CAPTURE
        return not self.values.get(IER, 0) & LINE and self.values.get(CR, 0) & wants == wants

    def flag(self, flag):
        if self.enabled():
            self.values[RIS] = self.values.get(RIS, 0) | flag

    def sync(self):
        """Handles a vertical sync, which begins a frame."""
        if not self.ports.has_syncs():
            return
        self.flag(VSYNC)
        self.capturing = self.enabled() and bool(self.values.get(CR, 0) & CAPTURE)
        self.row, self.rest = 0, b""

    def line(self, bytes_of):
        """Handles the begin of a line, whose bytes are `bytes_of(row)`."""
        if not self.ports.has_syncs():
            return
        self.flag(LINE)
        control = self.values.get(CR, 0)
        row, self.row = self.row, self.row + 1
        first, last, before, count = self._window() if control & CROP else (0, row, 0, None)
        if not self.capturing or not first <= row <= last:
            return
        data, mask = bytes_of(row)[before:][:count], self.ports.mask()
        if mask != 0xFF:
            data = bytes(byte & mask for byte in data)
        if control & EVERY_SECOND_BYTE:
            data = data[1 if control & THE_SECOND else 0 :: 2]
        # The rest of a line goes on with the next one. That of a frame which is not whole words is left out.
        data = self.rest + data
        data, self.rest = data[: len(data) // 4 * 4], data[len(data) // 4 * 4 :]
        if not self.dma.take(data):
            self.flag(OVERRUN)


class Camera:
    """The pixels of a sensor that sees a clip of GREY frames. Its registers decide what of them is sent, and how.
    """

    def __init__(self, machine, sensor, dcmi, clip, size, clock, faults=()):
        self.machine, self.sensor, self.dcmi, self.clip, self.faults = machine, sensor, dcmi, clip, dict(faults)
        self.size, self.clock = size, clock
        self.frame, self.began, self.nominal = None, None, None
        self.machine.at(machine.now, self._begin)

    @property
    def period(self):
        """Returns the cycles of a frame."""
        return round(self.clock * self.sensor.period())

    @property
    def line_time(self):
        """Returns the cycles from a line to the next. Of the time between frames, that of eight comes before the first
        line. Settings that are wrong may leave less time.
        """
        return min(round(self.clock * self.sensor.row()), self.period // (self.sensor.size()[1] + 15))

    def is_over(self):
        """Returns whether the clip has been sent, and one more frame time has passed."""
        return self.frame is not None and self.frame > len(self.clip)

    def _begin(self):
        """Begins a frame time. Those of the clip are planned from its start, so that nothing drifts, and a sensor that
        ran at another rate in between sends nothing until the next of them begins.
        """
        begins, period, line_time = self.machine.now, self.period, self.line_time
        if self.began is None and self.dcmi.uses_frames():
            self.began, self.nominal, self.frame = begins, period, -1
        on_time, fault = True, None
        if self.began is None or period != self.nominal:
            self.machine.at(begins + period, self._begin)
        else:
            self.machine.at(begins + period - (begins - self.began) % period, self._begin)
            on_time = (begins - self.began) % period == 0
        if self.began is not None and (begins - self.began) // self.nominal != self.frame:
            self.frame = (begins - self.began) // self.nominal
            fault = self.faults.get(self.frame)
            fault = fault() if callable(fault) else fault
        self.sensor.begin_frame()
        if not self.sensor.drives() or fault == "silent" or not on_time:
            return
        if fault != "lost sync":
            self.dcmi.sync()
        picture = self.clip[self.frame] if self.frame is not None and self.frame < len(self.clip) else None
        lines = self.sensor.size()[1]
        for row in range(lines):
            if fault == "sync inside" and row == lines // 2:
                self.machine.at(begins + (8 + row) * line_time, self.dcmi.sync)
                break
            if fault == "overrun" and row == lines // 3:
                self.machine.at(begins + (8 + row) * line_time, lambda: self.dcmi.flag(OVERRUN))
            self.machine.at(begins + (8 + row) * line_time, lambda: self._line(picture))

    def _line(self, picture):
        if self.sensor.drives():
            self.dcmi.line(lambda row: self.sensor.line(picture, row, self.size))
