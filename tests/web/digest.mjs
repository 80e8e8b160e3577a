// What web/decoder.js makes of views, as digests that Python can compare with the native decoder's.
// Usage: node digest.mjs DECODER LIST
// LIST: a JSON file, {"packed": FILE, "views": [[offset, length], ...]}.
// Prints JSON: {"memory": bytes of the WebAssembly memory at the end, "results"}; a result per view,
// {"validate", "decode": sentence or null, and, if decoded, "triangles", "vertices", "meshlets",
// "indices", "values", "integers", "alone": digests}.
import { createHash } from 'node:crypto';
import { readFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';

const [decoderFile, listFile] = process.argv.slice(2);
const { createDecoder, MalformedError } = await import(pathToFileURL(decoderFile));
const { instantiate } = WebAssembly;
let memory;
WebAssembly.instantiate = async (...given) => {
  const instance = await instantiate(...given);
  memory = instance.exports.memory;
  return instance;
};
const decoder = await createDecoder();
const list = JSON.parse(await readFile(listFile, 'utf8'));
const packed = new Uint8Array(await readFile(list.packed));

const bytes = (array) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
const digest = (...arrays) => {
  const hash = createHash('sha256');
  for (const array of arrays) hash.update(bytes(array));
  return hash.digest('hex');
};
// Any other exception ends this program, and with it the test.
const problem = (action) => {
  try {
    action();
    return null;
  } catch (error) {
    if (error instanceof MalformedError) return error.message;
    throw error;
  }
};

// Each meshlet: its counts, triangles and integers.
function alone(view, count) {
  const hash = createHash('sha256');
  for (let m = 0; m < count; m++) {
    const meshlet = decoder.decodeMeshlet(view, m);
    hash.update(bytes(new Uint32Array([meshlet.triangleCount, meshlet.vertexCount])));
    for (const array of [meshlet.triangles, ...meshlet.values]) hash.update(bytes(array));
  }
  return hash.digest('hex');
}

const results = list.views.map(([offset, length]) => {
  const view = packed.slice(offset, offset + length);
  const result = { validate: problem(() => decoder.validate(view)) };
  let decoded;
  result.decode = problem(() => (decoded = decoder.decodePrimitive(view)));
  if (result.decode !== null || result.validate !== null) return result;
  const integers = decoder.decodePrimitive(view, { integers: true });
  return {
    ...result,
    triangles: decoded.triangleCount,
    vertices: decoded.vertexCount,
    meshlets: decoded.meshletCount,
    indices: digest(decoded.indices),
    values: decoded.streams.map((s) => digest(s.values)),
    integers: integers.streams.map((s) => digest(s.values)),
    alone: alone(view, decoded.meshletCount),
  };
});
process.stdout.write(JSON.stringify({ memory: memory.buffer.byteLength, results }));
