// Checks finished pages in Chromium, as wide as a phone and as a desktop: nothing is wider than the window or cut off, no
// picture is missing, and the console has no error.
//
//     node pages.mjs FOLDER [PICTURES]
//
// All pages of FOLDER are checked. Of the reference of Rust, which has thousands, each crate's first page and its longest
// page of each kind are. Pictures of what a reader sees first go to PICTURES, if it is given.

import { createReadStream, mkdirSync, readFileSync, readdirSync, statSync } from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { chromium } from 'playwright-core';

const [, , folder, pictures, ...rest] = process.argv;
if (!folder || rest.length > 0) {
  console.error('usage: node pages.mjs FOLDER [PICTURES]');
  process.exit(2);
}
// A phone lays a page out as wide as itself only if the page asks for that.
const WINDOWS = {
  phone: { viewport: { width: 360, height: 740 }, isMobile: true },
  wide: { viewport: { width: 1440, height: 900 } },
};
const TYPES = { '.css': 'text/css', '.html': 'text/html', '.js': 'text/javascript', '.svg': 'image/svg+xml' };
// These are for other programs, not for readers.
const UNREAD = ['404.html', 'toc.html'];
// The reference of a crate of Rust in a book.
const RUST = /^api\/rust\/[^/]+\//;

/** Returns the pages of a folder that are checked. */
function pagesOf(folder) {
  // A page that only sends its reader to another one is none.
  const isPage = (file) => file.endsWith('.html') && !/http-equiv="refresh"/.test(readFileSync(path.join(folder, file), 'utf8').slice(0, 400));
  const all = readdirSync(folder, { recursive: true }).filter(isPage);
  const plain = all.filter((file) => !RUST.test(file) && !UNREAD.includes(path.basename(file)));
  const longest = new Map();
  for (const file of all) {
    const [crate, kind] = [file.split('/')[2], path.basename(file).split('.')[0]];
    if (!RUST.test(file) || crate === 'src') continue;
    const isFirst = file === `api/rust/${crate}/index.html`;
    const key = `${crate} ${isFirst ? 'first' : kind}`;
    const size = statSync(path.join(folder, file)).size;
    if (!longest.has(key) || longest.get(key).size < size) longest.set(key, { file, size });
  }
  return [...plain, ...[...longest.values()].map(({ file }) => file)].sort();
}

/** Serves a folder on this machine alone. Returns the server when it listens. */
function serve(folder) {
  const server = http.createServer((request, response) => {
    // Browsers ask every site for its sign, which these pages need not have.
    if (request.url === '/favicon.ico') return response.writeHead(204).end();
    const name = path.join(folder, decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    const file = createReadStream(name);
    file.once('open', () => response.writeHead(200, { 'Content-Type': TYPES[path.extname(name)] ?? 'application/octet-stream' }));
    file.once('error', () => response.writeHead(404).end());
    return file.pipe(response);
  });
  return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

/** Returns what is wrong with how the page is laid out. It runs in the page. */
async function layoutProblems(expected) {
  await document.fonts.ready;
  // A picture that is missing is found below.
  await Promise.all([...document.images].map((picture) => picture.decode().catch(() => {})));
  const problems = [];
  const width = document.documentElement.scrollWidth;
  if (width > expected) problems.push(`the page is ${width} pixels wide, expected ${expected}`);
  for (const picture of document.images) {
    if (!picture.complete || picture.naturalWidth === 0) problems.push(`there is no picture ${picture.getAttribute('src')}`);
  }
  // Also what a body without scrolling cuts off.
  const scrolls = (element) => element && element !== document.body && (/auto|scroll/.test(getComputedStyle(element).overflowX) || scrolls(element.parentElement));
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const range = document.createRange();
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement;
    if (!texts.currentNode.data.trim() || !element.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    range.selectNodeContents(texts.currentNode);
    const { right, left } = range.getBoundingClientRect();
    // Menus wait on the left of the window.
    if (right > expected + 1 && left < right && !scrolls(element)) {
      problems.push(`"${texts.currentNode.data.trim().slice(0, 50)}" ends at ${right.toFixed(0)}, expected at most ${expected}`);
    }
  }
  return problems;
}

/** Returns what is wrong with a page in a window. */
async function problemsOf(page, width, address, picture) {
  const problems = [];
  const said = (message) => message.type() === 'error' && problems.push(`the console says ${message.text()}`);
  const thrown = (error) => problems.push(`a script fails: ${error}`);
  const missing = (address) => problems.push(`there is no ${address}`);
  // What the page before had asked for ends with that page.
  const failed = (request) => request.failure().errorText !== 'net::ERR_ABORTED' && missing(request.url());
  const answered = (response) => response.status() >= 400 && missing(response.url());
  page.on('console', said).on('pageerror', thrown).on('requestfailed', failed).on('response', answered);
  await page.goto(address);
  problems.push(...(await page.evaluate(layoutProblems, width)));
  if (picture) await page.screenshot({ path: picture });
  page.off('console', said).off('pageerror', thrown).off('requestfailed', failed).off('response', answered);
  return problems;
}

const begun = Date.now();
const pages = pagesOf(folder);
const server = await serve(path.resolve(folder));
const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
if (pictures) mkdirSync(pictures, { recursive: true });
let wrong = 0;
for (const [window, options] of Object.entries(WINDOWS)) {
  const page = await browser.newPage(options);
  for (const file of pages) {
    const picture = pictures && path.join(pictures, `${file.replace(/\.html$/, '').replaceAll('/', '-')}-${window}.png`);
    const address = `http://127.0.0.1:${server.address().port}/${file}`;
    const problems = await problemsOf(page, options.viewport.width, address, picture);
    wrong += problems.length > 0 ? 1 : 0;
    if (problems.length > 0) console.log(`FAILED  ${file}, ${window}`);
    for (const problem of problems.slice(0, 5)) console.log(`        ${problem}`);
  }
  await page.close();
}
await browser.close();
server.close();
console.log(`pages: ${pages.length} at ${Object.keys(WINDOWS).length} widths, ${wrong} wrong; ${((Date.now() - begun) / 1000).toFixed(0)} s`);
process.exit(wrong > 0 || pages.length === 0 ? 1 : 0);
