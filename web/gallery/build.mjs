// Bundles the scripts of the gallery into a folder: node build.mjs NODE_MODULES FOLDER
// tools/build_gallery.py adds the page and its models. NODE_MODULES holds esbuild and three;
// web/decoder.wasm and web/unpacker.wasm have been compiled.
import { copyFile, mkdir } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const [modules, folder] = process.argv.slice(2).map((name) => path.resolve(name));
const { build } = createRequire(path.join(modules, 'x.js'))('esbuild');
const web = path.dirname(path.dirname(fileURLToPath(import.meta.url)));

await mkdir(folder, { recursive: true });
await build({
  absWorkingDir: web,
  entryPoints: { gallery: 'element.js', worker: 'stream/worker.js' },
  outdir: folder,
  bundle: true,
  minify: true,
  format: 'esm',
  target: ['chrome111', 'firefox113', 'safari16.4'],
  nodePaths: [modules],
  logLevel: 'error',
});
for (const name of ['decoder.wasm', 'unpacker.wasm'])
  await copyFile(path.join(web, name), path.join(folder, name));
