"""ADC3 of the STM32H743 (RM0433, chapter 25) and the sensor of its temperature, at channel 18.

The sensor's voltage falls on a line through two numbers that the factory measured at 30 and at 110 degrees. A conversion
that is not set up as the manual says gives a number of no temperature.
"""

from .registers import Registers

ADC3, RCC_AHB4ENR, ADC3_ENABLE = 0x5802_6000, 0xE0, 1 << 24
ISR, CR, CFGR, SMPR2, PCSEL, SQR1, DR, CCR = 0x00, 0x08, 0x0C, 0x18, 0x1C, 0x30, 0x40, 0x308
READY, END = 1, 1 << 2
ENABLE, START, REGULATOR, DEEP, CALIBRATE = 1, 1 << 2, 1 << 28, 1 << 29, 1 << 31
SENSOR_ON, CHANNEL = 1 << 23, 18
TS_CAL1, TS_CAL2, CALIBRATION = 0x1FF1_E820, 0x1FF1_E840, (12_300, 15_900)
SAMPLE_CYCLES = (1.5, 2.5, 8.5, 16.5, 32.5, 64.5, 387.5, 810.5)
# The highest clock of each boost; microseconds that the regulator and the sensor need.
BOOST, REGULATOR_US, SENSOR_US = (6.25e6, 12.5e6, 25e6, 50e6), 10, 9


class Adc3(Registers):
    """The converter. `celsius` is the temperature of the chip."""

    def __init__(self, machine, rcc, clock):
        super().__init__(ADC3, {CR: DEEP})
        self.machine, self.rcc, self.clock, self.celsius = machine, rcc, clock, 42.5
        self.regulated = self.calibrated = None
        for address, number in zip((TS_CAL1, TS_CAL2), CALIBRATION, strict=True):
            machine.uc.mem_write(address, number.to_bytes(2, "little"))

    def reset(self):
        """Resets the registers: no calibration is left."""
        super().reset()
        self.regulated = self.calibrated = None

    def read(self, offset):
        """Returns a register; 0 without a clock. The result clears its flag."""
        if not self.rcc.read(RCC_AHB4ENR) & ADC3_ENABLE:
            return 0
        if offset == DR:
            self.values[ISR] = self.values.get(ISR, 0) & ~END
        return super().read(offset)

    def write(self, offset, value):
        """Stores a register, and does what it asks for after its time."""
        if not self.rcc.read(RCC_AHB4ENR) & ADC3_ENABLE:
            return
        before = self.values.get(offset, 0)
        if offset == ISR:
            self.values[ISR] = before & ~value
            return
        if offset != CR:
            super().write(offset, value)
            return
        # A bit that is set by software is cleared by the converter alone.
        value |= before & (ENABLE | START | CALIBRATE)
        super().write(CR, value)
        if value & REGULATOR and not value & DEEP and self.regulated is None:
            self.regulated = self.machine.now
        new = value & ~before
        ready = self.regulated is not None and self.machine.now - self.regulated >= REGULATOR_US * self.clock // 1_000_000
        if new & CALIBRATE and ready and not value & ENABLE:
            self._later(16_384, CR, ~CALIBRATE, 0)
            self.calibrated = True
        if new & ENABLE and self.calibrated and not value & CALIBRATE:
            self._later(10, ISR, ~0, READY)
        if new & START and self.values.get(ISR, 0) & READY | value & ENABLE:
            cycles = SAMPLE_CYCLES[self.values.get(SMPR2, 0) >> 3 * (CHANNEL - 10) & 7]
            self.values[DR] = self._number(cycles)
            self._later(cycles + 8.5, ISR, ~0, END)
            self.values[CR] &= ~START

    def _hertz(self):
        """Returns the clock of the converter: a part of the bus clock, which is half of the core's at most."""
        return {1: self.clock, 2: self.clock / 2, 3: self.clock / 4}.get(self.values.get(CCR, 0) >> 16 & 3, 0)

    def _later(self, cycles, offset, keep, add):
        hertz = self._hertz()
        if hertz:
            change = lambda: self.values.update({offset: self.values.get(offset, 0) & keep | add})
            self.machine.at(self.machine.now + int(cycles * self.clock / hertz) + 1, change)

    def _number(self, cycles):
        """Returns what is measured: 0 unless the sensor is on, selected and sampled for long enough, with 16 bits, and the
        clock is not faster than the boost is for.
        """
        hertz, control = self._hertz(), self.values.get(CR, 0)
        selected = self.values.get(PCSEL, 0) >> CHANNEL & 1 and self.values.get(SQR1, 0) >> 6 & 0x1F == CHANNEL
        is_fast = hertz > BOOST[control >> 8 & 3]
        sampled = hertz and cycles / hertz * 1e6 >= SENSOR_US
        if not self.values.get(CCR, 0) & SENSOR_ON or not selected or is_fast or not sampled or self.values.get(CFGR, 0) >> 2 & 7:
            return 0
        low, high = CALIBRATION
        return round(low + (self.celsius - 30) / 80 * (high - low))
