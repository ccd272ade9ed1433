// Checks the page of `wstac serve` in Chromium: what it shows is what `wstac run --json` says, it fits a phone, and it
// connects again when the server comes back. Foreign requests are refused. It records, calibrates and examines (tools.mjs).
//
//     node check.mjs WSTAC [FOLDER]
//
// Pictures of the page go to FOLDER, if it is given. `ci/pages browser` installs what this needs.

import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';

import { chromium } from 'playwright-core';

import {
  LIMIT_MS, MODEL, bytesOf, differences, ended, eventsOf, failed, more as given, open, recordsOf, say, serve, statusOf, wstac,
} from './common.mjs';
import { tools } from './tools.mjs';

if (!wstac || given.length > 0) {
  console.error('usage: node check.mjs WSTAC [FOLDER]');
  process.exit(2);
}
const SCENE = 'scene:Saw3@150,90deg,seed=7', OTHER = 'scene:Fla0@100,0deg,seed=1';
// The whole page, in bytes: with less, a part of it was not counted.
const LEAST_BYTES = 30_000, MOST_BYTES = 200_000;

/** Returns what is wider than its place: the page, or a table of it. */
const tooWide = (page) =>
  page.evaluate(() => {
    const all = [document.documentElement, ...document.querySelectorAll('.table')];
    const wide = all.filter(({ scrollWidth, clientWidth }) => scrollWidth > clientWidth);
    return wide.map(({ tagName, scrollWidth, clientWidth }) => `${tagName} is ${scrollWidth} pixels wide, expected ${clientWidth}`);
  });

/** Returns whether pictures of the whole page make it or its traces larger. */
async function grown(page) {
  const tall = async () => {
    await page.screenshot({ fullPage: true });
    return page.evaluate(() => [document.documentElement.scrollHeight, ...[...document.querySelectorAll('.plot')].map(({ height }) => height)]);
  };
  const [before, after] = [await tall(), (await tall(), await tall())];
  const grows = String(before) !== String(after) || after.slice(1).some((height) => height > 900);
  return grows ? [`the page and its traces are ${after} pixels high, expected ${before}`] : [];
}

const begun = Date.now();
const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
const [event] = eventsOf(SCENE);

let server = await serve(SCENE, ...MODEL, '--listen', '127.0.0.1:0');
const { address } = server;
const wide = await open(browser, address, 1440, 900, 'light');
const phone = await open(browser, address, 360, 740, 'dark');
await ended(wide.page, 1);
await ended(phone.page, 1);
say('an event is what wstac run says', await differences(wide.page.locator('.sensor'), event));
for (const [name, { page, errors }] of Object.entries({ wide, phone })) {
  const bytes = await bytesOf(page);
  const problems = errors.map((error) => `the console says ${error}`);
  problems.push(...(await tooWide(page)));
  // Of white and black, in every channel.
  const [light] = await page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number));
  if (name === 'wide' ? light < 200 : light > 60) problems.push(`the background has a brightness of ${light} of 255`);
  const isRight = bytes >= LEAST_BYTES && bytes <= MOST_BYTES;
  if (!isRight) problems.push(`the page has ${bytes} bytes, expected ${LEAST_BYTES} to ${MOST_BYTES}`);
  say(`${name}: ${bytes} bytes`, problems);
}

say('a picture of the whole page', [...(await grown(wide.page)), ...(await grown(phone.page))]);

const host = new URL(address).host;
const statuses = {
  'another site': await statusOf(address, { Host: host, Origin: 'http://example.org' }),
  'another host': await statusOf(address, { Host: 'example.org' }),
  'the page itself': await statusOf(address, { Host: host, Origin: address.replace(/\/$/, '') }),
};
const refused = JSON.stringify(statuses) === JSON.stringify({ 'another site': 403, 'another host': 403, 'the page itself': 200 });
say('foreign requests', refused ? [] : [JSON.stringify(statuses)]);

const says = (text) =>
  wide.page.waitForFunction((text) => document.querySelector('#connection').textContent === text, text, { timeout: LIMIT_MS });
await server.stop();
await wide.page.waitForFunction(() => document.querySelector('#connection').textContent !== 'connected', { timeout: LIMIT_MS });
server = await serve(SCENE, ...MODEL, '--listen', host);
await says('connected');
await ended(wide.page, 1);
say('the server comes back', await differences(wide.page.locator('.sensor'), event));
await server.stop();

// A scene waits for the first page, however late that comes.
server = await serve(SCENE, ...MODEL, '--listen', '127.0.0.1:0');
await new Promise((resolve) => setTimeout(resolve, 6000));
const late = await open(browser, server.address, 360, 740, 'light');
await late.page.waitForFunction(() => document.querySelector('.phase').textContent.startsWith('gathering'), { timeout: LIMIT_MS });
await ended(late.page, 1);
const told = await late.page.locator('tbody td').last().textContent();
const sideways = await late.page.evaluate(() => document.documentElement.scrollWidth);
say('a scene waits for a page', [told.startsWith('by the ') ? '' : `more is ${told}`, sideways <= 360 ? '' : `${sideways} pixels wide`].filter(Boolean));
await server.stop();

server = await serve(`cam:left=${SCENE}`, `cam:right=${OTHER}`, ...MODEL, '--listen', '127.0.0.1:0');
const two = await Promise.all([open(browser, server.address, 1440, 900, 'dark'), open(browser, server.address, 360, 740, 'light')]);
for (const { page } of two) {
  await ended(page, 2);
  const [left, right] = [0, 1].map((number) => page.locator('.sensor').nth(number));
  const answers = [...(await differences(left, event)), ...(await differences(right, eventsOf(OTHER)[0]))];
  say(`two sensors, ${page.viewportSize().width} pixels`, [...answers, ...(await tooWide(page)), ...(await grown(page))]);
}
await server.stop();

// A part that is held slips, and a ball has a place and a width.
const home = mkdtempSync(path.join(tmpdir(), 'wstac-answers-'));
const scene = (name, touch) => {
  const file = path.join(home, `${name}.toml`);
  writeFileSync(file, `seed = 3\n[sensor]\nsize = [640, 480]\n[[touch]]\nkind = "slide"\n${touch}\n`);
  return `scene:${file}`;
};
const held = scene('held', 'specimen = "Sin2"\nhold = 2\nspeed = 60\ndirection = 270');
const ball = scene('ball', 'shape = "ball"\ndiameter = 14\nspeed = 120\ndirection = 20\noffset = 2');
server = await serve(`held=${held}`, `ball=${ball}`, '--listen', '127.0.0.1:0');
const small = await open(browser, server.address, 360, 740, 'light');
await ended(small.page, 2);
const [slip] = recordsOf(held).filter(({ kind }) => kind === 'slip');
const answer = recordsOf(ball).find(({ kind }) => kind === 'event');
const words = await small.page.locator('tr[data-kind=slip] .words').textContent();
const more = await small.page.locator('.sensor').nth(1).locator('tr[data-kind=event] td').last().textContent();
const lacks = [[words, `slip since frame ${slip.onset_frame}`], [more, `by the ${answer.basis}`], [more, `${answer.width_mm.value.toFixed(1)} ± `]];
lacks.push([more, `${Math.abs(answer.place_mm.value).toFixed(1)} ± `], [await small.page.evaluate(() => short(0.04)), '0.1']);
say('slip, basis, width and place', lacks.filter(([text, part]) => !text.includes(part)).map(([text, part]) => `"${text}" lacks ${part}`));
await server.stop();
rmSync(home, { recursive: true });

// Keys and buttons pause a scene and go back and forth in it, and what was shown is shown again.
server = await serve(SCENE, ...MODEL, '--listen', '127.0.0.1:0');
const film = await open(browser, server.address, 360, 740, 'light');
await ended(film.page, 1);
const frameIs = (frame) =>
  film.page.waitForFunction((frame) => document.querySelector('dd.frame').textContent === String(frame), frame, { timeout: LIMIT_MS });
const frames = Number(await film.page.locator('dd.frame').textContent());
const rows = () => film.page.locator('tr[data-kind=event]').count();
await film.page.keyboard.press(',');
await frameIs(frames - 1);
const problems = (await film.page.locator('.phase').textContent()) === 'paused' ? [] : ['a step does not pause'];
await film.page.getByRole('button', { name: '−1 s' }).click();
await frameIs(frames - 31);
if ((await rows()) !== 1) problems.push('the event is not there before the end');
await film.page.keyboard.press('.');
await frameIs(frames - 30);
await film.page.keyboard.press('0');
await frameIs(1);
if ((await rows()) !== 0) problems.push('the event is there at the start');
await film.page.getByRole('button', { name: 'Play' }).click();
await ended(film.page, 1);
say('a way back and forth', [...problems, ...(await differences(film.page.locator('.sensor'), event)), ...film.errors]);

// A button and a key let it start again at its end. The events of all rounds stay, also for a browser that comes later.
const loop = film.page.getByRole('button', { name: 'Loop' });
await loop.click();
await film.page.waitForFunction(() => document.querySelectorAll('tr[data-kind=event]').length === 2, undefined, { timeout: LIMIT_MS });
const pressed = [await loop.getAttribute('aria-pressed')];
await film.page.keyboard.press('l');
await ended(film.page, 1);
pressed.push(await loop.getAttribute('aria-pressed'));
const second = await open(browser, server.address, 1440, 900, 'light');
await ended(second.page, 1);
const kept = await Promise.all([film, second].map(({ page }) => page.locator('tbody tr:not([data-kind=note])').allTextContents()));
const rounds = kept[0].filter((text) => text.includes('end of the source')).length;
const expected = JSON.stringify([['true', 'false'], 2 * rounds, kept[0]]);
const found = JSON.stringify([pressed, kept[0].length, kept[1]]);
say(`a loop of ${rounds} rounds`, [...(found === expected && rounds > 1 ? [] : [`${found}, expected ${expected}`]), ...film.errors]);
await server.stop();

await tools(browser);

await browser.close();
console.log(`${failed()} failed; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(failed() ? 1 : 0);
