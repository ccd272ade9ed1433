// An HM01B0: what its registers make of its pins.
//
// Registers and bits are those of Himax's list as public drivers quote it: OpenMV's and Zephyr's drivers, Arm's and
// P. Marques's for the RP2040. They are not those of the firmware's table. What none of them says is a guess, and the
// comment says so.

const ADDRESS = 0x24;
// What a reset sets, as far as the drivers say it: standby, automatic exposure on, the whole array, 8 wires, the clock
// halved. The lengths of lines and frames are a guess.
const DEFAULTS = {
  0x0000: 0x01, 0x0001: 0xb0, 0x0100: 0x00, 0x0101: 0x00, 0x0202: 0x01, 0x0203: 0x08, 0x0205: 0x00, 0x020e: 0x01,
  0x020f: 0x00, 0x0340: 0x02, 0x0341: 0x32, 0x0342: 0x01, 0x0343: 0x72, 0x0383: 0x01, 0x0387: 0x01, 0x0390: 0x00,
  0x0601: 0x00, 0x2100: 0x01, 0x3010: 0x00, 0x3011: 0x70, 0x3059: 0x02, 0x3060: 0x0a, 0x3068: 0x20,
};
const READ_ONLY = new Set([0x0000, 0x0001]);
// Exposure in lines at which the clip was taken.
const NOMINAL_LINES = 240;

/** The sensor. `slips` has registers that act as if another value were written, although the right one is read back. */
export class Hm01b0 {
  constructor() {
    this.present = true;
    this.holds = 0; // clocks for which it holds the data line
    this.slips = {};
    this.nackAfter = null; // how often it answers before it fails once
    this.powerOn();
  }

  /** Sets all registers to their defaults. */
  powerOn() {
    this.registers = { ...DEFAULTS };
    this.touched = new Set();
    this.pointer = 0;
    this.bytes = [];
  }

  /** Returns whether it acknowledges this address. */
  answers(address) {
    if (this.nackAfter === 0) {
      this.nackAfter = null;
      return false;
    }
    if (this.nackAfter !== null) this.nackAfter -= 1;
    return this.present && address === ADDRESS;
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
      this.powerOn();
    } else if (!READ_ONLY.has(register)) {
      this.registers[register] = value;
      this.touched.add(register);
    }
  }

  /** Returns the value that a register acts by. */
  at(register) {
    if (register in this.slips && this.touched.has(register)) return this.slips[register];
    return this.registers[register] ?? 0;
  }

  /** Returns a number of two registers. */
  number(high) {
    return (this.at(high) << 8) | this.at(high + 1);
  }

  streams() {
    return this.present && this.at(0x0100) === 1;
  }

  /** Returns the seconds of a frame from a clock of this frequency. */
  period(clock) {
    const pixelClock = clock / [8, 4, 2, 1][this.at(0x3060) & 3];
    return (this.number(0x0342) * this.number(0x0340)) / pixelClock;
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
    const parts = [];
    for (let at = 0; at < 8; at += wires) parts.push((pixel >> at) & mask);
    // Bit 4 of 0x3060: the high bits first.
    return this.at(0x3060) & 0x10 ? parts.reverse() : parts;
  }

  /** Returns whether data is to be taken at the rising edge of PCLK. */
  rises() {
    return !(this.at(0x3068) & 1);
  }

  /**
   * Returns the pixels that are sent of a picture of 320 x 240, or of darkness. The border repeats the edge with another
   * value, so that a picture that is shifted is another one.
   */
  pixels(picture) {
    const [columns, rows] = this.size();
    const out = new Uint8Array(columns * rows);
    const [flipX, flipY] = [this.at(0x0101) & 1, this.at(0x0101) & 2];
    const gain = (this.number(0x0202) / NOMINAL_LINES) * 2 ** ((this.at(0x0205) >> 4) & 7) * (this.number(0x020e) / 0x100);
    // Automatic exposure brightens what it sees; how much is a guess.
    const light = this.at(0x2100) & 1 ? gain * 1.2 : gain;
    for (let y = 0; y < rows; y++) {
      for (let x = 0; x < columns; x++) {
        const [sx, sy] = [(flipX ? columns - 1 - x : x) - 2, (flipY ? rows - 1 - y : y) - 2];
        const inside = sx >= 0 && sx < 320 && sy >= 0 && sy < 240;
        let value = picture && inside ? picture[sy * 320 + sx] : inside ? 0 : 199;
        if (light !== 1) value = Math.min(255, Math.round(value * light));
        if (this.at(0x0601) & 1) value = x & 0xff;
        out[y * columns + x] = value;
      }
    }
    return out;
  }
}
