// From a page to the arrays that are drawn. Runs in Workers.
import { FLOAT } from '../../accessors.js';
import { MalformedError, sameStreams } from '../../blob.js';
import { attributeArray } from '../../components.js';
import { formatsOf, indexType, LARGEST } from './formats.js';

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
