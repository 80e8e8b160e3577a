// Opens pages in Chromium, acts on them and tells what they show.
// Usage: node view.mjs NODE_MODULES CHROMIUM
// Reads lines of JSON, [{"address", "width", "height", "scheme", "steps": [[action, ...arguments],
// ...]}], and answers each with a line: per page {"results": one for each step, "requests":
// addresses, "problems": what the console says of errors}, or {"error": text}. One browser for all
// lines: the driver compiles its shaders for the first page.
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { createInterface } from 'node:readline';

const [modules, executablePath] = process.argv.slice(2);
const { chromium } = createRequire(path.join(modules, 'x.js'))('playwright-core');
const TIMEOUT = 400_000; // milliseconds: software rendering on a busy machine

const actions = {
  // Waits for "ready" or "error".
  wait: async (page, ...states) => {
    await page.waitForFunction((s) => s.includes(document.body.dataset.state), states, {
      timeout: TIMEOUT,
    });
    return page.evaluate(() => document.body.dataset.state);
  },
  // Waits for a condition; the page's policy forbids what waitForFunction does with text.
  until: async (page, code) => {
    while (!(await page.evaluate(code))) await page.waitForTimeout(100);
  },
  key: (page, name) => page.keyboard.press(name),
  click: (page, selector) => page.click(selector),
  // Text as the user sees it.
  text: (page, selector) => page.innerText(selector),
  attribute: (page, selector, name) => page.getAttribute(selector, name),
  visible: (page, selector) => page.isVisible(selector),
  reload: async (page) => void (await page.reload()),
  evaluate: (page, code) => page.evaluate(code),
  screenshot: async (page, name) => void (await page.screenshot({ path: name })),
  drag: async (page, x, y) => {
    await page.mouse.move(560, 240);
    await page.mouse.down();
    await page.mouse.move(560 + x, 240 + y, { steps: 4 });
    await page.mouse.up();
  },
  // One finger.
  touch: async (page, x, y) => {
    const session = await page.context().newCDPSession(page);
    const send = (type, ...points) =>
      session.send('Input.dispatchTouchEvent', { type, touchPoints: points });
    await send('touchStart', { x: 560, y: 240 });
    for (let step = 1; step <= 4; step++)
      await send('touchMove', { x: 560 + (x * step) / 4, y: 240 + (y * step) / 4 });
    await send('touchEnd');
  },
  // Files are dropped as from the desktop: [[name, path], ...].
  drop: async (page, files) => {
    const contents = await Promise.all(
      files.map(async ([name, from]) => [name, (await readFile(from)).toString('base64')]),
    );
    const transfer = await page.evaluateHandle(async (list) => {
      const made = new DataTransfer();
      for (const [name, content] of list) {
        const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
        made.items.add(new File([bytes], name));
      }
      return made;
    }, contents);
    // The page reads the files before it says that it loads them.
    await page.evaluate(() => {
      document.body.dataset.state = 'dropped';
    });
    await page.dispatchEvent('body', 'dragover', { dataTransfer: transfer });
    await page.dispatchEvent('body', 'drop', { dataTransfer: transfer });
  },
  // Saves what a key downloads; returns the name that the page suggests.
  download: async (page, key, to) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.keyboard.press(key)]);
    await download.saveAs(to);
    return download.suggestedFilename();
  },
};

const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const browser = await chromium.launch({ executablePath, args });

async function show({ address, width = 760, height = 480, scheme = 'dark', steps }) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: scheme,
    reducedMotion: 'reduce', // animations stand still: the same picture each time
  });
  const page = await context.newPage();
  page.setDefaultTimeout(TIMEOUT);
  const requests = [];
  const problems = [];
  page.on('request', (request) => requests.push(request.url()));
  page.on('console', (message) => message.type() === 'error' && problems.push(message.text()));
  page.on('pageerror', (error) => problems.push(String(error)));
  try {
    await page.goto(address);
    const results = [];
    for (const [action, ...rest] of steps) results.push(await actions[action](page, ...rest));
    return { results, requests, problems };
  } finally {
    await context.close();
  }
}

async function showAll(pages) {
  const shown = [];
  for (const page of pages) shown.push(await show(page));
  return shown;
}

for await (const line of createInterface({ input: process.stdin })) {
  const answer = await showAll(JSON.parse(line)).catch(({ stack }) => ({ error: stack }));
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
await browser.close();
