// Bundles the page into a folder: node build.mjs NODE_MODULES FOLDER
// NODE_MODULES holds esbuild and three in the versions that the Makefile names; web/decoder.wasm
// and web/unpacker.wasm have been compiled. The same sources and versions give the same bytes.
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const [modules, folder] = process.argv.slice(2).map((name) => path.resolve(name));
const { build } = createRequire(path.join(modules, 'x.js'))('esbuild');
const sources = path.dirname(fileURLToPath(import.meta.url));
const copied = ['index.html', 'icon.svg', 'NOTICES.txt', '../decoder.wasm', '../unpacker.wasm'];

function bundle(options) {
  return build({
    absWorkingDir: sources, // comments in the result name files relative to it
    outdir: folder,
    bundle: true,
    minify: true,
    format: 'esm',
    target: ['chrome111', 'firefox113', 'safari16.4'],
    nodePaths: [modules],
    legalComments: 'inline',
    logLevel: 'error',
    ...options,
  });
}

await mkdir(folder, { recursive: true });
await bundle({ entryPoints: ['vendor.js', 'view.css'] });
// The library's imports of three.js lead to the page's own file of it.
const vendor = {
  name: 'vendor',
  setup: ({ onResolve }) =>
    onResolve({ filter: /^three($|\/)/ }, () => ({ path: './vendor.js', external: true })),
};
await bundle({
  entryPoints: { view: 'main.js', worker: '../stream/worker.js' },
  external: ['./vendor.js'],
  plugins: [vendor],
});
// Without the indentation of shaders: no other text of a minified file has tabs after line breaks.
const script = path.join(folder, 'vendor.js');
await writeFile(script, (await readFile(script, 'utf8')).replace(/\n[\t\n]+/g, '\n'));
for (const name of copied) {
  const bytes = await readFile(path.join(sources, name));
  const isPage = name.endsWith('.html');
  // Without indentation.
  const written = isPage ? bytes.toString().replace(/\n\s+/g, '\n') : bytes;
  await writeFile(path.join(folder, path.basename(name)), written);
}
