// An HM01B0: what its registers make of its pins.
//
// Registers and bits are those of Himax's data sheet as public drivers quote it: OpenMV's and Zephyr's drivers, those
// of Arm and of P. Marques for the RP2040, SparkFun's with its test of the data wires, and blankchenxm's for the ESP32.
// They are not those of the firmware's table. What none of them says is a guess, and the comment says so.
//
// How many clocks a line has while PCLK is gated is where drivers differ: those of P. Marques and of the Coral Dev Board
// Micro count 324, one of 4 wires for the MSP430FR5994 counts 326, and Zephyr's has 326 without a gate. So both are run.

const ADDRESS = 0x24;
// What a reset sets, as far as the drivers say it: standby, automatic exposure on, the whole array, 8 wires, the clock
// halved. The lengths of lines and frames are a guess.
const DEFAULTS = {
  0x0000: 0x01, 0x0001: 0xb0, 0x0100: 0x00, 0x0101: 0x00, 0x0104: 0x00, 0x0202: 0x01, 0x0203: 0x08, 0x0205: 0x00,
  0x020e: 0x01,
  0x020f: 0x00, 0x0340: 0x02, 0x0341: 0x32, 0x0342: 0x01, 0x0343: 0x72, 0x0383: 0x01, 0x0387: 0x01, 0x0390: 0x00,
  0x0601: 0x00, 0x1000: 0x01, 0x1003: 0x20, 0x1006: 0x00, 0x1007: 0x20, 0x1008: 0x00, 0x1012: 0x00, 0x2100: 0x01,
  0x3010: 0x00, 0x3011: 0x70, 0x3020: 0x01, 0x3022: 0x02, 0x3023: 0x02, 0x3059: 0x02, 0x3060: 0x0a, 0x3064: 0x00,
  0x3067: 0x00, 0x3068: 0x20,
};
const READ_ONLY = new Set([0x0000, 0x0001]);
// Registers that act only when 1 is written to 0x0104. Which they are is a guess: those of exposure, frames and
// picture.
const HELD = new Set([
  0x0101, 0x0202, 0x0203, 0x0205, 0x020e, 0x020f, 0x0340, 0x0341, 0x0342, 0x0343, 0x0383, 0x0387, 0x0390, 0x0601,
  0x3010,
]);
// Exposure in lines at which the clip was taken, and the black level that it has.
const NOMINAL_LINES = 240, NOMINAL_BLACK = 8;
// The frequency of the oscillator inside, which is a guess.
const OSCILLATOR = 10e6;
// The shortest line that was measured, and how many more lines a frame has than rows (P. Marques).
const SHORTEST_LINE = 369, FEWEST_BLANK = 16;

/** The sensor. `slips` has registers that act as if another value were written, although the right one is read back. */
export class Hm01b0 {
  constructor() {
    this.present = true;
    this.deaf = false; // whether it sends frames, but does not answer
    this.holds = 0; // clocks for which it holds the data line
    this.pullsUp = true; // whether resistors outside of the chip pull its bus up
    this.shorted = []; // the pins of the bus that are held low for ever
    this.slips = {};
    this.stuck = null; // a register that keeps its value
    this.isGateEarly = false; // whether a gated PCLK begins with HREF, and not with the first pixel
    this.dead = 0; // the data wires that are off, as bits
    this.nackAfter = null; // how often it answers before it fails once
    this.resets = 0;
    this.powerOn();
  }

  /** Sets all registers to their defaults. */
  powerOn() {
    this.registers = { ...DEFAULTS };
    this.active = { ...DEFAULTS };
    this.history = []; // what was written since the reset
    this.touched = new Map();
    this.pointer = 0;
    this.bytes = [];
    this.sent = 0;
  }

  /** Returns whether it acknowledges this address. */
  answers(address) {
    if (this.nackAfter === 0) {
      this.nackAfter = null;
      return false;
    }
    if (this.nackAfter !== null) this.nackAfter -= 1;
    return this.present && !this.deaf && address === ADDRESS;
  }

  start() {
    this.bytes = [];
  }

  /** Accepts a byte: the high and low byte of an address, then values. */
  write(value) {
    this.bytes.push(value);
    if (this.bytes.length === 2) this.pointer = (this.bytes[0] << 8) | this.bytes[1];
    if (this.bytes.length > 2) this.set(this.pointer++, value);
  }

  /** Returns the register at the pointer, which moves on. */
  read() {
    return this.registers[this.pointer++] ?? 0;
  }

  set(register, value) {
    if (register === 0x0103) {
      this.resets += 1;
      this.powerOn();
    } else if (!READ_ONLY.has(register)) {
      this.history.push([register, value]);
      if (register === this.stuck) return;
      this.registers[register] = value;
      this.touched.set(register, value);
      const acts = this.slips[register] ?? value;
      if (!HELD.has(register)) this.active[register] = acts;
      if (register === 0x0104 && acts & 1) {
        for (const held of HELD) {
          const isSet = this.touched.has(held);
          this.active[held] = isSet && held in this.slips ? this.slips[held] : this.registers[held];
        }
      }
      if (register === 0x0100) this.sent = 0;
    }
  }

  /** Makes a register act by another value than the one that is read back, at once. */
  slip(register, value) {
    this.slips[register] = value;
    this.active[register] = value;
  }

  /** Returns the value that a register acts by. */
  at(register) {
    return this.active[register] ?? 0;
  }

  /** Returns a number of two registers. */
  number(high) {
    return (this.at(high) << 8) | this.at(high + 1);
  }

  /** Returns whether frames are sent: 0x0100 bits 2-0, 1 for all and 3 for some; 0x3064 bit 2 waits for a trigger. */
  streams() {
    const mode = this.at(0x0100) & 7;
    return this.present && !(this.at(0x3064) & 4) && (mode === 1 || (mode === 3 && this.sent < this.at(0x3020)));
  }

  /** Ends a frame. Automatic exposure changes the registers of the exposure, where drivers read what it found (SparkFun). */
  endFrame() {
    this.sent += 1;
    if (this.at(0x2100) & 1) this.registers[0x0203] = (this.registers[0x0203] + 1) & 0xff;
  }

  /** Returns the seconds of a frame from a clock of this frequency. An exposure that does not fit skips frames. */
  period(clock) {
    const source = this.at(0x3067) & 1 ? OSCILLATOR : clock;
    const pixelClock = source / [8, 4, 2, 1][this.at(0x3060) & 3];
    const lines = this.lines();
    const skipped = Math.ceil((this.number(0x0202) + 2) / lines);
    return (this.clocks() * lines * Math.max(1, skipped)) / pixelClock;
  }

  /** Returns the pixel clocks of a line. */
  clocks() {
    return Math.max(this.number(0x0342), SHORTEST_LINE);
  }

  /** Returns the lines of a frame, blank ones too. */
  lines() {
    return Math.max(this.number(0x0340), this.size()[1] + FEWEST_BLANK);
  }

  /** Returns columns and rows of what is sent: the array or its window, or half of both. */
  size() {
    const half = (value) => ((value & 3) === 3 ? 2 : 1);
    return [324 / half(this.at(0x0383)), (this.at(0x3010) & 1 ? 244 : 324) / half(this.at(0x0387))];
  }

  /** Returns the number of data wires. */
  wires() {
    const bits = this.at(0x3059);
    return bits & 0x20 ? 1 : bits & 0x40 ? 4 : 8;
  }

  /** Returns the values of the data wires for a pixel, one for each pixel clock. */
  bits(pixel) {
    const wires = this.wires();
    const mask = (1 << wires) - 1;
    // 0x3011 bit 0: pixels of 6 bits, which are the high ones. Where they are sent is a guess.
    const isShort = this.at(0x3011) & 1;
    const value = isShort ? pixel >> 2 : pixel;
    const parts = [];
    for (let at = 0; at < (isShort ? 6 : 8); at += wires) parts.push((value >> at) & mask & ~this.dead);
    // Bit 4 of 0x3060: the high bits first. With 8 wires, there is no order.
    return this.at(0x3060) & 0x10 ? parts.reverse() : parts;
  }

  /** Returns whether data is to be taken at the rising edge of PCLK. */
  rises() {
    return !(this.at(0x3068) & 1);
  }

  /** Returns how many lines VSYNC comes before the first line. Bit 0 of 0x1012 makes it a line later, which is a guess. */
  early() {
    return (this.at(0x3022) & 0x1f) - (this.at(0x1012) & 1);
  }

  /**
   * Returns the pixels for which PCLK runs before the first one of a line, while HREF is high: HREF comes early, and PCLK is
   * not gated (0x3060 bit 5), or its gate opens with HREF. Bit 1 of 0x1012 makes HREF a pixel later, which is a guess.
   */
  pixelsBefore() {
    return this.at(0x3060) & 0x20 && !this.isGateEarly ? 0 : this.hrefEarly();
  }

  /** Returns how many pixels HREF comes before the first pixel. */
  hrefEarly() {
    return Math.max(0, (this.at(0x3023) & 0x1f) - ((this.at(0x1012) >> 1) & 1));
  }

  /** Returns what brightens and darkens: gains and exposure, and what is added. */
  light() {
    const again = 2 ** ((this.at(0x0205) >> 4) & 7), dgain = ((this.at(0x020e) & 3) << 6 | this.at(0x020f) >> 2) / 0x40;
    // A frame cannot be exposed for longer than all its lines less two, or it is skipped; `period` has that.
    const lines = this.number(0x0202);
    // Binning without half of the pixels adds pairs: a guess.
    const pairs = (this.at(0x0390) & 1 ? 2 : 1) * (this.at(0x0390) & 2 ? 2 : 1);
    // The black level follows its targets if it is switched on, or is what covered pixels have: a guess.
    const black = this.at(0x1000) & 1 ? this.at(0x1003) : 16;
    const both = this.at(0x1006) & 1 ? this.at(0x1007) : 16;
    // Automatic exposure brightens what it sees; how much is a guess.
    const gain = (lines / NOMINAL_LINES) * again * dgain * pairs * (this.at(0x2100) & 1 ? 1.2 : 1);
    return [gain, (black - NOMINAL_BLACK) / 2 + (both - NOMINAL_BLACK) / 2];
  }

  /** Returns all that the registers do, in comparable parts. */
  acts(clock) {
    if (!this.streams()) return { pins: 'silent' };
    const walking = (this.at(0x0601) & 0x11) === 0x11;
    return {
      pins: (this.at(0x0100) & 7) === 3 ? 'some frames' : 'all',
      rate: 1 / this.period(clock),
      size: `${this.size()}`,
      sync: Math.min(0, this.early()),
      format: `${this.wires()} ${this.wires() < 8 ? this.at(0x3060) & 0x10 : 0} ${this.at(0x3011) & 1} ${this.rises()}`,
      automatic: this.at(0x2100) & 1,
      light: `${this.light()}`,
      view: this.at(0x0101) & 3,
      picture: `${this.at(0x0601) & 1 ? walking : 'scene'} ${this.at(0x1008) & 1}`,
    };
  }

  /**
   * Returns the pixels that are sent of a picture of 320 x 240, or of darkness. The border repeats the edge with
   * another value, so that a picture that is shifted is another one.
   */
  pixels(picture) {
    const [columns, rows] = this.size();
    const out = new Uint8Array(columns * rows);
    const [flipX, flipY] = [this.at(0x0101) & 1, this.at(0x0101) & 2];
    const [gain, more] = this.light();
    const pattern = this.at(0x0601) & 1 ? (this.at(0x0601) & 0x10 ? 'walking' : 'bar') : null;
    // Walking ones: each value is twice the last one, and 1 follows 0 (SparkFun). Black levels and gains act on them.
    let walking = 1;
    for (let y = 0; y < rows; y++) {
      for (let x = 0; x < columns; x++) {
        const [sx, sy] = [(flipX ? columns - 1 - x : x) - 2, (flipY ? rows - 1 - y : y) - 2];
        const inside = sx >= 0 && sx < 320 && sy >= 0 && sy < 240;
        let value = picture && inside ? picture[sy * 320 + sx] : inside ? 0 : 199;
        if (pattern === 'bar') value = x & 0xff;
        if (pattern === 'walking') {
          const blacks = this.at(0x1000) & 1 ? this.at(0x1003) : 0;
          value = Math.min(255, walking + blacks);
          walking = walking ? (walking << 1) & 0xff : 1;
        } else if (gain !== 1 || more !== 0) {
          value = Math.max(0, Math.min(255, Math.round(value * gain + more)));
        }
        out[y * columns + x] = value;
      }
    }
    // 0x1008 bit 0: a pixel that differs from both neighbors becomes one of them.
    if (this.at(0x1008) & 1) {
      for (let at = out.length - 2; at > 0; at--) {
        const [a, b] = [Math.min(out[at - 1], out[at + 1]), Math.max(out[at - 1], out[at + 1])];
        out[at] = Math.max(a, Math.min(b, out[at]));
      }
    }
    return out;
  }
}
