// Opens pages of this repository in a browser with WebGPU and takes pictures of them.
// Usage: node webgpu_pages.mjs BROWSER ROOT NODE_MODULES EXECUTABLE FOLDER PAGE...
// BROWSER: chromium (SwiftShader) or firefox (lavapipe). PAGE: a path that the server knows and a query;
// the n-th one's picture is FOLDER/n.png. Pages find FOLDER's files in /files. Prints JSON:
// window.done of each page.
import { createRequire } from 'node:module';
import path from 'node:path';

import { serve, TIMEOUT } from './static_server.mjs';

const [name, root, modules, executablePath, folder, ...pages] = process.argv.slice(2);
const require = createRequire(path.join(modules, 'x.js'));
const size = { width: 640, height: 480 };
const server = await serve(root, modules, folder);

const launch = {
  chromium: () =>
    require('playwright-core').chromium.launch({
      executablePath,
      timeout: TIMEOUT,
      args: [
        ...['--no-sandbox', '--enable-unsafe-webgpu', '--enable-features=Vulkan'],
        ...['--use-vulkan=swiftshader', '--use-angle=swiftshader'],
      ],
    }),
  firefox: () =>
    require('puppeteer-core').launch({
      browser: 'firefox',
      executablePath,
      timeout: TIMEOUT,
      protocolTimeout: TIMEOUT,
      extraPrefsFirefox: { 'dom.webgpu.enabled': true, 'gfx.webgpu.ignore-blocklist': true },
      env: { ...process.env, HOME: folder },
    }),
};
const browser = await launch[name]();
const results = [];
for (const [number, page] of pages.entries()) {
  const tab = await browser.newPage();
  tab.setDefaultTimeout(TIMEOUT);
  await (tab.setViewportSize ?? tab.setViewport).call(tab, size);
  await tab.goto(`${server.url}/${page}`);
  const done = await tab.waitForFunction(() => window.done);
  results.push(await done.jsonValue());
  await tab.screenshot({ path: path.join(folder, `${number}.png`) });
  await tab.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
