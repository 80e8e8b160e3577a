// From decoded streams to the arrays of a primitive's accessors (specification, "glTF Schema
// Updates"). Loaders share this file.
import { ARRAYS, COMPONENTS, EXTENSION, expect } from './accessors.js';
import { attributeArray, LIMITS } from './components.js';

export { ARRAYS, COMPONENTS, EXTENSION };

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
