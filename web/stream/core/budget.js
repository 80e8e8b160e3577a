// How a stream divides its memory.

import { SourceError } from '../io/source.js';
import { indexType } from './formats.js';
import { capacityOf, GeometryPool, geometryBytes } from './geometry.js';

const MEGABYTE = 1e6;
const WORKER_BYTES = 11 * 65_536; // of WebAssembly, after pages of 32 KiB
const UNPACKER_BYTES = 0.13 * MEGABYTE; // of its WebAssembly at first,
const UNPACKING = 140; // and for each byte of the largest unpacked page: 95 to 130 were measured
const MOST_WORKERS = 4;
const SMALL = 24 * MEGABYTE; // budgets with one Worker
// Of the budget, for bytes that are requested or wait for a decoder.
const WAITING = 0.008;
const LEAST_WAITING = 0.07 * MEGABYTE; // two pages
const MOST_WAITING = 3 * MEGABYTE;

export function workersOf(maxBytes) {
  if (maxBytes <= SMALL) return 1;
  const cores = globalThis.navigator?.hardwareConcurrency ?? 2;
  return Math.min(Math.max(cores - 1, 1), MOST_WORKERS);
}

export function tooSmall(maxBytes, why) {
  return new SourceError(`maxBytes ${maxBytes} is too small for this file: ${why}; allow more`);
}

// What a page takes while it is decoded, beside the memory of WebAssembly: a copy of its bytes, also
// unpacked, and its arrays.
export function decodingBytes({ owner, vertices, triangles, length, packed }) {
  const vertexBytes = owner.formats.reduce((sum, { bytes }) => sum + bytes, 0);
  const indexBytes = 3 * indexType(vertices).BYTES_PER_ELEMENT;
  return length + packed + vertexBytes * vertices + indexBytes * triangles;
}

// The number of workers, and bytes: {maxBytes, workers, wasm (of a Worker), tables, waiting, decoding,
// room (of all pools, of each copy)}. held: of the first bytes of files. copies: of decoded pages; 2
// are an array of ours, and the buffer on the GPU. Throws SourceError.
export function planBudget(primitives, maxBytes, held, copies) {
  const workers = workersOf(maxBytes);
  const pages = primitives.flatMap((one) => one.pages);
  const stored = pages.reduce((sum, { bytes }) => sum + (bytes?.length ?? 0), 0);
  const roots = primitives.flatMap((one) => one.roots);
  const most = (values) => values.reduce((a, b) => Math.max(a, b), 0);
  const tables = primitives.reduce(
    (sum, one) => sum + one.tables.byteLength + one.cut.byteLength + 9 * one.pages.length,
    0,
  );
  const packed = most(pages.map((page) => page.packed));
  const wasm = WORKER_BYTES + (packed > 0 ? UNPACKER_BYTES + UNPACKING * packed : 0);
  const decoding = most(pages.map(decodingBytes));
  const waiting = Math.max(
    LEAST_WAITING,
    Math.min(WAITING * maxBytes, MOST_WAITING),
    stored + held + most(roots.map(decodingBytes)) - decoding, // the coarsest pages are there
  );
  const room = (maxBytes - tables - workers * wasm - waiting - decoding) / copies;
  if (bytesOf(roots) > room) throw tooSmall(maxBytes, 'its coarsest level does not fit');
  return { maxBytes, workers, wasm, tables, waiting, decoding, room };
}

// Pools for the primitives of each layout of vertices, which get room later.
export function makePools(primitives) {
  const pools = new Map();
  for (const one of primitives) {
    const layout = JSON.stringify(
      one.formats.map((f) => [f.name, f.Type.name, f.size, f.normalized]),
    );
    if (!pools.has(layout))
      pools.set(layout, new GeometryPool(one.formats, { vertices: 0, triangles: 0 }));
    one.pool = pools.get(layout);
  }
  return [...pools.values()];
}

// Pool -> its capacity. Each primitive has the same share of the room, for its coarsest pages: cuts
// have their mix of vertices and triangles.
export function divideRoom(primitives, pools, room) {
  const total = bytesOf(primitives.flatMap(({ pages }) => pages));
  const shareBeyond = (bytes) => Math.min(1, (room - bytes) / Math.max(total - bytes, 1));
  const share = shareBeyond(bytesOf(primitives.flatMap(({ roots }) => roots)));
  const coarsest = new Map(primitives.map((one) => [one, coarsestPages(one, share)]));
  const rest = shareBeyond(bytesOf([...coarsest.values()].flat()));
  const divided = pools.map((pool) => {
    const ones = primitives.filter((one) => one.pool === pool);
    const pages = ones.flatMap((one) => one.pages);
    const always = ones.flatMap((one) => coarsest.get(one));
    return [pool, capacityOf(pages, always, rest)];
  });
  return new Map(divided);
}

// Root pages, and those that follow them within a share of the bytes of all others.
function coarsestPages({ pages, roots }, share) {
  let left = share * bytesOf(pages.slice(roots.length));
  const beyond = pages.findIndex((page, p) => {
    if (p >= roots.length) left -= bytesOf([page]);
    return left < 0;
  });
  return beyond < 0 ? pages : pages.slice(0, beyond);
}

function bytesOf(pages) {
  return pages.reduce(
    (sum, { owner, vertices, triangles }) =>
      sum + geometryBytes(owner.formats, vertices, triangles),
    0,
  );
}
