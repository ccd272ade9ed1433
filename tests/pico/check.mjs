// Checks the program of the Raspberry Pi Pico in rp2040js: its events and features are those of `wstac run` on the same
// frames, whatever happens to the camera.
//
//     node check.mjs WSTAC ONE FOUR EIGHT
//
// WSTAC is the command on the host. The others are the program, built for 1, 4 and 8 data wires. `ci/pico` installs what
// it needs and builds the programs.

import { execFileSync, spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Board } from './machine.mjs';

const SCENE = `
lead_in = 30
gap = 70
[sensor]
size = [320, 240]
[[slide]]
specimen = "Saw3"
speed = 150
direction = 90
[[slide]]
specimen = "Sin2"
speed = 170
direction = 180
`;
const SIZE = 320 * 240;
// Requests, as in tests/emulator/check.py: their numbers, and the version of the link.
const FEATURES = 1, VERSION = 4;
const LOST_SYNC = 'a frame did not begin or end when it should have';

const [, , wstac, one, four, eight, ...more] = process.argv;
if (!eight || more.length > 0) {
  console.error('usage: node check.mjs WSTAC ONE FOUR EIGHT');
  process.exit(2);
}
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'pico-'));
process.on('exit', () => fs.rmSync(folder, { recursive: true }));
const scene = path.join(folder, 'scene.toml'), clip = path.join(folder, 'clip.y4m'), raw = path.join(folder, 'clip.raw');
fs.writeFileSync(scene, SCENE);

/** Runs the command. Returns its lines; those of standard error are in `notes`. */
let notes = '';
function says(...options) {
  const done = spawnSync(wstac, options, { encoding: 'utf8', maxBuffer: 1 << 28 });
  if (done.status !== 0) throw new Error(`wstac ${options[0]} failed: ${done.stderr}`);
  notes = done.stderr;
  return done.stdout.split('\n').filter((line) => line);
}
execFileSync(wstac, ['scene', 'render', scene, '-o', clip], { stdio: 'ignore' });
execFileSync(wstac, ['scene', 'render', scene, '-o', raw], { stdio: 'ignore' });
const pixels = fs.readFileSync(raw);
const frames = Array.from({ length: pixels.length / SIZE }, (_, k) => pixels.subarray(k * SIZE, (k + 1) * SIZE));

const ofKind = (lines, ...kinds) => lines.filter((line) => kinds.includes(JSON.parse(line).kind));
const ofClip = (...options) => says('run', clip, '--json', ...options);
const ofLine = (bytes, ...options) => {
  const file = path.join(folder, 'serial');
  fs.writeFileSync(file, bytes);
  return says('monitor', file, '--json', ...options);
};
const events = ofKind(ofClip(), 'event');
const features = ofKind(ofClip('--features'), 'features');

/** CRC-32 (IEEE). */
function crc(bytes) {
  let rest = 0xffff_ffff;
  for (const byte of bytes) {
    rest ^= byte;
    for (let bit = 0; bit < 8; bit++) rest = (rest >>> 1) ^ (rest & 1 ? 0xedb8_8320 : 0);
  }
  return ~rest >>> 0;
}

/** Returns the frame of a request. */
function request(message, ...wanted) {
  const data = [VERSION, 0, message, ...wanted];
  const sum = crc(data);
  const all = [...data, ...[0, 8, 16, 24].map((shift) => (sum >>> shift) & 0xff), 0];
  const stuffed = [0];
  let part = [];
  for (const byte of all) {
    if (byte === 0) {
      stuffed.push(part.length + 1, ...part);
      part = [];
    } else {
      part.push(byte);
    }
  }
  return [...stuffed, 0];
}

let failures = 0;
function say(name, problems) {
  failures += problems.length > 0 ? 1 : 0;
  console.log(`${problems.length > 0 ? 'FAILED' : 'passed'}  ${name}`);
  for (const problem of problems) console.log(`        ${problem}`);
}
const same = (a, b) => a.length === b.length && a.every((line, k) => line === b[k]);

/** Nothing goes wrong: every event is the host's. */
function plain(name, program) {
  const board = new Board(program, frames);
  const lines = ofKind(ofLine(board.play()), 'event');
  const problems = same(lines, events) ? [] : [`events are ${lines}, expected ${events}`];
  if (events.length !== 2) problems.push(`the clip has ${events.length} events, expected 2: it shows less than it should`);
  if (/the board: /.test(notes)) problems.push(`the host is told ${notes}`);
  if (board.resets) problems.push(`the chip restarted ${board.resets} times`);
  say(name, problems);
}

/** Features of all frames of a part of the clip but the missing ones are right, and the host is told these faults. */
function faulty(name, program, count, faults, missing, told) {
  const board = new Board(program, frames.slice(0, count), faults);
  board.requests.push(request(FEATURES, 1));
  const lines = ofKind(ofLine(board.play(), '--features'), 'features');
  const expected = features.slice(0, count).filter((_, frame) => !missing.includes(frame));
  const problems = [];
  if (!same(lines, expected)) {
    const numbers = (all) => all.map((line) => JSON.parse(line).frame);
    const lost = numbers(expected).filter((frame) => !numbers(lines).includes(frame));
    const wrong = numbers(lines.filter((line) => !expected.includes(line)));
    problems.push(`frames that are missing, too: ${lost.slice(0, 9)}; wrong or too many: ${wrong.slice(0, 9)}`);
  }
  const faultsTold = notes.split('\n').filter((line) => line.includes('the board: ')).map((line) => line.split('the board: ')[1]);
  if (!same(faultsTold, told)) problems.push(`the host is told ${JSON.stringify(faultsTold)}, expected ${JSON.stringify(told)}`);
  say(name, problems);
}

/** The camera does not come up: the host is told why, and no frame is used. */
function never(name, program, prepare, told) {
  const board = new Board(program, []);
  prepare(board);
  for (let k = 0; k < 40; k++) board.frame(null);
  ofLine(Buffer.from(board.sent));
  say(name, notes.includes(`the board: the camera ${told}\n`) ? [] : [`the host is told ${JSON.stringify(notes)}`]);
}

const begun = Date.now();
plain('events, 8 data wires', eight);
faulty('features, 4 data wires', four, 12, {}, [], []);
faulty('features, 1 data wire', one, 6, {}, [], []);
// The next sync shows it, and capture begins again at the one after that.
faulty('a line is missing', eight, 16, { 8: 'lost line' }, [8, 9], [LOST_SYNC]);
faulty('sync inside a frame', eight, 16, { 8: 'sync inside' }, [8], [LOST_SYNC]);
never('no sensor', eight, (board) => (board.sensor.present = false), 'does not answer');
console.log(`${failures} failed; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(failures ? 1 : 0);
