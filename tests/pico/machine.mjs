// A Raspberry Pi Pico in rp2040js, with an HM01B0 at its pins and a host at its serial line: at its USB, or its UART.
//
// The emulator is used as it is, but for this:
// - The machines of the PIO are stepped with the camera's pins, as often as they can do something.
// - The pins that the PIO reads are kept as one number.
// - An address without acknowledge flags the empty queue of the bus.
// - An SEV instruction sets the core's event, which the emulator leaves out.
// - A fault enters its handler, which the emulator does not do by itself.
// Not modeled: electricity, and the time of instructions in flash. The time of a byte that the board sends is not either, and
// that of the bus only if a case sets it.

import fs from 'node:fs';
import { RP2040 } from 'rp2040js';
import { Flash } from './flash.mjs';
import { Hm01b0 } from './sensor.mjs';
import { UsbHost } from './usb.mjs';

// The wires of wstac-fw/README.md.
const DATA = 6, PCLK = 14, HREF = 15, VSYNC = 16, CLOCK = 21, SENDS = 0, EVENTS = 25, TROUBLE = 22;
/** The pins of the bus. */
export const SDA = 4, SCL = 5;
// Functions of pins (RP2040 data sheet, 2.19.2).
// Numbers of exceptions.
const HARD_FAULT = 3, INTERRUPTS = 16;
const UART = 2, I2C = 3, SIO = 5, PIO0 = 6, GPOUT = 8;
const FLASH = 0x1000_0000, RAM = 0x2000_0000, BOOT2 = 0x100;
// Where the boot ROM copies the second boot loader to. Its stack is below that (RP2040 data sheet, 2.8.1).
const LOADER = 0x2004_1f00;
const FRAME = 1e9 / 30;
/** A byte and its acknowledge on a bus of 100 kHz. */
export const BUS_BYTE = 9e9 / 100e3;
// A byte on the serial line to the board: 10 bits.
const BYTE = 10e9 / 115_200;
// The registers that let clocks run, WAKE_EN0 and 1, and whose clock which bit is (RP2040 data sheet, 2.15.7). Each has its
// page of addresses.
const WAKE = 0xa0;
const CLOCKED = {
  ADC: [2, 0x4004c], DMA: [5, 0x50000], I2C0: [6, 0x40044], I2C1: [7, 0x40048], IO: [8, 0x40014], PADS: [11, 0x4001c],
  PIO0: [12, 0x50200], PIO1: [13, 0x50300], PWM: [17, 0x40050], RTC: [22, 0x4005c], SPI0: [25, 0x4003c], SPI1: [27, 0x40040],
  TIMER: [37, 0x40054], UART0: [39, 0x40034], UART1: [41, 0x40038], USB: [43, 0x50110], WATCHDOG: [44, 0x40058],
};

/** CRC-32/MPEG-2, which the boot ROM demands of the second boot loader. */
function crc(bytes) {
  let rest = 0xffff_ffff;
  for (const byte of bytes) {
    rest ^= byte << 24;
    for (let bit = 0; bit < 8; bit++) rest = rest & 0x8000_0000 ? (rest << 1) ^ 0x04c1_1db7 : rest << 1;
  }
  return rest >>> 0;
}

/** Returns the addresses of the functions of a program, by their names. */
function functions(file) {
  const elf = fs.readFileSync(file);
  const [table, size, count] = [elf.readUInt32LE(32), elf.readUInt16LE(46), elf.readUInt16LE(48)];
  const sections = Array.from({ length: count }, (_, k) => {
    const [type, offset, length, link] = [4, 16, 20, 24].map((field) => elf.readUInt32LE(table + k * size + field));
    return { type, offset, length, link };
  });
  const { offset, length, link } = sections.find(({ type }) => type === 2);
  const found = {};
  for (let at = offset; at < offset + length; at += 16) {
    const name = sections[link].offset + elf.readUInt32LE(at);
    if ((elf[at + 12] & 15) === 2) found[elf.toString('latin1', name, elf.indexOf(0, name))] = elf.readUInt32LE(at + 4);
  }
  return found;
}

/** Returns the parts of a program that are flashed, of an ELF or a UF2 file (UF2 1.0 for the RP2040). */
function parts(file) {
  const elf = fs.readFileSync(file);
  if (file.endsWith('.uf2')) {
    return Array.from({ length: elf.length / 512 }, (_, number) => {
      const block = elf.subarray(512 * number, 512 * (number + 1));
      const words = [0, 4, 8, 16, 20, 24, 28, 508].map((at) => block.readUInt32LE(at));
      const expected = [0x0a324655, 0x9e5d5157, 0x2000, 256, number, elf.length / 512, 0xe48bff56, 0x0ab16f30];
      if (words.some((word, k) => word !== expected[k])) throw new Error(`${file}: block ${number} is not one of an RP2040`);
      return [block.readUInt32LE(12), block.subarray(32, 288)];
    });
  }
  const [table, size, count] = [elf.readUInt32LE(28), elf.readUInt16LE(42), elf.readUInt16LE(44)];
  const found = [];
  for (let at = table; at < table + size * count; at += size) {
    const [type, offset, , place, length] = [0, 4, 8, 12, 16].map((field) => elf.readUInt32LE(at + field));
    if (type === 1 && length > 0) found.push([place, elf.subarray(offset, offset + length)]);
  }
  return found;
}

/** The board with a program and a clip of pictures. `faults` has the faults of the clip's frames, by number. */
export class Board {
  constructor(program, clip, faults = {}, flash = new Flash(), fps = 30) {
    this.flash = flash;
    this.frameTime = 1e9 / fps;
    this.busByte = 0; // the time of a byte on the bus
    this.busBytes = 0; // those that took it
    for (const [place, bytes] of parts(program)) flash.bytes.set(bytes, place - FLASH);
    this.functions = program.endsWith('.uf2') ? {} : functions(program);
    this.clip = clip;
    this.faults = faults;
    this.sensor = new Hm01b0();
    this.usb = new UsbHost();
    this.sent = [];
    this.requests = [];
    // What the host sends, and when its next byte comes.
    this.incoming = [];
    this.nextByte = 0;
    this.now = 0;
    this.began = null; // the time of the clip's first frame
    this.warnings = new Set();
    this.unclocked = new Set();
    this.instructions = 0;
    this.cycles = 0; // those in which the core does not sleep
    this.stalledUntil = 0;
    this.resets = 0;
    this.lights = [];
    this.chance = 1;
    this.power();
  }

  /** Switches the chip on, or resets it: memory keeps what it has. */
  power() {
    this.stalledUntil = 0;
    const before = this.mcu;
    const mcu = (this.mcu = new RP2040());
    const core = mcu.core;
    const warn = (part, text) => this.warnings.add(`${part}: ${text}`);
    mcu.logger = { debug() {}, info: (_, text) => text === 'SEV' && (core.eventRegistered = true), warn, error: warn };
    this.flash.connect(mcu, (nanos) => this.stall(nanos));
    // After power was off, memory has arbitrary bytes.
    mcu.sram.fill(0xa5);
    if (before) {
      mcu.sram.set(before.sram);
      mcu.clock.tick(before.clock.nanos);
    }
    const boot = mcu.flash.subarray(0, BOOT2);
    if (crc(boot.subarray(0, BOOT2 - 4)) !== boot[252] + (boot[253] << 8) + (boot[254] << 16) + boot[255] * 2 ** 24) {
      throw new Error('the boot ROM refuses the second boot loader');
    }
    mcu.sram.set(boot, LOADER - RAM);
    [core.SP, core.LR, core.PC] = [LOADER, 0, LOADER];
    mcu.uart[0].onByte = (byte) => mcu.gpio[SENDS].functionSelect === UART && this.sent.push(byte);
    this.usb.connect(mcu, (bytes) => this.sent.push(...bytes));
    const dog = mcu.peripherals[0x40058];
    dog.onWatchdogTrigger = () => {
      // What the watchdog resets is chosen by WDSEL (RP2040 data sheet, 2.13.5): nothing until the program has chosen.
      if (mcu.peripherals[0x40010].wdsel !== 0) this.resetBy = dog.reason;
      // The emulator would trigger again in the same instant, for ever.
      dog.alarm.enable = false;
    };
    if (this.reason !== undefined) dog.reason = this.reason;
    this.gateClocks(mcu);
    this.bus(mcu.i2c[0]);
    this.pio = mcu.pio[0];
    this.pio.run = () => {};
    this.levels = 0;
    Object.defineProperty(mcu, 'gpioValues', { get: () => this.levels });
    // A bus with open drains: a line is high if a resistor pulls it up, and nothing holds it low.
    this.lines = () => {
      const low = (pin) => mcu.gpio[pin].outputEnable && !mcu.gpio[pin].outputValue;
      const { sensor } = this;
      if (this.wasLow && !low(SCL)) sensor.holds = Math.max(0, sensor.holds - 1);
      this.wasLow = low(SCL);
      for (const pin of [SDA, SCL]) {
        const isHeld = sensor.shorted.includes(pin) || (pin === SDA && sensor.holds > 0);
        const isHigh = !low(pin) && !isHeld && (sensor.pullsUp || mcu.gpio[pin].pullupEnabled);
        mcu.gpio[pin].rawInputValue = isHigh;
        this.level(pin, isHigh);
      }
    };
    mcu.gpio[SCL].addListener(this.lines);
    mcu.gpio[SDA].addListener(this.lines);
    this.lines();
  }

  /** Keeps which clocks run, which the emulator does not. What is used without one is in `unclocked`. */
  gateClocks(mcu) {
    const { clocks, peripherals } = mcu;
    const enabled = [0xffff_ffff, 0xffff_ffff];
    const [read, write] = [clocks.readUint32.bind(clocks), clocks.writeUint32.bind(clocks)];
    const place = (offset) => [WAKE, WAKE + 4].indexOf(offset);
    clocks.readUint32 = (offset) => (place(offset) < 0 ? read(offset) : enabled[place(offset)]);
    clocks.writeUint32 = (offset, value) => (place(offset) < 0 ? write(offset, value) : void (enabled[place(offset)] = value >>> 0));
    this.runs = (part) => Boolean((enabled[CLOCKED[part][0] >> 5] >>> (CLOCKED[part][0] & 31)) & 1);
    this.stopped = () => Object.keys(CLOCKED).filter((part) => !this.runs(part));
    for (const [part, [, page]] of Object.entries(CLOCKED)) {
      for (const name of ['readUint32', 'writeUint32']) {
        const access = peripherals[page][name].bind(peripherals[page]);
        peripherals[page][name] = (...all) => (this.runs(part) || this.unclocked.add(part), access(...all));
      }
    }
  }

  /** Returns which lights are lit. */
  lit() {
    return [EVENTS, TROUBLE].map((pin) => this.mcu.gpio[pin].outputEnable && this.mcu.gpio[pin].outputValue);
  }

  bus(i2c) {
    const wired = () => [SDA, SCL].every((pin) => this.mcu.gpio[pin].functionSelect === I2C);
    let next;
    const alarm = this.mcu.clock.createAlarm(() => next());
    const later = (done) => {
      if (this.busByte === 0) return done();
      this.busBytes += 1;
      next = done;
      alarm.schedule(this.busByte);
    };
    i2c.onStart = () => {
      // While a line is low, the interface waits for ever.
      const lines = (1 << SDA) | (1 << SCL);
      if ((this.levels & lines) !== lines) return;
      this.sensor.start();
      i2c.completeStart();
    };
    const connect = (address) => {
      const answers = wired() && this.hertz() > 0 && this.sensor.answers(address);
      i2c.completeConnect(answers);
      // An abort empties the queue of what is sent (RP2040 data sheet, 4.3.10), which the emulator does not flag.
      if (!answers) i2c.setInterrupts(1 << 4);
    };
    i2c.onConnect = (address) => later(() => connect(address));
    i2c.onWriteByte = (value) => later(() => (this.sensor.write(value), i2c.completeWrite(true)));
    i2c.onReadByte = () => later(() => i2c.completeRead(this.sensor.read()));
    i2c.onStop = () => i2c.completeStop();
  }

  /** Returns the frequency of the sensor's clock, by the registers of the clock output. */
  hertz() {
    const { clocks, gpio, clkSys } = this.mcu;
    const control = clocks.gpout0Ctrl;
    const isOn = gpio[CLOCK].functionSelect === GPOUT && control & 0x800 && ((control >> 5) & 15) === 6;
    return isOn ? clkSys / (clocks.gpout0Div / 256) : 0;
  }

  /** Lets the core run for some time. */
  run(nanos) {
    const { core, clock } = this.mcu;
    const end = this.now + nanos;
    this.debt = (this.debt ?? 0) + nanos;
    while (this.debt > 0) {
      if (this.now >= this.stalledUntil && !core.waiting) {
        this.flash.before(core.PC);
        const cycles = core.executeInstruction();
        const nanos = (cycles * 1e9) / this.mcu.clkSys;
        this.instructions += 1;
        this.cycles += cycles;
        this.debt -= nanos;
        this.tick(nanos);
      } else {
        const next = clock.nextAlarm ? Math.max(0, clock.nextAlarm.nanos - clock.nanos) : this.debt;
        const step = Math.min(Math.max(1, next), this.debt);
        this.debt -= step;
        this.tick(step);
      }
      if (this.resetBy) {
        this.reason = this.resetBy;
        this.resetBy = undefined;
        this.resets += 1;
        this.power();
        return this.run(Math.max(0, end - this.now));
      }
    }
  }

  /** Counts the core's reads and writes of data from now on, by memory. What an instruction is read from does not count. */
  countAccesses() {
    const { core } = this.mcu;
    const accesses = (this.accesses = { RAM: 0, flash: 0, peripherals: 0 });
    for (const name of ['readUint32', 'readUint16', 'readUint8', 'writeUint32', 'writeUint16', 'writeUint8']) {
      const access = core[name].bind(core);
      core[name] = (address, value) => {
        const isCode = name === 'readUint16' && (address === core.PC || address === core.PC + 2);
        const region = address >>> 28;
        if (!isCode) accesses[region === 2 ? 'RAM' : region <= 1 ? 'flash' : 'peripherals'] += 1;
        return access(address, value);
      };
    }
  }

  /** Sends the core to an address without instructions, whose fault it takes. */
  crash() {
    this.mcu.core.PC = 0x2000_0100;
    this.mcu.core.exceptionEntry(HARD_FAULT);
  }

  /** Sends the core into a function of the program that panics. Nothing else calls it. */
  panic() {
    this.mcu.core.PC = this.functions.__defmt_default_panic & ~1;
  }

  /** Sends the core into the handler of an interrupt, whatever is enabled. */
  interrupt(number) {
    this.mcu.core.exceptionEntry(INTERRUPTS + number);
  }

  /** Stops the core for some time, or until a reset. Everything else continues. */
  stall(nanos) {
    this.stalledUntil = this.now + nanos;
  }

  /** Resets the chip at once, as a debugger does. */
  reset() {
    this.resets += 1;
    this.reason = 0;
    this.power();
  }

  /** Returns which of the camera's wires have no pull-down, or are no inputs. */
  floating() {
    const wires = [...Array(this.sensor.wires()).keys()].map((wire) => DATA + wire);
    return [...wires, PCLK, HREF, VSYNC].filter((pin) => {
      const gpio = this.mcu.gpio[pin];
      return !gpio.pulldownEnabled || gpio.pullupEnabled || !gpio.inputEnable;
    });
  }

  tick(nanos) {
    this.now += nanos;
    if (this.usb.isOpen) {
      if (this.incoming.length > 0) this.usb.send(this.incoming.splice(0));
    } else if (this.incoming.length > 0 && this.now >= this.nextByte && this.mcu.gpio[SENDS].functionSelect === UART) {
      this.mcu.uart[0].feedByte(this.incoming.shift());
      this.nextByte = this.now + BYTE;
    }
    this.mcu.clock.tick(nanos);
  }

  /** Sets a pin of the camera, as far as the program lets it in, and lets the machines follow. */
  pin(number, value) {
    const gpio = this.mcu.gpio[number];
    if (gpio.rawInputValue === value) return;
    // Machines that the program has started meanwhile come to where they wait.
    this.follow(8);
    gpio.rawInputValue = value;
    this.level(number, gpio.inputValue && gpio.functionSelect === PIO0);
    this.follow(4);
  }

  level(number, value) {
    this.levels = value ? this.levels | (1 << number) : this.levels & ~(1 << number);
  }

  /** Steps the machines. */
  follow(steps) {
    for (let step = 0; step < steps; step++) {
      for (const machine of this.pio.machines) if (machine.enabled) machine.step();
    }
  }

  /** Returns whether the program captures the picture to use it: machines 0 and 1 run, and no line interrupts. */
  uses() {
    const [pixels, lines] = this.pio.machines;
    return pixels.enabled && lines.enabled && !(this.pio.irq0IntEnable & 0x200);
  }

  /** Plays the clip, and the frames before it. Returns what came out of the serial line. */
  play(longest = 90) {
    const latest = () => this.now > (this.clip.length + longest) * this.frameTime;
    while (!latest()) {
      const slot = this.began === null ? null : Math.round((this.now - this.began) / this.frameTime);
      if (slot !== null && slot >= this.clip.length) {
        // The last results are sent.
        this.run(FRAME / 2);
        break;
      }
      this.frame(slot);
    }
    return Buffer.from(this.sent);
  }

  /** Sends a frame, or lets its time pass. `number` is that of the clip. */
  frame(number) {
    this.incoming.push(...this.requests.splice(0).flatMap((request) => [...request]));
    this.lights.push(this.lit());
    const begins = this.now;
    const hertz = this.hertz();
    const fault = this.faults[number];
    const done = typeof fault === 'function' ? fault(this) : fault;
    this.lines();
    let period = this.sensor.streams() && hertz ? this.sensor.period(hertz) * 1e9 : this.frameTime;
    // The clip's rate is whole. The sensor's is a little different, by arithmetic alone.
    if (Math.abs(period / this.frameTime - 1) < 0.01) period = this.frameTime;
    if (!this.sensor.streams() || !hertz || done === 'silent') return this.until(begins + period);
    if (this.began === null && this.uses()) {
      this.began = begins;
      this.instructionsBefore = this.instructions;
      return this.frame(0);
    }
    const isSeen = this.pio.machines.some((machine) => machine.enabled);
    if (isSeen) this.picture(number === null ? null : this.clip[number], hertz, done);
    this.sensor.endFrame();
    this.until(begins + period);
  }

  /** Lets the time pass until then. */
  until(time) {
    if (time > this.now) this.run(time - this.now);
  }

  /** Returns what the wires have while they change from one value to another: each has the old one or the new one. */
  mix(before, after) {
    this.chance = (Math.imul(this.chance, 1_664_525) + 1_013_904_223) >>> 0;
    return before ^ ((before ^ after) & (this.chance >>> 24));
  }

  picture(picture, hertz, fault) {
    const { sensor } = this;
    const [columns, rows] = sensor.size();
    const pixels = sensor.pixels(picture);
    const line = (sensor.period(hertz) * 1e9) / sensor.lines(), pixel = line / sensor.clocks();
    const wires = sensor.wires(), rises = sensor.rises();
    const parts = Array.from({ length: 256 }, (_, value) => sensor.bits(value));
    // Only the pins that the program lets in, at their places.
    const mask = [...Array(wires).keys()].reduce((sum, wire) => {
      const gpio = this.mcu.gpio[DATA + wire];
      return gpio.inputEnable && gpio.functionSelect === PIO0 ? sum | (1 << wire) : sum;
    }, 0);
    const clock = this.mcu.gpio[PCLK];
    const clocked = clock.inputEnable && clock.functionSelect === PIO0;
    const machine = this.pio.machines[0];
    const drive = (value) => (this.levels = (this.levels & ~(0xff << DATA)) | ((value & mask) << DATA));
    let last = 0;
    const send = (value) => {
      // Data changes at the edge that is not the one to take it at.
      drive(value);
      last = value;
      if (!clocked) return;
      clock.rawInputValue = rises;
      this.level(PCLK, clock.inputValue);
      if (machine.enabled) for (let step = 0; step < 3; step++) machine.step();
      clock.rawInputValue = !rises;
      this.level(PCLK, clock.inputValue);
      drive(this.mix(last, ~last));
      if (machine.enabled) for (let step = 0; step < 3; step++) machine.step();
    };
    // VSYNC comes with the first line, or some lines earlier or later.
    const first = this.now + Math.max(0, sensor.early()) * line;
    const late = Math.max(0, -sensor.early());
    this.pin(PCLK, !rises);
    if (late === 0) this.pin(VSYNC, true);
    for (let y = 0; y < rows; y++) {
      if (fault === 'sync inside' && y === rows >> 1) {
        this.pin(VSYNC, false);
        this.run(line / 2);
        this.pin(VSYNC, true);
      }
      const lineBegins = first + y * line;
      this.until(lineBegins - sensor.hrefEarly() * pixel);
      if (y === late && late > 0) this.pin(VSYNC, true);
      if (fault === 'lost line' && y === 100) continue;
      if (fault === 'late core' && y === 110) this.stall(30 * line);
      if (fault === 'late DMA' && (y === 110 || y === 111)) this.holdDma(y === 110);
      this.pin(HREF, true);
      this.until(lineBegins);
      // What is on the wires then is a guess.
      for (let clocks = (sensor.pixelsBefore() * 8) / wires; clocks > 0; clocks--) send(0x5a);
      for (let x = 0; x < columns; x++) {
        if (fault === 'split line' && y === 100 && x === 160) {
          this.pin(HREF, false);
          this.pin(HREF, true);
        }
        const values = parts[pixels[y * columns + x]];
        for (const value of values) send(value);
        // The core runs every 16 pixels, and the DMA whenever a word is there.
        if (x % 4 === 3) this.mcu.clock.tick(0);
        if (x % 16 === 15) this.until(lineBegins + (x + 1) * pixel);
      }
      this.pin(HREF, false);
      if (fault === 'line too many' && y === 100) {
        this.run(line / 50);
        this.pin(HREF, true);
        this.run(line / 50);
        this.pin(HREF, false);
      }
    }
    this.until(first + rows * line);
    if (fault !== 'lost sync') this.pin(VSYNC, false);
  }

  /** Keeps the DMA from taking what machine 0 has, or lets it again. */
  holdDma(isHeld) {
    const { dma } = this.mcu;
    const number = this.pio.dreqRx[0];
    if (isHeld) {
      let value = dma.dreq[number];
      Object.defineProperty(dma.dreq, number, { configurable: true, get: () => false, set: (now) => (value = now) });
      this.wanted = () => value;
    } else {
      const value = this.wanted();
      Object.defineProperty(dma.dreq, number, { configurable: true, writable: true, value: false });
      if (value) dma.setDREQ(number);
    }
  }
}
