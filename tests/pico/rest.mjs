// Programs for slower clocks; that for 48 MHz is without USB, and lets its sensor rest after 5 seconds without light.

import { Board } from './machine.mjs';
import { BACK, GONE, ofKind, same } from './host.mjs';
import { FEATURES, request } from './wire.mjs';

const REST = 5, FPS = 30;
// One of so many frames is sent at rest, and the next one after the first light still comes late.
const RESTS = 4;
// The most frames that are lost of a touch, and if the sensor has to be set up again.
const MOST_LOST = 2 * RESTS - 1, MOST_LOST_SET_UP = 40;
// The high byte of a frame's lines, whose write begins a return.
const LINES = 0x0340;
// What has no clock, since nothing uses it, besides what has the line.
const UNUSED = ['I2C1', 'PIO1', 'PWM', 'RTC', 'SPI0', 'SPI1', 'UART1'];
// Less than this of the time, the core is awake while slides are answered.
const MOST_AWAKE = 0.25;

/** Every line is the host's at the slow clock, and the core sleeps in between. */
export function slow(name, host, program, mhz, hasUsb) {
  const board = new Board(program, host.frames);
  board.requests.push(request(FEATURES, 1));
  const lines = host.ofLine(board.play(), '--features');
  const problems = ['event', 'features'].flatMap((kind) => {
    const found = ofKind(lines, kind), expected = kind === 'event' ? host.events : host.features;
    return same(found, expected) ? [] : [`${found.length} lines of ${kind} are not the host's ${expected.length}`];
  });
  if (host.told().length > 0) problems.push(`the host is told ${host.told()}`);
  const { clkSys, pllSys } = board.mcu;
  if (clkSys !== mhz * 1e6 || (!hasUsb && pllSys.frequency)) problems.push(`the core has ${clkSys / 1e6} MHz, its PLL ${pllSys.frequency}`);
  const [stopped, used] = [board.stopped(), [...board.unclocked]];
  if (!same(stopped, hasUsb ? UNUSED : [...UNUSED, 'USB']) || used.length > 0) problems.push(`without a clock are ${stopped}, and used are ${used}`);
  const awake = board.cycles / board.now / (clkSys / 1e9);
  if (!(awake < MOST_AWAKE)) problems.push(`the core is awake for ${(100 * awake).toFixed(1)} % of the time`);
  host.say(name, problems);
}

/**
 * After a long rest, a slide begins at some part of the time between two frames, and the same one follows soon. Of the first
 * one, an answer is absent or not reliable; that of the second one is the host's. Returns what was lost of the first. With
 * `isDeaf`, the third write of the return, by which the others act, is not acknowledged.
 */
function touch(host, program, speed, late, isDeaf = false) {
  const toml = `lead_in = ${FPS * (REST + 3) + late}\ngap = 70\n[sensor]\nsize = [320, 240]\n` +
    `[[slide]]\nspecimen = "Saw3"\nspeed = ${speed}\ndirection = 90\n`.repeat(2);
  const { clip, frames } = host.rendered(`rest ${speed} ${late}`, toml);
  const board = new Board(program, frames), { sensor } = board;
  const set = sensor.set.bind(sensor);
  let failed = 0;
  sensor.set = (register, value) => {
    // A reset leaves less than twice as many lines.
    const isReturn = register === LINES && sensor.registers[LINES] > 2 * value;
    if (isDeaf && isReturn && !failed) [sensor.nackAfter, failed] = [1, 1];
    set(register, value);
  };
  board.requests.push(request(FEATURES, 1));
  const lines = host.ofLine(board.play(), '--features'), told = host.told(), problems = [];
  if (isDeaf && !(failed && sensor.nackAfter === null)) problems.push('no write fails');
  const events = ofKind(lines, 'event').map(JSON.parse), features = ofKind(lines, 'features').map(JSON.parse);
  const expected = host.of(clip, '--features');
  const [{ touch_frame: begins }, second] = ofKind(expected, 'event').map(JSON.parse);
  // What differs of the second one is how many frames were not sent before it.
  const answer = ({ frame, speed, direction, reliable }) => JSON.stringify([frame, speed, direction, reliable]);
  const last = events.at(-1);
  if (!last || answer(last) !== answer(second)) problems.push(`the second event is ${JSON.stringify(last)}`);
  for (const event of events.slice(0, -1)) {
    if (event.reliable) problems.push(`the first event is reliable: ${JSON.stringify(event)}`);
  }
  if (!same(told, isDeaf ? [GONE, BACK] : [])) problems.push(`the host is told ${told}`);
  const sent = new Set(features.map(({ frame }) => frame));
  const sentFrom = (from) => [...Array(RESTS + 1).keys()].filter((k) => sent.has(from + k)).length;
  const isResting = sentFrom(begins - 3 * RESTS) <= 2;
  if (!isResting) problems.push('the sensor does not rest');
  // The sensor is back with the first frame of which the next one is there, too.
  let back = begins;
  while (!(sent.has(back) && sent.has(back + 1)) && back < begins + 100) back += 1;
  const lost = back - begins;
  if (lost > (isDeaf ? MOST_LOST_SET_UP : MOST_LOST)) problems.push(`the sensor is back ${lost} frames after the touch`);
  return { problems, lost, first: events.length > 1 ? 'not reliable' : 'absent' };
}

/** The sensor does not take the end of its rest: it is set up again, and every frame comes. */
export function deaf(name, host, program) {
  host.say(name, touch(host, program, 150, 0, true).problems);
}

/** Slides of these speeds after a long rest. */
export function rests(name, host, program, speeds, phases = [0]) {
  for (const speed of speeds) {
    const touches = phases.map((late) => touch(host, program, speed, late));
    host.say(`${name}, ${speed} mm/s`, touches.flatMap(({ problems }) => problems));
    const lost = touches.map((one) => Math.round((1000 * one.lost) / FPS)), answers = touches.map((one) => one.first);
    console.log(`        lost of the first touch: ${lost.join(', ')} ms; its event: ${answers.join(', ')}`);
  }
}
