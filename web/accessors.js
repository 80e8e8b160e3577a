// Types of accessors, and the streams that hold their components.
import { Kind, MalformedError } from './blob.js';

export const EXTENSION = 'EXT_meshlet_edgebreaker';
export const TRANSPORT = 'EXT_meshlet_transport';

export const COMPONENTS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };
export const FLOAT = 5126;
export const ARRAYS = {
  5120: Int8Array,
  5121: Uint8Array,
  5122: Int16Array,
  5123: Uint16Array,
  5125: Uint32Array,
  [FLOAT]: Float32Array,
};

// Whether a value of a JSON is an object.
export const isObject = (value) =>
  value !== null && typeof value === 'object' && !Array.isArray(value);

export function expect(ok, problem) {
  if (!ok) throw new MalformedError(problem);
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
