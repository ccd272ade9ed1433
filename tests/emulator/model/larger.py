"""Sensors of one to five million pixels: what their registers make of the pins.

The registers and bits are those of public drivers, not those of the firmware's tables: Linux's, OpenMV's, Espressif's
and Zephyr's of the OV2640, Linux's and Espressif's of the OV5640, Linux's, Espressif's and MediaTek's of the GC2145,
and Linux's, OpenMV's, NXP's, Alif's and MediaTek's of the MT9M114. What none of them says is a guess, and the comment
says so.
"""

from .sensor import GAMMA_AT_RESET, STRAIGHT, XCLK, Sensor, WordSensor, curve, doublings

# The fastest clock of pixels that a camera interface at 72 MHz takes: 2.5 of its clocks for each (RM0433).
FASTEST = 28_800_000


def on_time(sent, pclk, row):
    """Returns the bytes of a line. A clock that is too slow for a row loses some, and so does one that is too fast."""
    if pclk > FASTEST:
        return sent // 2
    return min(sent, int(pclk * row) & ~3)


class Ov2640(Sensor):
    """OV2640, whose registers have two banks: those of bank 1 are 0x100 higher, and 0xFF chooses one."""

    ADDRESS, IDENTITY = 0x30, {0x10A: 0x26, 0x10B: 0x42, 0x11C: 0x7F, 0x11D: 0xA2}
    DEFAULTS = {
        0xFF: 0x00, 0x05: 0x01, 0x50: 0x00, 0x51: 0x40, 0x52: 0xF0, 0x5A: 0x58, 0x5B: 0x48, 0x86: 0x0D, 0x87: 0x50,
        0xC0: 0xC8, 0xC1: 0x96, 0xC2: 0x0C, 0xC3: 0xFF, 0xD3: 0x82, 0xDA: 0x00, 0xE0: 0x04, 0x103: 0x0F, 0x104: 0x20,
        0x109: 0x00, 0x110: 0x33, 0x111: 0x00, 0x112: 0x00, 0x113: 0xC7, 0x117: 0x11, 0x118: 0x75, 0x119: 0x01,
        0x11A: 0x97, 0x132: 0x36,
    }  # fmt: skip
    RESET, SWITCHES, NOMINAL = (0x112, 0x80), (0x113, 5), 630
    AUTOMATIC = ((1, 0x145, 0x110), (4, 0, 0x100))
    # The clock of the array, of 24 MHz: the data sheet's.
    SPEED = 1.0
    # By bits 6-4 of 0x12: pixels of a line and lines of a frame with blank ones, and without.
    SIZES = {4: (1190, 672, 800, 600), 2: (595, 336, 400, 300)}
    WHOLE = (1922, 1248, 1600, 1200)

    def _place(self, register):
        return register + 0x100 if register != 0xFF and self.registers.get(0xFF) == 1 else register

    def effects(self):
        """Returns the registers of the effects: 0x7C is the number of one, and each value of 0x7D moves on to the
        next."""
        number, values = 0, {}
        last = {
            place: max((k for k, (at, _) in enumerate(self.history) if at == place), default=-1)
            for place in (0x7C, 0x7D)
        }
        for k, (place, value) in enumerate(self.history):
            if k == last.get(place):
                value = self.slips.get(place, value)
            if place == 0x7C:
                number = value
            elif place == 0x7D:
                values[number], number = value, number + 1
        return values

    def drives(self):
        """Returns whether frames come: the port may be in reset, the sensor asleep, HREF off, and VSYNC inverted."""
        runs = not self[0xE0] & 0x07 and not self[0x109] & 0x10 and self[0x104] & 8 and not self[0x115] & 2
        return self.present and self.is_on() and bool(runs)

    def drives_data(self):
        """Returns whether the data is right when it is taken: a clock of the other polarity changes it then."""
        return not self[0x115] & 0x10

    def _sizes(self):
        return self.SIZES.get(self[0x112] >> 4 & 7, self.WHOLE)

    def lines(self):
        """Returns the lines of a frame, of which two pairs of registers add some."""
        return self._sizes()[1] + (self[0x12D] | self[0x12E] << 8) + (self[0x146] | self[0x147] << 8)

    def array_line(self):
        clock = XCLK * self.SPEED * (2 if self[0x111] & 0x80 else 1) / ((self[0x111] & 0x3F) + 1)
        clock /= {2: 2, 3: 4}.get(self[0x132] >> 6, 1)
        return (self._sizes()[0] + (self[0x12B] | (self[0x12A] & 0xF0) << 4)) / clock

    def period(self):
        """Returns the seconds of a frame that is sent: some may be left out."""
        return self.array_line() * self.lines() * (1, 2, 4, 8)[self[0x103] >> 6]

    def _fed(self):
        """Returns the size of the picture that the sensor's image processor gets: that of the window, but at most that of the
        array and that in the processor's own registers."""
        *_, wide, high = self._sizes()
        columns = 2 * ((self[0x118] << 3 | self[0x132] >> 3 & 7) - (self[0x117] << 3 | self[0x132] & 7))
        rows = 2 * ((self[0x11A] << 2 | self[0x103] >> 2 & 3) - (self[0x119] << 2 | self[0x103] & 3))
        told = self[0xC0] << 3 | self[0x8C] >> 3 & 7 | (self[0x8C] & 0x40) << 5, self[0xC1] << 3 | self[0x8C] & 7
        return min(max(columns, 8), wide, told[0]), min(max(rows, 8), high, told[1])

    def _taken(self):
        """Returns the part of that which is scaled."""
        wide, high = self._fed()
        left, top = self[0x53] | (self[0x55] & 7) << 8, self[0x54] | (self[0x55] & 0x70) << 4
        columns = self[0x51] << 2 | (self[0x55] & 8) << 7 | (self[0x57] & 0x80) << 4
        rows = self[0x52] << 2 | (self[0x55] & 0x80) << 3
        return max(8, min(columns, wide - left)), max(8, min(rows, high - top))

    def size(self):
        """Returns the size of the picture that leaves the image processor, or what it gets while it is switched off."""
        if self[0x05] & 1:
            return self._fed()
        wide, high = self._taken()
        if not self[0x86] & 0x20:
            return wide, high
        divided = max(4, wide >> (self[0x50] & 7)), max(4, high >> (self[0x50] >> 3 & 7))
        out = self[0x5A] << 2 | (self[0x5C] & 3) << 10, self[0x5B] << 2 | (self[0x5C] & 4) << 8
        return max(4, min(divided[0], out[0]) & ~1), max(1, min(divided[1], out[1]))

    def row(self):
        return self.array_line() * (1 if self[0x05] & 1 else self._taken()[1] / self.size()[1])

    def bytes_per_line(self):
        """Returns the bytes of a line. The port's clock is a part of 48 MHz, or follows the array's by itself."""
        sent = super().bytes_per_line()
        # An HSYNC in place of HREF, or one of the other polarity, is another time: how long is a guess.
        sent = sent + 40 if self[0x115] & 0x48 else sent
        return sent if self[0xD3] & 0x80 else on_time(sent, 48_000_000 / max(self[0xD3] & 0x7F, 1), self.row())

    def format(self):
        """Returns the format: that of 0xDA, if 0xC2 makes it."""
        kind = self[0xDA] >> 2 & 3
        if self[0x05] & 1 or self[0xDA] & 0x50 or kind in (1, 3) or self[0xC2] & 0x0D != 0x0C:
            return "RAW"
        if kind == 2:
            return "RGB"
        return "UYVY" if self[0xDA] & 1 else "YUYV"

    def chroma(self):
        effects = self.effects()
        fixed = self[0x86] & 0x10 and effects.get(0, 0) & 0x18 == 0x18
        return (effects.get(5, 0), effects.get(6, 0)) if fixed else None

    def automatic(self):
        """Returns the bits of exposure and gain. White balance acts by its gains, which have a switch of their own."""
        return super().automatic() | (2 if self[0xC3] & 0x0C == 0x0C else 0)

    def light(self):
        """Returns the table of exposure, gain and gamma. How much digital gain, lens correction and effects change is a
        guess."""
        lines = min((self[0x145] & 0x3F) << 10 | self[0x110] << 2 | self[0x104] & 3, self.lines() - 4)
        gain = doublings(self[0x100]) * (1.5 if self[0xC3] & 0x10 else 1) * (1.1 if self[0xC3] & 2 else 1)
        gain *= 1.2 if self[0xC3] & 4 else 1
        gain *= 0.5 if self[0x86] & 0x10 and self.effects().get(0, 0) & 0x44 else 1
        bent = self[0xC3] & 0x20
        return curve(round(lines / self.nominal * gain, 6), GAMMA_AT_RESET if bent else STRAIGHT, 0x06 if bent else 64)

    def view(self):
        """Returns how the picture lies. How far windows shift it is a guess."""
        right = 2 * ((self[0x117] - 0x11) * 8 + (self[0x132] & 7) - 1) + (self[0x53] | (self[0x55] & 7) << 8)
        down = 2 * (self[0x119] * 4 + (self[0x103] & 3) - 2) + (self[0x54] | (self[0x55] & 0x70) << 4)
        # A window that is scaled less shows less.
        columns, rows = self._taken()
        return bool(self[0x104] & 0x80), bool(self[0x104] & 0x40), right + columns - 800, down + rows - 600

    def bars(self):
        return bool(self[0x112] & 2)


class SlowOv2640(Ov2640):
    """An OV2640 whose array has the clock that OpenMV's driver counts with: three times that of 24 MHz, by 2, for two
    bytes."""

    SPEED = 0.75


class Ov5640(WordSensor):
    ADDRESS, IDENTITY, RESET = 0x3C, {0x300A: 0x56, 0x300B: 0x40}, (0x3008, 0x82)
    DEFAULTS = {
        0x3008: 0x02, 0x300E: 0x58, 0x3034: 0x1A, 0x3035: 0x11, 0x3036: 0x69, 0x3037: 0x03, 0x3108: 0x16, 0x3503: 0x00,
        0x3804: 0x0A, 0x3805: 0x3F, 0x3806: 0x07, 0x3807: 0x9F, 0x3808: 0x0A, 0x3809: 0x20, 0x380A: 0x07, 0x380B: 0x98,
        0x380C: 0x0B, 0x380D: 0x1C, 0x380E: 0x07, 0x380F: 0xB0, 0x3811: 0x10, 0x3813: 0x04, 0x3814: 0x11, 0x3815: 0x11,
        0x3820: 0x40, 0x3824: 0x01, 0x4300: 0xF8, 0x4740: 0x20, 0x5000: 0xFF, 0x5001: 0x01, 0x460C: 0x20,
    }  # fmt: skip
    SWITCHES, NOMINAL = (0x3503, 3), 920
    AUTOMATIC = ((1, 0x3500, 0x3501), (2, 0x350A, 0x350B))
    # Columns that a line has besides its pixels, at least, and lines of a frame (OpenMV).
    BLANK = 252, 24

    def automatic(self):
        """Returns the bits of automatic controls: a one fixes exposure or gain, and white balance has two switches."""
        white = self[0x5001] & 1 and not self[0x3406] & 1
        return (~self[0x3503] & 3) | (4 if white else 0)

    def drives(self):
        """Returns whether frames come: not asleep or in reset, nor over MIPI, and with their pins on and the right
        way."""
        pins = self[0x3017] & 0x70 == 0x70 and not self[0x4740] & 1
        return self.present and self.is_on() and not self[0x3008] & 0xC0 and not self[0x300E] & 4 and pins

    def drives_data(self):
        """Returns whether the eight high data pins are on, and the data is right when it is taken."""
        return self[0x3017] & 0x0F == 0x0F and self[0x3018] & 0xF0 == 0xF0 and bool(self[0x4740] & 0x20)

    def _word(self, register, bits=16):
        return self.number(register, register + 1, bits - 8)

    def _pll(self):
        """Returns the clock that is divided once more for the array and for the port."""
        if self[0x3039] & 0x80 or not self[0x3103] & 2:
            return XCLK
        before = {0: 1, 1: 1, 2: 2, 3: 3, 4: 4, 5: 1.5, 6: 6, 7: 2.5, 8: 8}.get(self[0x3037] & 15, 8)
        multiplier = self[0x3036] if self[0x3036] < 128 else self[0x3036] & ~1
        bits = {8: 2, 10: 2.5}.get(self[0x3034] & 15, 1)
        return XCLK / before * max(multiplier, 1) / (self[0x3035] >> 4 or 16) / (1 + (self[0x3037] >> 4 & 1)) / bits

    def _clock(self):
        return self._pll() / (1 << (self[0x3108] & 3))

    def _port_clock(self):
        divider = self[0x3824] & 0x1F if self[0x460C] & 2 else 2
        return self._pll() / (1 << (self[0x3108] >> 4 & 3)) / max(divider, 1)

    def _steps(self):
        """Returns the columns and rows from one that is read to the next."""
        return tuple(max(1, ((self[at] >> 4) + (self[at] & 15)) // 2) for at in (0x3814, 0x3815))

    def _read(self):
        """Returns the columns and rows of the array that are read."""
        columns = self._word(0x3804, 12) - self._word(0x3800, 12) + 1
        rows = self._word(0x3806, 11) - self._word(0x3802, 11) + 1
        across, down = self._steps()
        return max(16, min(columns, 2624) // across), max(16, min(rows, 1964) // down)

    def _fed(self):
        """Returns the columns and rows that are scaled."""
        (wide, high), left, top = self._read(), self._word(0x3810, 12), self._word(0x3812, 11)
        return max(8, wide - 2 * left), max(8, high - 2 * top)

    def lines(self):
        return max(self._word(0x380E), self._read()[1] + self.BLANK[1] // 4) + self._word(0x350C)

    def array_line(self):
        return max(self._word(0x380C, 13), self._read()[0] + self.BLANK[0]) / self._clock()

    def period(self):
        return self.array_line() * self.lines()

    def size(self):
        """Returns the size behind the scaler, or of a part of what comes if that is off."""
        fed, out = self._fed(), (self._word(0x3808, 12), self._word(0x380A, 11))
        # An HREF of the other polarity is high between lines: how long that is counts as a guess.
        wide = min(fed[0], out[0]) + (40 if self[0x4740] & 2 else 0)
        return max(4, wide & ~1), max(1, min(fed[1], out[1]))

    def row(self):
        return self.array_line() * (self._fed()[1] / self.size()[1] if self[0x5001] & 0x20 else 1)

    def bytes_per_line(self):
        return on_time(super().bytes_per_line(), self._port_clock(), self.row())

    def format(self):
        """Returns the format: the source of 0x501F, in the order of 0x4300. An order that Linux does not name counts as
        one of chroma."""
        source, kind, order = self[0x501F] & 7, self[0x4300] >> 4, self[0x4300] & 15
        if source == 1 or kind == 6:
            return "RGB"
        if source or kind != 3 or self[0x3821] & 0x20:
            return "RAW"
        return "YUYV" if order in (0, 1) else "UYVY"

    def chroma(self):
        fixed = self[0x5001] & 0x80 and self[0x5580] & 0x18 == 0x18
        return (self[0x5583], self[0x5584]) if fixed else None

    def light(self):
        """Returns the table of exposure, gains and gamma. How much lens correction, effects and a matrix change is a
        guess."""
        sixteenths = (self[0x3500] & 15) << 16 | self[0x3501] << 8 | self[0x3502]
        gain = min(sixteenths / 16, self.lines() - 4) / self.nominal * self._word(0x350A, 10) / 16
        red, green, blue = (self._word(at, 12) / 0x400 for at in (0x3400, 0x3402, 0x3404))
        gain *= 0.299 * red + 0.587 * green + 0.114 * blue if self[0x3406] & 1 else 1
        gain *= (1.1 if self[0x5000] & 0x80 else 1) * (1.01 if self[0x5000] & 1 == 0 else 1)
        gain *= 1 if self[0x5001] & 2 else 0.99
        gain *= 0.5 if self[0x5001] & 0x80 and self[0x5580] & 0xC4 else 1
        bent = self[0x5000] & 0x20
        return curve(round(gain, 6), GAMMA_AT_RESET if bent else STRAIGHT, 0x06 if bent else 64)

    def view(self):
        """Returns how the picture lies. How far windows and steps shift it is a guess."""
        left, top = self._word(0x3800, 12), self._word(0x3802, 11)
        columns, rows = self._fed()
        right = left + 2 * (self._word(0x3810, 12) - 16) + columns - 1280 + (0 if self[0x5001] & 0x20 else 7)
        down = top - 4 + 2 * (self._word(0x3812, 11) - 6) + rows - 960
        binned = (self[0x3820] & 1) + (self[0x3821] & 1) - 2
        down += bool(self[0x3821] & 6) + bool(self[0x3820] & 6)
        return self[0x3821] & 6 == 6, self[0x3820] & 6 == 6, right + binned, down

    def bars(self):
        return bool(self[0x503D] & 0x80)


class Gc2145(Sensor):
    """GC2145, whose registers have banks: those of bank n are n × 0x100 higher, and from 0xF0 on they are in all
    banks."""

    ADDRESS, IDENTITY, RESET = 0x3C, {0xF0: 0x21, 0xF1: 0x45}, (0xFE, 0xF0)
    DEFAULTS = {
        0x03: 0x00, 0x04: 0x10, 0x05: 0x01, 0x06: 0x1C, 0x08: 0x10, 0x0D: 0x04, 0x0E: 0xC0, 0x0F: 0x06, 0x10: 0x52,
        0x12: 0x2E, 0x17: 0x14, 0x80: 0xFF, 0x82: 0xFA, 0x84: 0x02, 0x86: 0x01, 0x95: 0x04, 0x96: 0xB0, 0x97: 0x06,
        0x98: 0x40, 0x99: 0x11, 0xB0: 0x40, 0xB3: 0x40, 0xB4: 0x40, 0xB5: 0x40, 0xB6: 0x01, 0xF2: 0x00, 0xF7: 0x1D,
        0xF8: 0x84, 0xFA: 0x00,
    }  # fmt: skip
    SWITCHES, NOMINAL = (0xB6, 1), 376
    AUTOMATIC = ((1, 0x03, 0x04), (2, 0, 0xB3))

    def _place(self, register):
        return register if register >= 0xF0 else (self.registers.get(0xFE, 0) & 7) << 8 | register

    def automatic(self):
        """Returns the bits of exposure and white balance."""
        return super().automatic() | self[0x82] & 2

    def _word(self, register, bits=16):
        return self.number(register, register + 1, bits - 8)

    def drives(self):
        """Returns whether frames come. Which pin each of the bits is counts as a guess."""
        return self.present and self.is_on() and self[0xF2] & 7 == 7 and bool(self[0x86] & 1)

    def drives_data(self):
        """Returns whether the data pins are on, and the data is right when it is taken, which is a guess."""
        return bool(self[0xF2] & 8) and not self[0x86] & 4

    def clock(self):
        """Returns the clock of rows: Linux's multipliers and rates give it."""
        multiplied = XCLK / (2 if self[0xF7] & 2 else 1) * ((self[0xF8] & 0x3F) + 1) if self[0xF8] & 0x80 else XCLK
        return multiplied / 4 / ((self[0xFA] >> 4) + 1)

    def lines(self):
        """Returns the rows of a frame."""
        return self._word(0x07, 13) + self._word(0x0D, 11) + 16

    def row(self):
        """Returns the seconds of a row. Of every second row or so, each takes as long."""
        columns = self._word(0x05, 12) + self._word(0x11, 10) + self._word(0x0F, 11) // 2 + 4
        return columns / self.clock() * max(1, self[0x99] >> 4)

    def period(self):
        return self.row() / max(1, self[0x99] >> 4) * self.lines()

    def size(self):
        """Returns the size of the output: a part of what the window and its steps give."""
        wide = self._word(0x0F, 11) // max(1, self[0x99] & 15) >> (self[0xFD] >> 1 & 1)
        high = self._word(0x0D, 11) // max(1, self[0x99] >> 4) >> (self[0xFD] & 1)
        if self[0x90] & 1:
            wide = min(self._word(0x97, 11), wide - self._word(0x93, 11))
            high = min(self._word(0x95, 11), high - self._word(0x91, 11))
        # An HREF of the other polarity is high between lines: how long that is counts as a guess.
        return max(4, (wide + (0 if self[0x86] & 2 else 40)) & ~1), max(1, high)

    def bytes_per_line(self):
        """Returns the bytes of a line. The port has two bytes for each of two pixels in a clock of rows."""
        return on_time(super().bytes_per_line(), 4 * self.clock(), self.row())

    def format(self):
        """Returns the format."""
        kind = self[0x84] & 0x1F
        return {0: "UYVY", 1: "UYVY", 2: "YUYV", 3: "YUYV", 6: "RGB"}.get(kind, "RAW")

    def chroma(self):
        """Returns U and V if an effect fixes them: bit 1 does, and the high bits are a color, of which 1 is none."""
        effect = self[0x83]
        return None if not effect & 2 else (0x80, 0x80) if effect >> 4 == 1 else (0x60, 0xA0)

    def light(self):
        """Returns the table of exposure, gains and gamma. How much the switches of 0x80 to 0x82 change is a guess."""
        rows = min(self._word(0x03, 13), self.lines() - 8)
        white = (0.299 * self[0xB3] + 0.587 * self[0xB4] + 0.114 * self[0xB5]) / 0x40
        gain = rows / self.nominal * white * self[0xB0] / 0x55
        for register, right, bits in ((0x80, 0x08, 0x3F), (0x81, 0x00, 0xFF), (0x82, 0x00, 0xFC)):
            gain *= 1 + 0.02 * bin((self[register] ^ right) & bits).count("1")
        gain *= 0.5 if self[0x83] & 1 else 1
        bent = self[0x80] & 0xC0
        return curve(round(gain, 6), GAMMA_AT_RESET if bent else STRAIGHT, 0x06 if bent else 64)

    def view(self):
        right = self._word(0x0B, 11) - 640 + self._word(0x93, 11) + (self[0x99] & 15) - 1
        down = self._word(0x09, 11) - 480 + self._word(0x91, 11) + (self[0x99] >> 4) - 1
        return bool(self[0x17] & 1), bool(self[0x17] & 2), right, down

    def bars(self):
        return bool(self[0x81] & 1)


class Mt9m114(WordSensor):
    """MT9M114, whose registers below 0x8000 take values of two bytes alone. Its own processor does commands, and reads
    the variables from 0xC800 on only when its configuration changes.
    """

    ADDRESS, IDENTITY = 0x48, {0x0000: 0x24, 0x0001: 0x81}
    DEFAULTS = {
        0x0080: 0x80, 0xA805: 0xFF, 0xB404: 0x00, 0xB405: 0x32, 0xBC03: 0x0F, 0xC801: 0x04, 0xC803: 0x04, 0xC804: 0x03,
        0xC805: 0xCB, 0xC806: 0x05, 0xC807: 0x0B, 0xC808: 0x02, 0xC809: 0xDC, 0xC80A: 0x6C, 0xC80D: 0x01, 0xC812: 0x03,
        0xC813: 0xEF, 0xC814: 0x06, 0xC815: 0x35, 0xC837: 0x20, 0xC857: 0x78, 0xC858: 0x05, 0xC85A: 0x02, 0xC85B: 0xD0,
        0xC868: 0x05, 0xC86A: 0x02, 0xC86B: 0xD0, 0xC86D: 0x10, 0xC86F: 0x18, 0xC88C: 0x1E, 0xC88E: 0x1E, 0xC909: 0x03,
        0xC92F: 0x02, 0xC932: 0x01, 0xC941: 0xDC, 0xC942: 0x38, 0xC943: 0x30, 0xC97E: 0x01, 0xC980: 0x09, 0xC981: 0xA0,
        0xC982: 0x07, 0xC984: 0x80, 0xC985: 0x40,
    }  # fmt: skip
    RESET, SWITCHES, NOMINAL = (0x001B, 0x01), (0xA805, 1), 420
    AUTOMATIC = ((1, 0xC83C, 0xC83D),)
    # How often a command is seen under way, which is a guess.
    TAKES = 3
    # The seconds after a reset in which it does not answer: at least so long wait Linux, OpenMV, NXP and Zephyr.
    WAKES = 0.0445

    def power_on(self):
        super().power_on()
        self.history, self.busy, self.known, self.awake = [], 0, None, self.now() + self.WAKES

    def answers(self, reads):
        return super().answers(reads) and self.now() >= self.awake

    def read(self):
        """Returns a register. The command under way is in the low byte of its own."""
        self._point()
        if self.pointer == 0x0081 and self.busy:
            self.busy, self.pointer = self.busy - 1, self.pointer + 1
            return 0x02
        return super().read()

    def stop(self):
        """Ends a transfer. A part of a value of two bytes is not taken, which is a guess."""
        register = int.from_bytes(self.written[:2], "big")
        if register < 0x8000 and (register | len(self.written)) & 1:
            del self.written[2:]
        super().stop()

    def _set(self, register, value):
        super()._set(register, value)
        self.known = None
        if register == 0x001B:
            # It answers in reset, as in Linux, which ends it at once.
            self.busy, self.registers[register] = self.TAKES, value
            self.awake = self.now() + self.WAKES * (not value & 1)
        if register == 0x0081 and self[0x0081] & 0x0F:
            self.busy = self.TAKES
            self.registers[0x0080], self.registers[0x0081] = 0x80 if self._configured()[1] else 0x00, 0x00

    def _configured(self):
        """Returns the values with which the configuration has changed, and whether the last command had success: that
        other commands fail is a guess.
        """
        if self.known is None:
            written, acting, success = {}, {}, True
            for place, value in self.history:
                written[place] = self.slips.get(place, value)
                if place == 0x0081 and written[place] & 0x0F:
                    told = written[place] & 0x0F, written.get(0x0080, 0) & 0x80, written.get(0xDC00)
                    success = told == (0x02, 0x80, 0x28) and self._fits({**self.DEFAULTS, **written})
                    acting = dict(written) if success else acting
            self.known = acting, success
        return self.known

    def __getitem__(self, place):
        if 0xC800 <= place < 0xCC00:
            return self._configured()[0].get(place, self.DEFAULTS.get(place, 0))
        return super().__getitem__(place)

    @staticmethod
    def _windows(values):
        """Returns the last column and row, the pixels that leave the array, the first of those that are cut out, and
        the sizes that are cut out and sent. Of sums of two by two, seven are lost at the sides: Zephyr's and Alif's
        pictures of 640 x 480 come from 1294 x 974.
        """
        at = lambda place: values.get(place, 0) << 8 | values.get(place + 1, 0)
        sums = 2 if values.get(0xC835, 0) & 0x30 else 1, 2 if values.get(0xC834, 0) & 0x03 else 1
        last = at(0xC806), at(0xC804)
        fed = (last[0] + 1 - at(0xC802)) // sums[0] - 7, (last[1] + 1 - at(0xC800)) // sums[1] - 7
        return last, fed, (at(0xC854), at(0xC856)), (at(0xC858), at(0xC85A)), (at(0xC868), at(0xC86A))

    def _fits(self, values):
        """Returns whether windows lie in each other, and none is enlarged: Linux allows no others, of at least 32."""
        last, fed, first, cut, out = self._windows(values)
        inside = last[0] < 1296 and last[1] < 976 and all(at + size <= most for at, size, most in zip(first, cut, fed))
        return inside and all(32 <= sent <= size for sent, size in zip(out, cut))

    def _acting(self):
        return self._windows({**self.DEFAULTS, **self._configured()[0]})

    def drives(self):
        """Returns whether frames come: in reset, over MIPI and without syncs, none do."""
        runs = not self[0x001B] & 1 and not self[0xC985] & 7 and not self[0xC86D] & 0x20
        return self.present and self.is_on() and runs

    def clock(self):
        """Returns pixels per second. The PLL's formula is NXP's; without it, a pixel takes two clocks, as in Linux."""
        if not self[0xC97E] & 1:
            return XCLK / 2
        return XCLK * self[0xC981] / ((self[0xC980] & 0x3F) + 1) / ((self[0xC982] & 0x3F) + 1)

    def array_line(self):
        """Returns the seconds of a line, which has at least the 303 clocks more than pixels that Linux knows of."""
        return max(self.number(0xC814, 0xC815, 5), self._acting()[1][0] + 303) / self.clock()

    def lines(self):
        """Returns the lines of a frame. The highest rate of automatic exposure lengthens it, which is a guess."""
        told = self.number(0xC808, 0xC809, 8) << 16 | self.number(0xC80A, 0xC80B, 8)
        clocks = self.number(0xC814, 0xC815, 5) * self.number(0xC88C, 0xC88D, 8)
        limit = 256 * told // max(clocks, 1)
        return max(self.number(0xC812, 0xC813, 8), self._acting()[1][1] + 21, limit)

    def period(self):
        return self.array_line() * self.lines()

    def row(self):
        *_, cut, out = self._acting()
        return self.array_line() * cut[1] / out[1]

    def size(self):
        return self._acting()[-1]

    def bytes_per_line(self):
        """Returns the bytes of a line, of which codes of BT.656 are eight. A pixel has two, in a clock each."""
        return on_time(super().bytes_per_line(), 2 * self.clock(), self.row()) + (self[0xC86D] & 8)

    def format(self):
        kind = self[0xC86C] & 3
        if kind:
            return "RGB" if kind == 1 else "RAW"
        return "YUYV" if self[0xC86D] & 2 else "UYVY"

    def chroma(self):
        """Returns U and V if an effect fixes them, as MediaTek's driver names them: 1 is gray, 2 sepia."""
        middle = 0x80 if self[0xC86F] & 0x10 else 0
        return {1: (middle, middle), 2: (0x23, 0xB2)}.get(self[0xC874] & 7)

    def light(self):
        """Returns the table of exposure, gain and gamma. How much other bits change is a guess."""
        lines = min(self.number(0xC83C, 0xC83D, 8), self.lines() - 2)
        gain = lines / self.nominal * self.number(0xC836, 0xC837, 1) / 0x20
        gain *= (1 if self[0xC834] & 3 == 3 else 0.5) * (1 if self[0xC835] & 0x30 == 0x30 else 0.5)
        for place, right, bits in (
            (0xB405, 0, 0x10), (0xBC03, 0, 0x08), (0xC86F, 0x08, 0x2C), (0xC874, 0, 0x04), (0xC909, 0, 0x02),
            (0xC92F, 0, 0xFF), (0xC932, 0, 0xFF), (0xC942, 0x20, 0xFF), (0xC943, 0x20, 0xFF), (0xC95F, 0, 0x03),
        ):  # fmt: skip
            gain *= 1 + 0.02 * bin((self[place] ^ right) & bits).count("1")
        straight = self.number(0xC940, 0xC941, 8) == 100
        return curve(round(gain, 6), STRAIGHT if straight else GAMMA_AT_RESET, 64 if straight else 0x06)

    def view(self):
        """Returns how the picture lies: an even first column and row of the array, and the window of its sums."""
        first = self._acting()[2]
        right, down = (self.number(high, high + 1, 8) - at for high, at in ((0xC802, 320), (0xC800, 240)))
        return bool(self[0xC835] & 1), bool(self[0xC835] & 2), right // 2 + first[0], down // 2 + first[1]

    def bars(self):
        return self[0xC84C] == 2
