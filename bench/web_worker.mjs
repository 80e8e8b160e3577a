// What bench/web.py runs in Node: decodes files with ours (web/), Draco (npm draco3d) and meshopt
// (npm meshoptimizer), to arrays that a page could use.
// Usage: node web_worker.mjs WEB NODE_MODULES TASK LIST
// LIST: {"ours": [view...], "draco": [buffer...], "meshopt": [file...], "repetitions", "workers"}.
// TASK: warm, prints {codec: [seconds...], "ours, N workers": [...]}, the codecs in turns; or
// cold-CODEC, prints the seconds of one import, compilation and first decoding.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import { performance } from 'node:perf_hooks';
import { pathToFileURL } from 'node:url';

const [web, modules, task, listFile] = process.argv.slice(2);
const require = createRequire(path.join(modules, 'x.js'));
const list = JSON.parse(readFileSync(listFile, 'utf8'));
const read = (names) => names.map((name) => new Uint8Array(readFileSync(name)));

const codecs = {
  async ours() {
    const views = read(list.ours);
    const wasm = readFileSync(path.join(web, 'decoder.wasm'));
    return async () => {
      const { createDecoder } = await import(pathToFileURL(path.join(web, 'decoder.js')));
      const decoder = await createDecoder(wasm);
      return () => views.forEach((view) => decoder.decodePrimitive(view));
    };
  },
  async draco() {
    const buffers = read(list.draco);
    return async () => {
      const draco3d = require('draco3d');
      const draco = await draco3d.createDecoderModule({});
      return () => buffers.forEach((buffer) => decodeDraco(draco, buffer));
    };
  },
  async meshopt() {
    const views = read(list.meshopt).flatMap(meshoptViews);
    return async () => {
      // Its module begins to compile when it is imported.
      const { MeshoptDecoder } = await import(pathToFileURL(require.resolve('meshoptimizer')));
      await MeshoptDecoder.ready;
      return () =>
        views.forEach(({ count, byteStride, mode, filter, bytes }) =>
          MeshoptDecoder.decodeGltfBuffer(
            new Uint8Array(count * byteStride),
            count,
            byteStride,
            bytes,
            mode,
            filter,
          ),
        );
    };
  },
};

function decodeDraco(draco, buffer) {
  const decoder = new draco.Decoder();
  const mesh = new draco.Mesh();
  const status = decoder.DecodeArrayToMesh(buffer, buffer.length, mesh);
  if (!status.ok()) throw new Error(status.error_msg());
  const arrays = [
    copied(draco, 3 * mesh.num_faces(), Uint32Array, (bytes, at) =>
      decoder.GetTrianglesUInt32Array(mesh, bytes, at),
    ),
  ];
  for (let a = 0; a < mesh.num_attributes(); a++) {
    const attribute = decoder.GetAttribute(mesh, a);
    const count = attribute.num_components() * mesh.num_points();
    arrays.push(
      copied(draco, count, Float32Array, (bytes, at) =>
        decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, draco.DT_FLOAT32, bytes, at),
      ),
    );
  }
  draco.destroy(mesh);
  draco.destroy(decoder);
  return arrays;
}

function copied(draco, count, Type, fill) {
  const at = draco._malloc(4 * count);
  fill(4 * count, at);
  const array = new Type(draco.HEAPF32.buffer, at, count).slice();
  draco._free(at);
  return array;
}

function meshoptViews(file) {
  const data = new DataView(file.buffer);
  const length = data.getUint32(12, true);
  const { bufferViews } = JSON.parse(new TextDecoder().decode(file.subarray(20, 20 + length)));
  const binary = file.subarray(28 + length);
  return bufferViews
    .map(({ extensions }) => extensions?.KHR_meshopt_compression)
    .filter((compressed) => compressed)
    .map((c) => ({
      ...c,
      bytes: binary.subarray(c.byteOffset ?? 0, (c.byteOffset ?? 0) + c.byteLength),
    }));
}

const timed = async (action) => {
  const start = performance.now();
  await action();
  return (performance.now() - start) / 1000;
};

async function warm() {
  const tasks = {};
  for (const [name, prepare] of Object.entries(codecs)) tasks[name] = await (await prepare())();
  const { createDecoderPool } = await import(pathToFileURL(path.join(web, 'pool.js')));
  const views = read(list.ours);
  for (const workers of list.workers) {
    const pool = await createDecoderPool({ workers });
    const name = `ours, ${workers} worker${workers > 1 ? 's' : ''}`;
    tasks[name] = () => Promise.all(views.map((view) => pool.decodePrimitive(view)));
  }
  const seconds = Object.fromEntries(Object.keys(tasks).map((name) => [name, []]));
  for (let i = 0; i <= list.repetitions; i++)
    for (const [name, decode] of Object.entries(tasks)) {
      const spent = await timed(decode);
      if (i > 0) seconds[name].push(spent); // the first repetition compiles
    }
  return seconds;
}

async function cold(codec) {
  const start = await codecs[codec](); // reads the files
  return timed(async () => (await start())());
}

const result = await (task === 'warm' ? warm() : cold(task.replace('cold-', '')));
process.stdout.write(JSON.stringify(result), () => process.exit());
