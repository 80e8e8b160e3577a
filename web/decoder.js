// Decodes the primitives of EXT_meshlet_edgebreaker with the codec's C++ decoder, compiled to
// WebAssembly. For browsers and Node. decoder.d.ts documents what this module exports.

export const Kind = Object.freeze({ GRID: 0, OCT: 1, INTEGER: 2, FLOAT32: 3, SIGN: 4 });

export class MalformedError extends Error {
  constructor(problem) {
    super(problem);
    this.name = 'MalformedError';
  }
}

// The header of a blob and its stream table (specification, appendices A.2 and A.3), by byte.
const HEADER_BYTES = 32;
const STREAM_COUNT = 5;
const TRIANGLE_COUNT = 8;
const VERTEX_COUNT = 12;
const MESHLET_COUNT = 16;
const BYTE_LENGTH = 20;
const STREAM_BYTES = 28;
const STREAM_STEP = 8;
const STREAM_OFFSETS = 12;
const MAX_COUNT = 2 ** 32 - 1; // of a view's vertices, and of its indices

const NO_MESHLET = -1; // of a problem that is in no meshlet
const MESHLET_LIMIT = 64; // vertices, and triangles
// Meshlets decoded at a time. What the module writes is still in the processor's cache when it is
// copied, its memory stays small, and V8 can go on with better code: it keeps a function's first
// compilation until the function returns. From 64 to 512 the time of dragon is the same.
const PART_MESHLETS = 256;
const OUTER_BYTES = 8; // of OuterVertex in codec/decode/bulk_decoder.h
export const KEPT_BYTES = 392; // of Kept in codec/decode/bulk_decoder.cpp, of one meshlet

// Integers of a vertex of a stream, as the WebAssembly module stores those of a meshlet.
const STORED_ELEMENTS = 4;

export async function createDecoder(source) {
  const module = await compileDecoder(source);
  let memory;
  const host = {
    refuse(text, number, meshlet) {
      throw new MalformedError(sentence(new Uint8Array(memory.buffer, text), number, meshlet));
    },
  };
  const { exports } = await WebAssembly.instantiate(module, { host });
  memory = exports.memory;
  exports._initialize?.();
  return new Decoder(exports);
}

// As `sentence` of codec/format/refuse.cpp. `text` ends with a 0.
function sentence(text, number, meshlet) {
  const problem = new TextDecoder()
    .decode(text.subarray(0, text.indexOf(0)))
    .replace('#', number >>> 0);
  return meshlet === NO_MESHLET ? problem : `meshlet ${meshlet >>> 0}: ${problem}`;
}

// The compiled module; see createDecoder.
export async function compileDecoder(given = new URL('./decoder.wasm', import.meta.url)) {
  const source = await given;
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source === 'string' || source instanceof URL)
    return compileDecoder(await load(String(source)));
  if (typeof Response !== 'undefined' && source instanceof Response) {
    if (!source.ok) throw new Error(`${source.url}: the server answered ${source.status}`);
    return WebAssembly.compile(await source.arrayBuffer());
  }
  return WebAssembly.compile(source);
}

async function load(url) {
  if (!url.startsWith('file:')) return fetch(url);
  const node = 'node:fs/promises'; // Node fetches no files; in a variable, for bundlers
  const { readFile } = await import(/* @vite-ignore */ node);
  return readFile(new URL(url));
}

class Decoder {
  #exports;
  #stack; // stack pointer outside all calls: an exception leaves it where it was thrown
  #opened = {}; // what decodeMeshlet opened last: view, blobs, number of the open blob

  constructor(exports) {
    this.#exports = exports;
    this.#stack = exports.__stack_pointer.value;
  }

  decodePrimitive(view, { integers = false } = {}) {
    const plan = this.plan(view, integers);
    this.#fill(plan);
    return plan.result;
  }

  // For the pool: the blobs of a view, and where their parts go; without arrays.
  plan(view, integers) {
    return new Plan(this.#blobs(view), integers);
  }

  // For the pool: decodes the leading blobs of a view, the last of them up to meshlet `end`, into
  // arrays of the whole view, whose counts are `total`. Passes the triangles of each blob to onPart.
  // Returns the arrays, the counts of the last blob, and what decodeRange returns with `keep`.
  decodeHead(view, { integers, total, end, keep }, onPart) {
    const plan = new Plan(this.#blobs(view), integers, total);
    const decoded = this.#fill(plan, end, ({ triangles }) => onPart({ triangles }));
    return { ...this.#kept(decoded, keep), ...plan.arrays() };
  }

  // For the pool: a range of a view of one blob, with the options of #decode. Passes the parts, with
  // copies of their arrays, to onPart. keep: returns also the vertex numbers of the last meshlets,
  // for later ranges.
  decodeRange(view, options, onPart) {
    const [blob] = this.#blobs(view);
    const decoded = this.#decode(blob, options, ({ indices, values, vertexCount, outer }, at) =>
      onPart({
        indices: indices.slice(),
        values: values.map((array) => array.slice()),
        vertexCount,
        outer: outer.slice(),
        at: { ...at },
      }),
    );
    return this.#kept(decoded, options.keep);
  }

  decodeMeshlet(view, meshlet) {
    const blobs = this.#opened.view === view ? this.#opened.blobs : this.#blobs(view);
    const number = blobs.findIndex(({ end }) => meshlet < end.meshlets);
    if (!Number.isInteger(meshlet) || meshlet < 0 || number < 0)
      throw new RangeError(`there is no meshlet ${meshlet} of ${blobs.at(-1).end.meshlets}`);
    const open = this.#opened.number ?? blobs.length - 1;
    this.#opened = {}; // an error closes the view
    return named(blobs.length, number, () => {
      const blob = blobs[number];
      if (open !== number) this.#open(blob.bytes);
      const decoded = this.#meshlet(blob, meshlet - blob.begin.meshlets);
      this.#opened = { view, blobs, number };
      return decoded;
    });
  }

  blobs(view) {
    return this.#blobs(view).map(({ bytes, begin, end, streams }) => ({
      bytes,
      triangleCount: end.triangles - begin.triangles,
      vertexCount: end.vertices - begin.vertices,
      meshletCount: end.meshlets - begin.meshlets,
      streams,
    }));
  }

  validate(view) {
    const blobs = this.#blobs(view);
    blobs.forEach((blob, number) =>
      named(blobs.length, number, () => {
        if (blobs.length > 1) this.#open(blob.bytes);
        this.#call('validate');
      }),
    );
  }

  // Checks headers and tables of all blobs of a view. Leaves the last one open.
  #blobs(view) {
    this.#opened = {};
    const blobs = [];
    for (let at = 0; at < view.byteLength || blobs.length === 0; at += blobs.at(-1).bytes.length) {
      const bytes = view.subarray(at, at + blobLength(view.subarray(at)));
      const several = blobs.length > 0;
      try {
        this.#open(bytes);
      } catch (error) {
        throw several ? blamed(error, blobs.length) : error;
      }
      const blob = readHeader(bytes, several ? blobs.at(-1).end : NOTHING);
      if (several && !sameStreams(blob.streams, blobs[0].streams))
        throw blamed(
          new MalformedError('its streams differ from those of the first blob'),
          blobs.length,
        );
      blobs.push(blob);
    }
    const { vertices, triangles } = blobs.at(-1).end;
    if (vertices > MAX_COUNT || 3 * triangles > MAX_COUNT)
      throw new MalformedError('the blobs have more vertices or indices than 32 bits can count');
    return blobs;
  }

  // Copies a blob into the module's memory and opens it there.
  #open(bytes) {
    this.#call('reset');
    const at = this.#call('allocate', bytes.length);
    new Uint8Array(this.#exports.memory.buffer, at, bytes.length).set(bytes);
    this.#call('open_blob', at, bytes.length);
  }

  // Makes the arrays of a plan and decodes its blobs into them, the last one up to meshlet `end`.
  // Calls onBlob with what #decode returns. Returns that of the last blob.
  #fill(plan, end = plan.blobs.at(-1).meshlets, onBlob = () => {}) {
    plan.allocate();
    const several = plan.blobs.length > 1;
    const decoded = plan.blobs.map((blob, number) =>
      named(plan.total.blobs, number, () => {
        if (several) this.#open(blob.bytes);
        const last = number + 1 === plan.blobs.length;
        const options = { begin: 0, end: last ? end : blob.meshlets, first: blob.begin.vertices };
        const insert = (part, at) => plan.insert(blob, part, at);
        const counts = this.#decode(blob, { integers: plan.integers, ...options }, insert);
        onBlob(counts);
        return counts;
      }),
    );
    return decoded.at(-1);
  }

  // What #decode returns, with a copy of the kept numbers, or with null.
  #kept({ kept, keptCount, ...counts }, keep) {
    const { buffer } = this.#exports.memory;
    const numbers = new Uint8Array(buffer, kept, KEPT_BYTES * keptCount);
    return { ...counts, kept: keep ? numbers.slice() : null };
  }

  // Decodes the meshlets [begin, end) of the open blob. Numbers their new vertices from `first` on,
  // and those of meshlets before the range as DecoderContext::start says. Calls insert(part, at) for
  // some meshlets at a time; `at`: triangles and vertices before them; the arrays lie in the module's
  // memory until the next call. Returns `at` behind the last ones.
  #decode({ streams }, { integers, begin, end, first }, insert) {
    const most = MESHLET_LIMIT * Math.min(end - begin, PART_MESHLETS);
    const triangles = this.#call('allocate', 3 * 4 * most);
    const widths = streams.map((stream) => width(stream, integers));
    const places = widths.map((n) => this.#call('allocate', 4 * n * most));
    const list = this.#call('allocate', 4 * places.length);
    const outer = begin > 0 ? this.#call('allocate', OUTER_BYTES * most) : 0;
    new Uint32Array(this.#exports.memory.buffer).set(places, list / 4);
    this.#call('start', begin, first);
    const at = { triangles: 0, vertices: 0 };
    let kept;
    for (let next = begin; next < end; ) {
      next = Math.min(next + PART_MESHLETS, end);
      const lists = integers ? [list, 0] : [0, list];
      const words = this.#call('decode', next, triangles, ...lists, outer);
      const { buffer } = this.#exports.memory; // decoding may have replaced it
      const [triangleCount, vertexCount, outerCount, ...rest] = new Uint32Array(buffer, words, 5);
      const part = {
        indices: new Uint32Array(buffer, triangles, 3 * triangleCount),
        values: streams.map(
          (stream, s) =>
            new (arrayType(stream, integers))(buffer, places[s], widths[s] * vertexCount),
        ),
        vertexCount,
        outer: new Uint32Array(buffer, outer, 2 * outerCount),
      };
      insert(part, at);
      at.triangles += triangleCount;
      at.vertices += vertexCount;
      kept = rest;
    }
    return { ...at, kept: kept[0], keptCount: kept[1] };
  }

  #meshlet({ streams }, meshlet) {
    const at = this.#call('decode_meshlet', meshlet) / 4;
    const words = new Uint32Array(this.#exports.memory.buffer);
    const [triangleCount, vertexCount, packed] = words.subarray(at, at + 3);
    const triangles = new Uint8Array(3 * triangleCount);
    for (let t = 0; t < triangleCount; t++)
      for (let c = 0; c < 3; c++) triangles[3 * t + c] = words[packed / 4 + t] >>> (8 * c);
    const values = streams.map(({ elements }, s) => {
      const from = words[at + 3 + s] / 4;
      const integers = new Uint32Array(elements * vertexCount);
      for (let v = 0; v < vertexCount; v++)
        for (let c = 0; c < elements; c++)
          integers[elements * v + c] = words[from + STORED_ELEMENTS * v + c];
      return integers;
    });
    return { triangleCount, vertexCount, triangles, values };
  }

  #call(name, ...args) {
    this.#exports.__stack_pointer.value = this.#stack;
    return this.#exports[name](...args) >>> 0;
  }
}

// What becomes of a view's blobs: the decoded primitive, filled part by part. Of leading blobs only
// with `total`: the number of blobs, triangles and vertices of the view.
class Plan {
  constructor(blobs, integers, total = { ...blobs.at(-1).end, blobs: blobs.length }) {
    this.blobs = blobs;
    this.integers = integers;
    this.total = total;
    this.result = {
      triangleCount: total.triangles,
      vertexCount: total.vertices,
      meshletCount: total.meshlets,
      indices: null,
      streams: blobs[0].streams.map((stream) => ({ ...stream, values: null })),
    };
  }

  allocate() {
    const { result, total, integers } = this;
    const values = result.streams.map((stream) =>
      array(arrayType(stream, integers), total.vertices * width(stream, integers)),
    );
    this.adopt({ indices: array(Uint32Array, 3 * total.triangles), values });
  }

  // Takes the arrays of another plan of the view.
  adopt({ indices, values }) {
    this.result.indices = indices;
    this.result.streams.forEach((stream, s) => (stream.values = values[s]));
  }

  arrays() {
    const { indices, streams } = this.result;
    return { indices, values: streams.map((stream) => stream.values) };
  }

  // Copies a decoded part of a blob; `at`: triangles and vertices of the blob before it.
  insert({ begin }, { indices, values }, at) {
    this.result.indices.set(indices, 3 * (begin.triangles + at.triangles));
    this.result.streams.forEach((stream, s) => {
      const n = stream.values.length / this.result.vertexCount;
      stream.values.set(values[s], n * (begin.vertices + at.vertices));
    });
  }

  // The error of a blob's part; it names the blob if the view has several.
  blame(blob, error) {
    return this.blobs.length > 1 ? blamed(error, this.blobs.indexOf(blob)) : error;
  }
}

const NOTHING = Object.freeze({ triangles: 0, vertices: 0, meshlets: 0 });

// The header of a blob that the module has checked. begin and end: the triangles, vertices and
// meshlets of a view before and after the blob.
function readHeader(bytes, begin) {
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const end = {
    triangles: begin.triangles + data.getUint32(TRIANGLE_COUNT, true),
    vertices: begin.vertices + data.getUint32(VERTEX_COUNT, true),
    meshlets: begin.meshlets + data.getUint32(MESHLET_COUNT, true),
  };
  const streams = Array.from({ length: bytes[STREAM_COUNT] }, (_, s) => {
    const row = HEADER_BYTES + STREAM_BYTES * s;
    return {
      kind: bytes[row],
      elements: bytes[row + 1],
      bits: bytes[row + 2],
      step: data.getFloat32(row + STREAM_STEP, true),
      offset: [0, 1, 2, 3].map((c) => data.getFloat32(row + STREAM_OFFSETS + 4 * c, true)),
    };
  });
  return { bytes, begin, end, meshlets: end.meshlets - begin.meshlets, streams };
}

// The length of the blob that `rest` of a view starts with. A last blob may be malformed in its
// length: open_blob says so.
function blobLength(rest) {
  if (rest.byteLength < HEADER_BYTES) return rest.byteLength;
  const length = new DataView(rest.buffer, rest.byteOffset).getUint32(BYTE_LENGTH, true);
  const fits = length >= HEADER_BYTES && length % 4 === 0 && length < rest.byteLength;
  return fits ? length : rest.byteLength;
}

function sameStreams(a, b) {
  const same = (x, y) =>
    x.kind === y.kind &&
    x.elements === y.elements &&
    x.bits === y.bits &&
    x.step === y.step &&
    x.offset.every((offset, c) => offset === y.offset[c]);
  return a.length === b.length && a.every((stream, s) => same(stream, b[s]));
}

// Numbers of a vertex of a stream: a unit vector has two integers and three floats.
function width({ kind, elements }, integers) {
  return kind === Kind.OCT && !integers ? 3 : elements;
}

function arrayType({ kind }, integers) {
  return integers || kind === Kind.INTEGER ? Uint32Array : Float32Array;
}

function array(Type, length) {
  try {
    return new Type(length);
  } catch {
    throw new MalformedError('the decoded arrays do not fit into memory');
  }
}

// Runs `action`; an error names the blob if the view has several.
function named(count, number, action) {
  try {
    return action();
  } catch (error) {
    throw count > 1 ? blamed(error, number) : error;
  }
}

function blamed(error, number) {
  return error instanceof MalformedError
    ? new MalformedError(`blob ${number}: ${error.message}`)
    : error;
}
