// Unpacks buffer views of EXT_meshlet_transport with the codec's C++ unpacker, compiled to
// WebAssembly: a module of its own, which is loaded when a file needs it.

import { expect, TRANSPORT } from './accessors.js';
import { MalformedError } from './blob.js';
import { compileDecoder } from './compile.js';

export { TRANSPORT };

const VERSION = 1;
const MAX_BYTES = 448 * 2 ** 20; // of a page, packed or not
const EXPANSION = 256; // the most resident bytes for a packed byte,
const FREE_BYTES = 4096; // and these

// source: as createDecoder's, of unpacker.wasm.
export function compileUnpacker(source = new URL('./unpacker.wasm', import.meta.url)) {
  return compileDecoder(source);
}

// source: as of compileUnpacker.
export async function createUnpacker(source) {
  const instance = await WebAssembly.instantiate(await compileUnpacker(source));
  const exports = /** @type {any} */ (instance.exports);
  exports._initialize?.();
  return new Unpacker(exports);
}

// The places of pages in a packed view: {begin, end, size, raw}, with size the resident bytes.
// bytes: of the view, at least the first 4 + 8 * pages; length: of the view. Throws MalformedError.
export function packedTable(bytes, length) {
  const words = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  expect(bytes.length >= 4, 'the packed view is too short');
  const version = words.getUint32(0, true) & 255;
  expect(version === VERSION, `the packed view is of version ${version}`);
  const count = words.getUint32(0, true) >>> 8;
  let begin = 4 + 8 * count;
  expect(count > 0 && begin <= bytes.length, 'the packed view is shorter than its page table');
  const places = [];
  for (let page = 0; page < count; page++) {
    const size = words.getUint32(4 + 8 * page, true);
    const packed = words.getUint32(8 + 8 * page, true);
    const end = begin + (packed || size);
    expect(end <= length, `page ${page} lies outside the packed view`);
    const most = Math.min(MAX_BYTES, FREE_BYTES + EXPANSION * (end - begin));
    expect(
      size > 0 && size <= most && packed <= MAX_BYTES && size !== packed,
      `page ${page} has an impossible length`,
    );
    places.push({ begin, end, size, raw: packed === 0 });
    begin = end;
  }
  expect(begin === length, 'the packed view is longer than its pages');
  return places;
}

// The pages of a packed view: {bytes, size, raw}, as of packedTable. Throws MalformedError.
export function packedPages(view) {
  return packedTable(view, view.length).map(({ begin, end, size, raw }) => {
    return { bytes: view.subarray(begin, end), size, raw };
  });
}

class Unpacker {
  #exports;

  constructor(exports) {
    this.#exports = exports;
  }

  get memoryBytes() {
    return this.#exports.memory.buffer.byteLength;
  }

  unpack(view, byteLength) {
    const { pages, resident } = placedPages(view, byteLength);
    for (const page of pages) resident.set(this.unpackPage(page), page.begin);
    return resident;
  }

  // Borrows the result until the next call.
  unpackPage({ bytes, size, raw }) {
    if (raw) return bytes;
    const { reset, allocate, unpack, memory } = this.#exports;
    reset();
    const page = allocate(bytes.length);
    const out = allocate(size);
    new Uint8Array(memory.buffer, page, bytes.length).set(bytes);
    let problem;
    try {
      problem = unpack(page, bytes.length, out, size);
    } catch {
      throw new MalformedError('the unpacked data do not fit into memory');
    }
    if (problem) {
      const text = new Uint8Array(memory.buffer, problem);
      throw new MalformedError(new TextDecoder().decode(text.subarray(0, text.indexOf(0))));
    }
    return new Uint8Array(memory.buffer, out, size);
  }
}

// The pages of a packed view with their places, and room for what they unpack to. byteLength: what
// the extension object says.
function placedPages(view, byteLength) {
  let total = 0;
  const pages = packedPages(view).map((page) => {
    total += page.size;
    return { ...page, begin: total - page.size };
  });
  expect(byteLength === total, `its ${TRANSPORT} object does not say that it has ${total} bytes`);
  return { pages, resident: new Uint8Array(total) };
}

// page -> promise of its resident bytes. With a decoder pool, its Workers unpack.
export async function createPageUnpacker(pool, source) {
  const module = await compileUnpacker(source);
  if (!pool) {
    const unpacker = await createUnpacker(module);
    return async (page) => unpacker.unpackPage(page).slice();
  }
  return async ({ bytes, size, raw }, signal) =>
    raw ? bytes.slice() : pool.run({ task: 'unpack', bytes, options: { size, module } }, signal);
}

// load, or a function that also unpacks what it loads. For loaders; see virtualViews.
// load: number of a buffer view -> promise of its bytes. decoder: a decoder, a pool, or a promise.
export function unpacking(json, load, decoder) {
  if (!json.extensionsUsed?.includes(TRANSPORT)) return load;
  const unpacker = Promise.resolve(decoder).then((given) =>
    createPageUnpacker(given?.run ? given : null),
  );
  unpacker.catch(() => {}); // whoever loads a view gets the error
  return async (number) => {
    const bytes = await load(number);
    const extension = json.bufferViews[number].extensions?.[TRANSPORT];
    if (!extension) return bytes;
    const unpackPage = await unpacker;
    const { pages, resident } = placedPages(bytes, extension.byteLength);
    await Promise.all(pages.map(async (page) => resident.set(await unpackPage(page), page.begin)));
    return resident;
  };
}
