// A Raspberry Pi Pico that learns textures over the link, and keeps them in its flash.

import { ofKind, same } from './host.mjs';
import { Board } from './machine.mjs';
import { carried } from './settings.mjs';
import { LEARN, LEARNED, LEARNING, TEXTURES, contents, request } from './wire.mjs';

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

/**
 * A texture is learned from five slides, and kept: without power, a slide of it has its name, and a slide of another texture
 * is what the host says with the model that is compiled in.
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
  const expected = ofKind(host.says('run', afterwards.clip, '--json', '--model', model), 'event').map((line) => JSON.parse(line));
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
  for (const flash of [board.flash, after.flash]) problems.push(...flash.problems);
  host.say(name, problems.slice(0, 5));
}
