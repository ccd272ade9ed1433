// Changes each bit of the HM01B0's table, and shows what the firmware says.
//
//     node mutate.mjs PROGRAM…
//
// A changed setting acts in the modeled sensor, while the firmware reads back what it wrote. So it acts like a table
// with that value in it, or like a sensor that takes a setting in another way than its table says. What a bit changes
// is computed from the model. One of the bits of a register that change the same things runs in the emulator.
//
// Whatever changes the pins, the size, the format or the rate of frames, or switches an automatic control on, must be
// noticed before frames are used or within a second. The firmware cannot know the right light, the right view or the
// right picture: a constant change of these is named, and only a calibration sees it.
//
// Bit 5 of 0x3060 is not among them: with it off, PCLK runs before the first pixel, which the firmware measures and leaves out.
//
// The first program runs all bits. Others run only those of the registers of the data bus, which depend on its wires.

import { Board } from './machine.mjs';
import { Hm01b0 } from './sensor.mjs';

const MUST = ['pins', 'sync', 'size', 'format', 'rate', 'automatic'];
const MAY = {
  light: 'another light, which stays as it is',
  view: 'another view, which a calibration sees',
  picture: 'another picture',
};
const BUS = [0x3011, 0x3059, 0x3060, 0x3068];
const CLOCK = 24e6, FRAME = 1e9 / 30;
const picture = Uint8Array.from({ length: 320 * 240 }, (_, at) => 64 + (at % 128));

/** Returns a board that has come up, or not after so many frames. */
function boot(program, slips, frames) {
  const board = new Board(program, Array(40).fill(picture));
  board.sensor.slips = slips;
  while (!board.uses() && board.now < frames * FRAME) board.frame(null);
  return board;
}

/** Returns whether the firmware reports a problem: its light of problems is lit. */
const isLit = (board) => board.lit()[1];

/** Returns whether the firmware notices, at start or within a second. */
function notices(program, slips) {
  const board = boot(program, slips, 34);
  if (!board.uses() || isLit(board)) return isLit(board) ? 'at the start' : null;
  while (board.now < 70 * FRAME && !isLit(board)) board.frame(board.began === null ? null : 0);
  return isLit(board) ? 'within a second' : null;
}

/** Returns the parts that differ. A rate may differ by 2 %. */
function changes(before, after) {
  if (after.pins === 'silent') return ['pins'];
  const isRight = (part) => (part === 'rate' ? Math.abs(after.rate / before.rate - 1) < 0.02 : before[part] === after[part]);
  return Object.keys(before).filter((part) => !isRight(part));
}

const hex = (value, digits) => `0x${value.toString(16).toUpperCase().padStart(digits, '0')}`;

/** Returns the sensor after what the firmware wrote, with a setting that acts by another value. */
function replayed(history, slips) {
  const sensor = new Hm01b0();
  sensor.slips = slips;
  for (const [register, value] of history) sensor.set(register, value);
  return sensor;
}

let failures = 0;
function check(program, only) {
  const right = boot(program, {}, 60);
  if (!right.uses()) throw new Error('the board does not come up with the right settings');
  const history = right.sensor.history, acts = right.sensor.acts(CLOCK);
  for (const [register, value] of new Map(history)) {
    if (only && !only.includes(register)) continue;
    const kinds = new Map();
    for (let bit = 0; bit < 8; bit++) {
      const parts = changes(acts, replayed(history, { [register]: value ^ (1 << bit) }).acts(CLOCK));
      const key = parts.join();
      kinds.set(key, [...(kinds.get(key) ?? []), bit]);
    }
    const said = [];
    for (const [key, bits] of [...kinds].sort(([, a], [, b]) => a[0] - b[0])) {
      const parts = key ? key.split(',') : [];
      const named = bits.length > 1 ? `bits ${bits.join(', ')}` : `bit ${bits[0]}`;
      const must = MUST.filter((part) => parts.includes(part));
      if (must.length > 0) {
        const when = notices(program, { [register]: value ^ (1 << bits[0]) });
        failures += when === null ? 1 : 0;
        said.push(`${named}: ${must.join(', ')}: ${when ?? 'NOT NOTICED'}`);
      } else if (parts.length > 0) {
        const may = Object.keys(MAY).filter((part) => parts.includes(part)).map((part) => MAY[part]).join(', ');
        const when = parts.includes('picture') ? notices(program, { [register]: value ^ (1 << bits[0]) }) : null;
        said.push(`${named}: ${may}${when ? `: ${when}` : ''}`);
      }
    }
    const wires = right.sensor.wires();
    const where = `HM01B0, ${wires} data wire${wires > 1 ? 's' : ''}, ${hex(register, 4)} = ${hex(value, 2)}`;
    console.log(`${where}: ${said.join('; ') || 'no effect on the pins is known'}`);
  }
}

const [, , program, ...others] = process.argv;
if (!program) {
  console.error('usage: node mutate.mjs PROGRAM…');
  process.exit(2);
}
check(program, null);
for (const other of others) check(other, BUS);
console.log(`${failures} changes were not noticed`);
process.exit(failures ? 1 : 0);
