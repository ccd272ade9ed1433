"""The sensors: what their registers make of the pins.

The registers and bits are those of public drivers and of quotes of OmniVision's data sheets, not those of the
firmware's tables: Linux drivers of the OV7670, OV7690 and OV772x, MediaTek's and Analog Devices' drivers of the OV7692,
OpenMV's drivers of the OV7670, OV7690, OV7725 and HM0360, Zephyr's of the HM0360, and Adafruit's of the OV7670. What
none of them says is a guess, and the comment says so.

A clip is what the sensor sees with the exposure `nominal`, in lines, and gain 1. Wrong lights change its luma, wrong
sizes cut or enlarge it, and a wrong format gives other bytes.
"""

from functools import lru_cache

XCLK = 24_000_000
GREY_CHROMA = 0x80


class Sensor:
    """A sensor behind a bus with registers of eight bits.

    `is_on` returns whether the board gives it power and a clock, `present` is whether it answers, `nack_after` is how
    often it answers before it fails once, and `stuck` is a register that keeps its value. `pulls_up` is whether
    resistors outside of the chip pull its bus up, and `shorted` has the pins of the bus that are held low for ever.
    `deaf` is whether it sends frames but does not answer, and `holds` is the number of clocks for which it holds the
    data line. `slips` has registers that act as if another value were written, although the value that was written is
    read back: so a table with that value in it would act. `now` returns the seconds of its board.

    Each sensor defines, of what is sent: `drives`, whether VSYNC, HREF and PCLK are driven; `period`, the seconds of a frame;
    `row`, the seconds from a row to the next; `size`, pixels per line and lines; `format`, the bytes of a pixel pair, such as
    "YUYV", or "RGB", or "RAW"; `chroma`, U and V if they are fixed; `light`, the table from the clip's luma to the sensor's,
    or None if it is the same; `view`, whether the picture is mirrored and turned over, and how far it is shifted.
    """

    ADDRESS, IDENTITY, DEFAULTS, RESET = 0, {}, {}, (0x12, 0x80)
    # The register and the bits that switch automatic controls on, and what each changes: (bit, registers).
    SWITCHES, AUTOMATIC = (0x13, 7), ()
    # The exposure with which a clip is as it is, in lines.
    NOMINAL = 480

    def __init__(self, address=None, identity=None):
        self.address = self.ADDRESS if address is None else address
        self.identity = self.IDENTITY if identity is None else identity
        self.present, self.resets, self.nack_after, self.stuck, self.slips = True, 0, None, None, {}
        self.holds, self.deaf, self.nominal = 0, False, self.NOMINAL
        self.pulls_up, self.shorted = True, ()
        self.is_on, self.now = lambda: True, lambda: 0
        self.pointer, self.written, self.history, self.dark = 0, [], [], None
        self.power_on()

    def power_on(self):
        """Sets all registers to their defaults."""
        self.registers = {**self.DEFAULTS, **self.identity}

    def answers(self, reads):
        """Returns whether it acknowledges its address. It does not accept a repeated start."""
        if self.nack_after == 0:
            self.nack_after = None
            return False
        if self.nack_after is not None:
            self.nack_after -= 1
        self.written = [] if not reads else self.written
        return self.present and self.is_on() and not self.deaf

    def write(self, value):
        """Accepts a byte."""
        self.written.append(value)

    def read(self):
        """Returns the register whose address was written before the last stop."""
        return self.registers.get(self._place(self.pointer), 0)

    def stop(self):
        """Ends a transfer of an address, or of an address and a value."""
        if self.written:
            self.pointer = self.written[0]
        if len(self.written) == 2:
            self._set(*self.written)
        self.written = []

    def _place(self, register):
        return register

    def _set(self, register, value):
        place = self._place(register)
        if (place, value) == self.RESET:
            self.resets += 1
            self.history = []
            self.power_on()
        elif place not in self.identity:
            self.history.append((place, value))
            if place != self.stuck:
                self.registers[place] = value

    def __getitem__(self, place):
        """Returns the value that a register acts by."""
        if place in self.slips and any(at == place for at, _ in self.history):
            return self.slips[place]
        return self.registers.get(place, 0)

    def number(self, high, low, bits):
        """Returns a number of two registers, of which the high one has this many bits."""
        return (self[high] & (1 << bits) - 1) << 8 | self[low]

    def drives_data(self):
        """Returns whether the data pins are driven."""
        return True

    def readout_ms(self):
        """Returns the milliseconds from the first row of what is sent to the last."""
        return 1000 * self.row() * (self.size()[1] - 1)

    def bytes_per_line(self):
        """Returns the bytes of a line."""
        return self.size()[0] * (1 if self.format() == "RAW" else 2)

    def bars(self):
        """Returns whether color bars hide the picture."""
        return False

    def automatic(self):
        """Returns the bits of the automatic controls that are on."""
        return self[self.SWITCHES[0]] & self.SWITCHES[1]

    def acts(self):
        """Returns all that the registers do, in comparable parts."""
        if not self.drives():
            return {"pins": "silent"}
        return {
            "pins": "all" if self.drives_data() else "no data",
            "rate": round(1 / self.period(), 2),
            "size": (self.bytes_per_line(), self.size()[1]),
            "format": self.format(),
            # A difference of 2 is within what a byte may differ by.
            "chroma": self.chroma() is not None and all(abs(value - GREY_CHROMA) <= 2 for value in self.chroma()),
            "automatic": self.automatic(),
            "light": self.light(),
            "view": self.view(),
            "picture": "bars" if self.bars() else "scene",
        }

    def begin_frame(self):
        """Lets the automatic controls act: they look for another light, and their registers show it."""
        self.dark = None
        for bit, high, low in self.AUTOMATIC:
            if self.automatic() & bit:
                value = (self.registers.get(high, 0) << 8 | self.registers.get(low, 0)) + 1 if high else None
                if high:
                    self.registers[high], self.registers[low] = value >> 8 & 0xFF, value & 0xFF
                else:
                    self.registers[low] = self.registers.get(low, 0) + 1 & 0x0F | self.registers.get(low, 0) & 0xF0

    def line(self, picture, row, clip_size):
        """Returns the bytes of a line; `picture` has the clip's frame of GREY pixels, or None in the dark."""
        if picture is None and self.dark is not None:
            return self.dark
        line = self._line(picture, row, clip_size)
        if picture is None:
            self.dark = line
        return line

    def _line(self, picture, row, clip_size):
        wide, high = self.size()
        width, height = clip_size
        mirrored, turned, right, down = self.view()
        if self.bars():
            luma = bytes(235 - 31 * (x * 8 // wide) for x in range(wide))
        elif picture is None:
            luma = bytes(wide)
        elif (wide, high) == clip_size and self.view() == (False, False, 0, 0):
            luma = picture[row * width : (row + 1) * width]
        else:
            y = ((high - 1 - row if turned else row) + down) % high * height // high
            # A line that is not scaled shows the left part of a larger picture.
            x_of = [(wide - 1 - x if mirrored else x) + right for x in range(wide)]
            luma = bytes(picture[y * width + x % wide * width // wide] for x in x_of)
        table = self.light()
        data, length = self._bytes(luma.translate(table) if table else luma), self.bytes_per_line()
        # A clock that is too fast sends bytes again.
        return (data * -(-length // max(len(data), 1)))[:length] if self.drives_data() else bytes(length)

    def _bytes(self, luma):
        kind = self.format()
        if kind == "RAW":
            return luma
        line = bytearray(2 * len(luma))
        if kind == "RGB":
            line[0::2] = bytes(y & 0xF8 | y >> 5 for y in luma)
            line[1::2] = bytes((y & 0x1C) << 3 | y >> 3 for y in luma)
            return bytes(line)
        first = 0 if kind == "YUYV" else 1
        line[first::2] = luma
        # A chroma that must not matter, where it is not fixed.
        chroma = bytes(self.chroma() or ((74 * x + 11) & 0xFF for x in range(len(luma))))
        line[1 - first :: 2] = (chroma * len(luma))[: len(luma)]
        return bytes(line)


@lru_cache
def curve(scale, knots, slope):
    """Returns the table of a scale and a curve of outputs at fixed inputs, or None if it changes nothing."""
    inputs = (0, 4, 8, 16, 32, 40, 48, 56, 64, 72, 80, 96, 112, 144, 176, 208)
    outputs = (0, *knots)

    def bend(value):
        for (a, b), (c, d) in zip(zip(inputs, inputs[1:]), zip(outputs, outputs[1:])):
            if value <= b:
                return c + (value - a) * (d - c) / (b - a)
        return outputs[-1] + (value - inputs[-1]) * 0.75 * slope / 48

    table = bytes(min(255, max(0, round(bend(min(255.0, value * scale))))) for value in range(256))
    return None if table == bytes(range(256)) else table


STRAIGHT = (4, 8, 16, 32, 40, 48, 56, 64, 72, 80, 96, 112, 144, 176, 208)
GAMMA_AT_RESET = (11, 21, 42, 81, 99, 116, 131, 145, 158, 170, 190, 206, 229, 243, 251)


def doublings(value):
    """Returns the gain of a register whose high bits double it, one each, and whose low four bits add sixteenths."""
    return 2 ** bin(value >> 4).count("1") * (1 + (value & 15) / 16)


class WordSensor(Sensor):
    """A sensor whose registers have addresses of 16 bits, the high byte first. It accepts a repeated start."""

    RESET = (0x0103, 0x01)

    def stop(self):
        """Ends a transfer of an address, and of values for the registers from there on."""
        self._point()
        for value in self.written:
            self._set(self.pointer, value)
            self.pointer += 1
        self.written = []

    def read(self):
        """Returns the register at the address that was written, which moves on."""
        self._point()
        value = self.registers.get(self.pointer, 0)
        self.pointer += 1
        return value

    def _point(self):
        if len(self.written) >= 2:
            self.pointer = int.from_bytes(self.written[:2], "big")
            del self.written[:2]


class Ov7690(Sensor):
    ADDRESS, IDENTITY = 0x21, {0x0A: 0x76, 0x0B: 0x91, 0x1C: 0x7F, 0x1D: 0xA2}
    DEFAULTS = {
        0x01: 0x40, 0x02: 0x40, 0x03: 0x40, 0x0C: 0x16, 0x0E: 0x00, 0x0F: 0x01, 0x10: 0x00, 0x11: 0x00, 0x12: 0x00,
        0x13: 0xF7, 0x15: 0x00, 0x16: 0x03, 0x17: 0x69, 0x18: 0xA4, 0x19: 0x0C, 0x1A: 0xF6, 0x29: 0x50, 0x2A: 0x30,
        0x2B: 0x08, 0x3E: 0x20, 0x81: 0x41, 0x82: 0x00, 0xC8: 0x02, 0xC9: 0x80, 0xCA: 0x01, 0xCB: 0xE0, 0xCC: 0x02,
        0xCD: 0x80, 0xCE: 0x01, 0xCF: 0xE0, 0xDA: 0x80, 0xDB: 0x80,
        **{0xA3 + k: value for k, value in enumerate(GAMMA_AT_RESET)}, 0xB2: 0x06,
    }  # fmt: skip
    AUTOMATIC = ((1, 0x0F, 0x10), (2, 0, 0x02), (4, 0, 0x00))

    def drives(self):
        """Returns whether VSYNC, HREF and PCLK are driven: 0x0C bit 1, and 0x0E bit 3 is sleep."""
        return self.present and self.is_on() and bool(self[0x0C] & 2) and not self[0x0E] & 8

    def drives_data(self):
        return bool(self[0x0C] & 4)

    def clock(self):
        """Returns pixels per second. PCLK is twice that in YUV and RGB: f / 2 if 0x3E bit 4 is set, f / 4 if not."""
        multiplier = (1, 4, 6, 8)[self[0x29] >> 4 & 3]
        divider = 1 if self[0x11] & 0x40 else (self[0x11] & 0x3F) + 1
        return XCLK * multiplier / ((self[0x29] >> 6) + 1) / divider / 4

    def lines(self):
        """Returns the lines of a frame, whatever the scaler makes of them: 516 at reset, half of them in skip mode."""
        more = ((self[0x2A] & 0x0F) << 8 | self[0x2C]) + (self[0x2D] | self[0x2E] << 8)
        return (258 if self[0x12] & 0x40 else 516) + more

    def period(self):
        """Returns the seconds of a frame, of which a line has 776 pixels at reset."""
        night = {0: 1, 1: 2, 2: 3, 3: 4}.get(self[0x15] >> 4 & 7, 8) if self[0x15] & 0x80 else 1
        return night * self.array_line() * self.lines()

    def array_line(self):
        return max((self[0x2A] & 0x70) << 4 | self[0x2B], 1) / self.clock()

    def row(self):
        return self.array_line() * self.number(0xCA, 0xCB, 1) / self.size()[1]

    def size(self):
        """Returns the size behind the scaler: what goes in where it is off, which is at reset."""
        window = (self[0x18] * 4 + (self[0x16] >> 5 & 2), self[0x1A] * 2 // (2 if self[0x12] & 0x40 else 1))
        wanted = (self.number(0xC8, 0xC9, 2), self.number(0xCA, 0xCB, 1))
        out = (self.number(0xCC, 0xCD, 2), self.number(0xCE, 0xCF, 1))
        sent = []
        for axis, bit in ((0, 4), (1, 8)):
            fed = min(window[axis], wanted[axis])
            scaled = self[0x81] & bit and out[axis] <= wanted[axis]
            # The scaler's factor follows from the two sizes; it stops where its input does.
            sent.append(fed * out[axis] // max(1, wanted[axis]) if scaled else fed)
        return max(4, sent[0] & ~1), max(1, sent[1])

    def format(self):
        """Returns the format: 0x12 bits 5-0 with 0x82, and the order of 0x0C bit 4."""
        kind = self[0x12] & 3
        if self[0x82] & 3 != 3 or self[0x12] & 0x30 or kind in (1, 3):
            return "RAW"
        if kind == 2:
            return "RGB"
        return "YUYV" if self[0x0C] & 0x10 else "UYVY"

    def bytes_per_line(self):
        """Returns the bytes of a line: half of them are lost if PCLK is not doubled."""
        return super().bytes_per_line() // (1 if self._is_doubled() or self.format() == "RAW" else 2)

    def _is_doubled(self):
        return bool(self[0x3E] & 0x10)

    def chroma(self):
        return (self[0xDA], self[0xDB]) if self[0x81] & 0x20 and self[0xD2] & 0x18 == 0x18 else None

    def light(self):
        lines = min(self.number(0x0F, 0x10, 8), self.lines() - 4)
        gain = doublings(self[0x00]) * (1, 2, 2, 4)[self[0x15] & 3]
        white = (0.114 * self[0x01] + 0.299 * self[0x02] + 0.587 * self[0x03]) / 0x40
        # Contrast and brightness at their defaults are a guess: half of the light.
        effect = 0.5 if self[0x81] & 0x20 and self[0xD2] & 4 else 1
        knots = tuple(self[0xA3 + k] for k in range(15))
        return curve(round(lines / self.nominal * gain * white * effect, 6), knots, self[0xB2])

    def view(self):
        """Returns how the picture lies. 0x17 and 0x19 shift it, and how far is a guess."""
        right, down = self[0x17] - 0x69, self[0x19] - 0x0C
        return bool(self[0x0C] & 0x40), bool(self[0x0C] & 0x80), right, down

    def bars(self):
        return bool(self[0x0C] & 1 or self[0x82] & 8)


class Ov7692(Ov7690):
    """OV7692: a MIPI sensor with a parallel port, whose registers have two banks."""

    ADDRESS, IDENTITY = 0x3C, {0x0A: 0x76, 0x0B: 0x92, 0x1C: 0x7F, 0x1D: 0xA2}
    DEFAULTS = {
        **Ov7690.DEFAULTS, 0x13: 0xE5, 0x31: 0x83, 0x37: 0x0C, 0x5E: 0x00, 0x64: 0x11, 0x1B5: 0x70, 0x0FF: 0x00,
    }  # fmt: skip

    def _place(self, register):
        """Returns the place of a register: those of bank 1 are 0x100 higher, and 0xFF is in both."""
        return register + 0x100 if register != 0xFF and self.registers.get(0xFF) == 1 else register

    def drives(self):
        """Returns whether the parallel port is driven: MIPI must be off, and the registers at bank 0."""
        return super().drives() and not self[0x1B5] & 0x40

    def _is_doubled(self):
        """Returns whether PCLK has room for two bytes: 0x37 bits 3-2 divide it, and 0 does not."""
        return self[0x37] & 0x0C in (0, 4)

    def clock(self):
        """Returns pixels per second. 0x31 bits 1-0 divide the PLL's loop; what 3 and 2 differ in is a guess."""
        return super().clock() * (2 if self[0x31] & 3 < 2 else 1)


class Ov7725(Sensor):
    ADDRESS, IDENTITY = 0x21, {0x0A: 0x77, 0x0B: 0x21, 0x1C: 0x7F, 0x1D: 0xA2}
    DEFAULTS = {
        0x01: 0x80, 0x02: 0x80, 0x03: 0x80, 0x08: 0x00, 0x0C: 0x10, 0x0D: 0x41, 0x0E: 0x01, 0x10: 0x40, 0x11: 0x80,
        0x12: 0x00, 0x13: 0x8F, 0x17: 0x26, 0x18: 0xA0, 0x19: 0x07, 0x1A: 0xF0, 0x29: 0xA0, 0x2C: 0xF0, 0x46: 0x00,
        0x60: 0x80, 0x61: 0x80, 0x64: 0x1F, 0x65: 0x20, 0xA6: 0x00, 0xAC: 0xFF,
    }  # fmt: skip
    AUTOMATIC = ((1, 0x08, 0x10), (2, 0, 0x02), (4, 0, 0x00))

    def drives(self):
        """Returns whether the port is driven: 0x09 bit 4 is sleep. Its pins are tri-stated only in power-down."""
        return self.present and self.is_on() and not self[0x09] & 0x10

    def lines(self):
        """Returns the lines of a frame: 510 for VGA, and 278 for QVGA."""
        return (278 if self[0x12] & 0x40 else 510) + (self[0x2D] | self[0x2E] << 8) + (self[0x33] | self[0x34] << 8)

    def period(self):
        """Returns the seconds of a frame, of which a line has 784 pixels for VGA, and 576 for QVGA, each two clocks."""
        night = {0: 1, 1: 2, 2: 4, 3: 8}[self[0x0E] >> 4 & 3] if self[0x0E] & 0x80 else 1
        return night * self.array_line() * self.lines()

    def array_line(self):
        multiplier = (1, 4, 6, 8)[self[0x0D] >> 6]
        divider = 1 if self[0x11] & 0x40 else 2 * ((self[0x11] & 0x3F) + 1)
        pixels = (576 if self[0x12] & 0x40 else 784) + (self[0x2B] | (self[0x2A] & 0xF0) << 4)
        return pixels * 2 * divider / (XCLK * multiplier)

    def row(self):
        return self.array_line() * 2 * self[0x1A] / self.size()[1]

    def size(self):
        half = 2 if self[0x12] & 0x40 else 1
        window = (self[0x18] * 4 + (self[0x32] & 3), self[0x1A] * 2 + (self[0x32] >> 2 & 1))
        array = (640 // half, 480 // half)
        out = (self[0x29] * 4 + (self[0x2A] & 3), self[0x2C] * 2 + (self[0x2A] >> 2 & 1))
        sent = []
        # Whole factors and zoom each have a switch, and both follow the sizes only where 0xAC says so.
        for axis, whole, zoom in ((0, 4, 1), (1, 8, 2)):
            fed = min(window[axis], array[axis])
            ratio = out[axis] / array[axis]
            fits = self[0x65] & whole and self[0xAC] & 8 and ratio in (0.5, 0.25, 0.125)
            fits = fits or (self[0x65] & whole and self[0x65] & zoom and self[0xAC] & 0x0C == 0x0C and ratio <= 1)
            sent.append(int(fed * ratio) if fits else min(fed, out[axis]) if ratio == 1 else fed)
        return max(4, sent[0] & ~1), max(1, sent[1])

    def format(self):
        """Returns the format: 0x12 bits 1-0, and the order of 0x0C bit 4."""
        kind = self[0x12] & 3
        if kind in (1, 3) or self[0x12] & 0x10 or self[0x67] & 2:
            return "RAW"
        if kind == 2:
            return "RGB"
        return "YUYV" if self[0x0C] & 0x10 else "UYVY"

    def chroma(self):
        return (self[0x60], self[0x61]) if self[0x64] & 0x20 and self[0xA6] & 0x18 == 0x18 else None

    def light(self):
        lines = min(self.number(0x08, 0x10, 8), self.lines() - 4)
        white = (0.114 * self[0x01] + 0.299 * self[0x02] + 0.587 * self[0x03]) / 0x80
        effect = 0.5 if self[0x64] & 0x20 and self[0xA6] & 0x64 else 1
        lens = 1.1 if self[0x46] & 1 else 1
        knots, slope = (GAMMA_AT_RESET, 0x06) if self[0x64] & 4 else (STRAIGHT, 64)
        return curve(round(lines / self.nominal * doublings(self[0x00]) * white * effect * lens, 6), knots, slope)

    def view(self):
        """Returns how the picture lies. How far 0x17, 0x19 and 0x32 shift it is a guess; where windows begin is not
        (OpenMV)."""
        first, top = (0x3F, 0x03) if self[0x12] & 0x40 else (0x22, 0x07)
        right = (self[0x17] - first) * 4 + (self[0x32] >> 4 & 3)
        down = (self[0x19] - top) * 2 + (self[0x32] >> 6 & 1)
        return bool(self[0x0C] & 0x40), bool(self[0x0C] & 0x80), right, down

    def bars(self):
        return bool(self[0x0C] & 1 or self[0x66] & 0x20)


class Ov7670(Sensor):
    """OV7670. A line takes 784 pixels of two clocks, and a frame 510 lines, whatever the scaler makes of them."""

    ADDRESS, IDENTITY = 0x21, {0x0A: 0x76, 0x0B: 0x73, 0x1C: 0x7F, 0x1D: 0xA2}
    DEFAULTS = {
        0x00: 0x00, 0x01: 0x80, 0x02: 0x80, 0x0D: 0x40, 0x0E: 0x01, 0x0F: 0x43, 0x10: 0x40, 0x11: 0x80, 0x13: 0x8F,
        0x14: 0x4A, 0x17: 0x11, 0x18: 0x61, 0x19: 0x03, 0x1A: 0x7B, 0x1E: 0x00, 0x32: 0x80, 0x3A: 0x0D, 0x3C: 0x68,
        0x3D: 0x88, 0x3E: 0x00, 0x40: 0xC0, 0x41: 0x10, 0x56: 0x40, 0x57: 0x80, 0x67: 0x80, 0x68: 0x80, 0x6B: 0x0A,
        0x70: 0x3A, 0x71: 0x35, 0x72: 0x11, 0x73: 0x00, 0x74: 0x00,
        **{0x7B + k: value for k, value in enumerate(GAMMA_AT_RESET)}, 0x7A: 0x24, 0xA2: 0x02,
    }  # fmt: skip
    AUTOMATIC = ((1, 0x07, 0x10), (2, 0, 0x02), (4, 0, 0x00))
    PIXELS, LINES, ARRAY = 784, 510, (640, 480)

    def drives(self):
        """Returns whether frames come with their pixels: 0x09 bit 4 is sleep, and a VSYNC of the other polarity ends
        them."""
        return self.present and self.is_on() and not self[0x09] & 0x10 and not self[0x15] & 2

    def drives_data(self):
        """Returns whether the data is right when it is taken: a clock of the other polarity changes it then."""
        return not self[0x15] & 0x10

    def lines(self):
        """Returns the lines of a frame. The two pairs of registers both add some."""
        return self.LINES + (self[0x2D] | self[0x2E] << 8) + (self[0x92] | self[0x93] << 8)

    def array_line(self):
        """Returns the seconds of a line of the array. A divider of 1 divides by 2, which Linux's driver has
        measured."""
        multiplier = (1, 4, 6, 8)[self[0x6B] >> 6]
        divider = 1 if self[0x11] & 0x40 else max((self[0x11] & 0x3F) + 1, 2)
        return 2 * (self.PIXELS + (self[0x2B] | (self[0x2A] & 0xF0) << 4)) * divider / (XCLK * multiplier)

    def period(self):
        """Returns the seconds of a frame. In the dark, more frame times belong to each."""
        night = (1, 2, 4, 8)[self[0x3B] >> 5 & 3] if self[0x3B] & 0x80 else 1
        return night * self.array_line() * self.lines()

    def row(self):
        return self.array_line() * (self._fraction(4) if self._is_scaled() else 1)

    def _is_scaled(self):
        return bool(self[0x0C] & 4)

    def _fraction(self, bit):
        return 1 << (self[0x72] >> bit & 3)

    def size(self):
        """Returns the size behind the scaler: 0x12 chooses CIF and QCIF, unless 0x3E says that the scaler is set by
        hand."""
        left, right = self[0x17] << 3 | self[0x32] & 7, self[0x18] << 3 | self[0x32] >> 3 & 7
        top, bottom = self[0x19] << 2 | self[0x03] & 3, self[0x1A] << 2 | self[0x03] >> 2 & 3
        wide, high = (right - left) % self.PIXELS, max(bottom - top, 1)
        if self[0x12] & 0x28 and not self[0x3E] & 8:
            wide, high = (352, 288) if self[0x12] & 0x20 else (176, 144)
        elif self._is_scaled():
            wide, high = wide // self._fraction(0), high // self._fraction(4)
        elif self[0x12] & 0x10 and not self[0x3E] & 8:
            wide, high = wide // 2, high // 2
        # An HSYNC in place of HREF also comes in lines without pixels, and an HREF of the other polarity is high there.
        if self[0x15] & 0x40:
            high = self.lines()
        if self[0x15] & 8:
            wide = self.PIXELS // self._fraction(0) - wide
        # Codes before and behind the pixels take the place of four of them.
        return max(4, wide + (4 if self[0x04] & 0x40 else 0) & ~1), max(1, high)

    def bytes_per_line(self):
        """Returns the bytes of a line. The scaled picture has a clock of its own; too slow a one loses bytes, and too
        fast a one repeats them. What a picture looks like whose clock is not that of its scaler is a guess.
        """
        divided = 1 << min(self[0x3E] & 7, 4) if self[0x3E] & 0x10 else 1
        wanted = self._fraction(0) if self._is_scaled() else 1
        inner = 1 if self[0x73] & 8 else 1 << min(self[0x73] & 7, 4)
        shown = super().bytes_per_line() * wanted // divided
        return shown if not self._is_scaled() or inner == wanted else shown * wanted // inner

    def format(self):
        """Returns the format: 0x12 bits 2 and 0, and the order of 0x3A bit 3."""
        kind = self[0x12] & 5
        if kind & 1:
            return "RAW"
        if kind == 4:
            return "RGB"
        return "UYVY" if self[0x3A] & 8 else "YUYV"

    def chroma(self):
        return (self[0x67], self[0x68]) if self[0x3A] & 0x10 else None

    def light(self):
        """Returns the table of exposure, gains and gamma. How much contrast and brightness change is a guess."""
        lines = min((self[0x07] & 0x3F) << 10 | self[0x10] << 2 | self[0x04] & 3, self.lines() - 4)
        gain = doublings(self[0x00]) * (1, 2, 2, 4)[self[0x03] >> 6]
        if self[0x41] & 8:
            gain *= (0.114 * self[0x01] + 0.299 * self[0x02] + 0.587 * self[0x6A]) / 0x40
        gain *= (1, 1, 2, 4)[self[0x74] & 3] if self[0x74] & 0x10 else 1
        gain *= self[0x56] / 0x40 * (1 + (self[0x55] & 0x7F) / 256)
        gain *= (1.1 if self[0x66] & 1 else 1) * (1 + self[0x69] / 256)
        gain *= {0: 0.875, 2: 0.99, 3: 1}.get(self[0x40] >> 6, 0.875)
        # A center of contrast other than the middle moves the light, and so does a negative.
        gain *= 1 - abs(self[0x57] - 0x80) / 512
        gain *= 0.5 if self[0x3A] & 0x20 else 1
        curved = self[0x3D] & 0x80
        knots = tuple(self[0x7B + k] for k in range(15)) if curved else STRAIGHT
        return curve(round(lines / self.nominal * gain, 6), knots, self[0x7A] if curved else 64)

    def view(self):
        """Returns how the picture lies. The window's first column and line shift it."""
        right = (self[0x17] << 3 | self[0x32] & 7) - 168
        down = (self[0x19] << 2 | self[0x03] & 3) - 10
        return bool(self[0x1E] & 0x20), bool(self[0x1E] & 0x10), right // 2, down // 2

    def bars(self):
        return bool(self[0x12] & 2 or self[0x42] & 8 or (self[0x70] | self[0x71]) & 0x80)


class Hm0360(WordSensor):
    """HM0360: gray pixels. `halves` is whether a pixel takes two of the clocks that OpenMV's driver counts, so that its
    rates are those that the same driver sets.
    """

    ADDRESS, IDENTITY, halves = 0x24, {0x0000: 0x03, 0x0001: 0x60}, True
    DEFAULTS = {
        0x0100: 0x00, 0x0202: 0x01, 0x0203: 0x08, 0x020E: 0x01, 0x0300: 0x08, 0x0340: 0x02, 0x0341: 0x14, 0x0342: 0x03,
        0x0343: 0x00, 0x2000: 0x5F,
    }  # fmt: skip
    SWITCHES, AUTOMATIC = (0x2000, 1), ((1, 0x0202, 0x0203),)

    def drives(self):
        return self.present and self.is_on() and bool(self[0x0100] & 1)

    def _is_noise(self):
        """Returns whether the data is taken while it changes: a rising edge is Zephyr's name of bit 0."""
        return bool(self[0x3112] & 1)

    def lines(self):
        """Returns the lines of a frame, which has some more than rows."""
        return max(self.number(0x0340, 0x0341, 8), self.size()[1] + 16)

    def row(self):
        """Returns the seconds of a line, each of which is sent."""
        clock = XCLK / (1 << (self[0x0300] & 3)) / (2 if self.halves else 1)
        return max(self.number(0x0342, 0x0343, 8), self.size()[0]) / clock

    def period(self):
        return self.row() * self.lines()

    def size(self):
        """Returns the window, of which every second or fourth column and row is sent."""
        window = (640, 480) if self[0x3030] & 1 else (656, 496)
        return window[0] >> (self[0x0380] & 3), window[1] >> (self[0x0381] & 3)

    def format(self):
        """Returns the format: gray pixels come as raw ones do."""
        return "RAW"

    def bytes_per_line(self):
        """Returns the bytes of a line. Other values of 0x310F are for fewer wires, which is a guess: a pixel takes more
        clocks."""
        return self.size()[0] * (1, 2, 8, 8)[self[0x310F] & 3]

    def chroma(self):
        """Returns that there is none."""

    def light(self):
        """Returns the table of exposure, gains and curve. What curve it is, is a guess."""
        lines = min(self.number(0x0202, 0x0203, 8), self.lines() - 4)
        gain = (1 << (self[0x0205] >> 4 & 7)) * self.number(0x020E, 0x020F, 8) / 256
        knots, slope = (GAMMA_AT_RESET, 0x06) if self[0x102F] & 1 else (STRAIGHT, 64)
        return curve(round(lines / self.nominal * gain, 6), knots, slope)

    def view(self):
        return bool(self[0x0101] & 1), bool(self[0x0101] & 2), 0, 0

    def bars(self):
        """Returns whether a test picture or noise hides the scene."""
        return bool(self[0x0601] & 1) or self._is_noise()


class Hm01b0(WordSensor):
    """HM01B0 with eight wires: gray pixels with a border. Its registers are those of the drivers that
    tests/pico/sensor.mjs names.
    """

    ADDRESS, IDENTITY = 0x24, {0x0000: 0x01, 0x0001: 0xB0}
    DEFAULTS = {
        0x0202: 0x01, 0x0203: 0x08, 0x020E: 0x01, 0x0340: 0x02, 0x0341: 0x32, 0x0342: 0x01, 0x0343: 0x72, 0x0383: 0x01,
        0x0387: 0x01, 0x1000: 0x01, 0x1003: 0x20, 0x1007: 0x20, 0x2100: 0x01, 0x3011: 0x70, 0x3022: 0x02, 0x3023: 0x02,
        0x3059: 0x02, 0x3060: 0x0A, 0x3068: 0x20,
    }  # fmt: skip
    SWITCHES, AUTOMATIC = (0x2100, 1), ((1, 0x0202, 0x0203),)
    # The oscillator inside, which is a guess; the shortest line, and how many more lines a frame has than rows.
    OSCILLATOR, SHORTEST_LINE, FEWEST_BLANK, BORDER = 10_000_000, 369, 16, 2

    def drives(self):
        """Returns whether all frames come: in mode 3 some do, and 0x3064 bit 2 waits for a trigger."""
        return self.present and self.is_on() and self[0x0100] & 7 == 1 and not self[0x3064] & 4

    def drives_data(self):
        """Returns whether the data is right when it is taken: a clock of the other polarity changes it then."""
        return not self[0x3068] & 1

    def lines(self):
        return max(self.number(0x0340, 0x0341, 8), self.size()[1] + self.FEWEST_BLANK)

    def row(self):
        """Returns the seconds of a line, each of which is sent."""
        clock = (self.OSCILLATOR if self[0x3067] & 1 else XCLK) / (8, 4, 2, 1)[self[0x3060] & 3]
        return max(self.number(0x0342, 0x0343, 8), self.SHORTEST_LINE) / clock

    def period(self):
        """Returns the seconds of a frame. One whose exposure does not fit takes several."""
        return self.row() * self.lines() * max(1, -(-(self.number(0x0202, 0x0203, 8) + 2) // self.lines()))

    def readout_ms(self):
        """Returns the milliseconds from the first row inside the border to the last."""
        return 1000 * self.row() * (self.size()[1] - 2 * self.BORDER - 1)

    def size(self):
        """Returns columns and rows: of the array or its window, or half of both."""
        columns, rows = (2 if self[register] & 3 == 3 else 1 for register in (0x0383, 0x0387))
        return 324 // columns, (244 if self[0x3010] & 1 else 324) // rows

    def format(self):
        """Returns the format: gray pixels come as raw ones do, or as numbers of six bits."""
        return "SHORT" if self[0x3011] & 1 else "RAW"

    def bytes_per_line(self):
        """Returns the bytes of a line's pixels. With fewer wires, one takes more clocks."""
        return self.size()[0] * (8 if self[0x3059] & 0x20 else 2 if self[0x3059] & 0x40 else 1)

    def early(self):
        """Returns the clocks before the pixels of a line, while HREF is high: unless the clock runs only with pixels.
        The firmware measures and leaves them out.
        """
        return 0 if self[0x3060] & 0x20 else max(0, (self[0x3023] & 0x1F) - (self[0x1012] >> 1 & 1))

    def chroma(self):
        """Returns that there is none."""

    def light(self):
        """Returns the table of exposure and gains. What black levels and binning change is a guess."""
        lines = min(self.number(0x0202, 0x0203, 8), self.lines() - 2)
        gain = 2 ** (self[0x0205] >> 4 & 7) * ((self[0x020E] & 3) << 6 | self[0x020F] >> 2) / 0x40
        gain *= (2 if self[0x0390] & 1 else 1) * (2 if self[0x0390] & 2 else 1)
        black = (self[0x1003] if self[0x1000] & 1 else 16) + (self[0x1007] if self[0x1006] & 1 else 16)
        return curve(round(lines / self.nominal * gain * (1 + (black - 16) / 512), 6), STRAIGHT, 64)

    view = Hm0360.view

    def bars(self):
        """Returns whether a test picture or repaired pixels hide the scene."""
        return bool(self[0x0601] & 1 or self[0x1008] & 1)

    def _shown(self, picture, row, clip_size):
        """Returns the pixels of a line: of walking ones, of the clip inside the border, or of another picture."""
        (wide, high), (width, height), inside = self.size(), clip_size, row - self.BORDER
        border = bytes([199]) * self.BORDER
        if self[0x0601] & 0x11 == 0x11:
            # Each value is twice the last one, and 1 follows 0. A black level is added to them.
            black = self[0x1003] if self[0x1000] & 1 else 0
            return bytes(min(255, (1 << at % 9 & 0xFF) + black) for at in range(row * wide, (row + 1) * wide))
        if picture is None or not 0 <= inside < height or (wide, high) != (width + 4, height + 4) or self.bars():
            return bytes(wide)
        mirrored, turned, *_ = self.view()
        inside = height - 1 - inside if turned else inside
        shown = picture[inside * width : (inside + 1) * width]
        table = self.light()
        shown = shown.translate(table) if table else shown
        return border + (shown[::-1] if mirrored else shown) + border

    def _line(self, picture, row, clip_size):
        length, data = self.bytes_per_line(), self._shown(picture, row, clip_size)
        data = bytes(value >> 2 for value in data) if self.format() == "SHORT" else data
        data = data[:1] * self.early() + (data * -(-length // len(data)))[:length]
        return data if self.drives_data() else bytes(len(data))
