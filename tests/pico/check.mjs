// Checks the program of the Raspberry Pi Pico in rp2040js: its events and features are those of `wstac run` on the same
// frames, whatever happens to the camera.
//
//     node check.mjs WSTAC ONE FOUR EIGHT UF2 [TAKING COMPILED SENT]
//
// WSTAC is the command on the host. The others are the program, built for 1, 4 and 8 data wires: that for 8 has its line at USB,
// and UF2 is its image. EIGHT.15, EIGHT.25 and EIGHT.60 are it at these frame rates, with a UART, EIGHT.72 at 72 MHz, and EIGHT.slow at 48 MHz, whose
// sensor rests. TAKING, for 8 of them, has
// the model COMPILED compiled in, learns textures, and takes models over the link: SENT is one. `ci/boards pico` installs what it
// needs and builds the programs.

import { fileURLToPath } from 'node:url';
import { learning, models } from './models.mjs';
import { BUS_BYTE, Board, SCL, SDA } from './machine.mjs';
import {
  ANOTHER_RATE,
  ANOTHER_SIZE,
  BACK,
  FORGETS,
  GONE,
  HELD_LOW,
  Host,
  LOST_SYNC,
  NOT_PULLED_UP,
  OVERRUN,
  READOUT_MS,
  SENDS,
  SILENT,
  ofKind,
  range,
  same,
} from './host.mjs';
import { deaf, rests, slow } from './rest.mjs';
import { exposure, settings } from './settings.mjs';
import { bootloader, late, modem, reopened, unread } from './usb_check.mjs';
import { FEATURES, HELLO, request } from './wire.mjs';

const [, , wstac, one, four, eight, uf2, taking, compiled, sent, ...more] = process.argv;
if (!uf2 || Boolean(taking) !== Boolean(sent) || more.length > 0) {
  console.error('usage: node check.mjs WSTAC ONE FOUR EIGHT UF2 [TAKING COMPILED SENT]');
  process.exit(2);
}
const host = new Host(wstac);
const { frames } = host;
const ofLine = (...all) => host.ofLine(...all), told = () => host.told(), say = (...all) => host.say(...all);

/** Nothing goes wrong: every event is the host's, and the program is within its budgets. */
function plain(name, program) {
  const board = new Board(program, frames);
  const sent = board.play();
  const lines = ofKind(ofLine(sent), 'event');
  const problems = same(lines, host.events) ? [] : [`events are ${lines}, expected ${host.events}`];
  if (told().length > 0) problems.push(`the host is told ${told()}`);
  // The program's table states it, and the sensor has it by its registers.
  const readout = (239_000 * board.sensor.period(24e6)) / board.sensor.lines();
  if (Math.abs(readout - READOUT_MS) > 1e-6) problems.push(`rows are read in ${readout} ms, expected ${READOUT_MS}`);
  if (board.resets) problems.push(`the chip restarted ${board.resets} times`);
  problems.push(...board.usb.problems);
  say(name, problems);
  host.budget('pico', program, sent, (board.instructions - board.instructionsBefore) / frames.length);
}

/** A program for another rate: rate, readout and exposure are those of the registers, and every line is the host's. */
function rate(fps, program) {
  const at = host.at(fps);
  const board = new Board(program, at.frames, {}, undefined, fps);
  board.requests.push(request(FEATURES, 1));
  const lines = ofLine(board.play(), '--features');
  const problems = ['event', 'features'].flatMap((kind) => {
    // Two frames are a feature frame above 45 per second: the first one behind the clip may complete one.
    const expected = ofKind(at.lines, kind), found = ofKind(lines, kind).slice(0, expected.length);
    const isRight = found.length > 0 && same(found, expected);
    return isRight ? [] : [`${found.length} lines of ${kind} are not the host's ${expected.length}`];
  });
  if (told().length > 0) problems.push(`the host is told ${told()}`);
  const period = board.sensor.period(24e6), readout = (239_000 * period) / board.sensor.lines();
  if (Math.abs(readout - at.readout) > 1e-6 || Math.abs(period * fps - 1) > 0.004) {
    problems.push(`rows are read in ${readout} ms, and ${1 / period} frames come per second`);
  }
  say(`${fps} frames per second`, problems);
}

/** The sensor's bus has 100 kHz: the core waits for three registers after each frame, and loses none. */
function slowBus(name, program, fps = 30) {
  const at = fps === 30 ? { frames, lines: host.features } : host.at(fps);
  const count = 24, begun = [];
  const note = (board) => void begun.push(board.busBytes);
  const board = new Board(program, at.frames.slice(0, count), { 2: note, 22: note }, undefined, fps);
  board.busByte = BUS_BYTE;
  board.requests.push(request(FEATURES, 1));
  const lines = ofKind(ofLine(board.play(), '--features'), 'features');
  const expected = ofKind(at.lines, 'features').slice(0, lines.length);
  const isRight = lines.length >= count * Math.min(1, 30 / fps) && same(lines, expected);
  const problems = isRight ? [] : [`features are those of ${lines.length} frames`];
  if (told().length > 0) problems.push(`the host is told ${told()}`);
  // Three times an address, a register of two bytes, an address and a value.
  if (begun[1] - begun[0] !== 20 * 15) problems.push(`${begun} bytes, expected 15 per frame`);
  say(name, problems);
}

/** Events by a wave, with a texture by a linear model, take longer than the DMA fills its ring: no frame is lost. */
function long(name, program) {
  const config = fileURLToPath(new URL('wave.toml', import.meta.url));
  const expected = ofKind(host.ofClip('--config', config, '--model', 'builtin:svm'), 'event');
  const lines = ofKind(ofLine(new Board(program, frames).play(), '--status'), 'event');
  // A board does not send accelerations.
  const problems = same(lines, expected.map((line) => line.replace(/"acceleration":{.*?},/, ''))) ? [] : [`events are ${lines}, expected ${expected}`];
  if (told().length > 0 || !host.notes.includes(' 0 overruns')) problems.push(`the host is told ${host.notes}`);
  say(name, problems);
}

/** Features of all frames of a part of the clip but the missing ones are right, and the host is told these faults. */
function faulty(name, program, count, faults, missing, expectedFaults) {
  const board = new Board(program, frames.slice(0, count), faults);
  board.requests.push(request(FEATURES, 1));
  const lines = ofKind(ofLine(board.play(), '--features'), 'features');
  const problems = host.compare(lines, count, missing);
  if (!same(told(), expectedFaults)) {
    problems.push(`the host is told ${JSON.stringify(told())}, expected ${JSON.stringify(expectedFaults)}`);
  }
  if (board.resets) problems.push(`the chip restarted ${board.resets} times`);
  say(name, problems);
}

/** The sensor fails when it is first set up: the host is told, and then everything works. */
function start(name, program, prepare, expectedFaults, expectedResets = null) {
  const board = new Board(program, frames.slice(0, 3));
  prepare(board);
  board.requests.push(request(FEATURES, 1));
  const lines = ofKind(ofLine(board.play(), '--features'), 'features');
  const problems = same(lines, host.features.slice(0, 3)) ? [] : [`features are those of ${lines.length} frames`];
  if (!same(told(), expectedFaults)) problems.push(`the host is told ${JSON.stringify(told())}`);
  if (expectedResets !== null && board.sensor.resets !== expectedResets) {
    problems.push(`the sensor is reset ${board.sensor.resets} times, expected ${expectedResets}`);
  }
  say(name, problems);
}

/** The camera does not come up: the host is told why, and again when it asks; no frame is used. */
function never(name, program, prepare, reason) {
  const board = new Board(program, []);
  prepare(board);
  const until = (frames) => {
    while (board.now < (frames * 1e9) / 30) board.frame(null);
  };
  until(26);
  board.requests.push(request(HELLO));
  // The next attempt to set it up ends about a second later.
  until(65);
  ofLine(Buffer.from(board.sent));
  // Three times if USB is opened while the fault is found.
  const isTold = same(told(), [reason, reason]) || same(told(), [reason, reason, reason]);
  const problems = isTold ? [] : [`the host is told ${JSON.stringify(told())}, expected ${reason} twice`];
  if (board.began !== null) problems.push('frames are used');
  say(name, problems);
}

/** The rate changes by 4 % while frames are used: the host is told, and they are used again when it is right. */
function drift(name, program) {
  // A line has 391 clocks, and then 376 again.
  const change = { 10: (board) => board.sensor.slip(0x0343, 0x87), 80: (board) => board.sensor.slip(0x0343, 0x78) };
  const board = new Board(program, frames.slice(0, 110), change);
  ofLine(board.play());
  say(name, same(told(), [ANOTHER_RATE('2[89]...'), BACK]) ? [] : [`the host is told ${JSON.stringify(told())}`]);
}

/**
 * The program fails: it restarts, reports why, and continues. It may be reset `again` at once, before it has reported
 * that; then the report comes after the second restart. A later reset reports nothing.
 */
function crash(name, program, how, why, { count = 60, again = false } = {}) {
  const faults = {
    20: (board) => {
      how(board);
      for (let turn = 0; again && board.resets === 0 && turn < 100_000; turn++) board.run(1e4);
      // The line sends bytes in no time, 5 ms after a restart, and what is sent is erased.
      if (again) board.run(4e6), board.reset();
    },
  };
  const board = new Board(program, frames.slice(0, count), faults);
  board.play();
  const problems = [];
  ofLine(Buffer.from(board.sent));
  const restarts = again ? 2 : 1;
  // A start that ends so early may not be counted.
  const pattern = new RegExp(`^it started again because of: ${why}; restart ${again ? '[12]' : 1}$`);
  if (told().length !== 1 || !pattern.test(told().at(-1))) {
    problems.push(`the host is told ${JSON.stringify(told())}, expected ${why}; restart ${restarts}`);
  }
  if (board.resets !== restarts) problems.push(`the chip restarted ${board.resets} times`);
  if (!board.uses()) problems.push('no frames are used after it');
  // On USB, it is a host once it asks for something.
  board.requests.push(request(HELLO));
  for (let k = 0; k < 3; k++) board.frame(null);
  const before = board.sent.length;
  board.reset();
  for (let k = 0; k < 40 && !board.uses(); k++) board.frame(null);
  ofLine(Buffer.from(board.sent.slice(before)));
  if (told().length > 0) problems.push(`the host is told again ${JSON.stringify(told())}`);
  if (!board.uses()) problems.push('no frames are used after a reset');
  say(name, problems);
}

/** The program fails before it has set the watchdog: it restarts all the same. */
function early(name, program) {
  const board = new Board(program, frames.slice(0, 1));
  board.run(20e3);
  board.crash();
  const problems = [];
  ofLine(board.play());
  if (board.resets !== 1 || !told()[0]?.startsWith('it started again because of: hard fault')) {
    problems.push(`the chip restarted ${board.resets} times, and the host is told ${JSON.stringify(told())}`);
  }
  say(name, problems);
}

/** Every wire of the camera is an input that is pulled down, so that a wire that is off does not float. */
function pulls(name, ...programs) {
  const floating = programs.flatMap((program) => {
    const board = new Board(program, frames.slice(0, 1));
    board.play();
    return board.floating();
  });
  say(name, floating.map((pin) => `GP${pin} is not pulled down`));
}

/** The light of events changes with each of them, and that of faults is lit from a fault to the next event. */
function lights(name, program) {
  const board = new Board(program, frames, { 40: 'late core' });
  board.play();
  const lit = board.lights.map(String);
  const seen = lit.filter((state, k) => state !== lit[k - 1]);
  const expected = ['false,false', 'false,true', 'true,false', 'false,false'];
  say(name, same(seen, expected) ? [] : [`events and faults are lit ${seen.join('; ')}`]);
}

/** The sensor's power fails. */
const unplug = (board) => {
  board.sensor.present = false;
  board.sensor.powerOn();
  return 'silent';
};
const plugIn = (board) => {
  board.sensor.present = true;
};

const begun = Date.now();
plain('events, 8 data wires', eight);
long('long events, 4 data wires', four);
faulty('features, 4 data wires', four, 12, {}, [], []);
faulty('features, 1 data wire', one, 6, {}, [], []);
for (const fps of [15, 25, 60]) rate(fps, `${eight}.${fps}`);
slow('48 MHz', host, `${eight}.slow`, 48, false);
slow('72 MHz with USB', host, `${eight}.72`, 72, true);
rests('a slide after a rest', host, `${eight}.slow`, taking ? [30, 80, 150, 300] : [150], taking ? [0, 1, 2, 3] : [0]);
deaf('no acknowledge at the end of a rest', host, `${eight}.slow`);
slowBus('a bus of 100 kHz', eight);
slowBus('a bus of 100 kHz at 60 frames per second', `${eight}.60`, 60);
for (const [wires, program] of [[8, eight], [4, four], [1, one]]) {
  start(`326 clocks a line, ${wires} wires`, program, (board) => (board.sensor.isGateEarly = true), []);
}
start('PCLK without a gate', eight, (board) => (board.sensor.slips = { 0x3060: 0x08 }), []);
// The next sync shows it, and capture begins again at the one after that.
faulty('a line is missing', eight, 16, { 8: 'lost line' }, [8, 9], [LOST_SYNC]);
faulty('a line is split', eight, 16, { 8: 'split line' }, [8], [LOST_SYNC]);
faulty('a line too many', eight, 16, { 8: 'line too many' }, [8], [LOST_SYNC]);
faulty('sync inside a frame', eight, 16, { 8: 'sync inside' }, [8], [LOST_SYNC]);
faulty('lost sync', eight, 16, { 8: 'lost sync' }, [8, 9], [LOST_SYNC]);
faulty('late core', eight, 16, { 8: 'late core' }, [8], [OVERRUN]);
faulty('late DMA', eight, 16, { 8: 'late DMA' }, [8], [OVERRUN]);
faulty('silent for two frames', eight, 36, { 8: 'silent', 9: 'silent' }, range(8, 32), [SILENT, BACK]);
faulty('unplugged', eight, 52, { 8: unplug, 18: plugIn }, range(8, 47), [SILENT, GONE, BACK]);
faulty('brown-out', eight, 36, { 8: (board) => board.sensor.powerOn() }, range(8, 32), [SILENT, BACK]);
faulty(
  'automatic exposure switches itself on',
  eight,
  36,
  { 8: (board) => board.sensor.set(0x2100, 1) },
  range(8, 31),
  [FORGETS('0x2100', '0x01', '0x00'), BACK],
);
faulty('data line held low for a while', eight, 16, { 8: (board) => (board.sensor.holds = 4) }, [], []);
const deafen = (board) => (board.sensor.deaf = true), cure = (board) => (board.sensor.deaf = false);
faulty(
  'frames without an answer',
  eight,
  86,
  { 8: deafen, 60: (board) => void cure(board) },
  range(37, 83),
  [GONE, BACK],
);
start('data line held low', eight, (board) => (board.sensor.holds = 5), [], 1);
// In the identity, at the reset, and in the settings. Nobody has opened USB so early.
for (const at of [0, 1, 3, 5, 8, 40]) {
  start(`no acknowledge at step ${at}`, four, (board) => (board.sensor.nackAfter = at), [GONE, BACK]);
}
never('no sensor', eight, (board) => Object.assign(board.sensor, { present: false, pullsUp: false }), NOT_PULLED_UP);
never('no clock of the sensor', eight, (board) => (board.sensor.present = false), GONE);
for (const [name, shorted] of [['SDA', [SDA]], ['SCL', [SCL]], ['both', [SDA, SCL]]]) {
  never(`held low: ${name}`, eight, (board) => (board.sensor.shorted = shorted), HELD_LOW[name]);
}
never(
  'another sensor',
  eight,
  (board) => (board.sensor.registers[0x0001] = 0x60),
  'the camera says it is 0x0160, which the firmware does not know',
);
never('a setting that is not taken', eight, (board) => (board.sensor.stuck = 0x3055), FORGETS('0x3055', '0x00', '0xf7'));
never('60 frames per second', eight, (board) => (board.sensor.slips = { 0x3060: 0x29 }), ANOTHER_RATE('(59.99|60.00)'));
never('half of the columns', eight, (board) => (board.sensor.slips = { 0x0383: 0x03 }), ANOTHER_SIZE({ words: 9882 }));
const tall = { lines: 324, words: 26244, rate: '23.4.' };
never('324 rows', eight, (board) => (board.sensor.slips = { 0x3010: 0x00 }), ANOTHER_SIZE(tall));
never(
  'a sensor with another number of wires',
  eight,
  (board) => (board.sensor.slips = { 0x3059: 0x42 }),
  ANOTHER_SIZE({ words: 39528 }),
);
// What only the test pattern shows.
const bits = SENDS('bits in another order, or without those of a wire', {}, 'the data wires and PCLK', '0x3059');
for (const [name, program, wire] of [['1 of 8', eight, 0x20], ['1 of 4', four, 0x04], ['the only one', one, 0x01]]) {
  never(`a data wire is off: ${name}`, program, (board) => (board.sensor.dead = wire), bits);
}
for (const [name, program, slips] of [
  ['the high bits come first, 4 data wires', four, { 0x3060: 0x38 }],
  ['the high bits come first, 1 data wire', one, { 0x3060: 0x38 }],
  ['data changes at the edge at which it is taken', eight, { 0x3068: 0x21 }],
  ['pixels of 6 bits', eight, { 0x3011: 0x71 }],
]) {
  never(name, program, (board) => (board.sensor.slips = slips), bits);
}
drift('the rate changes by 4 %', eight);
const hard = 'hard fault at 0x20000100, called from 0x[0-9A-F]+';
crash('hard fault', eight, (board) => board.crash(), hard);
crash('hard fault, and a reset before it is reported', four, (board) => board.crash(), hard, { again: true });
crash('panic', eight, (board) => board.panic(), 'panic at \\S*/src/lib\\.rs:\\d+: explicit panic');
crash('interrupt without a handler', eight, (board) => board.interrupt(30), 'an interrupt without a handler: 30');
early('hard fault before the watchdog is set', eight);
crash(
  'the program hangs',
  eight,
  (board) => board.stall(5e9),
  'the program hung, and the watchdog ended it',
  { count: 180 },
);
pulls('pulled inputs', one, four, eight);
lights('lights', eight);
late('USB: a host opens the port late', host, eight);
unread('USB: a host that does not read', host, eight);
reopened('USB: the port is closed and opened, and the cable unplugged and plugged', host, eight);
modem('USB: a program that looks for a modem', host, eight);
bootloader('USB: the boot loader', host, eight, four);
start('the UF2 file', uf2, () => {}, []);
settings('settings', host, eight);
exposure('an exposure that does not fit in a frame', host, eight);
if (taking) {
  models('models over the link', host, taking, sent);
  learning('learning', host, taking, compiled);
}
console.log(`${host.failures} failed; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(host.failures ? 1 : 0);
