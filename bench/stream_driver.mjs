// Runs bench/stream_page.html for each of a list of settings, on a server of files that answers
// ranges at a limited rate. Usage: node stream_driver.mjs ROOT NODE_MODULES BROWSER PROGRAM FOLDER
// RATE LIST. BROWSER: Chromium or Firefox. RATE: bytes per second of files of FOLDER, all
// connections together. LIST: a file with the settings. Prints JSON: what the pages report, with
// the browser and the bytes that the server has sent.
import { createReadStream, existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';

const [root, modules, name, executablePath, folder, rate, list] = process.argv.slice(2);
const puppeteer = createRequire(path.join(modules, 'x.js'))('puppeteer-core');
const TIMEOUT = 900_000; // milliseconds
const STEP = 16_384; // bytes that are sent at a time
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const roots = {
  node_modules: modules,
  files: folder,
  web: path.join(root, 'web'),
  bench: path.join(root, 'bench'),
};
let sent = 0;
let free = 0; // when the line is free again

const server = createServer(async (request, response) => {
  const [first, ...rest] = new URL(request.url, 'http://host').pathname.slice(1).split('/');
  const file = path.join(roots[first] ?? '/missing', ...rest);
  if (!existsSync(file)) return response.writeHead(404).end();
  const { size } = statSync(file);
  const [, from, to] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '') ?? [];
  const range = { start: Number(from ?? 0), end: Math.min(Number(to ?? size), size - 1) };
  const headers = {
    'content-type': TYPES[path.extname(file)] ?? 'application/octet-stream',
    etag: '"1"',
  };
  if (from) headers['content-range'] = `bytes ${range.start}-${range.end}/${size}`;
  response.writeHead(from ? 206 : 200, {
    ...headers,
    'content-length': range.end + 1 - range.start,
  });
  for await (const piece of createReadStream(file, { ...range, highWaterMark: STEP })) {
    if (response.destroyed) return;
    if (first === 'files') {
      sent += piece.length;
      free = Math.max(free, performance.now()) + (1000 * piece.length) / Number(rate);
      await new Promise((resolve) => setTimeout(resolve, free - performance.now()));
    }
    response.write(piece);
  }
  response.end();
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

const isFirefox = name === 'Firefox';
const chromium = [
  '--no-sandbox',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--enable-precise-memory-info',
];
const browser = await puppeteer.launch({
  browser: isFirefox ? 'firefox' : 'chrome',
  executablePath,
  args: isFirefox ? [] : chromium,
  headless: !isFirefox, // Firefox has WebGL on a display only
  // Times of updates are below its clock's millisecond.
  extraPrefsFirefox: { 'webgl.force-enabled': true, 'privacy.reduceTimerPrecision': false },
  env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' },
  timeout: TIMEOUT,
  protocolTimeout: TIMEOUT,
});
const results = [];
for (const settings of JSON.parse(readFileSync(list, 'utf8'))) {
  sent = 0;
  const page = await browser.newPage();
  page.setDefaultTimeout(TIMEOUT);
  const given = encodeURIComponent(
    JSON.stringify({ ...settings, file: `/files/${settings.file}` }),
  );
  await page.goto(
    `http://127.0.0.1:${server.address().port}/bench/stream_page.html?settings=${given}`,
  );
  const done = await (await page.waitForFunction('window.done')).jsonValue();
  if (done.error?.includes?.('\n')) throw new Error(`${settings.file}: ${done.error}`);
  results.push({ browser: name, ...settings, ...done, sent });
  process.stderr.write(`${name} ${settings.task} ${settings.file} ${settings.maxBytes ?? ''}\n`);
  await page.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
