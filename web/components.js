// How streams become the components of an accessor. Apart from their types: a page that streams leaves
// this to its Workers.
import { ARRAYS, COMPONENTS, expect, FLOAT, streamsOf } from './accessors.js';
import { Kind } from './blob.js';

export const LIMITS = {
  5120: [-128, 127],
  5121: [0, 255],
  5122: [-32768, 32767],
  5123: [0, 65535],
  5125: [0, 4294967295],
};

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

// The nearest integer of a component type; half-way cases to the even one.
function rounded(value, [least, most]) {
  const floor = Math.floor(value);
  const half = value - floor === 0.5;
  const nearest = half ? floor + (floor % 2 === 0 ? 0 : 1) : Math.round(value);
  return Math.min(Math.max(nearest, least), most);
}
