// From decoded streams to the arrays of a primitive's accessors (specification, "glTF Schema
// Updates"). Loaders share this file.
import { Kind, MalformedError } from './blob.js';

export const EXTENSION = 'EXT_meshlet_edgebreaker';

export const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };
const FLOAT = 5126;
export const ARRAYS = {
  5120: Int8Array,
  5121: Uint8Array,
  5122: Int16Array,
  5123: Uint16Array,
  5125: Uint32Array,
  [FLOAT]: Float32Array,
};
const LIMITS = {
  5120: [-128, 127],
  5121: [0, 255],
  5122: [-32768, 32767],
  5123: [0, 65535],
  5125: [0, 4294967295],
};

// Whether a value of a JSON is an object.
export const isObject = (value) =>
  value !== null && typeof value === 'object' && !Array.isArray(value);

// Bytes of a vertex of a primitive, in all its attributes and morph targets.
export function vertexBytes(json, primitive) {
  const groups = [primitive.attributes, ...(primitive.targets ?? [])];
  const sizes = groups.flatMap(Object.values).map((number) => {
    const { componentType, type } = json.accessors[number];
    return ARRAYS[componentType].BYTES_PER_ELEMENT * COMPONENTS[type];
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}

// The numbers of all accessors of a primitive.
function accessorNumbers(primitive) {
  const groups = [primitive.attributes, ...(primitive.targets ?? [])];
  return [primitive.indices, ...groups.flatMap((attributes) => Object.values(attributes))];
}

// Calls visit(primitive, its name for messages, its accessors' numbers) for the compressed
// primitives of a file. Primitives with the same view and accessors are visited once.
export function forCompressed(json, visit) {
  const visited = new Set();
  json.meshes?.forEach((mesh, m) =>
    mesh.primitives.forEach((primitive, p) => {
      const extension = primitive.extensions?.[EXTENSION];
      if (!extension) return;
      const numbers = accessorNumbers(primitive);
      const key = [extension.bufferView, ...numbers].join();
      if (visited.has(key)) return;
      visited.add(key);
      visit(primitive, `mesh ${m} primitive ${p}`, numbers);
    }),
  );
}

// For loaders that ask for buffer views: gives each accessor of a compressed primitive a view that
// exists only in the loader. Returns a map: number of such a view -> () => promise of its bytes.
// load: number of a view of the file -> promise of its bytes. decoder: it or its promise.
export function virtualViews(json, load, decoder) {
  const views = new Map();
  forCompressed(json, (primitive, name, numbers) => {
    let arrays;
    const decode = async () => {
      try {
        const view = await load(primitive.extensions[EXTENSION].bufferView);
        const decoded = await (await decoder).decodePrimitive(view);
        return accessorArrays(json, primitive, decoded);
      } catch (error) {
        throw new Error(`${name}: ${error.message}`, { cause: error });
      }
    };
    for (const number of numbers) {
      const accessor = json.accessors[number]; // a fallback's view is not read
      accessor.bufferView = json.bufferViews.push({ buffer: 0, byteLength: 0 }) - 1;
      accessor.byteOffset = 0;
      delete accessor.sparse;
      const bytes = ({ buffer, byteOffset, byteLength }) =>
        new Uint8Array(buffer, byteOffset, byteLength);
      views.set(accessor.bufferView, async () => {
        arrays ??= decode();
        return bytes((await arrays).get(number));
      });
    }
  });
  return views;
}

// Accessor number -> its components, for all accessors of a decoded primitive. Throws
// MalformedError if the extension's object or the accessors do not fit the streams.
export function accessorArrays(json, primitive, decoded) {
  const extension = primitive.extensions[EXTENSION];
  const arrays = new Map([[primitive.indices, indexArray(json, primitive, decoded)]]);
  const add = (attributes, streams) => {
    for (const [name, number] of Object.entries(attributes))
      arrays.set(number, attributeArray(json.accessors?.[number], name, streams?.[name], decoded));
  };
  add(primitive.attributes, extension.attributes);
  primitive.targets?.forEach((target, i) => add(target, extension.targets?.[i]));
  return arrays;
}

export function expect(ok, problem) {
  if (!ok) throw new MalformedError(problem);
}

function indexArray(json, primitive, { indices, vertexCount }) {
  const accessor = json.accessors?.[primitive.indices];
  const limit = LIMITS[accessor?.componentType]?.[1];
  expect(
    accessor?.count === indices.length,
    `its indices accessor does not have ${indices.length} elements`,
  );
  expect(limit >= vertexCount - 1, "its indices accessor's component type cannot hold its indices");
  return accessor.componentType === 5125 ? indices : ARRAYS[accessor.componentType].from(indices);
}

// The components of an attribute's accessor; `first`: number of its first stream.
export function attributeArray(accessor, name, first, { streams, vertexCount }) {
  const Type = ARRAYS[accessor?.componentType];
  const components = COMPONENTS[accessor?.type];
  expect(Type !== undefined && components !== undefined, `its ${name} accessor has no valid type`);
  expect(
    accessor.count === vertexCount,
    `its ${name} accessor does not have ${vertexCount} elements`,
  );
  const parts = streamsOf(first, components, streams, name);
  const integers = accessor.componentType !== FLOAT;
  expect(
    !integers || parts.every(({ kind }) => kind !== Kind.OCT && kind !== Kind.SIGN),
    `${name} has integers, but a stream of unit vectors or signs`,
  );
  if (parts.length === 1 && parts[0].values instanceof Type) return parts[0].values;
  const array = new Type(vertexCount * components);
  let at = 0;
  for (const { values, elements, kind } of parts) {
    const width = kind === Kind.OCT ? 3 : elements;
    const round = integers && values instanceof Float32Array;
    for (let v = 0; v < vertexCount; v++)
      for (let c = 0; c < width; c++) {
        const value = values[v * width + c];
        array[v * components + at + c] = round
          ? rounded(value, LIMITS[accessor.componentType])
          : value;
      }
    at += width;
  }
  return array;
}

// The consecutive streams that fill an accessor's components.
export function streamsOf(first, components, streams, name) {
  let filled = 0;
  let end = first;
  while (filled < components) {
    const stream = streams[end++];
    expect(stream !== undefined, `there is no stream for ${name}`);
    filled += stream.kind === Kind.OCT ? 3 : stream.elements;
  }
  expect(filled === components, `the streams of ${name} do not fill its accessor's components`);
  return streams.slice(first, end);
}

// The nearest integer of a component type; half-way cases to the even one.
function rounded(value, [least, most]) {
  const floor = Math.floor(value);
  const half = value - floor === 0.5;
  const nearest = half ? floor + (floor % 2 === 0 ? 0 : 1) : Math.round(value);
  return Math.min(Math.max(nearest, least), most);
}
