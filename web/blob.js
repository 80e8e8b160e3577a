// What the stream table of a blob says, and the error of a malformed one. Small: a page that streams
// has no need of the decoder, which is in its Workers.

export const Kind = Object.freeze({ GRID: 0, OCT: 1, INTEGER: 2, FLOAT32: 3, SIGN: 4 });

export class MalformedError extends Error {
  constructor(problem) {
    super(problem);
    this.name = 'MalformedError';
  }
}

// Offsets in the header of a blob and in its stream table (specification, appendices A.2 and A.3),
// in bytes.
export const HEADER_BYTES = 32;
const STREAM_COUNT = 5;
const STREAM_BYTES = 28;
const STREAM_STEP = 8;
const STREAM_OFFSETS = 12;

// The stream table of a blob. Checks nothing but its length: the module checks the rest.
export function readStreams(bytes) {
  const count = bytes[STREAM_COUNT];
  if (!(bytes.length >= HEADER_BYTES + STREAM_BYTES * count))
    throw new MalformedError('it ends within its stream table');
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  return Array.from({ length: count }, (_, s) => {
    const row = HEADER_BYTES + STREAM_BYTES * s;
    return {
      kind: bytes[row],
      elements: bytes[row + 1],
      bits: bytes[row + 2],
      step: data.getFloat32(row + STREAM_STEP, true),
      offset: [0, 1, 2, 3].map((c) => data.getFloat32(row + STREAM_OFFSETS + 4 * c, true)),
    };
  });
}

export function sameStreams(a, b) {
  const same = (x, y) =>
    x.kind === y.kind &&
    x.elements === y.elements &&
    x.bits === y.bits &&
    x.step === y.step &&
    x.offset.every((offset, c) => offset === y.offset[c]);
  return a.length === b.length && a.every((stream, s) => same(stream, b[s]));
}
