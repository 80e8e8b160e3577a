// Decodes blobs of EXT_meshlet_edgebreaker on the GPU, into buffers that a renderer draws from.
// Nothing is read back. webgpu.d.ts documents what this module exports.
import { Kind, createDecoder } from './decoder.js';

const MESHLET_TRIANGLES = 64;
const MESHLET_VERTICES = 64;
const SCRATCH_BYTES = 32 * 2 ** 20; // default: of the integers of some meshlets at a time
const WORKGROUPS = 65535; // of a dispatch, by WebGPU's default limits
const CONNECTED_BYTES = 48; // of a meshlet in shaders/decoders/decode_buffers.glsl
const PLACES_BYTES = 64;
const PACKED_POSITION_BITS = 21;

// Decoders: the shaders that all meshlets need first, those that a range of meshlets needs then,
// each with the meshlets of a workgroup, the layout of the values, and the capacities
// (build_wgsl.py).
const METHODS = {
  serial: { all: {}, range: { decode: 32 }, layout: plainLayout, streams: 64, elements: 256 },
  passes: {
    all: { connect: 32, lengths: 8 },
    range: { corners: 8, chains: 8, interior: 1 },
    layout: packedLayout,
    streams: 8,
    elements: 20,
  },
};
const OUTPUT = ['attribute', 'ranges', 'indices'];

// The fields of the uniform buffer (shaders/web/wgsl.glsl), in order.
const PUSH = ['blob_words', 'meshlets', 'streams', 'value_words', 'first'];
const PUSH_ATTRIBUTE = ['stream', 'base', 'stride', 'field', 'integers'];
const PUSH_BYTES = 256; // WebGPU's default alignment of offsets of uniform buffers

export async function decodeToGPU(device, blob, options = {}) {
  const { decoder = createDecoder(), label = 'meshlets' } = options;
  const wasm = await decoder;
  const blobs = wasm.blobs(blob);
  if (blobs.length !== 1)
    throw new RangeError(`the view has ${blobs.length} blobs; decode each of decoder.blobs(view)`);
  const method = METHODS[options.method ?? bestMethod(blobs[0])];
  const names = [...Object.keys(method.all), ...Object.keys(method.range), ...OUTPUT];
  const modules = await shaders(device, names);
  const job = new Job(device, modules, method, blobs[0], options, label);
  return job.run(wasm);
}

function bestMethod({ streams }) {
  const { streams: most, elements } = METHODS.passes;
  const sum = streams.reduce((all, stream) => all + stream.elements, 0);
  return streams.length <= most && sum <= elements ? 'passes' : 'serial';
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
    const { bytes, meshletCount, triangleCount, streams } = this.#blob;
    const { integers = false, streams: wanted = streams.map((_, s) => s) } = this.#options;
    for (const s of wanted)
      if (!streams[s]) throw new RangeError(`there is no stream ${s} of ${streams.length}`);
    const results = wanted.map((s) => ({ ...streams[s], stream: s, ...format(streams[s], integers) }));
    this.#checkSizes(results);
    const { VERTEX, INDEX, INDIRECT, COPY_SRC } = GPUBufferUsage;
    const made = [];
    const keep = (name, size, usage) => {
      made.push(this.#buffer(name, size, usage | COPY_SRC | (this.#options.usage ?? 0)));
      return made.at(-1);
    };
    const primitive = {
      triangleCount,
      meshletCount,
      vertexCount: MESHLET_VERTICES * meshletCount,
      indices: keep('indices', 12 * triangleCount, INDEX),
      indirect: keep('indirect', 20, INDIRECT),
      streams: results.map((result) => ({
        ...result,
        buffer: keep(
          `stream ${result.stream}`,
          4 * result.width * MESHLET_VERTICES * meshletCount,
          VERTEX,
        ),
      })),
      destroy: () => made.forEach((buffer) => buffer.destroy()),
    };
    const status = keep('status', 8, 0);
    primitive.byteLength = made.reduce((sum, { size }) => sum + size, 0);
    primitive.check = () => check(this.#device, status, decoder, bytes);
    this.#encode(primitive, status, integers);
    return primitive;
  }

  #checkSizes(results) {
    const { meshletCount, triangleCount } = this.#blob;
    const { maxStorageBufferBindingSize, maxBufferSize } = this.#device.limits;
    const most = Math.min(maxStorageBufferBindingSize, maxBufferSize);
    const widest = Math.max(...results.map(({ width }) => width));
    if (
      Math.max(12 * triangleCount, 4 * MESHLET_TRIANGLES * meshletCount, this.#blob.bytes.length) >
        most ||
      4 * widest * MESHLET_VERTICES * meshletCount > maxBufferSize
    )
      throw new RangeError(
        `a blob of ${triangleCount} triangles needs larger buffers than the device has ` +
          `(${most} bytes); compress it with --page-bytes`,
      );
  }

  #encode(primitive, status, integers) {
    const { bytes, meshletCount, streams } = this.#blob;
    const end = 1 + Math.max(...primitive.streams.map(({ stream }) => stream));
    const { all, range, layout } = this.#method;
    const places = layout(streams.slice(0, end));
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
    const job = {
      blob_words: bytes.length / 4,
      meshlets: meshletCount,
      streams: end,
      value_words: words,
    };
    const dispatch = (modules, count, push) =>
      Object.entries(modules).map(([module, per]) => ({ module, groups: Math.ceil(count / per), push }));
    const steps = dispatch(all, meshletCount, job);
    for (let first = 0; first < meshletCount; first += chunk) {
      const count = Math.min(chunk, meshletCount - first);
      const push = { ...job, meshlets: first + count, first };
      steps.push(...dispatch(range, count, push));
      for (const { stream, width, buffer } of primitive.streams) {
        const { begin: base, stride, field } = places[stream];
        const size = 4 * width * MESHLET_VERTICES;
        steps.push({
          module: 'attribute',
          groups: count,
          push: { ...push, stream, base, stride, field, integers: Number(integers) },
          results: { buffer, offset: size * first, size: size * count },
        });
      }
    }
    steps.push({ module: 'ranges', groups: 1, push: job });
    for (let first = 0; first < meshletCount; first += WORKGROUPS)
      steps.push({
        module: 'indices',
        groups: Math.min(WORKGROUPS, meshletCount - first),
        push: { ...job, first },
        results: { buffer: primitive.indices },
      });
    this.#submit(steps, buffers);
  }

  // Meshlets that are decoded at a time.
  #chunk(words) {
    const { maxStorageBufferBindingSize } = this.#device.limits;
    const bytes = Math.min(this.#options.scratchBytes ?? SCRATCH_BYTES, maxStorageBufferBindingSize);
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
    steps.forEach(({ module, groups, results }, i) => {
      const { pipeline, bindings } = this.#modules[module];
      const resources = {
        ...Object.fromEntries(Object.entries(buffers).map(([n, buffer]) => [n, { buffer }])),
        1: { buffer: uniforms, offset: i * PUSH_BYTES, size: PUSH_BYTES },
        10: results,
      };
      pass.setPipeline(pipeline);
      pass.setBindGroup(
        0,
        this.#device.createBindGroup({
          layout: pipeline.getBindGroupLayout(0),
          entries: bindings.map((binding) => ({ binding, resource: resources[binding] })),
        }),
      );
      pass.dispatchWorkgroups(groups);
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

// How a stream's values lie in its buffer: numbers per vertex, and the format of a vertex buffer.
function format({ kind, elements }, integers) {
  const whole = integers || kind === Kind.INTEGER;
  const width = kind === Kind.OCT && !integers ? 3 : elements;
  return { width, format: (whole ? 'uint32' : 'float32') + (width > 1 ? `x${width}` : '') };
}

// Where the values of each stream lie among those of a meshlet, in words: [begin, end), `stride`
// between vertices, and the bits of an element.

// decode.wgsl: 64 words per element.
function plainLayout(streams) {
  return consecutive(streams, ({ elements }) => ({ stride: elements, field: 0 }));
}

// The passes (shaders/decoders/packed_values.glsl).
function packedLayout(streams) {
  return consecutive(streams, ({ elements, bits }, s) => {
    const least = s === 0 ? Math.max(bits, PACKED_POSITION_BITS) : bits;
    const field = least * elements <= 64 ? least : 32;
    return { stride: Math.ceil((field * elements) / 32), field };
  });
}

function consecutive(streams, shape) {
  let end = 0;
  return streams.map((stream, s) => {
    const { stride, field } = shape(stream, s);
    return { stride, field, begin: end, end: (end += MESHLET_VERTICES * stride) };
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

const compiled = new WeakMap(); // device -> name -> promise of a pipeline and its bindings

async function shaders(device, names) {
  const known = compiled.get(device) ?? new Map();
  compiled.set(device, known);
  for (const name of names) {
    if (known.has(name)) continue;
    known.set(name, compile(device, name));
    known.get(name).catch(() => known.delete(name)); // the next call tries again
  }
  const pairs = names.map(async (name) => [name, await known.get(name)]);
  return Object.fromEntries(await Promise.all(pairs));
}

async function compile(device, name) {
  const code = await load(new URL(`./wgsl/${name}.wgsl`, import.meta.url));
  const module = device.createShaderModule({ label: name, code });
  const pipeline = await device.createComputePipelineAsync({
    label: name,
    layout: 'auto',
    compute: { module, entryPoint: 'main' },
  });
  const bindings = [...code.matchAll(/@binding\((\d+)\)/g)].map((match) => Number(match[1]));
  return { pipeline, bindings };
}

async function load(url) {
  if (url.protocol === 'file:') {
    const node = 'node:fs/promises'; // Node fetches no files; in a variable, for bundlers
    const { readFile } = await import(/* @vite-ignore */ node);
    return readFile(url, 'utf8');
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: the server answered ${response.status}`);
  return response.text();
}
