// Checks the program of the Raspberry Pi Pico 2 in rp2350-emu (tests/pico2): its events and features are those of
// `wstac run` on the same frames.
//
//     node check2.mjs WSTAC PLAYER ONE FOUR EIGHT [TAKING MODEL]
//
// WSTAC is the command on the host, and PLAYER runs a program on a clip. The others are the program, built for 1, 4 and
// 8 data wires, and TAKING for 8 of them with models over the link; MODEL is one to send. `ci/boards pico` builds all of them.

import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
import { BACK, GONE, Host, LOST_SYNC, OVERRUN, SILENT, ofKind, range, same } from './host.mjs';
import { IS_OUTSIDE, IS_SET, LAYOUT, LAYOUT_OUTSIDE, withLayout } from './layout.mjs';
import {
  ANSWER,
  BOARD_MODEL,
  FEATURES,
  IN_USE,
  MODEL,
  SET,
  SETTINGS,
  contents,
  modelPieces,
  modelState,
  request,
} from './wire.mjs';

// An emulated run takes a minute or two, and much longer on a machine with other work.
const LIMIT_MS = 30 * 60_000;
const [, , wstac, player, one, four, eight, taking, model, ...more] = process.argv;
if (!eight || Boolean(taking) !== Boolean(model) || more.length > 0) {
  console.error('usage: node check2.mjs WSTAC PLAYER ONE FOUR EIGHT [TAKING MODEL]');
  process.exit(2);
}
const host = new Host(wstac);
const hex = (bytes) => Buffer.from(bytes).toString('hex');

/** Plays the beginning of the clip. `flash` is a file with what the flash keeps. Returns what was sent, and the board's state. */
function play(program, count, wanted = '-', faults = {}, flash = '-', clip = host.raw) {
  const serial = host.file('sent');
  const listed = Object.entries(faults).map(([frame, fault]) => `${frame}:${fault}`);
  const done = spawnSync(player, [program, flash, clip, count, serial, wanted, ...listed], {
    encoding: 'utf8',
    timeout: LIMIT_MS,
  });
  if (done.status !== 0) throw new Error(`${player}: ${done.stderr}`);
  return { sent: fs.readFileSync(serial), ...JSON.parse(done.stdout) };
}

/** Nothing goes wrong: every event is the host's, and the program is within its budgets. */
function plain(name, program) {
  const { sent, resets, lights, instructions } = play(program, host.frames.length);
  const lines = ofKind(host.ofLine(sent), 'event');
  const problems = same(lines, host.events) ? [] : [`events are ${lines}, expected ${host.events}`];
  if (host.told().length > 0) problems.push(`the host is told ${host.told()}`);
  if (resets) problems.push(`the chip restarted ${resets} times`);
  // The light of events changes with each.
  const seen = JSON.stringify(lights);
  if (seen !== '[[false,false],[true,false],[false,false]]') problems.push(`events and faults are lit ${seen}`);
  host.say(name, problems);
  host.budget('pico_2', program, sent, instructions / host.frames.length);
}

/** Features of all frames of a part of the clip but the missing ones are right, and the host is told these faults. */
function faulty(name, program, count, faults, missing, expected, restarts = 0) {
  const { sent, resets, uses, floating } = play(program, count, hex(request(FEATURES, 1)), faults);
  const lines = ofKind(host.ofLine(sent, '--features'), 'features');
  const problems = host.compare(lines, count, missing);
  const told = host.told();
  if (told.length !== expected.length || !expected.every((line, k) => new RegExp(`^${line}$`).test(told[k]))) {
    problems.push(`the host is told ${JSON.stringify(told)}, expected ${JSON.stringify(expected)}`);
  }
  if (resets !== restarts) problems.push(`the chip restarted ${resets} times`);
  if (!uses) problems.push('no frames are used at the end');
  if (floating.length > 0) problems.push(`pins ${floating} are not pulled up`);
  host.say(name, problems);
}

/** A layout that is set over the link is kept, and a bad one refused: the events are the host's with it. */
function settings(name, program) {
  const flash = host.file('flash');
  const problems = [];
  const asked = (wanted) => {
    const { sent, problems: found } = play(program, 8, hex(wanted), {}, flash);
    problems.push(...found);
    return contents(sent);
  };
  const inUse = asked(request(SETTINGS)).find((content) => content[0] === IN_USE);
  const compiledIn = inUse.subarray(1, -1);
  if (inUse.at(-1) !== 0) problems.push('an empty flash has settings');
  const answer = (layout) => {
    const answers = asked(request(SET, ...withLayout(compiledIn, layout))).filter((content) => content[0] === ANSWER);
    return answers.map((content) => [...content.subarray(1)]);
  };
  const refused = answer(LAYOUT_OUTSIDE), done = answer(LAYOUT);
  if (refused.length !== 1 || !same(refused[0].slice(0, 4), IS_OUTSIDE)) problems.push(`a bad one is answered by ${refused}`);
  if (done.length !== 1 || !same(done[0], IS_SET)) problems.push(`a layout is answered by ${done}`);
  const { sent, problems: found } = play(program, host.frames.length, '-', {}, flash);
  problems.push(...found);
  const events = ofKind(host.ofLine(sent), 'event'), expected = host.eventsWith(LAYOUT);
  if (!same(events, expected)) problems.push(`events are ${events}, expected ${expected}`);
  host.say(name, problems);
}

/** A model that is sent over the link is kept, and the answers are then the host's with it. */
function models(name, program, file) {
  const flash = host.file('flash of models'), clip = host.file('long.raw');
  const pieces = modelPieces(fs.readFileSync(file));
  // Before the first piece is taken, a few sectors are erased, and after each of them the camera is set up again.
  // A host waits for the answer to each piece: one that comes while another is written would be lost.
  const first = 160, each = 2, count = first + each * pieces.all.length + 90;
  fs.writeFileSync(clip, Buffer.concat(new Array(count).fill(host.frames[0])));
  const faults = { 5: `send ${hex(pieces.begin)}` };
  pieces.all.forEach((piece, number) => (faults[first + each * number] = `send ${hex(piece)}`));
  const sending = play(program, count, '-', faults, flash, clip);
  const steps = contents(sending.sent).filter((content) => content[0] === BOARD_MODEL).map(modelState);
  const problems = [...sending.problems];
  if (!steps.some(({ step }) => step[0] === 2)) problems.push(`the model is not kept: ${JSON.stringify(steps.at(-1))}`);
  const after = play(program, host.frames.length, hex(request(MODEL)), {}, flash);
  problems.push(...after.problems);
  const events = ofKind(host.ofLine(after.sent), 'event'), expected = ofKind(host.ofClip('--model', file), 'event');
  if (!same(events, expected)) problems.push(`events are ${events}, expected ${expected}`);
  const used = contents(after.sent).filter((content) => content[0] === BOARD_MODEL).map(modelState)[0];
  if (!used?.isSent || used.checksum !== pieces.checksum) problems.push(`the model in use is ${JSON.stringify(used)}`);
  host.say(name, problems);
}

const begun = Date.now();
console.log('Pico 2:');
plain('events, 8 data wires', eight);
faulty('features, 4 data wires', four, 6, {}, [], []);
faulty('features, 1 data wire', one, 4, {}, [], []);
faulty('a bus of 100 kHz', eight, 14, { 0: 'slow bus' }, [], []);
faulty('a line is missing', eight, 14, { 8: 'lost line' }, [8, 9], [LOST_SYNC]);
faulty('a line is split', eight, 14, { 8: 'split line' }, [8], [LOST_SYNC]);
faulty('sync inside a frame', eight, 14, { 8: 'sync inside' }, [8], [LOST_SYNC]);
faulty('late core', eight, 14, { 8: 'late core' }, [8], [OVERRUN]);
faulty('silent for two frames', eight, 40, { 8: 'silent', 9: 'silent' }, range(8, 32), [SILENT, BACK]);
faulty('unplugged', eight, 60, { 8: 'unplug', 18: 'plug in' }, range(8, 47), [SILENT, GONE, BACK]);
faulty('data line held low for a while', eight, 14, { 8: 'hold data line' }, [], []);
// After a restart, features are asked for again, which this host does not do.
const again = (why) => `it started again because of: ${why}; restart 1`;
faulty(
  'hard fault',
  eight,
  60,
  { 8: 'crash' },
  range(8, 60),
  [again('hard fault at 0x20081F00, called from 0x[0-9A-F]+')],
  1,
);
faulty(
  'the program hangs',
  eight,
  180,
  { 8: 'hang' },
  range(8, 180),
  [again('the program hung, and the watchdog ended it')],
  1,
);
settings('settings', eight);
if (taking) models('models over the link', taking, model);
console.log(`${host.failures} failed; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(host.failures ? 1 : 0);
