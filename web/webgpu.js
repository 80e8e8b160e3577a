// Decodes blobs of EXT_meshlet_edgebreaker on the GPU, into buffers that a renderer draws from.
// Nothing is read back. webgpu.d.ts documents what this module exports.
import { createDecoder, Kind } from './decoder.js';

const MESHLET_TRIANGLES = 64;
const MESHLET_VERTICES = 64;
const SCRATCH_BYTES = 32 * 2 ** 20; // default: of the integers of some meshlets at a time
const WORKGROUPS = 65535; // of a dispatch, by WebGPU's default limits
const CONNECTED_BYTES = 48; // of a meshlet in shaders/decoders/decode_buffers.glsl
const PLACES_BYTES = 64;
const PACKED_POSITION_BITS = 21;

// Compute shaders with the meshlets of a workgroup, in the order in which they run: those for all
// meshlets, then, for some meshlets at a time, those of a method.
const FIRST = { connect: 32, lengths: 8 };
const METHODS = {
  interior: { corners: 8, chains: 8, interior: 1 },
  traversal: { corners: 8, chains: 8, traversal: 64, geo: 2 },
};
// From here on `traversal` is faster. On an H200 it takes 0.66 ms in place of 0.35 for 1,108 meshlets
// and 0.79 in place of 0.50 for 2,509, but 0.26 in place of 0.29 for 4,381, 0.45 in place of 0.73 for
// 14,227 and 1.19 in place of 2.55 for 56,884 (bench/results/webgpu.json).
const MANY_MESHLETS = 4000;
const INTERIOR_STREAMS = 8; // capacities of `interior`, whose values lie in workgroup memory
const INTERIOR_ELEMENTS = 20;
// Threads of connect per meshlet, of which one decodes it: threads side by side that take
// different branches wait for each other, and few meshlets do not fill a GPU. For 1,108 meshlets all
// steps together take 0.35 ms in place of 0.41.
const SPREAD = 16;
const SPLIT = ['corners', 'chains', 'traversal']; // have a row of workgroups for each stream
const PASSES = ['lengths', 'corners', 'chains', 'traversal', 'geo']; // share a file, passes.wgsl
const OUTPUT = ['attribute', 'ranges', 'indices'];

// The fields of the uniform buffer (shaders/web/wgsl.glsl), in order.
const PUSH = ['blob_words', 'meshlets', 'streams', 'value_words', 'spread', 'first'];
const PUSH_ATTRIBUTE = ['stream', 'base', 'stride', 'field', 'integers'];
const PUSH_BYTES = 256; // WebGPU's default alignment of offsets of uniform buffers

export async function decodeToGPU(device, blob, options = {}) {
  const { decoder = createDecoder(), label = 'meshlets' } = options;
  const wasm = await decoder;
  const blobs = wasm.blobs(blob);
  if (blobs.length !== 1)
    throw new RangeError(`the view has ${blobs.length} blobs; decode each of decoder.blobs(view)`);
  const method = chooseMethod(blobs[0], options.method);
  const names = [...Object.keys(FIRST), ...Object.keys(method), ...OUTPUT];
  const modules = await shaders(device, names);
  const job = new Job(device, modules, method, blobs[0], options, label);
  return guarded(device, () => job.run(wasm));
}

// The shaders of a method: the named one, or the faster one.
function chooseMethod({ streams, meshletCount }, name) {
  const elements = streams.reduce((sum, stream) => sum + stream.elements, 0);
  const fits = streams.length <= INTERIOR_STREAMS && elements <= INTERIOR_ELEMENTS;
  const wanted = name ?? (fits && meshletCount < MANY_MESHLETS ? 'interior' : 'traversal');
  if (!METHODS[wanted] || (wanted === 'interior' && !fits))
    throw new RangeError(`${streams.length} streams of ${elements} elements: no method ${wanted}`);
  return METHODS[wanted];
}

// Rejects with the device's error if `action`, which returns a primitive, causes one.
async function guarded(device, action) {
  const scopes = ['validation', 'out-of-memory'];
  scopes.forEach((scope) => device.pushErrorScope(scope));
  let primitive;
  let errors;
  try {
    primitive = action();
  } finally {
    errors = scopes.map(() => device.popErrorScope());
  }
  const error = (await Promise.all(errors)).find((found) => found !== null);
  if (!error) return primitive;
  primitive.destroy();
  throw new Error(`the GPU cannot decode it: ${error.message || 'out of memory'}`);
}

class Job {
  #device;
  #modules;
  #method;
  #blob;
  #label;
  #options;
  #scratch = []; // buffers that only this job needs

  constructor(device, modules, method, blob, options, label) {
    this.#device = device;
    this.#modules = modules;
    this.#method = method;
    this.#blob = blob;
    this.#options = options;
    this.#label = label;
  }

  run(decoder) {
    const { bytes, meshletCount, triangleCount } = this.#blob;
    const streams = this.#wanted();
    this.#checkSizes(streams);
    const { VERTEX, INDEX, INDIRECT } = GPUBufferUsage;
    const made = [];
    const keep = (name, size, usage) => {
      const all = usage | GPUBufferUsage.COPY_SRC | (this.#options.usage ?? 0);
      made.push(this.#buffer(name, size, all));
      return made.at(-1);
    };
    const vertexCount = MESHLET_VERTICES * meshletCount;
    const primitive = {
      triangleCount,
      meshletCount,
      vertexCount,
      indices: keep('indices', 12 * triangleCount, INDEX),
      indirect: keep('indirect', 20, INDIRECT),
      streams: streams.map((stream) => ({
        ...stream,
        buffer: keep(`stream ${stream.stream}`, 4 * stream.width * vertexCount, VERTEX),
      })),
      destroy: () => made.forEach((buffer) => buffer.destroy()),
    };
    const status = keep('status', 8, 0);
    primitive.byteLength = made.reduce((sum, { size }) => sum + size, 0);
    primitive.check = () => check(this.#device, status, decoder, bytes);
    this.#decode(primitive, status);
    return primitive;
  }

  #wanted() {
    const { streams } = this.#blob;
    const { integers = false, streams: wanted = [...streams.keys()] } = this.#options;
    for (const s of wanted)
      if (!streams[s]) throw new RangeError(`there is no stream ${s} of ${streams.length}`);
    return wanted.map((s) => ({ ...streams[s], stream: s, ...format(streams[s], integers) }));
  }

  // Threads of the first pass for a meshlet.
  get #spread() {
    return this.#method === METHODS.interior ? SPREAD : 1;
  }

  #checkSizes(streams) {
    const { bytes, meshletCount, triangleCount } = this.#blob;
    const { maxStorageBufferBindingSize, maxBufferSize } = this.#device.limits;
    const most = Math.min(maxStorageBufferBindingSize, maxBufferSize);
    const widest = Math.max(0, ...streams.map(({ width }) => width));
    const bound = [12 * triangleCount, 4 * MESHLET_TRIANGLES * meshletCount, bytes.length];
    const fits =
      Math.max(...bound) <= most && 4 * widest * MESHLET_VERTICES * meshletCount <= maxBufferSize;
    const mostMeshlets = Math.min(FIRST.connect / this.#spread, FIRST.lengths) * WORKGROUPS;
    if (meshletCount > mostMeshlets)
      throw new RangeError(
        `a blob of ${meshletCount} meshlets takes more workgroups than a dispatch may have ` +
          `(${mostMeshlets} meshlets); compress it with --page-bytes`,
      );
    if (!fits)
      throw new RangeError(
        `a blob of ${triangleCount} triangles needs larger buffers than the device has ` +
          `(${most} bytes); compress it with --page-bytes`,
      );
  }

  #decode(primitive, status) {
    const { bytes, meshletCount, streams } = this.#blob;
    const end = 1 + Math.max(0, ...primitive.streams.map(({ stream }) => stream));
    const places = packedLayout(streams.slice(0, end));
    const words = places.at(-1).end;
    const chunk = this.#chunk(words);
    const buffers = {
      0: this.#upload('blob', bytes),
      2: this.#temporary('summaries', 4 * meshletCount),
      3: this.#temporary('triangles', 4 * MESHLET_TRIANGLES * meshletCount),
      4: this.#temporary('values', 4 * words * Math.min(chunk, meshletCount)),
      5: this.#temporary('connectivity', CONNECTED_BYTES * meshletCount),
      6: this.#temporary('places', PLACES_BYTES * meshletCount),
      7: this.#temporary('ranges', 4 * meshletCount),
      8: primitive.indirect,
      9: status,
    };
    const push = {
      blob_words: bytes.length / 4,
      meshlets: meshletCount,
      streams: end,
      value_words: words,
      spread: this.#spread,
    };
    /** @type {any[]} */
    const steps = dispatches(FIRST, meshletCount, push);
    for (const range of ranges(meshletCount, chunk)) {
      steps.push(...dispatches(this.#method, range.count, { ...push, ...range.push }));
      for (const stream of primitive.streams)
        steps.push(this.#attribute(stream, places[stream.stream], range, push));
    }
    steps.push({ module: 'ranges', groups: 1, push });
    for (const range of ranges(meshletCount, WORKGROUPS)) {
      const results = { buffer: primitive.indices };
      const some = { ...push, ...range.push };
      steps.push({ module: 'indices', groups: range.count, push: some, results });
    }
    this.#submit(steps, buffers);
  }

  #attribute({ stream, width, buffer }, { begin: base, stride, field }, range, push) {
    const size = 4 * width * MESHLET_VERTICES;
    const integers = Number(this.#options.integers ?? false);
    return {
      module: 'attribute',
      groups: range.count,
      push: { ...push, ...range.push, stream, base, stride, field, integers },
      results: { buffer, offset: size * range.push.first, size: size * range.count },
    };
  }

  // Meshlets that are decoded at a time.
  #chunk(words) {
    const { scratchBytes = SCRATCH_BYTES } = this.#options;
    const bytes = Math.min(scratchBytes, this.#device.limits.maxStorageBufferBindingSize);
    return Math.min(WORKGROUPS, Math.max(1, Math.floor(bytes / (4 * words))));
  }

  #submit(steps, buffers) {
    const pushes = new Uint32Array((steps.length * PUSH_BYTES) / 4);
    steps.forEach(({ push }, i) =>
      [...PUSH, ...PUSH_ATTRIBUTE].forEach((name, word) => {
        pushes[(i * PUSH_BYTES) / 4 + word] = push[name] ?? 0;
      }),
    );
    const uniforms = this.#upload('steps', new Uint8Array(pushes.buffer), GPUBufferUsage.UNIFORM);
    const encoder = this.#device.createCommandEncoder({ label: this.#label });
    const pass = encoder.beginComputePass({ label: this.#label });
    steps.forEach(({ module, groups, rows = 1, results }, i) => {
      const { pipeline, layout, bindings } = this.#modules[module];
      const resources = {
        ...Object.fromEntries(Object.entries(buffers).map(([n, buffer]) => [n, { buffer }])),
        1: { buffer: uniforms, offset: i * PUSH_BYTES, size: PUSH_BYTES },
        10: results,
      };
      pass.setPipeline(pipeline);
      pass.setBindGroup(
        0,
        this.#device.createBindGroup({
          layout,
          entries: bindings.map((binding) => ({ binding, resource: resources[binding] })),
        }),
      );
      pass.dispatchWorkgroups(groups, rows);
    });
    pass.end();
    this.#device.queue.submit([encoder.finish()]);
    for (const buffer of this.#scratch) buffer.destroy(); // once the GPU has finished
  }

  #buffer(name, size, usage) {
    const label = `${this.#label} ${name}`;
    return this.#device.createBuffer({ label, size, usage: usage | GPUBufferUsage.STORAGE });
  }

  #temporary(name, size, usage = 0) {
    this.#scratch.push(this.#buffer(name, size, usage));
    return this.#scratch.at(-1);
  }

  #upload(name, bytes, usage = 0) {
    const buffer = this.#temporary(name, bytes.length, usage | GPUBufferUsage.COPY_DST);
    this.#device.queue.writeBuffer(buffer, 0, bytes);
    return buffer;
  }
}

// The dispatches of modules, as in METHODS, for `count` meshlets.
function dispatches(modules, count, push) {
  return Object.entries(modules).map(([module, size]) => {
    const rows = SPLIT.includes(module) ? push.streams : 1;
    const threads = module === 'connect' ? push.spread : 1;
    return { module, groups: Math.ceil((count * threads) / size), rows, push };
  });
}

// Meshlets [first, meshlets) for the shaders, `size` at a time.
function ranges(total, size) {
  return Array.from({ length: Math.ceil(total / size) }, (_, i) => {
    const first = i * size;
    const count = Math.min(size, total - first);
    return { count, push: { first, meshlets: first + count } };
  });
}

// How a stream's values lie in its buffer: numbers per vertex, and the format of a vertex buffer.
function format({ kind, elements }, integers) {
  const whole = integers || kind === Kind.INTEGER;
  const width = kind === Kind.OCT && !integers ? 3 : elements;
  return { width, format: (whole ? 'uint32' : 'float32') + (width > 1 ? `x${width}` : '') };
}

// Where the values of each stream lie among those of a meshlet (shaders/decoders/packed_values.glsl),
// in words: [begin, end), `stride` between vertices, and the bits of an element.
function packedLayout(streams) {
  let end = 0;
  return streams.map(({ elements, bits }, s) => {
    const least = s === 0 ? Math.max(bits, PACKED_POSITION_BITS) : bits;
    const field = least * elements <= 64 ? least : 32;
    const stride = Math.ceil((field * elements) / 32);
    const begin = end;
    end += MESHLET_VERTICES * stride;
    return { stride, field, begin, end };
  });
}

// Reads two words back. The native decoder's sentence says what is wrong.
async function check(device, status, decoder, bytes) {
  const copy = device.createBuffer({
    size: 8,
    usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST,
  });
  const encoder = device.createCommandEncoder();
  encoder.copyBufferToBuffer(status, 0, copy, 0, 8);
  device.queue.submit([encoder.finish()]);
  await copy.mapAsync(GPUMapMode.READ);
  const [malformed, first] = new Uint32Array(copy.getMappedRange());
  copy.destroy();
  if (malformed === 0) return;
  decoder.decodeMeshlet(bytes, first);
  throw new Error(`the GPU has refused meshlet ${first}, which is well formed`);
}

// --- shaders ---

const compiled = new WeakMap(); // device -> name -> promise of a module or pipeline

// The cached result of make().
function once(device, name, make) {
  const known = compiled.get(device) ?? new Map();
  compiled.set(device, known);
  if (!known.has(name)) {
    known.set(name, make());
    known.get(name).catch(() => known.delete(name)); // the next call tries again
  }
  return known.get(name);
}

// Pipelines by shader, each with its bind group layout and the numbers of its bindings.
async function shaders(device, names) {
  const pairs = names.map(async (name) => [
    name,
    await once(device, name, () => compile(device, name)),
  ]);
  return Object.fromEntries(await Promise.all(pairs));
}

async function compile(device, name) {
  const file = `${PASSES.includes(name) ? 'passes' : name}.wgsl`;
  const { module, layout, bindings } = await once(device, file, () => loadModule(device, file));
  const pipeline = await device.createComputePipelineAsync({
    label: name,
    layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
    compute: { module, entryPoint: `${name}_main` },
  });
  return { pipeline, layout, bindings };
}

const BINDING_TYPES = { read: 'read-only-storage', read_write: 'storage' };

// A file of wgsl/ and the bind group layout of all its shaders.
async function loadModule(device, file) {
  const code = await load(new URL(`./wgsl/${file}`, import.meta.url));
  const declared = [...code.matchAll(/@binding\((\d+)\) @group\(0\) var<\w+(?:, (\w+))?>/g)];
  const entries = declared.map(([, binding, access]) => ({
    binding: Number(binding),
    visibility: GPUShaderStage.COMPUTE,
    buffer: { type: BINDING_TYPES[access] ?? 'uniform' },
  }));
  return {
    module: device.createShaderModule({ label: file, code }),
    layout: device.createBindGroupLayout({ label: file, entries }),
    bindings: entries.map(({ binding }) => binding),
  };
}

async function load(url) {
  if (url.protocol === 'file:') {
    const node = 'node:fs/promises'; // Node fetches no files; in a variable, for bundlers
    const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ node);
    return readFile(url, 'utf8');
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: the server answered ${response.status}`);
  return response.text();
}
