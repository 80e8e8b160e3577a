// Opens pages of this repository in a browser with WebGPU and takes pictures of them.
// Usage: node webgpu_pages.mjs BROWSER ROOT NODE_MODULES EXECUTABLE FOLDER PAGE...
// BROWSER: chromium (SwiftShader) or firefox (lavapipe). PAGE: path in the repository and query;
// the n-th one's picture is FOLDER/n.png. Pages find FOLDER's files in /files. Prints JSON:
// window.done of each page.
import { createReadStream, existsSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';

const [name, root, modules, executablePath, folder, ...pages] = process.argv.slice(2);
const require = createRequire(path.join(modules, 'x.js'));
const roots = { node_modules: modules, files: folder, web: `${root}/web`, tests: `${root}/tests` };
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const size = { width: 640, height: 480 };
const timeout = 600_000; // software rendering compiles the decoder's shaders for minutes

const server = createServer((request, response) => {
  const [first, ...rest] = new URL(request.url, 'http://host').pathname.slice(1).split('/');
  const file = path.join(roots[first] ?? '/missing', ...rest);
  if (!existsSync(file)) return response.writeHead(404).end();
  response.setHeader('content-type', types[path.extname(file)] ?? 'application/octet-stream');
  createReadStream(file).pipe(response);
});
await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));

const launch = {
  chromium: () =>
    require('playwright-core').chromium.launch({
      executablePath,
      args: [
        ...['--no-sandbox', '--enable-unsafe-webgpu', '--enable-features=Vulkan'],
        ...['--use-vulkan=swiftshader', '--use-angle=swiftshader'],
      ],
    }),
  firefox: () =>
    require('puppeteer-core').launch({
      browser: 'firefox',
      executablePath,
      protocolTimeout: timeout,
      extraPrefsFirefox: { 'dom.webgpu.enabled': true, 'gfx.webgpu.ignore-blocklist': true },
      env: { ...process.env, HOME: folder },
    }),
};
const browser = await launch[name]();
const results = [];
for (const [number, page] of pages.entries()) {
  const tab = await browser.newPage();
  await (tab.setViewportSize ?? tab.setViewport).call(tab, size);
  await tab.goto(`http://127.0.0.1:${server.address().port}/${page}`);
  const wait = [() => window.done, ...(name === 'chromium' ? [null] : []), { timeout }];
  results.push(await (await tab.waitForFunction(...wait)).jsonValue());
  await tab.screenshot({ path: path.join(folder, `${number}.png`) });
  await tab.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
