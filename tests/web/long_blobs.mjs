// What the WebAssembly decoder and the table of packed views make of blobs near the limit of their
// length. Usage: node long_blobs.mjs WEB BLOB SIZE.. Prints JSON.
// BLOB: a file with a blob of one group. Unused bytes before its entries make it SIZE bytes long.
import { readFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, file, ...sizes] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const { createDecoder } = await load('decoder.js');
const { packedTable } = await load('transport.js');

const BYTE_LENGTH = 20;
const DATA_OFFSET = 24;
const GROUP_BYTES = 12;

function stretched(blob, size) {
  const tables = new DataView(blob.buffer, blob.byteOffset).getUint32(DATA_OFFSET, true);
  const out = new Uint8Array(size);
  out.set(blob.subarray(0, tables));
  out.set(blob.subarray(tables), size - blob.length + tables);
  const words = new DataView(out.buffer);
  const base = words.getUint32(tables - GROUP_BYTES, true) + size - blob.length;
  words.setUint32(tables - GROUP_BYTES, base, true);
  words.setUint32(BYTE_LENGTH, size, true);
  return out;
}

function answer(action) {
  try {
    return action();
  } catch (error) {
    if (error.name !== 'MalformedError') throw error;
    return error.message;
  }
}

const blob = new Uint8Array(readFileSync(file));
const blobs = [];
for (const size of sizes.map(Number)) {
  const decoder = await createDecoder(); // the memory of a module does not shrink
  blobs.push(
    answer(() => {
      const view = stretched(blob, size);
      decoder.validate(view);
      return Array.from(decoder.decodePrimitive(view, { integers: true }).indices);
    }),
  );
}

// A table of one page: resident bytes, and packed bytes or 0.
function table(resident, packed) {
  const words = new Uint32Array([1 | (1 << 8), resident, packed]);
  return answer(() => packedTable(new Uint8Array(words.buffer), 12 + (packed || resident)).length);
}

const pages = sizes
  .map(Number)
  .map((size) => [table(size, 0), table(size, 2 ** 21), table(80, size)]);
console.log(JSON.stringify({ blobs, pages }));
