// A .glb, or a .gltf with its .bin files, read by ranges.

import { expect, isObject, TRANSPORT } from '../../accessors.js';
import { MalformedError } from '../../blob.js';
import { HEAD_BYTES, openSource, SourceError } from './source.js';

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const JSON_BEGIN = 20; // of a .glb
const CHUNK_BYTES = 8;
const GAP = 2048; // between places that are read by one request: less than a request's headers cost
const LARGEST_JSON = 2 ** 28;

// For packed files only.
export const transport = () => import('../../transport.js');

// Opens a URL or a Blob; options as of openSource. Throws SourceError, MalformedError.
export async function openDocument(place, options) {
  const source = await openSource(place, options);
  const head = await source.readHead();
  const data = new DataView(head.buffer, head.byteOffset, head.byteLength);
  const isGlb = head.length >= 4 && data.getUint32(0, true) === MAGIC;
  if (!isGlb) {
    expect(!(source.total > LARGEST_JSON), 'its JSON is too large');
    const text = head.length < HEAD_BYTES ? head : await source.readAll(LARGEST_JSON);
    return new Document(parseJson(text), place, [source], options);
  }
  expect(
    head.length >= JSON_BEGIN && data.getUint32(4, true) === 2,
    'it is not a .glb of version 2',
  );
  const length = data.getUint32(12, true);
  expect(data.getUint32(16, true) === JSON_CHUNK, 'its first chunk is not JSON');
  expect(length <= LARGEST_JSON, 'its JSON is too large');
  const json = parseJson(await source.readSurely(JSON_BEGIN, JSON_BEGIN + length));
  return new Document(json, place, [source], options, JSON_BEGIN + length + CHUNK_BYTES);
}

// The JSON object in some bytes. Throws MalformedError.
export function parseJson(bytes) {
  let json;
  try {
    json = JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    throw new MalformedError('it is no .glb, and its JSON cannot be read');
  }
  expect(isObject(json), 'its JSON is not an object');
  return json;
}

export class Document {
  #place;
  #sources;
  #options;
  #begin; // of the buffer of a .glb
  #buffers = new Map(); // number -> promise of its source
  #unpacker = null;

  constructor(json, place, sources, options, begin = null) {
    this.json = json;
    this.#place = place;
    this.#sources = sources;
    this.#options = options;
    this.#begin = begin;
  }

  // The whole .glb, where its server refuses ranges; else null.
  get blob() {
    return this.#begin === null ? null : this.#sources[0].blob;
  }

  get fetched() {
    return this.#sum('fetched');
  }

  get requests() {
    return this.#sum('requests');
  }

  get held() {
    return this.#sum('held');
  }

  #sum(name) {
    return this.#sources.reduce((sum, source) => sum + source[name], 0);
  }

  // Of all files but some.
  forgetHeads(kept) {
    for (const source of this.#sources) if (!kept.includes(source)) source.forgetHead();
  }

  // The place of a buffer view: {source, begin, end, size, isPacked}; size: of its bytes, unpacked.
  // Throws MalformedError, SourceError.
  async place(number) {
    const view = this.json.bufferViews?.[number];
    const buffer = this.json.buffers?.[view?.buffer];
    const { byteOffset = 0, byteLength, extensions } = view ?? {};
    const whole = (value) => Number.isInteger(value) && value >= 0;
    expect(
      buffer && whole(byteOffset) && whole(byteLength) && whole(buffer.byteLength),
      `there is no buffer view ${number}`,
    );
    expect(
      byteOffset + byteLength <= buffer.byteLength,
      `buffer view ${number} ends outside of its buffer`,
    );
    const own = view.buffer === 0 && buffer.uri === undefined && this.#begin !== null;
    const source = own ? this.#sources[0] : await this.#buffer(view.buffer, buffer.uri);
    const begin = (own ? this.#begin : 0) + byteOffset;
    expect(
      !(begin + byteLength > source.total),
      `buffer view ${number} ends after the end of the file`,
    );
    const packed = extensions?.[TRANSPORT];
    const size = packed ? packed.byteLength : byteLength;
    expect(whole(size), `buffer view ${number} has no valid ${TRANSPORT}`);
    return { source, begin, end: begin + byteLength, size, isPacked: Boolean(packed) };
  }

  // The compiled unpacker, for files that need it.
  unpackerModule() {
    this.#unpacker ??= transport().then(({ compileUnpacker }) =>
      compileUnpacker(this.#options?.unpacker),
    );
    return this.#unpacker;
  }

  #buffer(number, uri) {
    if (!this.#buffers.has(number)) this.#buffers.set(number, this.#open(uri));
    return this.#buffers.get(number);
  }

  async #open(uri) {
    expect(typeof uri === 'string', 'one of its buffers has no file');
    if (this.#place instanceof Blob && !uri.startsWith('data:'))
      throw new SourceError(`it refers to ${uri.slice(0, 80)}, which a Blob cannot reach`);
    const base =
      this.#place instanceof Blob ? undefined : new URL(this.#place, globalThis.location?.href);
    const url = new URL(uri, base);
    // What is for the file's server is for no other one that the file names.
    const { requestInit, ...others } = this.#options ?? {};
    const options = url.origin === base?.origin ? { ...others, requestInit } : others;
    const source = await openSource(url, options);
    this.#sources.push(source);
    return source;
  }

  // The bytes of a buffer view, unpacked.
  async readView(number) {
    const { source, begin, end, size, isPacked } = await this.place(number);
    const bytes = await source.readSurely(begin, end);
    if (!isPacked) return bytes;
    const { createUnpacker } = await transport();
    return (await createUnpacker(await this.unpackerModule())).unpack(bytes, size);
  }
}

// Reads places, {source, begin, end}, neighbours by one request. Returns their bytes in order.
export async function readPlaces(places) {
  const order = places
    .map((place, number) => ({ ...place, number }))
    .sort((a, b) => a.begin - b.begin);
  const requests = [];
  for (const place of order) {
    const last = requests.findLast(({ source }) => source === place.source);
    if (last && place.begin - last.end <= GAP) {
      last.end = Math.max(last.end, place.end);
      last.parts.push(place);
    } else requests.push({ ...place, parts: [place] });
  }
  const result = [];
  await Promise.all(
    requests.map(async ({ source, begin, end, parts }) => {
      const bytes = end > begin ? await source.readSurely(begin, end) : new Uint8Array(0);
      for (const part of parts)
        result[part.number] = bytes.slice(part.begin - begin, part.end - begin);
    }),
  );
  return result;
}
