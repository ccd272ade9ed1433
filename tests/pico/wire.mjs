// The link between a board and its host, as docs/SPEC.md describes it: frames, and numbers in their contents.

const VERSION = 4;
// Requests, as in tests/emulator/check.py: their numbers.
export const HELLO = 0, FEATURES = 1, SETTINGS = 8, SET = 9, FORGET = 10;
export const TEXTURES = 11, LEARN = 12, FORGET_TEXTURE = 14;
export const MODEL = 15, SEND_MODEL = 16, MODEL_PIECE = 17, FORGET_MODEL = 18, BOOTLOADER = 19;
// Messages.
export const BEGIN = 0, IN_USE = 16, ANSWER = 17, LEARNING = 18, LEARNED = 19, BOARD_MODEL = 20, BOOTLOADER_IS = 22;
/** The bytes of a piece of a model. */
const PIECE = 160;

/** A checksum of 32 bits; without a beginning and a polynomial, CRC-32 (IEEE). */
export function crc(bytes, rest = 0xffff_ffff, polynomial = 0xedb8_8320) {
  for (const byte of bytes) {
    rest ^= byte;
    for (let bit = 0; bit < 8; bit++) rest = (rest >>> 1) ^ (rest & 1 ? polynomial : 0);
  }
  return ~rest >>> 0;
}

/** Returns the frame of a request. */
export function request(message, ...wanted) {
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

/** Returns the contents of the frames that a board sent, without version, sequence number and checksum. */
export function contents(bytes) {
  const found = [];
  let stuffed = [];
  for (const byte of bytes) {
    if (byte !== 0) {
      stuffed.push(byte);
      continue;
    }
    const content = [];
    for (let at = 0; at < stuffed.length; at += stuffed[at]) {
      content.push(...stuffed.slice(at + 1, at + stuffed[at]));
      if (stuffed[at] < 0xff && at + stuffed[at] < stuffed.length) content.push(0);
    }
    stuffed = [];
    const [data, sum] = [content.slice(0, -4), Buffer.from(content.slice(-4))];
    if (data.length > 0 && crc(data) === sum.readUInt32LE()) found.push(Buffer.from(numbers(data.slice(1), 1).rest));
  }
  return found;
}

/** Returns so many numbers at the beginning of bytes, and the bytes behind them. */
export function numbers(bytes, count) {
  const found = [];
  let at = 0;
  while (found.length < count) {
    let number = 0;
    for (let shift = 0; ; shift += 7) {
      number += (bytes[at] & 0x7f) * 2 ** shift;
      if (bytes[at++] < 0x80) break;
    }
    found.push(number);
  }
  return { found, rest: bytes.slice(at) };
}

/** Returns the bytes of a number. */
export function asVarint(number) {
  return number < 0x80 ? [number] : [(number & 0x7f) | 0x80, ...asVarint(number >>> 7)];
}

/** Returns the requests that send a model file, and the checksum by which boards name it. */
export function modelPieces(file) {
  const checksum = file.readUInt32LE(4);
  const begin = request(SEND_MODEL, ...asVarint(file.length), ...asVarint(checksum));
  const all = [];
  for (let at = 0; at < file.length; at += PIECE) {
    const piece = file.subarray(at, at + PIECE);
    all.push(request(MODEL_PIECE, ...asVarint(at), ...asVarint(piece.length), ...piece));
  }
  return { checksum, begin, all };
}

/** Returns what a message says of a board's model: the checksum in use, whether it was sent, and what happened last. */
export function modelState(content) {
  const { found, rest } = content[1] ? numbers(content.subarray(2), 1) : { found: [null], rest: content.subarray(2) };
  // Behind kind and sample is the size, and at the end the newest layout that the board reads: 1, 2.
  return { checksum: found[0], isSent: rest[0] === 1, step: [...numbers(rest.subarray(3), 1).rest].slice(0, -2) };
}
