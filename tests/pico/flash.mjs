// The flash of a Raspberry Pi Pico, a W25Q16JV, and the functions of the boot ROM that erase and program it (RP2040 data
// sheet, 2.8.3). The ROM itself is a table of functions that call out of the emulator.
//
// An erasure sets bits, and programming clears them (W25Q16JV data sheet, 8.2). Each takes its longest time (9.6). While
// the serial interface is not set up to read the flash as memory, nothing may run from there, and no interrupt may come.

const SIZE = 0x20_0000, SECTOR = 4096, PAGE = 256;
const ERASE_NANOS = 400e6, PROGRAM_NANOS = 3e6;
const FLASH = 0x1000_0000, RAM = 0x2000_0000;
// The upper five digits of their addresses, by which the emulator finds them.
const SSI = 0x18000, CACHE = 0x14000;
// Places in the ROM: pointers that programs look for, and what they point to here.
const TABLE_AT = 0x14, LOOKUP_AT = 0x18, TABLE = 0x40, LOOKUP = 0x80, FIRST = 0xa0;
// The codes of the functions.
const NAMES = ['C4', 'IF', 'EX', 'RE', 'RP', 'FC', 'CX', 'UB'];
const BREAK = 0xbe00, RETURN = 0x4770;
// The register of the serial interface's data, and the instruction that reads the unique number behind four bytes
// without a meaning (W25Q16JV data sheet, 8.2).
const DATA = 0x60, READ_UNIQUE_ID = 0x4b, DUMMY = [0, 0, 0, 0];
export const UNIQUE_ID = [0xe6, 0x61, 0x40, 0x31, 0x1f, 0x2a, 0x53, 0x27];

/** The power fails while the flash is written. */
export class PowerFailed extends Error {}

export class Flash {
  constructor() {
    this.bytes = new Uint8Array(SIZE).fill(0xff);
    // The bytes that were programmed, and those of sectors that were erased.
    this.changed = 0;
    this.cutAfter = null;
    this.problems = new Set();
  }

  /** Connects the flash and the ROM to a chip. `wait` lets the core wait for some time. */
  connect(mcu, wait) {
    this.mcu = mcu;
    this.wait = wait;
    this.away = false;
    this.step = null;
    mcu.flash.set(this.bytes);
    this.answer(mcu.peripherals[SSI]);
    const rom = new DataView(mcu.bootrom.buffer);
    const half = (at, value) => rom.setUint16(at, value, true);
    half(TABLE_AT, TABLE);
    half(LOOKUP_AT, LOOKUP | 1);
    [LOOKUP, ...NAMES.map((_, k) => FIRST + 4 * k)].forEach((at, number) => {
      half(at, BREAK | number);
      half(at + 2, RETURN);
    });
    // The cache streams nothing (RP2040 data sheet, 2.6.3), which the emulator does not have.
    mcu.peripherals[CACHE] = { readUint32: () => 0, writeUint32Atomic() {} };
    mcu.onBreak = (number) => {
      // The program's own are elsewhere.
      if (mcu.core.PC < TABLE || mcu.core.PC > FIRST + 4 * NAMES.length) return;
      if (number === 0) this.lookup();
      else this[NAMES[number - 1]]();
    };
  }

  /** Answers what is sent while the flash is not read as memory. */
  answer(ssi) {
    const [read, write] = [ssi.readUint32.bind(ssi), ssi.writeUint32.bind(ssi)];
    const isAsked = (offset) => offset === DATA && this.step === 'serial';
    let left = [];
    ssi.writeUint32 = (offset, value) => {
      if (!isAsked(offset)) return write(offset, value);
      left = (value & 0xff) === READ_UNIQUE_ID ? [...DUMMY, ...UNIQUE_ID] : [];
    };
    ssi.readUint32 = (offset) => (isAsked(offset) ? (left.shift() ?? 0) : read(offset));
  }

  /** Returns the address of a function: table and code are in the first two registers. */
  lookup() {
    const { registers } = this.mcu.core;
    const [table, code] = registers;
    const found = NAMES.indexOf(String.fromCharCode(code & 0xff, code >> 8));
    if (table !== TABLE || found < 0) this.problems.add(`the boot ROM is asked for function ${code} of table ${table}`);
    registers[0] = found < 0 ? 0 : (FIRST + 4 * found) | 1;
  }

  /** Notes what must not be so while the flash is away. */
  check(isRight, problem) {
    if (!isRight) this.problems.add(problem);
  }

  /** Copies words. */
  C4() {
    const { registers } = this.mcu.core;
    const [to, from, count] = registers;
    this.check(count % 4 === 0 && to % 4 === 0 && from % 4 === 0, 'words that are copied are not aligned');
    for (let at = 0; at < count; at += 4) this.mcu.writeUint32(to + at, this.mcu.readUint32(from + at));
  }

  /** Connects the interface to the pads. */
  IF() {
    this.check(this.mcu.core.PM, 'interrupts are on while the flash is written');
    this.away = true;
    this.step = 'connected';
  }

  /** Ends reading as memory. */
  EX() {
    this.check(this.step === 'connected', 'the flash leaves reading without being connected');
    this.mcu.peripherals[SSI].spictlr0 = 0;
    this.step = 'serial';
    this.isStale = false; // whether the cache has what was changed since
  }

  /** Erases sectors. */
  RE() {
    const [from, count] = this.mcu.core.registers;
    this.check(this.step === 'serial', 'sectors are erased while the flash is read');
    const isWhole = from % SECTOR === 0 && count % SECTOR === 0 && from + count <= SIZE;
    this.check(isWhole, `an erasure of ${count} bytes at ${from}`);
    if (!isWhole) return;
    this.isStale = true;
    for (let sector = from; sector < from + count; sector += SECTOR) {
      const left = this.left(SECTOR);
      this.bytes.fill(0xff, sector, sector + left);
      // The rest is anything between what it was and erased.
      if (left < SECTOR) for (let at = sector + left; at < sector + SECTOR; at += 3) this.bytes[at] |= 0x5a;
      this.end(left < SECTOR);
    }
    this.wait((count / SECTOR) * ERASE_NANOS);
  }

  /** Programs pages. */
  RP() {
    const [to, from, count] = this.mcu.core.registers;
    this.check(this.step === 'serial', 'pages are programmed while the flash is read');
    const isWhole = to % PAGE === 0 && count % PAGE === 0 && to + count <= SIZE && from >= RAM;
    this.check(isWhole, `${count} bytes at ${from} are programmed at ${to}`);
    if (!isWhole) return;
    this.isStale = true;
    for (let page = 0; page < count; page += PAGE) {
      const data = this.mcu.sram.subarray(from - RAM + page, from - RAM + page + PAGE);
      // Bytes that stay as they are do not count.
      for (let at = 0; at < PAGE; at++) {
        const old = this.bytes[to + page + at], now = old & data[at];
        if (now === old) continue;
        const left = this.left(1);
        this.bytes[to + page + at] = left ? now : now | (old & 0x5a);
        this.end(left === 0);
      }
    }
    this.wait((count / PAGE) * PROGRAM_NANOS);
  }

  /** Forgets what is cached. */
  FC() {
    this.check(this.step === 'serial', 'the cache is flushed at another time');
    this.mcu.flash.set(this.bytes);
    this.step = 'flushed';
    this.isStale = false;
  }

  /** Reads as memory, slowly. */
  CX() {
    this.check(!this.isStale, 'the flash is read again before the cache is flushed');
    this.mcu.peripherals[SSI].spictlr0 = 0x0300_0218;
  }

  /** Starts the boot loader for USB, whose drive is no part of this. */
  UB() {
    const { core, usbCtrl, sram } = this.mcu;
    const [light, disabled] = core.registers;
    this.check(light === 0 && disabled === 0, 'the boot loader is started without its drive');
    this.boots = true;
    usbCtrl.sieCtrl = 0;
    // A loop.
    sram.set([0xfe, 0xe7]);
    core.PC = RAM;
  }

  /** Returns how many of these bytes change before the power fails. */
  left(count) {
    const left = this.cutAfter === null ? count : Math.min(count, this.cutAfter - this.changed);
    this.changed += left;
    return left;
  }

  end(isCut) {
    if (isCut) throw new PowerFailed();
  }

  /** Is called before an instruction. */
  before(at) {
    if (!this.away || at < FLASH || at >= RAM) return;
    this.away = false;
    const isRead = !this.isStale && this.mcu.peripherals[SSI].spictlr0 !== 0;
    this.check(isRead, `the program goes on in the flash when that is ${this.step}`);
  }
}
