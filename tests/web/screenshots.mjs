// Opens a page for each file, in Chromium or Firefox, and takes a picture of it.
// Usage: node screenshots.mjs ROOT NODE_MODULES BROWSER EXECUTABLE FOLDER PAGE FILE...
// BROWSER: chrome or firefox. PAGE: a path that the server knows. Files and pictures
// (FILE.png) lie in FOLDER. Prints JSON: what each page made of its file (window.done).
import { createRequire } from 'node:module';
import path from 'node:path';

import { serve, TIMEOUT } from './static_server.mjs';

const [root, modules, name, executablePath, folder, page, ...files] = process.argv.slice(2);
const puppeteer = createRequire(path.join(modules, 'x.js'))('puppeteer-core');
const server = await serve(root, modules, folder);

// Software rendering, of WebGPU too: the same pixels for the same geometry.
const chrome = [
  ...['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  ...['--enable-unsafe-webgpu', '--enable-features=Vulkan', '--use-vulkan=swiftshader'],
];
const firefox = {
  'webgl.force-enabled': true,
  'dom.webgpu.enabled': true,
  'gfx.webgpu.ignore-blocklist': true,
};
const browser = await puppeteer.launch({
  browser: name,
  executablePath,
  timeout: TIMEOUT,
  protocolTimeout: TIMEOUT,
  headless: name === 'chrome', // Firefox has WebGL on a display only
  args: name === 'chrome' ? chrome : [],
  extraPrefsFirefox: firefox,
  env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1' },
});
// Ends Chromium's GPU process, as a driver that fails does.
async function loseGpu() {
  const session = await browser.target().createCDPSession();
  await session.send('Browser.crashGpuProcess');
}

const results = [];
for (const file of files) {
  const tab = await browser.newPage();
  tab.setDefaultTimeout(TIMEOUT);
  await tab.setViewport({ width: 640, height: 480 });
  await tab.exposeFunction('loseGpu', loseGpu);
  await tab.goto(`${server.url}/${page}?file=/files/${file}`);
  const done = await tab.waitForFunction('window.done');
  results.push(await done.jsonValue());
  await tab.screenshot({ path: path.join(folder, `${file}.png`) });
  await tab.close();
}
await browser.close();
server.close();
process.stdout.write(JSON.stringify(results));
