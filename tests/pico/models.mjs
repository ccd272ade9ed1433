// A Raspberry Pi Pico that takes models and learns textures over the link, and keeps both in its flash.

import fs from 'node:fs';
import { Flash, PowerFailed } from './flash.mjs';
import { ofKind, same } from './host.mjs';
import { Board } from './machine.mjs';
import { asked, carried } from './settings.mjs';
import {
  BEGIN,
  BOARD_MODEL,
  FORGET_MODEL,
  FORGET_TEXTURE,
  LEARN,
  LEARNED,
  LEARNING,
  MODEL,
  TEXTURES,
  contents,
  modelPieces,
  modelState,
  request,
} from './wire.mjs';

const TEXTURE = 'carpet', NAME = [TEXTURE.length, ...Buffer.from(TEXTURE)];
const NEW = 'kind = "slide"\nspecimen = "Saw3"\nperiod = 12';
// A press, five slides of a texture that no model knows by its name, and then one more of it and one of a specimen.
const LESSON = [
  'kind = "press"',
  ...[[150, 90], [120, 200], [200, 315], [170, 20], [135, 260]].map(
    ([speed, direction]) => `${NEW}\nspeed = ${speed}\ndirection = ${direction}`,
  ),
];
const AFTERWARDS = [
  `${NEW}\nspeed = 160\ndirection = 140`,
  'kind = "slide"\nspecimen = "Sin2"\nspeed = 150\ndirection = 180',
];

function scene(touches, seed) {
  const all = touches.map((touch) => `[[touch]]\n${touch}\n`);
  return `lead_in = 30\ngap = 64\nseed = ${seed}\n[sensor]\nsize = [320, 240]\n${all.join('')}`;
}

/** Returns what a board says of its model, of each time. */
const states = (board) => contents(board.sent).filter((content) => content[0] === BOARD_MODEL).map(modelState);

/** Sends a model, piece by piece: every ninth is damaged at first. Returns the board's last word of it. */
function sending(board, pieces) {
  while (!board.uses()) board.frame(null);
  const wait = (isDone) => {
    for (let frame = 0; frame < 200 && !isDone(); frame++) board.frame(null);
  };
  const step = () => states(board).at(-1)?.step ?? [];
  board.requests.push(pieces.begin);
  wait(() => step()[0] === 1);
  pieces.all.forEach((piece, number) => {
    if (number % 9 === 8) board.requests.push(piece.map((byte, at) => (at === 20 ? byte ^ 0x55 || 1 : byte)));
    const before = states(board).length;
    board.requests.push(piece);
    wait(() => states(board).length > before);
  });
  const starts = () => contents(board.sent).filter((content) => content[0] === BEGIN).length;
  const before = starts();
  wait(() => starts() > before);
  return step();
}

/** Returns the model in use after a start. */
function inUse(board) {
  while (!board.uses()) board.frame(null);
  board.requests.push(request(MODEL));
  for (let frame = 0; frame < 10; frame++) board.frame(null);
  return states(board)[0];
}

/**
 * A model that is sent is used after the start that follows, and the answers are then those of the host with it. Without
 * power while it is written, there is the one of before or the new one. It can be forgotten.
 */
export function models(name, host, program, file) {
  const problems = [];
  const expect = (isRight, problem) => isRight || problems.push(problem);
  const pieces = modelPieces(fs.readFileSync(file));
  const board = new Board(program, []);
  const before = inUse(board);
  expect(!before.isSent, 'an empty flash has a model');
  sending(board, pieces);
  const changed = board.flash.changed;

  const after = new Board(program, host.frames, {}, carried(board.flash));
  after.requests.push(request(MODEL));
  const events = ofKind(host.ofLine(after.play()), 'event');
  const expected = ofKind(host.ofClip('--model', file), 'event');
  expect(same(events, expected), `events are ${events}, expected ${expected}`);
  const used = inUse(after);
  expect(used.isSent && used.checksum === pieces.checksum, `the model in use is ${JSON.stringify(used)}`);

  const flashes = [board.flash, after.flash];
  const left = new Set();
  // In the middle of its bytes, and at the last ones, which make it count.
  for (const cut of [changed >> 1, changed - 3, changed]) {
    const other = new Board(program, []);
    other.flash.cutAfter = cut;
    try {
      sending(other, pieces);
    } catch (error) {
      if (!(error instanceof PowerFailed)) throw error;
    }
    const again = new Board(program, [], {}, carried(other.flash));
    const found = inUse(again);
    flashes.push(other.flash, again.flash);
    const isNew = found.isSent && found.checksum === pieces.checksum;
    expect(isNew || found.checksum === before.checksum, `without power after ${cut} bytes, ${JSON.stringify(found)} is used`);
    left.add(isNew);
  }
  expect(left.size === 2, 'a cut shows the old model only, or the new one: this shows less than it should');

  after.requests.push(request(FORGET_MODEL));
  for (let frame = 0; frame < 60; frame++) after.frame(null);
  const forgotten = inUse(new Board(program, [], {}, carried(after.flash)));
  expect(!forgotten.isSent && forgotten.checksum === before.checksum, 'the model is not forgotten');
  for (const flash of flashes) problems.push(...flash.problems);
  host.say(name, problems.slice(0, 5));
}

/**
 * A texture is learned from five slides, and kept: without power, a slide of it has its name, and a slide of another texture
 * is what the host says with the model that is compiled in. It can be forgotten.
 */
export function learning(name, host, program, model) {
  const problems = [];
  const lesson = host.rendered('lesson', scene(LESSON, 0)), afterwards = host.rendered('afterwards', scene(AFTERWARDS, 7));
  const faults = { 5: (board) => void board.requests.push(request(LEARN, ...NAME)) };
  // A host that watches asks for the state.
  for (let frame = 100; frame < lesson.frames.length; frame += 100) {
    faults[frame] = (board) => void board.requests.push(request(TEXTURES));
  }
  const board = new Board(program, lesson.frames, faults);
  board.play();
  const told = contents(board.sent).filter((content) => content[0] === LEARNING).map((content) => [...content.subarray(1)]);
  // Begun, not taken because it is no slide, four slides taken, and learned.
  const steps = [[0, 5, 0], [0, 5, 2, 0], ...[1, 2, 3, 4].map((count) => [count, 5, 1]), [5, 5, 3]];
  const expectedSteps = steps.map((step) => [...NAME, ...step]);
  if (JSON.stringify(told) !== JSON.stringify(expectedSteps)) problems.push(`the board tells ${JSON.stringify(told)}`);

  const asks = { 20: (other) => void other.requests.push(request(TEXTURES)) };
  const after = new Board(program, afterwards.frames, asks, carried(board.flash));
  const events = ofKind(host.ofLine(after.play()), 'event');
  const expected = ofKind(host.of(afterwards.clip, '--model', model), 'event').map((line) => JSON.parse(line));
  expected[0].texture = {
    specimen: null,
    pattern: null,
    depth_mm: null,
    class: TEXTURE,
    confidence: null,
    known: true,
  };
  const lines = expected.map((event) => JSON.stringify(event));
  const found = events.map((event) => JSON.stringify(JSON.parse(event)));
  if (!same(found, lines)) problems.push(`events are ${found}, expected ${lines}`);
  const names = contents(after.sent).filter((content) => content[0] === LEARNED).map((content) => [...content.subarray(1)]);
  const one = [1, ...NAME, ...new Array(8).fill(0)];
  if (names.length !== 1 || !same(names[0], one)) problems.push(`the learned textures are ${JSON.stringify(names)}`);

  const begun = asked(after, request(FORGET_TEXTURE, ...NAME), LEARNED, BEGIN).some((content) => content[0] === BEGIN);
  if (!begun) problems.push('the board does not start again without the texture');
  const forgotten = new Board(program, [], {}, carried(after.flash));
  const left = asked(forgotten, request(TEXTURES), LEARNED).find((content) => content[0] === LEARNED);
  if (!left || left.subarray(1).some((byte) => byte !== 0)) problems.push('the texture is not forgotten');
  for (const flash of [board.flash, after.flash, forgotten.flash]) problems.push(...flash.problems);
  host.say(name, problems.slice(0, 5));
}
