// Another layout than the compiled-in one, as settings over the link have it.

import { asVarint, numbers } from './wire.mjs';

// The frame, a taxel and the corners of all are the first numbers of settings.
const COUNT = 54;
const TAXEL = [24, 28];
/** The corners of its taxels. */
export const LAYOUT = Array.from({ length: 25 }, (_, k) => [40 + 45 * (k % 5), 12 + 44 * Math.floor(k / 5)]);
/** Those of a layout whose last taxel is outside. */
export const LAYOUT_OUTSIDE = [...LAYOUT.slice(0, -1), [310, 12]];
/** The answers: set, and refused because the 25th taxel is outside. */
export const IS_SET = [0], IS_OUTSIDE = [1, 1, 2, 24];

/** Returns the bytes of settings with these corners. */
export function withLayout(settings, corners) {
  const { found, rest } = numbers(settings, COUNT);
  return Buffer.from([...[...found.slice(0, 2), ...TAXEL, ...corners.flat()].flatMap(asVarint), ...rest]);
}

/** Returns the configuration with them. */
export function asToml(corners) {
  return `[layout]\nframe = [320, 240]\ntaxel = ${JSON.stringify(TAXEL)}\ncorners = ${JSON.stringify(corners)}\n`;
}
