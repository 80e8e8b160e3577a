// The accessors' arrays that web/gltf.js makes of compressed files, as digests.
// Usage: node accessors.mjs WEB FILE.glb...
// Prints JSON: per file, per compressed primitive {"error": sentence}, or accessor number -> digest.
import { createHash } from 'node:crypto';
import { readFile } from 'node:fs/promises';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, ...files] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const { createDecoder, MalformedError } = await load('decoder.js');
const { EXTENSION, accessorArrays } = await load('gltf.js');
const decoder = await createDecoder();

const JSON_START = 20;

function parse(file) {
  const length = file.readUInt32LE(12);
  const json = JSON.parse(file.subarray(JSON_START, JSON_START + length));
  return { json, binary: file.subarray(JSON_START + length + 8) };
}

function digests({ json, binary }, primitive) {
  const number = primitive.extensions[EXTENSION].bufferView;
  if (json.bufferViews[number] === undefined) return { error: 'there is no such buffer view' };
  const { byteOffset = 0, byteLength } = json.bufferViews[number];
  const view = new Uint8Array(binary.subarray(byteOffset, byteOffset + byteLength));
  try {
    const arrays = accessorArrays(json, primitive, decoder.decodePrimitive(view));
    const digest = (array) =>
      createHash('sha256').update(new Uint8Array(array.buffer)).digest('hex');
    return Object.fromEntries([...arrays].map(([accessor, array]) => [accessor, digest(array)]));
  } catch (error) {
    if (error instanceof MalformedError) return { error: error.message };
    throw error;
  }
}

const results = [];
for (const file of files) {
  const glb = parse(await readFile(file));
  const primitives = glb.json.meshes.flatMap((mesh) => mesh.primitives);
  const compressed = primitives.filter((primitive) => primitive.extensions?.[EXTENSION]);
  results.push(compressed.map((primitive) => digests(glb, primitive)));
}
process.stdout.write(JSON.stringify(results));
