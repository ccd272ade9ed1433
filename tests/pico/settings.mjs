// The settings of a Raspberry Pi Pico: a layout that is set over the link is kept in its flash.

import { Flash, PowerFailed } from './flash.mjs';
import { ofKind, same } from './host.mjs';
import { IS_OUTSIDE, IS_SET, LAYOUT, LAYOUT_OUTSIDE, withLayout } from './layout.mjs';
import { Board } from './machine.mjs';
import { ANSWER, BEGIN, FORGET, IN_USE, SET, SETTINGS, asVarint, contents, crc, request } from './wire.mjs';

// The longest exposure of an HM01B0 in lines: those of a frame less two.
const LONGEST = 264;

/** Returns what a flash without power has, for another board. */
export function carried(flash) {
  const again = new Flash();
  again.bytes.set(flash.bytes);
  return again;
}

/**
 * Sends a request when the board uses frames. Returns the contents that come back until all of these kinds have come, or
 * for two seconds.
 */
export function asked(board, wanted, ...kinds) {
  while (!board.uses()) board.frame(null);
  const sent = board.sent.length;
  const found = () => contents(board.sent.slice(sent));
  board.requests.push(wanted);
  for (let k = 0; k < 60 && !kinds.every((kind) => found().some((content) => content[0] === kind)); k++) {
    board.frame(null);
  }
  return found();
}

/** Returns the settings in use, and whether they were set. */
function inUse(board) {
  const answer = asked(board, request(SETTINGS), IN_USE).find((content) => content[0] === IN_USE) ?? Buffer.alloc(2);
  return { settings: answer.subarray(1, -1), isSet: answer.at(-1) === 1 };
}

/**
 * A layout that is set over the link is kept: after a reset and without power, the answers are the host's with it. A bad
 * one is refused, and changes nothing. If the power fails while it is written, the old layout holds or the new one.
 */
export function settings(name, host, program) {
  const problems = [];
  const expect = (isRight, problem) => isRight || problems.push(problem);
  const board = new Board(program, []);
  const flashes = [board.flash];
  const { settings: compiledIn, isSet } = inUse(board);
  expect(!isSet, 'an empty flash has settings');
  const wanted = withLayout(compiledIn, LAYOUT);
  const answer = (content) => content[0] === ANSWER;

  const bad = withLayout(compiledIn, LAYOUT_OUTSIDE);
  const refused = asked(board, request(SET, ...bad), ANSWER).filter(answer);
  expect(
    refused.length === 1 && same([...refused[0].subarray(1, 5)], IS_OUTSIDE) && board.flash.changed === 0,
    `a bad layout is answered by ${refused.map((content) => content.toString('hex'))}`,
  );

  const done = asked(board, request(SET, ...wanted), ANSWER, BEGIN);
  const answers = done.filter(answer).map((content) => [...content.subarray(1)]);
  expect(answers.length === 1 && same(answers[0], IS_SET), `a layout is answered by ${JSON.stringify(answers)}`);
  expect(done.some((content) => content[0] === BEGIN), 'the board does not start again');
  const used = inUse(board);
  expect(used.isSet && used.settings.equals(wanted), 'the layout is not used after the restart');
  const bytes = board.flash.changed;

  const expected = host.eventsWith(LAYOUT);
  const after = new Board(program, host.frames, {}, carried(board.flash));
  flashes.push(after.flash);
  const events = ofKind(host.ofLine(after.play()), 'event');
  expect(same(events, expected), `events are ${events}, expected ${expected}`);

  // Another change of them, of which the power lets so many bytes be written.
  const left = new Set();
  for (const cut of [0, 1, 3, 8, 20, bytes >> 1, bytes - 9, bytes - 1, 2 * bytes]) {
    const other = new Board(program, [], {}, carried(board.flash));
    other.flash.cutAfter = cut;
    try {
      asked(other, request(SET, ...compiledIn), BEGIN);
    } catch (error) {
      if (!(error instanceof PowerFailed)) throw error;
    }
    const again = new Board(program, [], {}, carried(other.flash));
    const found = inUse(again);
    flashes.push(other.flash, again.flash);
    const isNew = found.settings.equals(wanted), isOld = found.settings.equals(compiledIn);
    expect(found.isSet && (isNew || isOld), `without power after ${cut} bytes, ${found.settings.toString('hex')} is used`);
    left.add(isNew);
  }
  expect(left.size === 2, 'a cut shows the old settings only, or the new ones: this shows less than it should');

  asked(board, request(FORGET), ANSWER, BEGIN);
  const forgotten = inUse(board);
  expect(!forgotten.isSet && forgotten.settings.equals(compiledIn), 'settings are not forgotten');
  for (const flash of flashes) problems.push(...flash.problems);
  host.say(name, problems.slice(0, 5));
}

/** Returns the checksum of an item of sequential-storage: CRC-32C with another beginning, without ends of 0 and 0xff. */
function itemChecksum(data) {
  const sum = crc(data, 0xeeee_eeee, 0x82f6_3b78);
  return [0, 0xff].includes(sum & 0xff) ? (sum ^ 1) >>> 0 : sum;
}

/** Returns a flash in which these settings stand in place of those that it keeps, which have as many bytes. */
function withSettings(flash, kept, wanted) {
  const again = carried(flash), bytes = Buffer.from(again.bytes.buffer);
  // The key of settings, and that there are some. In front are the checksum of both, their length and its checksum.
  const before = [1, 1], at = bytes.indexOf(Buffer.from([...before, ...kept]));
  const item = (settings) => Buffer.from([...before, ...settings]);
  if (at < 0 || bytes.readUInt32LE(at - 8) !== itemChecksum(item(kept)) || kept.length !== wanted.length) {
    throw new Error('the settings are not kept as an item of sequential-storage');
  }
  item(wanted).copy(bytes, at);
  bytes.writeUInt32LE(itemChecksum(item(wanted)), at - 8);
  return again;
}

/** An exposure that does not fit in a frame is refused; one that is in the flash all the same does not stop the board. */
export function exposure(name, host, program) {
  const problems = [];
  const expect = (isRight, problem) => isRight || problems.push(problem);
  const used = (board) => {
    for (let k = 0; k < 120 && !board.uses(); k++) board.frame(null);
    expect(board.uses(), `with ${board.sensor.number(0x0202)} lines of exposure, no frame is used`);
    return board.uses();
  };
  const board = new Board(program, []);
  const { settings: compiledIn } = inUse(board);
  const exposed = (lines) => Buffer.from([...compiledIn.subarray(0, -1), 1, ...asVarint(lines)]);
  const answered = (lines, expected, ...kinds) => {
    const found = asked(board, request(SET, ...exposed(lines)), ANSWER, ...kinds).filter(([kind]) => kind === ANSWER);
    const bytes = found.map((content) => [...content.subarray(1)]);
    expect(bytes.length === 1 && same(bytes[0], expected), `${lines} lines are answered by ${JSON.stringify(bytes)}`);
    return used(board);
  };
  const refused = (lines) => answered(lines, [1, 2, ...asVarint(lines), ...asVarint(LONGEST)]);
  if (refused(LONGEST + 1) && refused(500)) {
    expect(board.flash.changed === 0, 'an exposure that is refused is kept');
    if (answered(LONGEST, IS_SET, BEGIN)) expect(board.sensor.number(0x0202) === LONGEST, 'the longest exposure is not used');
    const kept = withSettings(board.flash, exposed(LONGEST), exposed(LONGEST + 1));
    const again = new Board(program, [], {}, kept);
    if (used(again)) expect(inUse(again).settings.equals(compiledIn), 'an exposure that does not fit is in use');
  }
  problems.push(...board.flash.problems);
  host.say(name, problems);
}
