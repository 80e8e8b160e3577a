// From decoded streams to the arrays of a primitive's accessors (specification, "glTF Schema
// Updates"). Loaders share this file.
import { ARRAYS, COMPONENTS, EXTENSION, expect, FLOAT } from './accessors.js';
import { attributeArray, LIMITS } from './components.js';

export { ARRAYS, COMPONENTS, EXTENSION };

const SHORT = 5122;
const UNSIGNED_SHORT = 5123;

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
// load: number of a view of the file -> promise of its bytes. decoder: it or its promise. quantizes:
// some floats become normalised integers.
export function virtualViews(json, load, decoder, quantizes = false) {
  const views = new Map();
  const { accessors = [] } = json;
  const original = { accessors: [...accessors] };
  forCompressed(json, (primitive, name, numbers) => {
    const integers = quantizes ? quantizable(json, primitive) : new Map();
    let arrays;
    const decode = async () => {
      try {
        const view = await load(primitive.extensions[EXTENSION].bufferView);
        const decoded = await (await decoder).decodePrimitive(view);
        return accessorArrays(original, primitive, decoded);
      } catch (error) {
        throw new Error(`${name}: ${error.message}`, { cause: error });
      }
    };
    for (const number of numbers) {
      const format = integers.get(number);
      const { componentType, byteStride } = format ?? {};
      if (format) accessors[number] = { ...accessors[number], componentType, normalized: true };
      const accessor = accessors[number]; // a fallback's view is not read
      const view = { buffer: 0, byteLength: 0, ...(format && { byteStride }) };
      accessor.bufferView = json.bufferViews.push(view) - 1;
      accessor.byteOffset = 0;
      delete accessor.sparse;
      const bytes = ({ buffer, byteOffset, byteLength }) =>
        new Uint8Array(buffer, byteOffset, byteLength);
      views.set(accessor.bufferView, async () => {
        arrays ??= decode();
        const array = (await arrays).get(number);
        return bytes(format ? quantized(array, format) : array);
      });
    }
  });
  return views;
}

// Accessor number -> {componentType, components, byteStride, factor} of the floats that fit into
// normalised integers of 16 bits: directions, and texture coordinates and colours whose limits the file
// tells.
function quantizable({ accessors }, { attributes }) {
  const integers = new Map();
  for (const [name, number] of Object.entries(attributes)) {
    const { componentType, type, min, max } = accessors[number] ?? {};
    const isUnit = min?.every((value) => value >= 0) && max?.every((value) => value <= 1);
    const isDirection = name === 'NORMAL' || name === 'TANGENT';
    if (componentType !== FLOAT || !(isDirection || (/^(TEXCOORD|COLOR)_/.test(name) && isUnit)))
      continue;
    const components = COMPONENTS[type];
    const byteStride = 4 * Math.ceil(components / 2); // aligned, as glTF wants it
    const [integer, factor] = isDirection ? [SHORT, 32767] : [UNSIGNED_SHORT, 65535];
    integers.set(number, { componentType: integer, components, byteStride, factor });
  }
  return integers;
}

function quantized(floats, { componentType, components, byteStride, factor }) {
  const width = byteStride / 2;
  const integers = new ARRAYS[componentType]((floats.length / components) * width);
  for (let v = 0; v < floats.length / components; v++)
    for (let c = 0; c < components; c++)
      integers[width * v + c] = Math.round(floats[components * v + c] * factor);
  return integers;
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
