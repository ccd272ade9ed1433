// Makes the pictures of the page in docs/SERVE.md: the page shows an event, and something slides.

import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';

import { LIMIT_MS, MODEL, folder, open, serve } from './common.mjs';

// The second slide takes two seconds, so that a busy machine has time for a picture.
const SLIDES = `gap = 100
seed = 7
[[slide]]
specimen = "Saw3"
speed = 150
direction = 90
[[slide]]
specimen = "Sin3"
speed = 60
direction = 20
`;

/** Makes a picture of the whole page when it shows an event, and something slides. */
async function picture(page, name) {
  const isSo = () => document.querySelector('.motion.slides') && document.querySelector('tr[data-kind=event]');
  await page.waitForFunction(isSo, undefined, { timeout: LIMIT_MS });
  await page.screenshot({ path: path.join(folder, `serve-${name}.png`), fullPage: true });
}

/** Starts a recording with labels. */
async function record(page) {
  await page.getByText('Record', { exact: true }).click();
  for (const [name, label] of [['Specimen', 'Saw3'], ['Speed', '150'], ['Direction', '90']]) await page.getByLabel(name).fill(label);
  await page.getByRole('button', { name: 'Start recording' }).click();
  await page.locator('.busy').filter({ hasText: 'recording' }).waitFor({ timeout: LIMIT_MS });
}

/** Makes pictures in a wide window, on a phone, and of a recording on a phone. */
export async function pictures(browser) {
  const scenes = { short: `lead_in = 45\n${SLIDES}`, long: `lead_in = 300\n${SLIDES}` };
  for (const [name, text] of Object.entries(scenes)) writeFileSync(`${name}.toml`, text);
  mkdirSync('pictures');
  const looks = [
    ['wide', 'short', 1440, 900, 'light'],
    ['phone', 'short', 360, 740, 'dark'],
    // Its first slide comes late, so that the recording has begun.
    ['record', 'long', 360, 740, 'dark'],
  ];
  // Each has a server of its own: a slide is too short for two pictures.
  for (const [name, scene, ...look] of looks) {
    const server = await serve(`scene:${scene}.toml`, ...MODEL, '--listen', '127.0.0.1:0', '--record-to', 'pictures');
    const { page } = await open(browser, server.address, ...look);
    if (name === 'record') await record(page);
    await picture(page, name);
    await page.close();
    await server.stop();
  }
}
