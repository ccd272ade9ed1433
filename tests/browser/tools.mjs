// Checks what the page can do besides showing a sensor: recordings with labels, calibration, the doctor's advice.

import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';

import { LIMIT_MS, MODEL, differences, eventsOf, folder, open, run, say, serve } from './common.mjs';
import { pictures } from './pictures.mjs';

// Slides of two specimens, over a small sensor. A busy machine has time for a new baseline between them.
const SLIDES = `lead_in = 210
gap = 240
seed = 3
[[slide]]
specimen = "Saw3"
speed = 150
direction = 90
[[slide]]
specimen = "Fla0"
speed = 120
[[slide]]
specimen = "Saw3"
speed = 100
direction = 90
[sensor]
size = [400, 400]
`;
// Ten seconds and more without a touch, of a sensor that light leaks into.
const LEAKY = 'specimen = "Fla0"\nspeed = 100\nlead_in = 420\n[light]\nleak = 0.3\n[sensor]\nsize = [400, 400]\n';

/** Returns the first part of the page that matches, of the first sensor. */
const part = (page, selector) => page.locator('.sensor').first().locator(selector).first();
/** Waits until a part of the page has a text like this, and returns the text. */
async function says(page, selector, pattern) {
  await part(page, selector).filter({ hasText: pattern }).waitFor({ timeout: LIMIT_MS });
  return part(page, selector).innerText();
}
/** Waits until the page shows this many events, and the sample of the last one is complete. */
const events = async (page, count) => {
  const isThere = (count) => document.querySelectorAll('tr[data-kind=event]').length >= count;
  await page.waitForFunction(isThere, count, { timeout: LIMIT_MS });
  await says(page, '.phase', /watching|ended/);
};
/** Returns what the console said, as problems. */
const quiet = ({ errors }) => errors.map((error) => `the console says ${error}`);

/** Returns what has no name for a screen reader, and what makes the page wider than its window. */
const unnamed = (page) =>
  page.evaluate(() => {
    const named = (element) => element.getAttribute('aria-label') || element.textContent.trim() || element.labels?.length;
    const all = [...document.querySelectorAll('button, input, progress, canvas, [role=region]')];
    const without = all.filter((element) => !element.hidden && !named(element));
    const problems = without.map((element) => `${element.outerHTML.slice(0, 60)} has no name`);
    const width = document.documentElement.scrollWidth;
    return width > innerWidth ? [...problems, `the page is ${width} pixels wide, expected ${innerWidth}`] : problems;
  });

/** Returns the whiskers whose light the picture does not show at their bases, or shows between them. */
const dimWhiskers = (page) =>
  page.evaluate(() => {
    const { glow, job } = sensors[0].tools;
    const scale = glow.width / sensors[0].about.size[0];
    const light = (x, y) => glow.bytes[Math.floor(y * scale) * glow.width + Math.floor(x * scale)];
    const { centers, corners, taxel } = job.proposal;
    const isRight = ([x, y], index) => light(x, y) > 150 && light(corners[index][0] + taxel[0] + 10, y) < 60;
    return centers.map((center, index) => (isRight(center, index) ? '' : `whisker ${index + 1} is not in its light`)).filter(Boolean);
  });

/** Records two slides with their labels, and a third one until the server ends. */
async function record(browser, scene) {
  const recordings = 'recordings';
  mkdirSync(recordings);
  const server = await serve(scene, ...MODEL, '--listen', '127.0.0.1:0', '--record-to', recordings);
  const seen = await open(browser, server.address, 360, 740, 'dark');
  const { page } = seen;
  const problems = [];
  await page.getByText('Record', { exact: true }).click();
  const field = (name) => page.getByLabel(name);
  // A key in a field is text.
  await field('Specimen').pressSequentially('r');
  const typed = await field('Specimen').inputValue();
  if ((await part(page, '.busy').isVisible()) || typed !== 'r') problems.push('a key in a field is taken');
  await field('Speed').fill('fast');
  await page.getByRole('button', { name: 'Start recording' }).click();
  const refused = await says(page, '.refused', /Refused/);
  if (!refused.includes('label speed is "fast", expected mm/s such as 150')) problems.push(`the page says ${refused}`);
  await field('Specimen').fill('Saw3');
  await field('Speed').fill('150');
  await field('Direction').fill('90');
  await field('Direction').blur();
  await page.keyboard.press('r');
  await says(page, '.busy', /recording/);
  await events(page, 1);
  problems.push(...(await unnamed(page)));
  await page.keyboard.press('r');
  await says(page, '.record .step', /^Recorded: .*wstac-1\.mcap: \d+ frames, 1 event/);
  const [event] = eventsOf(path.join(recordings, 'wstac-1.mcap'));
  const row = (await page.locator('tr[data-kind=event] td').first().innerText()).replace(/\D/g, '');
  // Frames of the recording count from its first one.
  if (!(event.frame < Number(row))) problems.push(`the event is at frame ${event.frame}, on the page at ${row}`);
  problems.push(...(await differences(part(page, '.table'), { ...event, frame: Number(row) })));

  // The next one goes on while the page is closed and opened again.
  await field('Specimen').fill('Fla0');
  await field('Speed').fill('120');
  await field('Direction').fill('0');
  await page.getByRole('button', { name: 'Start recording' }).click();
  await says(page, '.busy', /recording/);
  await page.reload();
  await says(page, '.record .step', /Recording to .*wstac-2\.mcap/);
  await says(page, '.record .count', /direction 0, specimen Fla0, speed 120/);
  await events(page, 2);
  await page.getByRole('button', { name: 'End recording' }).click();
  await says(page, '.record .step', /^Recorded: .*wstac-2\.mcap: \d+ frames, 1 event/);

  // Ctrl-C ends the file of a recording in progress.
  await page.keyboard.press('r');
  await says(page, '.record .step', /Recording to .*wstac-3\.mcap/);
  await events(page, 3);
  // Before the server ends: the page looks for it, and the console tells of every attempt.
  problems.push(...quiet(seen));
  const code = await server.stop();
  if (code !== 0) problems.push(`the server ends with ${code}`);
  const last = eventsOf(path.join(recordings, 'wstac-3.mcap'));
  if (last.length !== 1) problems.push(`the recording that Ctrl-C ended has ${last.length} events`);
  const files = readdirSync(recordings).sort().join(' ');
  if (files !== 'wstac-1.mcap wstac-2.mcap wstac-3.mcap') problems.push(`the folder has ${files}`);
  rmSync(path.join(recordings, 'wstac-3.mcap'));
  const model = 'own.wsm';
  run('train', recordings, '--test', '0', '-o', model);
  if (!existsSync(model)) problems.push('there is no model of the recordings');
  say('recordings have their labels and are those of wstac record', problems);
}

/** Records one of two sensors: the one that was clicked last. */
async function choose(browser, scene) {
  // The name of the folder turns the direction of writing. The page shows it with that character escaped.
  const recordings = 'cho\u202esen';
  mkdirSync(recordings);
  const sources = ['left', 'right'].map((name) => `cam:${name}=${scene}`);
  const server = await serve(...sources, '--listen', '127.0.0.1:0', '--record-to', recordings);
  const seen = await open(browser, server.address, 1440, 900, 'dark');
  const { page } = seen;
  const problems = [];
  const sections = page.locator('.sensor');
  await sections.nth(1).locator('h2').click();
  await page.keyboard.press('r');
  const busy = sections.nth(1).locator('.busy');
  await busy.filter({ hasText: 'recording' }).waitFor({ timeout: LIMIT_MS });
  // What a screen reader says is what the button does now.
  const spoken = (name) => sections.nth(1).getByRole('button', { name, exact: true }).waitFor({ timeout: LIMIT_MS });
  await spoken('End recording: right');
  if ((await sections.nth(1).getAttribute('aria-current')) !== 'true') problems.push('the chosen sensor is not marked');
  // A key for the other one leaves it alone, and its own baseline is refused meanwhile.
  await page.keyboard.press('1');
  await page.keyboard.press('2');
  await sections.nth(1).locator('.refused').filter({ hasText: 'a recording is in progress' }).waitFor({ timeout: LIMIT_MS });
  if (await sections.nth(0).locator('.refused').isVisible()) problems.push('a baseline of the other sensor is refused');
  await page.keyboard.press('r');
  await busy.waitFor({ state: 'hidden', timeout: LIMIT_MS });
  await spoken('Start recording: right');
  const where = await sections.nth(1).locator('.record .where').textContent();
  if (!where.includes('the folder cho\\u202esen on')) problems.push(`the page says ${where}`);
  const isTurned = await page.evaluate(() => /[\u0080-\u009f\u202a-\u202e\u2066-\u2069]/.test(document.documentElement.outerHTML));
  if (isTurned) problems.push('a character turns the direction of writing');
  const files = readdirSync(recordings).join(' ');
  if (files !== 'right-1.mcap') problems.push(`the folder has ${files}`);
  say('keys are for the chosen sensor', [...problems, ...quiet(seen)]);
  await server.stop();
}

/** A page whose server comes back with another token says why it does not connect, and does with the old one. */
async function token(browser, scene) {
  const tokens = ['first', 'second'].map((name) => `${name}-token-of-a-page`);
  tokens.forEach((token) => writeFileSync(token, token));
  const at = (token, port) => serve(scene, '--listen', `127.0.0.1:${port}`, '--token-file', token);
  let server = await at(tokens[0], 0);
  const { page } = await open(browser, server.address, 360, 740, 'light');
  const { port } = new URL(server.address);
  const says = (words) => page.locator('#connection').filter({ hasText: words }).waitFor({ timeout: LIMIT_MS });
  await says('connected');
  await server.stop();
  await says('no connection: trying again');
  server = await at(tokens[1], port);
  await says('the address has a new token; open the address that wstac serve has printed');
  await server.stop();
  server = await at(tokens[0], port);
  await says(/^connected$/);
  say('a page whose token is an old one says so', []);
  await page.close();
  await server.stop();
}

/** Calibrates with the keys, writes the file, and compares the next slide's answers. */
async function calibrate(browser, scene) {
  const file = 'my.toml';
  const server = await serve(scene, ...MODEL, '--listen', '127.0.0.1:0', '--calibrate-to', file);
  const seen = await open(browser, server.address, 1440, 900, 'light');
  const { page } = seen;
  const problems = [];
  await says(page, '.phase', /watching/);
  await page.keyboard.press('c');
  await says(page, '.calibrate .step', /Press on all whiskers/);
  await says(page, '.calibrate .count', /^25 spots/);
  await page.keyboard.press('c');
  const proposal = await says(page, '.calibrate .step', /25 whiskers found/);
  if (!proposal.includes('is every whisker in its square')) problems.push(`the page asks ${proposal}`);
  const which = await part(page, '.which').innerText();
  if (!which.includes('the light that the calibration has seen')) problems.push(`the picture is called ${which}`);
  problems.push(...(await dimWhiskers(page)));
  if (existsSync(file)) problems.push('the file was written before anybody said so');
  problems.push(...(await unnamed(page)));
  if (folder) await page.screenshot({ path: path.join(folder, 'serve-calibrate.png'), fullPage: true });
  await page.keyboard.press('u');
  const done = await says(page, '.calibrate .step', /The new layout is used/);
  if (!done.includes(file)) problems.push(`the page says ${done}`);
  if (await page.locator('.download').isVisible()) problems.push('a download is offered beside the file');
  // The next slide has the answers of the new layout.
  await events(page, (await page.locator('tr[data-kind=event]').count()) + 1);
  const cells = await page.locator('tr[data-kind=event]').first().locator('td').allInnerTexts();
  const numbers = [cells[0], ...cells[2].split('±')].map((text) => parseFloat(text.replace(/[^\d.]/g, '')));
  const [frame, found, sd] = numbers;
  const again = eventsOf(scene, '--config', file).find((event) => Math.abs(event.frame - frame) < 30);
  const isRight = again && Math.abs(found - again.speed.mm_s) <= 3 * sd;
  if (!isRight) problems.push(`the speed at frame ${frame} is ${found} ± ${sd}, expected ${again?.speed.mm_s}`);
  say('a confirmed calibration is used and written', [...problems, ...quiet(seen)]);
  await server.stop();
}

/** Calibrates with the mouse, cancels, is refused, and takes the file as a download. */
async function download(browser, scene) {
  const server = await serve(scene, '--listen', '127.0.0.1:0');
  const seen = await open(browser, server.address, 360, 740, 'light');
  const { page } = seen;
  const problems = [];
  const off = await part(page, '.record .where').textContent();
  if (!off.includes('--record-to FOLDER')) problems.push(`the page says ${off}`);
  if (await page.locator('form').isVisible()) problems.push('there is a form without a folder');
  await page.getByText('Calibrate', { exact: true }).first().click();
  await page.getByRole('button', { name: 'Calibrate' }).click();
  await says(page, '.busy', /calibrating/);
  await page.keyboard.press('Escape');
  await part(page, '.busy').waitFor({ state: 'hidden', timeout: LIMIT_MS });
  await page.getByRole('button', { name: 'Calibrate' }).click();
  await says(page, '.calibrate .step', /Press on all whiskers/);
  await says(page, '.calibrate .count', /^25 spots/);
  await page.getByRole('button', { name: 'Find the whiskers' }).click();
  await page.getByRole('button', { name: 'Use this layout' }).click();
  const link = page.getByRole('link', { name: 'Download wstac.toml' });
  await link.waitFor({ timeout: LIMIT_MS });
  const [saved] = await Promise.all([page.waitForEvent('download'), link.click()]);
  const text = readFileSync(await saved.path(), 'utf8');
  if (saved.suggestedFilename() !== 'wstac.toml') problems.push(`the download is ${saved.suggestedFilename()}`);
  if (!/\[layout\]\nframe = \[400, 400\]/.test(text)) problems.push(`the download is ${text.slice(0, 80)}`);
  problems.push(...(await unnamed(page)), ...quiet(seen));
  say('without a file a calibration is a download', problems);
  await server.stop();
}

/** Compares the advice with that of `wstac doctor`. */
async function doctor(browser, scene) {
  const expected = JSON.parse(run('doctor', scene, '--json')).verdict;
  const server = await serve(scene, '--listen', '127.0.0.1:0');
  const seen = await open(browser, server.address, 360, 740, 'dark');
  const { page } = seen;
  const problems = [];
  await says(page, '.phase', /watching/);
  await page.keyboard.press('d');
  await says(page, '.doctor .step', /Measuring/);
  await says(page, '.doctor .step', /to change/);
  const items = page.locator('.verdict li');
  const kinds = await items.evaluateAll((items) => items.map((item) => item.dataset.kind));
  const right = expected.map(({ kind }) => kind);
  if (String(kinds) !== String(right)) problems.push(`the verdict is ${kinds}, expected ${right}`);
  const advice = await items.locator('strong').allInnerTexts();
  if (String(advice) !== String(expected.map(({ advice }) => advice))) problems.push(`the advice is ${advice}`);
  await page.getByText('All numbers').click();
  const report = await part(page, '.report').innerText();
  if (!/^rate +\d+ frames in \d/m.test(report)) problems.push(`the numbers are ${report}`);
  problems.push(...(await unnamed(page)), ...quiet(seen));
  if (folder) await page.screenshot({ path: path.join(folder, 'serve-doctor.png'), fullPage: true });
  say(`the doctor's advice: ${kinds.join(', ')}`, problems);
  await server.stop();
}

/** Checks the tools of the page, in a folder of its own. */
export async function tools(browser) {
  const [before, home] = [process.cwd(), mkdtempSync(path.join(tmpdir(), 'wstac-browser-'))];
  process.chdir(home);
  try {
    const file = (name, text) => (writeFileSync(name, text), `scene:${name}`);
    const [slides, leaky] = [file('slides.toml', SLIDES), file('leaky.toml', LEAKY)];
    await record(browser, slides);
    await choose(browser, slides);
    await token(browser, slides);
    await calibrate(browser, slides);
    await download(browser, slides);
    await doctor(browser, leaky);
    if (folder) await pictures(browser);
  } finally {
    process.chdir(before);
    rmSync(home, { recursive: true, force: true });
  }
}
