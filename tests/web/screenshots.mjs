// Opens tests/web/three.html in Chromium for each file and takes a picture of it.
// Usage: node screenshots.mjs ROOT NODE_MODULES CHROMIUM FOLDER FILE...; files and pictures
// (FILE.png) lie in FOLDER. Prints JSON: what each page made of its file.
import { createReadStream, existsSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';

const [root, modules, executablePath, folder, ...files] = process.argv.slice(2);
const { chromium } = createRequire(path.join(modules, 'x.js'))('playwright-core');
const roots = { node_modules: modules, files: folder, web: path.join(root, 'web') };
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const page = path.join(root, 'tests', 'web', 'three.html');

const server = createServer((request, response) => {
  const [first, ...rest] = new URL(request.url, 'http://host').pathname.slice(1).split('/');
  const file = first === '' ? page : path.join(roots[first] ?? '/missing', ...rest);
  if (!existsSync(file)) return response.writeHead(404).end();
  response.setHeader('content-type', types[path.extname(file)] ?? 'application/octet-stream');
  createReadStream(file).pipe(response);
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

// Software rendering: the same pixels for the same geometry.
const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const browser = await chromium.launch({ executablePath, args });
const results = [];
for (const file of files) {
  const tab = await browser.newPage({ viewport: { width: 640, height: 480 } });
  await tab.goto(`http://127.0.0.1:${server.address().port}/?file=/files/${file}`);
  const done = await tab.waitForFunction(() => window.done, null, { timeout: 120_000 });
  results.push(await done.jsonValue());
  await tab.screenshot({ path: path.join(folder, `${file}.png`) });
  await tab.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
