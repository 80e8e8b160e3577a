// What web/webgpu.js makes of blobs on Dawn (npm webgpu), as digests.
// Usage: node webgpu.mjs WEB NODE_MODULES LIST
// LIST: a JSON file, {"packed": FILE, "views": [[offset, length], ...], "options": {...}}.
// Prints JSON: per view {"error": sentence}, or {"indices", "streams": digests, "draw": words,
// "problem": what check() says, or null}.
import { createHash } from 'node:crypto';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, modules, listFile] = process.argv.slice(2);
const load = (file) => import(pathToFileURL(file));
const { create, globals } = createRequire(path.join(modules, 'x.js'))('webgpu');
Object.assign(globalThis, globals);
const { createDecoder } = await load(path.join(web, 'decoder.js'));
const { decodeToGPU } = await load(path.join(web, 'webgpu.js'));

const gpu = create(['adapter=llvmpipe']);
const adapter = await gpu.requestAdapter();
if (!adapter) throw new Error('no WebGPU adapter llvmpipe; is lavapipe installed?');
const device = await adapter.requestDevice(); // the default limits
device.addEventListener('uncapturederror', ({ error }) => {
  console.error(error.message);
  process.exit(1);
});

const decoder = await createDecoder();
const list = JSON.parse(await readFile(listFile, 'utf8'));
const packed = new Uint8Array(await readFile(list.packed));

async function read(buffer) {
  const copy = device.createBuffer({
    size: buffer.size,
    usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST,
  });
  const encoder = device.createCommandEncoder();
  encoder.copyBufferToBuffer(buffer, 0, copy, 0, buffer.size);
  device.queue.submit([encoder.finish()]);
  await copy.mapAsync(GPUMapMode.READ);
  const bytes = new Uint8Array(copy.getMappedRange()).slice();
  copy.destroy();
  return bytes;
}

const digest = (bytes) => createHash('sha256').update(bytes).digest('hex');

async function decoded(view) {
  const primitive = await decodeToGPU(device, view, { ...list.options, decoder });
  const result = {
    draw: [...new Uint32Array((await read(primitive.indirect)).buffer)],
    indices: digest(await read(primitive.indices)),
    streams: [],
    problem: await primitive.check().then(
      () => null,
      (error) => error.message,
    ),
  };
  for (const { buffer } of primitive.streams) result.streams.push(digest(await read(buffer)));
  primitive.destroy();
  return result;
}

const results = [];
for (const [offset, length] of list.views)
  results.push(
    await decoded(packed.slice(offset, offset + length)).catch((error) => ({ error: error.message })),
  );
process.stdout.write(JSON.stringify(results), () => process.exit(0));
