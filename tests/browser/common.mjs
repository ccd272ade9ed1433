// What the checks of the page have in common: servers, pages of a browser, comparisons.

import { execFileSync, spawn } from 'node:child_process';
import http from 'node:http';
import path from 'node:path';
import { createInterface } from 'node:readline';

const [, , command, keep, ...rest] = process.argv;
export const more = rest;
// The checks go to a folder of their own.
export const [wstac, folder] = [command, keep].map((name) => name && path.resolve(name));
export const MODEL = ['--model', 'builtin'];
export const LIMIT_MS = 60_000;
let failures = 0;

/** Returns how many cases have failed. */
export const failed = () => failures;

/** Prints a line per case. */
export function say(name, problems) {
  failures += problems.length > 0 ? 1 : 0;
  console.log(`${problems.length > 0 ? 'FAILED' : 'passed'}  ${name}`);
  for (const problem of problems) console.log(`        ${problem}`);
}

/** Runs wstac, and returns what it prints. */
export const run = (...options) => execFileSync(wstac, options, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });

/** Returns the records of a source, as `wstac run` prints them. */
export const recordsOf = (source, ...options) =>
  run('run', source, '--json', ...options).trim().split('\n').map((line) => JSON.parse(line));

/** Returns the events of a source, with their textures. */
export const eventsOf = (source, ...options) => recordsOf(source, ...MODEL, ...options).filter(({ kind }) => kind === 'event');

/** Starts a server. Returns it with its address. */
export async function serve(...options) {
  const server = spawn(wstac, ['serve', ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
  const ended = new Promise((resolve) => server.once('exit', resolve));
  for await (const line of createInterface({ input: server.stderr })) {
    server.stderr.resume();
    // Its end is the code that it exits with.
    return { address: line, stop: () => (server.kill('SIGINT'), ended) };
  }
  throw new Error('the server says no address');
}

/** Returns the status of a request for the page with these headers. */
export function statusOf(address, headers) {
  return new Promise((resolve, reject) => {
    http.get(address, { headers }, (answer) => (answer.resume(), resolve(answer.statusCode))).on('error', reject);
  });
}

/** Opens the page. Returns it with what its console said. */
export async function open(browser, address, width, height, colorScheme) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme });
  const seen = { page, errors: [] };
  page.on('console', (message) => seen.errors.push(message.text()));
  page.on('pageerror', (error) => seen.errors.push(String(error)));
  await page.goto(address);
  return seen;
}

/** Returns the bytes of all that the page has loaded. */
export const bytesOf = (page) =>
  page.evaluate(() => performance.getEntries().reduce((bytes, { decodedBodySize }) => bytes + (decodedBodySize ?? 0), 0));

/** Waits until all sources have ended. */
export const ended = (page, count) =>
  page.waitForFunction(
    (count) => [...document.querySelectorAll('.phase')].filter((phase) => phase.textContent === 'the source has ended').length === count,
    count,
    { timeout: LIMIT_MS },
  );

/** Returns how the event that a section of the page shows differs from another one. */
export async function differences(section, event) {
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
  const isSure = /^texture confidence 0\.\d\d, reliable$/.test(certainty);
  if (isSure !== event.reliable) problems.push(`certainty is ${certainty}`);
  return problems;
}
