// Counts what a program of the Raspberry Pi Pico does per frame time in rp2040js, as JSON: untouched, during two slides, and at
// rest.
//
//     node power.mjs WSTAC PROGRAM REST
//
// WSTAC is the command on the host. REST is the seconds that the program was built with as WSTAC_REST.

import { BUS_BYTE, Board } from './machine.mjs';
import { Host, ofKind, same } from './host.mjs';

const FPS = 30;
const [, , wstac, program, rest] = process.argv;
if (!rest) {
  console.error('usage: node power.mjs WSTAC PROGRAM REST');
  process.exit(2);
}

/** A board that counts during spans of its clip: of each, the first frame and the one behind the last. */
class Counting extends Board {
  constructor(clip, spans) {
    super(program, clip);
    this.busByte = BUS_BYTE;
    Object.assign(this, { spans, found: [] });
  }

  counted() {
    const { now, instructions, cycles } = this;
    return { now, instructions, cycles, ...this.accesses };
  }

  frame(number) {
    if (number === 0) this.countAccesses();
    this.spans.forEach(([from, to], span) => {
      this.found[span] ??= [];
      const [begin, end] = this.found[span];
      if ((!begin && number >= from) || (begin && !end && number >= to)) this.found[span].push(this.counted());
    });
    super.frame(number);
  }

  /** Returns what a frame time takes in each span. */
  perFrame() {
    return this.found.map(([begin, end]) => {
      const frames = (end.now - begin.now) / this.frameTime;
      const keys = Object.keys(begin).filter((key) => key !== 'now');
      const mean = Object.fromEntries(keys.map((key) => [key, (end[key] - begin[key]) / frames]));
      return { ...mean, hertz: this.mcu.clkSys, awake: (mean.cycles * 1e9) / this.frameTime / this.mcu.clkSys };
    });
  }
}

const host = new Host(wstac);
// From the baseline's end to the end of the second slide's sample.
const slides = new Counting(host.frames, [[25, host.frames.length - 2]]);
const events = ofKind(host.ofLine(slides.play()), 'event');
if (!same(events, host.events)) throw new Error(`events are ${events}, expected ${host.events}`);
const first = FPS * rest + 60;
const dark = new Counting(new Array(first + 70).fill(host.frames[0]), [[30, 59], [first, first + 60]]);
dark.play();
const [watching, resting] = dark.perFrame();
console.log(JSON.stringify({ watching, touched: slides.perFrame()[0], resting }));
