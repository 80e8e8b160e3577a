// Runs webgpu_digest.js on Dawn (npm webgpu) and lavapipe.
// Usage: node webgpu.mjs WEB NODE_MODULES FOLDER
// FOLDER holds blobs.bin and list.json, {"views": [[offset, length], ...], "options": {...}}.
// Prints JSON: what digests() returns.
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { digests } from './webgpu_digest.js';

const [web, modules, folder] = process.argv.slice(2);
const { create, globals } = createRequire(path.join(modules, 'x.js'))('webgpu');
Object.assign(globalThis, globals);
const load = (file) => import(pathToFileURL(path.join(web, file)));
const { createDecoder } = await load('decoder.js');
const { decodeToGPU } = await load('webgpu.js');

globalThis.gpu = create(['adapter=llvmpipe']); // kept: its end would crash the device
const adapter = await gpu.requestAdapter();
if (!adapter) throw new Error('no WebGPU adapter llvmpipe; is lavapipe installed?');
const device = await adapter.requestDevice(); // the default limits
device.addEventListener('uncapturederror', ({ error }) => {
  console.error(error.message);
  process.exit(1);
});
const list = JSON.parse(await readFile(path.join(folder, 'list.json'), 'utf8'));
const packed = new Uint8Array(await readFile(path.join(folder, 'blobs.bin')));
const results = await digests(device, await createDecoder(), decodeToGPU, { ...list, packed });
process.stdout.write(JSON.stringify(results), () => process.exit(0));
