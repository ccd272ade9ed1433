// The host's side of the checks of the Pico and the Pico 2: what `wstac run` makes of a rendered scene, what `wstac
// monitor` makes of the bytes that a board sent, and the budgets of the boards' programs.

import { execFileSync, spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { asToml } from './layout.mjs';

const SIZE = 320 * 240;
/** Of the HM01B0: 240 rows of 376 pixel clocks, each of 8 clocks of 24 MHz. */
export const READOUT_MS = (239 * 376 * 8) / 24_000;
const FIRMWARE = (name) => fileURLToPath(new URL(`../firmware/${name}`, import.meta.url));
const BUDGETS = FIRMWARE('budgets.toml'), SCENE = FIRMWARE('two_slides.toml');
// The configuration of a program that is built without one.
const CONFIG = FIRMWARE('../../wstac-fw/wstac.toml');
// What the host says.
export const OVERRUN = 'pixels came faster than they were taken';
export const SILENT = 'the camera sends no pixels; help: check PCLK, VSYNC, HREF, then XCLK and power';
const SILENT_BUS = (why, first) => `the camera does not answer: ${why}; help: check ${first}`;
const FREE_FIRST = "the sensor's XCLK, its type, then whether SDA and SCL are swapped, PWDN and RESET";
export const GONE = SILENT_BUS('its bus is free', FREE_FIRST);
export const NOT_PULLED_UP = SILENT_BUS(
  'nothing pulls SDA and SCL up',
  'that it is connected, its power, then the pull-ups of SDA and SCL',
);
export const HELD_LOW = {
  SDA: SILENT_BUS('SDA is held low', "SDA for a short circuit, then the camera's power"),
  SCL: SILENT_BUS('SCL is held low', "SCL for a short circuit, then the camera's power"),
  both: SILENT_BUS('SDA and SCL are held low', "the camera's power, then both lines for short circuits"),
};
export const BACK = 'the camera sends frames';
export const FORGETS = (register, found, expected) =>
  `the camera does not keep what register ${register} is set to (address 0x24, found ${found}, expected ${expected}); ` +
  'help: check the sensor\'s type, the supply voltage, then the pull-ups of SDA and SCL';
/** What a camera sends in place of 30 frames per second of 244 lines of 324 pixels. */
export const SENDS = (what, found, first, register) => {
  const size = (lines, words, rate) => `${lines} lines, ${words} words, ${rate} per second`;
  const [right, wrong] = [size(244, 19764, '30.00'), size(found.lines ?? 244, found.words ?? 19764, found.rate ?? '30.0.')];
  const help = `help: check ${first}, then register ${register}`;
  return new RegExp(`^the camera at 0x24 sends ${what} \\(found ${wrong}; expected ${right}\\); ${help}$`);
};
const SIZE_FIRST = 'the wires HREF, VSYNC and PCLK and the number of data wires';
export const ANOTHER_SIZE = (found) => SENDS('frames of another size', found, SIZE_FIRST, '0x3010');
export const ANOTHER_RATE = (rate) => SENDS('frames at another rate', { rate }, "the sensor's clock, 24 MHz", '0x3060');
export const LOST_SYNC = 'a frame did not begin or end when it should have';

/** Returns the numbers from one to another one, without that. */
export const range = (from, to) => Array.from({ length: to - from }, (_, k) => from + k);
/** Returns whether lines are those that are expected, of which each is a text or an expression. */
export const same = (a, b) => {
  return a.length === b.length && a.every((line, k) => (b[k] instanceof RegExp ? b[k].test(line) : line === b[k]));
};
export const ofKind = (lines, ...kinds) => lines.filter((line) => kinds.includes(JSON.parse(line).kind));

/** The command, with a clip of two slides. */
export class Host {
  constructor(wstac) {
    this.wstac = wstac;
    this.folder = fs.mkdtempSync(path.join(os.tmpdir(), 'pico-'));
    process.on('exit', () => fs.rmSync(this.folder, { recursive: true }));
    Object.assign(this, this.rendered('clip', fs.readFileSync(SCENE)));
    this.failures = 0;
    this.notes = '';
    this.events = ofKind(this.ofClip(), 'event');
    this.features = ofKind(this.ofClip('--features'), 'features');
    if (this.events.length !== 2) throw new Error(`the clip has ${this.events.length} events, expected 2`);
  }

  /** Returns the path of a file of this check. */
  file(name) {
    return path.join(this.folder, name);
  }

  /** Renders a scene before a rolling shutter. Returns the paths of a clip and of its raw pixels, and its frames. */
  rendered(name, toml, readout = READOUT_MS, fps = 30) {
    const [scene, clip, raw] = ['toml', 'y4m', 'raw'].map((ending) => this.file(`${name}.${ending}`));
    fs.writeFileSync(scene, `${toml}`.replace('[sensor]\n', `[sensor]\nfps = ${fps}\nreadout_ms = ${readout}\n`));
    for (const output of [clip, raw]) execFileSync(this.wstac, ['scene', 'render', scene, '-o', output, '--force'], { stdio: 'ignore' });
    const pixels = fs.readFileSync(raw);
    const frames = Array.from({ length: pixels.length / SIZE }, (_, k) => pixels.subarray(k * SIZE, (k + 1) * SIZE));
    return { clip, raw, frames };
  }

  /** Runs the command. Returns its lines; those of standard error are in `notes`. */
  says(...options) {
    const done = spawnSync(this.wstac, options, { encoding: 'utf8', maxBuffer: 1 << 28 });
    if (done.status !== 0) throw new Error(`wstac ${options[0]} failed: ${done.stderr}`);
    this.notes = done.stderr;
    return done.stdout.split('\n').filter((line) => line);
  }

  ofClip(...options) {
    return this.of(this.clip, ...options);
  }

  /** Returns the lines of `wstac run` on another clip. */
  of(clip, ...options) {
    const config = options.includes('--config') ? [] : ['--config', CONFIG];
    const readout = options.includes('--readout') ? [] : ['--readout', `${READOUT_MS}`];
    return this.says('run', clip, '--json', ...readout, ...config, ...options);
  }

  /** Returns the events of the clip with these corners of taxels. */
  eventsWith(corners) {
    const toml = this.file('layout.toml');
    fs.writeFileSync(toml, fs.readFileSync(CONFIG) + asToml(corners));
    const events = ofKind(this.ofClip('--config', toml), 'event');
    if (events.length !== 2 || same(events, this.events)) throw new Error('another layout changes nothing');
    return events;
  }

  /** Returns the clip of two slides at another rate, its frames, its readout, and what the host makes of it. */
  at(fps) {
    const readout = (239 * 376 * (fps > 30 ? 4 : 8)) / 24_000;
    const { clip, frames } = this.rendered(`at ${fps}`, fs.readFileSync(SCENE), readout, fps);
    return { frames, readout, lines: this.of(clip, '--features', '--readout', `${readout}`) };
  }

  /** Returns the lines of `wstac monitor` on bytes that a board sent. */
  ofLine(bytes, ...options) {
    const file = this.file('serial');
    fs.writeFileSync(file, bytes);
    return this.says('monitor', file, '--json', ...options);
  }

  /** Returns what the board told the host of, in order. */
  told() {
    const lines = this.notes.split('\n').filter((line) => line.includes('the board: '));
    return lines.map((line) => line.split('the board: ')[1]).filter((line) => !line.startsWith('up for'));
  }

  /** Prints one line per case. */
  say(name, problems) {
    this.failures += problems.length > 0 ? 1 : 0;
    console.log(`${problems.length > 0 ? 'FAILED' : 'passed'}  ${name}`);
    for (const problem of problems) console.log(`        ${problem}`);
  }

  /** Returns how features differ from those of a part of the clip without the missing frames. */
  compare(lines, count, missing) {
    const expected = this.features.slice(0, count).filter((_, frame) => !missing.includes(frame));
    if (same(lines, expected)) return [];
    const numbers = (all) => all.map((line) => JSON.parse(line).frame);
    const lost = numbers(expected).filter((frame) => !numbers(lines).includes(frame));
    const more = numbers(lines).filter((frame) => !numbers(expected).includes(frame));
    const wrong = numbers(lines.filter((line) => !expected.includes(line)));
    return [`missing, too: ${lost.slice(0, 30)}; too many: ${more.slice(0, 30)}; wrong: ${wrong.slice(0, 30)}`];
  }

  /** Compares what a program takes of its board with the budgets. `sent` is what came out of the serial line. */
  budget(board, program, sent, instructions) {
    this.ofLine(sent, '--status');
    const stack = Number([...this.notes.matchAll(/(\d+) bytes of stack used/g)].at(-1)?.[1]);
    const found = { ...sizes(program), stack, instructions: Math.round(instructions) };
    const row = new RegExp(`^${board} = \\{(.*)\\}$`, 'm').exec(fs.readFileSync(BUDGETS, 'utf8'))[1];
    const parts = row.split(',').map((limit) => limit.split('=').map((part) => part.trim().replaceAll('_', '')));
    const limits = Object.fromEntries(parts);
    const problems = Object.entries(found).filter(([key, value]) => !(value > 0 && value <= Number(limits[key])));
    const named = problems.map(([key, value]) => `${key}: ${value}, expected at most ${limits[key]}`);
    this.say(`budgets of ${board}`, named);
    const [flash, ram, deepest, count] = Object.values(found).map((value) => value.toLocaleString('en'));
    const bytes = `${flash} bytes of flash, ${ram} of RAM, ${deepest} of stack`;
    console.log(`${board}: ${bytes}, ${count} instructions per frame`);
  }
}

/** Returns the bytes of flash and RAM that a program takes, without its stack. */
function sizes(program) {
  const elf = fs.readFileSync(program);
  const [table, size, count] = [elf.readUInt32LE(32), elf.readUInt16LE(46), elf.readUInt16LE(48)];
  let [flash, ram] = [0, 0];
  for (let at = table; at < table + size * count; at += size) {
    const [type, flags, place, length] = [4, 8, 12, 20].map((field) => elf.readUInt32LE(at + field));
    // Sections that are in memory: bits are flashed, and those of RAM copied from there; others are RAM without bits.
    if (!(flags & 2)) continue;
    if (type !== 8) flash += length;
    if (place >>> 28 === 2) ram += length;
  }
  return { flash, ram };
}
