// The line of a Raspberry Pi Pico at USB: whatever a host does with its port, the board goes on.

import { UNIQUE_ID } from './flash.mjs';
import { ofKind, same } from './host.mjs';
import { Board } from './machine.mjs';
import { BEGIN, BOOTLOADER, BOOTLOADER_IS, FEATURES, HELLO, contents, request } from './wire.mjs';

const FRAMES = 40;

/** Returns a board whose frames are used, and what runs so many of them. */
function running(host, program, prepare = () => {}) {
  const board = new Board(program, host.frames);
  prepare(board);
  for (let k = 0; k < 60 && board.began === null; k++) board.frame(null);
  let next = 1;
  return { board, run: (count = FRAMES) => Array.from({ length: count }, () => board.frame(next++)) };
}

/** Returns what is wrong with a board, whose last status is that of one that lost no frame, and with its host. */
function wrong(host, board, options = []) {
  host.ofLine(Buffer.from(board.sent), '--status', ...options);
  const isRight = host.notes.trim().split('\n').at(-1).includes('30.00 frames per second, 0 overruns, 0 restarts');
  return [...(isRight && !board.resets ? [] : [`at the end, ${host.notes}`]), ...board.usb.problems];
}

/** What nobody reads is discarded. A host that opens the port is told what the board is, and of no loss. */
export function late(name, host, program) {
  const { board, run } = running(host, program, (board) => (board.usb.opens = false));
  run();
  const problems = board.sent.length > 0 ? ['bytes come out of a port that is not open'] : [];
  board.usb.open();
  run();
  problems.push(...wrong(host, board));
  if (contents(board.sent)[0]?.[0] !== BEGIN) problems.push('the first message does not say what the board is');
  if (host.notes.includes(' lost')) problems.push(`the host is told ${host.notes}`);
  const { device, configuration, serial } = board.usb;
  const digits = Buffer.from(UNIQUE_ID).toString('hex');
  if (serial !== digits.toUpperCase() || !host.notes.includes(`, chip 00000000${digits}`)) {
    problems.push(`the serial number is ${serial}, expected ${digits}, which the host is told: ${host.notes}`);
  }
  problems.push(...board.flash.problems);
  const [size, vendor, product] = [device[7], device[8] | (device[9] << 8), device[10] | (device[11] << 8)];
  if (size !== 64 || vendor !== 0x2e8a || product !== 0x000a) problems.push(`the device says ${device}`);
  if (configuration.length !== (configuration[2] | (configuration[3] << 8))) problems.push('its configuration is cut');
  host.say(name, problems);
}

/** The queue is filled, and what has no room is lost and counted; no frame is. */
export function unread(name, host, program) {
  const { board, run } = running(host, program);
  board.requests.push(request(FEATURES, 1));
  run();
  board.usb.read(false);
  const before = board.sent.length;
  run();
  const problems = board.sent.length > before ? ['bytes arrive that nobody reads'] : [];
  board.usb.read(true);
  run();
  problems.push(...wrong(host, board));
  if (!/\d+ messages lost/.test(host.notes)) problems.push(`no loss is told: ${host.notes}`);
  const { length } = ofKind(host.ofLine(Buffer.from(board.sent), '--features'), 'features');
  if (length < 2 * FRAMES - 2 || length > 2 * FRAMES + 20) problems.push(`${length} frames arrive of ${3 * FRAMES}`);
  host.say(name, problems);
}

/** A port that is opened again begins with what the board is, also after the cable was unplugged. */
export function reopened(name, host, program) {
  const { board, run } = running(host, program);
  const problems = [];
  const again = (what, how) => {
    run();
    const before = board.sent.length;
    how();
    run();
    const [first] = contents(board.sent.slice(before));
    if (first?.[0] !== BEGIN) problems.push(`after ${what}, the first message is ${first?.[0]}`);
  };
  again('a port was closed', () => {
    board.usb.close();
    run();
    board.usb.open();
  });
  again('a cable was unplugged', () => board.usb.plug());
  if (!same(Object.values(board.usb.times), [2, 3])) problems.push(`resets and openings: ${Object.values(board.usb.times)}`);
  host.say(name, [...problems, ...wrong(host, board)]);
}

/** What a program reads that looks for a modem is told again to a host, also if there is no camera. */
export function modem(name, host, program) {
  const problems = [];
  for (const present of [true, false]) {
    const { board, run } = running(host, program, (board) => (board.sensor.present = present));
    board.crash();
    const tells = (what, expected, ...requests) => {
      const before = board.sent.length;
      board.requests.push(...requests);
      run();
      const found = new TextDecoder().decode(Uint8Array.from(board.sent.slice(before))).split('hard fault').length - 1;
      if (found !== expected) problems.push(`${what} is told ${found} times, expected ${expected}`);
    };
    tells('a program after the crash', 1, Buffer.from('AT\r\n'));
    board.reset();
    tells('a host after a reset', 1, request(HELLO));
    board.reset();
    tells('the next one', 0);
  }
  host.say(name, problems);
}

/** A request starts the boot loader, after the answer. The watchdog does not end it. A board without one says so. */
export function bootloader(name, host, program, without) {
  const answers = [program, without].map((file) => {
    const { board, run } = running(host, file);
    board.requests.push(request(BOOTLOADER));
    run();
    const isLeft = board.flash.boots === true;
    board.run(5e9);
    const answer = contents(board.sent).find((content) => content[0] === BOOTLOADER_IS);
    return [[...(answer ?? [])], isLeft, board.resets, ...board.flash.problems];
  });
  const expected = [[[BOOTLOADER_IS, 1, 0], true, 0], [[BOOTLOADER_IS, 0], false, 0]];
  const isRight = JSON.stringify(answers) === JSON.stringify(expected);
  host.say(name, isRight ? [] : [`${JSON.stringify(answers)}, expected ${JSON.stringify(expected)}`]);
}
