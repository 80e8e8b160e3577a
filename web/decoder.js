// Decodes the primitives of EXT_meshlet_edgebreaker with the codec's C++ decoder, compiled to
// WebAssembly. For browsers and Node. decoder.d.ts documents what this module exports.
import { HEADER_BYTES, Kind, MalformedError, readStreams, sameStreams } from './blob.js';
import { compileDecoder } from './compile.js';

export { Kind, MalformedError };

// Offsets in the header of a blob (specification, appendix A.2), in bytes.
const TRIANGLE_COUNT = 8;
const VERTEX_COUNT = 12;
const MESHLET_COUNT = 16;
const BYTE_LENGTH = 20;
const MAX_COUNT = 2 ** 32 - 1; // of a view's vertices, and of its indices

const NO_MESHLET = -1; // of a problem that is in no meshlet
const MESHLET_LIMIT = 64; // vertices, and triangles
// Meshlets decoded at a time. The module's output is still in the processor's cache when it is
// copied, its memory stays small, and V8 can go on with better code: it keeps a function's first
// compilation until the function returns. From 64 to 512 the time of dragon is the same.
const STEP_MESHLETS = 256;

// Integers of a vertex of a stream, as the WebAssembly module stores those of a meshlet.
const STORED_ELEMENTS = 4;

export async function createDecoder(source) {
  return startDecoder(await compileDecoder(source));
}

// For Workers, which get the compiled module.
export async function startDecoder(module) {
  let memory;
  const host = {
    refuse(text, number, meshlet) {
      throw new MalformedError(sentence(new Uint8Array(memory.buffer, text), number, meshlet));
    },
  };
  const instance = await WebAssembly.instantiate(/** @type {WebAssembly.Module} */ (module), {
    host,
  });
  const exports = /** @type {any} */ (instance.exports);
  memory = exports.memory;
  exports._initialize?.();
  return new Decoder(exports);
}

// As `sentence` of codec/format/problem.cpp. `text` ends with a 0.
function sentence(text, number, meshlet) {
  const problem = new TextDecoder()
    .decode(text.subarray(0, text.indexOf(0)))
    .replace('#', String(number >>> 0));
  return meshlet === NO_MESHLET ? problem : `meshlet ${meshlet >>> 0}: ${problem}`;
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
    return this.decodeBlobs(view, { integers }).result;
  }

  // For the pool: the blobs of a view and their places in the result; without arrays.
  plan(view, integers) {
    return new Plan(this.#blobs(view), { integers });
  }

  // For the pool: a plan of consecutive blobs, decoded; options as the plan's. Decodes so many
  // meshlets in a step, and calls onTriangles with the number of triangles of each step.
  decodeBlobs(bytes, { step = STEP_MESHLETS, ...options }, onTriangles = (_count) => {}) {
    const plan = new Plan(this.#blobs(bytes), options);
    plan.allocate();
    const insert = (part, at) => {
      plan.insert(part, at);
      onTriangles(part.indices.length / 3);
    };
    this.#each(plan.blobs, (blob) => this.#decode(blob, plan, step, insert));
    return plan;
  }

  // For gltf-meshlet/stream: calls take({indices, values, vertexCount}, {triangles, vertices}) for
  // each meshlet, with the counts before it. The next meshlet overwrites the arrays.
  decodeEach(bytes, integers, take) {
    const plan = new Plan(this.#blobs(bytes), { integers });
    this.#each(plan.blobs, (blob) => this.#decode(blob, plan, 1, take));
  }

  decodeMeshlet(view, meshlet) {
    const blobs = this.#opened.view === view ? this.#opened.blobs : this.#blobs(view);
    const number = blobs.findIndex(({ end }) => meshlet < end.meshlets);
    if (!Number.isInteger(meshlet) || meshlet < 0 || number < 0)
      throw new RangeError(`there is no meshlet ${meshlet} of ${blobs.at(-1).end.meshlets}`);
    const open = this.#opened.number ?? blobs.length - 1;
    this.#opened = {}; // an error closes the view
    return named(blobs.length > 1, number, () => {
      const blob = blobs[number];
      if (open !== number) this.#open(blob.bytes);
      const decoded = this.#meshlet(blob, meshlet - blob.begin.meshlets);
      this.#opened = { view, blobs, number };
      return decoded;
    });
  }

  get memoryBytes() {
    return this.#exports.memory.buffer.byteLength;
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
    this.#each(this.#blobs(view), () => this.#call('validate'));
  }

  // Calls action(blob) with each blob of a view open. An error names the blob if there are several.
  #each(blobs, action) {
    const several = blobs.length > 1;
    blobs.forEach((blob, number) =>
      named(several, number, () => {
        if (several) this.#open(blob.bytes);
        action(blob);
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
      named(several, blobs.length, () => this.#open(bytes));
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

  // Decodes the open blob of a plan, `step` meshlets at a time. Calls insert with their arrays and
  // the counts before them.
  #decode({ streams, begin, meshlets }, plan, step, insert) {
    const most = MESHLET_LIMIT * Math.min(meshlets, step);
    const triangles = this.#call('allocate', 3 * 4 * most);
    const stored = streams.map((_, s) => plan.storesIntegers(s));
    const widths = streams.map((stream, s) => width(stream, stored[s]));
    const places = widths.map((n) => this.#call('allocate', 4 * n * most));
    // Of integers and of values: an array per stream, or 0.
    const lists = [true, false].map((integers) => {
      const list = this.#call('allocate', 4 * places.length);
      const chosen = places.map((place, s) => (stored[s] === integers ? place : 0));
      new Uint32Array(this.#exports.memory.buffer).set(chosen, list / 4);
      return list;
    });
    const at = { ...begin };
    for (let first = 0; first < meshlets; first += step) {
      const count = Math.min(step, meshlets - first);
      const number = plan.firstVertex + begin.vertices;
      const words = this.#call('decode', first, count, number, triangles, ...lists);
      const { buffer } = this.#exports.memory; // decoding may have replaced it
      const [triangleCount, vertexCount] = new Uint32Array(buffer, words, 2);
      const indices = new Uint32Array(buffer, triangles, 3 * triangleCount);
      const values = streams.map((stream, s) => {
        const Type = arrayType(stream, stored[s]);
        return new Type(buffer, places[s], widths[s] * vertexCount);
      });
      insert({ indices, values, vertexCount }, at);
      at.triangles += triangleCount;
      at.vertices += vertexCount;
    }
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

// The decoded primitive of consecutive blobs of a view, filled in steps. Options:
// integers: of all streams, or a flag for each; total: the counts of its arrays, if they are for
// more than these blobs; firstVertex: number of the first vertex in the view.
class Plan {
  constructor(blobs, { integers = false, total = blobs.at(-1).end, firstVertex = 0 }) {
    this.blobs = blobs;
    this.integers = integers;
    this.total = total;
    this.firstVertex = firstVertex;
    this.result = {
      triangleCount: total.triangles,
      vertexCount: total.vertices,
      meshletCount: total.meshlets,
      indices: null,
      streams: blobs[0].streams.map((stream) => ({ ...stream, values: null })),
    };
  }

  storesIntegers(stream) {
    return this.integers[stream] ?? this.integers;
  }

  allocate() {
    const { result, total } = this;
    const values = result.streams.map((stream, s) => {
      const integers = this.storesIntegers(s);
      return array(arrayType(stream, integers), total.vertices * width(stream, integers));
    });
    this.adopt({ indices: array(Uint32Array, 3 * total.triangles), values });
  }

  // Takes the arrays of another plan.
  adopt({ indices, values }) {
    this.result.indices = indices;
    this.result.streams.forEach((stream, s) => (stream.values = values[s]));
  }

  arrays() {
    const { indices, streams } = this.result;
    return { indices, values: streams.map((stream) => stream.values) };
  }

  // Copies decoded arrays behind so many triangles and vertices.
  insert({ indices, values }, { triangles, vertices }) {
    this.result.indices.set(indices, 3 * triangles);
    this.result.streams.forEach((stream, s) => {
      const n = stream.values.length / this.result.vertexCount;
      stream.values.set(values[s], n * vertices);
    });
  }

  // An error of a blob; it names the blob if the view has several.
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
  return {
    bytes,
    begin,
    end,
    meshlets: end.meshlets - begin.meshlets,
    streams: readStreams(bytes),
  };
}

// The length of the blob that `rest` of a view starts with. A last blob may be malformed in its
// length: open_blob says so.
function blobLength(rest) {
  if (rest.byteLength < HEADER_BYTES) return rest.byteLength;
  const length = new DataView(rest.buffer, rest.byteOffset).getUint32(BYTE_LENGTH, true);
  const fits = length >= HEADER_BYTES && length % 4 === 0 && length < rest.byteLength;
  return fits ? length : rest.byteLength;
}

// How many numbers a vertex has in a stream: a unit vector has two integers or three floats.
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

// Runs `action`; an error names the blob if there are several.
function named(several, number, action) {
  try {
    return action();
  } catch (error) {
    throw several ? blamed(error, number) : error;
  }
}

function blamed(error, number) {
  return error instanceof MalformedError
    ? new MalformedError(`blob ${number}: ${error.message}`)
    : error;
}
