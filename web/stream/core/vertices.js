// From a page to the arrays that are drawn: integers where WebGL takes them. Runs in Workers.

import { ARRAYS, attributeArray, COMPONENTS, streamsOf } from '../../accessors.js';
import { Kind, MalformedError, sameStreams } from '../../blob.js';

const FLOAT = 5126;
const NARROW_BITS = 16; // of positions that are stored as 16-bit integers
const LARGEST = 65535;

// How a page's attributes are stored, from the streams of the pages and attributes, {name, first,
// accessor}: {name, Type, size, normalized, bytes, components, and of positions scale and offset}:
// value = offset + scale * stored. Size: components, filled up to 4 bytes. bytes: of a vertex.
// Throws MalformedError.
export function formatsOf(attributes, streams) {
  return attributes.map(({ name, first, accessor }) => {
    const components = COMPONENTS[accessor?.type];
    const Own = ARRAYS[accessor?.componentType];
    if (!components || !Own) throw new MalformedError(`its ${name} accessor has no valid type`);
    const parts = streamsOf(first, components, streams, name);
    const kinds = parts.map(({ kind }) => kind);
    const format = (Type, normalized, more = {}) => {
      const width = Type.BYTES_PER_ELEMENT;
      const size = (components * width) % 4 === 0 ? components : 4 * Math.ceil(components / 4);
      return { name, Type, size, normalized, bytes: size * width, components, ...more };
    };
    if (accessor.componentType !== FLOAT) return format(Own, accessor.normalized === true);
    if (name === 'POSITION' && kinds[0] === Kind.GRID && parts[0].bits <= NARROW_BITS) {
      const { step, offset } = parts[0];
      return format(Uint16Array, true, { scale: LARGEST * step, offset: offset.slice(0, 3) });
    }
    if (kinds.includes(Kind.OCT)) return format(Int16Array, true);
    if (parts.length === 1 && kinds[0] === Kind.GRID && fitsUnit(parts[0], components))
      return format(Uint16Array, true);
    return format(Float32Array, false);
  });
}

// Whether all values lie in 0 to 1, but for half a grid step.
function fitsUnit({ step, offset, bits }, components) {
  const margin = Math.abs(step) / 2;
  const span = (2 ** bits - 1) * step;
  return offset
    .slice(0, components)
    .every((o) => Math.min(o, o + span) >= -margin && Math.max(o, o + span) <= 1 + margin);
}

// The arrays' type for indices of so many vertices.
export const indexType = (vertices) => (vertices > LARGEST + 1 ? Uint32Array : Uint16Array);

// A task of Workers. expected: {triangles, vertices, clusters, streams}, by the tables and the
// first page. packed: null, or of a page in the transport form {module, size}:
// its unpacker's, and the bytes of the unpacked page. Returns {indices, values, triangles, memory}:
// an array of each format, the triangles of each meshlet, and the bytes of the decoder's memory.
// Each meshlet is packed at once, so that a page is never in memory as the decoder's wide integers.
export async function decodePage(decoder, given, { attributes, expected, packed }, tools) {
  const unpack = packed && (await tools.unpackerOf(packed.module));
  const bytes = unpack ? unpack.unpackPage({ bytes: given, size: packed.size }) : given;
  const blobs = decoder.blobs(bytes);
  const [{ triangleCount, vertexCount, meshletCount, streams }] = blobs;
  const counts = [triangleCount, vertexCount, meshletCount];
  const stated = [expected.triangles, expected.vertices, expected.clusters];
  if (blobs.length > 1 || counts.some((count, i) => count !== stated[i]))
    throw new MalformedError('it has other counts than the tables say');
  if (!sameStreams(streams, expected.streams))
    throw new MalformedError('its streams differ from those of the first page');
  const formats = formatsOf(attributes, streams);
  const triangles = new Uint8Array(meshletCount);
  const indices = new (indexType(vertexCount))(3 * triangleCount);
  const values = formats.map(({ Type, size }) => new Type(size * vertexCount));
  const integers = streams.map((_, s) =>
    attributes.some(({ first }, a) => first === s && formats[a].scale !== undefined),
  );
  let meshlet = 0;
  decoder.decodeEach(bytes, integers, (part, at) => {
    triangles[meshlet++] = part.indices.length / 3;
    indices.set(part.indices, 3 * at.triangles);
    const decoded = {
      vertexCount: part.vertexCount,
      streams: streams.map((stream, s) => ({ ...stream, values: part.values[s] })),
    };
    formats.forEach((format, a) => {
      const begin = format.size * at.vertices;
      const array = values[a].subarray(begin, begin + format.size * part.vertexCount);
      pack(array, format, attributes[a], decoded);
    });
  });
  const memory = decoder.memoryBytes + (unpack ? unpack.memoryBytes : 0);
  return { indices, values, triangles, memory };
}

// Fills an array of a format with what a meshlet's streams decode to.
function pack(packed, format, { name, first, accessor }, decoded) {
  const { Type, size, components, normalized, scale } = format;
  const { vertexCount, streams } = decoded;
  if (size > components && name.startsWith('COLOR')) packed.fill(Type === Float32Array ? 1 : -1);
  const isInteger = accessor.componentType !== FLOAT || scale !== undefined;
  const source =
    scale === undefined
      ? attributeArray({ ...accessor, count: vertexCount }, name, first, decoded)
      : streams[first].values;
  const factor = isInteger || !normalized ? 1 : Type === Uint16Array ? LARGEST : LARGEST >> 1;
  for (let v = 0; v < vertexCount; v++)
    for (let c = 0; c < components; c++) {
      const value = source[components * v + c];
      packed[size * v + c] = factor === 1 ? value : Math.round(clamp(value, Type) * factor);
    }
}

const clamp = (value, Type) => Math.min(Math.max(value, Type === Uint16Array ? 0 : -1), 1);
