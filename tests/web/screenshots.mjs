// Opens a page for each file, in Chromium or Firefox, and takes a picture of it.
// Usage: node screenshots.mjs ROOT NODE_MODULES BROWSER EXECUTABLE FOLDER PAGE FILE...
// BROWSER: chrome or firefox. PAGE: of tests/web, or a path in FOLDER. Files and pictures
// (FILE.png) lie in FOLDER. Prints JSON: what each page made of its file (window.done).
import { createReadStream, existsSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';

const [root, modules, name, executablePath, folder, page, ...files] = process.argv.slice(2);
const puppeteer = createRequire(path.join(modules, 'x.js'))('puppeteer-core');
const roots = {
  node_modules: modules,
  files: folder,
  web: path.join(root, 'web'),
  tests: path.join(root, 'tests', 'web'),
};
const types = {
  '.html': 'text/html',
  '.css': 'text/css',
  '.js': 'text/javascript',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};

const server = createServer((request, response) => {
  const [first, ...rest] = new URL(request.url, 'http://host').pathname.slice(1).split('/');
  const file = path.join(roots[first] ?? '/missing', ...rest);
  if (!existsSync(file)) return response.writeHead(404).end();
  response.setHeader('content-type', types[path.extname(file)] ?? 'application/octet-stream');
  createReadStream(file).pipe(response);
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

// Software rendering: the same pixels for the same geometry.
const chrome = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const browser = await puppeteer.launch({
  browser: name,
  executablePath,
  headless: name === 'chrome', // Firefox has WebGL on a display only
  args: name === 'chrome' ? chrome : [],
  extraPrefsFirefox: { 'webgl.force-enabled': true },
  env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' },
});
const results = [];
for (const file of files) {
  const tab = await browser.newPage();
  await tab.setViewport({ width: 640, height: 480 });
  await tab.goto(`http://127.0.0.1:${server.address().port}/${page}?file=/files/${file}`);
  const done = await tab.waitForFunction('window.done', { timeout: 180_000 });
  results.push(await done.jsonValue());
  await tab.screenshot({ path: path.join(folder, `${file}.png`) });
  await tab.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
