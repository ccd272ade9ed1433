// Checks the page of `wstac serve` in Chromium: what it shows is what `wstac run --json` says, it fits a phone, and it
// connects again when the server comes back. Foreign requests are refused.
//
//     node check.mjs WSTAC [FOLDER]
//
// Pictures of the page go to FOLDER, if it is given. `ci/browser` installs what this needs.

import { execFileSync, spawn } from 'node:child_process';
import http from 'node:http';
import path from 'node:path';
import { createInterface } from 'node:readline';
import { chromium } from 'playwright-core';

const [, , wstac, folder, ...more] = process.argv;
if (!wstac || more.length > 0) {
  console.error('usage: node check.mjs WSTAC [FOLDER]');
  process.exit(2);
}
const SCENE = 'scene:Saw3@150,90deg,seed=7', OTHER = 'scene:Fla0@100,0deg,seed=1';
const MODEL = ['--model', 'builtin:svm'];
// The whole page, in bytes.
const MOST_BYTES = 200_000;
const LIMIT_MS = 60_000;
let failures = 0;

/** Prints a line per case. */
function say(name, problems) {
  failures += problems.length > 0 ? 1 : 0;
  console.log(`${problems.length > 0 ? 'FAILED' : 'passed'}  ${name}`);
  for (const problem of problems) console.log(`        ${problem}`);
}

/** Returns the event of a source, as `wstac run` prints it. */
function eventOf(source) {
  const lines = execFileSync(wstac, ['run', source, '--json', ...MODEL], { encoding: 'utf8' }).trim().split('\n');
  return lines.map((line) => JSON.parse(line)).find(({ kind }) => kind === 'event');
}

/** Starts a server. Returns it with its address. */
async function serve(...options) {
  const server = spawn(wstac, ['serve', ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
  const ended = new Promise((resolve) => server.once('exit', resolve));
  for await (const line of createInterface({ input: server.stderr })) {
    server.stderr.resume();
    return { address: line, stop: () => (server.kill('SIGINT'), ended) };
  }
  throw new Error('the server says no address');
}

/** Returns the status of a request for the page with these headers. */
function statusOf(address, headers) {
  return new Promise((resolve, reject) => {
    http.get(address, { headers }, (answer) => (answer.resume(), resolve(answer.statusCode))).on('error', reject);
  });
}

/** Opens the page. Returns it with what its console said and the bytes that it loaded. */
async function open(browser, address, width, height, colorScheme) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme });
  const seen = { page, errors: [], bytes: 0 };
  page.on('console', (message) => seen.errors.push(message.text()));
  page.on('pageerror', (error) => seen.errors.push(String(error)));
  page.on('response', async (answer) => (seen.bytes += (await answer.body().catch(() => '')).length));
  await page.goto(address);
  return seen;
}

/** Waits until all sources have ended. */
const ended = (page, count) =>
  page.waitForFunction(
    (count) => [...document.querySelectorAll('.phase')].filter((phase) => phase.textContent === 'the source has ended').length === count,
    count,
    { timeout: LIMIT_MS },
  );

/** Returns how the event that a section of the page shows differs from another one. */
async function differences(section, event) {
  const cells = await section.locator('tbody tr').last().locator('td').allTextContents();
  const [frame, contact, speed, direction, texture, certainty] = cells;
  const problems = [];
  const near = (name, text, value, half) => {
    const shown = parseFloat(text);
    if (!(Math.abs(shown - value) <= half + 1e-9)) problems.push(`${name} is ${text}, expected ${value}`);
  };
  near('frame', frame, event.frame, 0);
  near('speed', speed, event.speed.mm_s, 0.5);
  near('its deviation', speed.split('±')[1], event.speed.sd, 0.05);
  near('direction', direction, event.direction.deg, 0.05);
  if (contact !== event.contact) problems.push(`contact is ${contact}, expected ${event.contact}`);
  const name = event.texture.specimen;
  if (!texture.startsWith(name)) problems.push(`texture is ${texture}, expected ${name}`);
  if (certainty.startsWith('reliable') !== event.reliable) problems.push(`certainty is ${certainty}`);
  return problems;
}

const begun = Date.now();
const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
const event = eventOf(SCENE);

let server = await serve(SCENE, ...MODEL, '--listen', '127.0.0.1:0');
const { address } = server;
const wide = await open(browser, address, 1440, 900, 'light');
const phone = await open(browser, address, 360, 740, 'dark');
await ended(wide.page, 1);
await ended(phone.page, 1);
say('an event is what wstac run says', await differences(wide.page.locator('.sensor'), event));
for (const [name, { page, errors, bytes }] of Object.entries({ wide, phone })) {
  const problems = errors.map((error) => `the console says ${error}`);
  const [found, width] = await page.evaluate(() => [document.documentElement.scrollWidth, window.innerWidth]);
  if (found > width) problems.push(`the page is ${found} pixels wide, expected ${width}`);
  if (bytes === 0 || bytes > MOST_BYTES) problems.push(`the page has ${bytes} bytes, expected at most ${MOST_BYTES}`);
  say(`${name}: ${bytes} bytes`, problems);
  if (folder) await page.screenshot({ path: path.join(folder, `serve-${name}.png`), fullPage: true });
}

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

server = await serve(`cam:left=${SCENE}`, `cam:right=${OTHER}`, ...MODEL, '--listen', '127.0.0.1:0');
const two = await open(browser, server.address, 1440, 900, 'light');
await ended(two.page, 2);
const [left, right] = [0, 1].map((number) => two.page.locator('.sensor').nth(number));
say('two sensors', [...(await differences(left, event)), ...(await differences(right, eventOf(OTHER)))]);
await server.stop();

await browser.close();
console.log(`${failures} failed; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(failures ? 1 : 0);
