// How pages are stored in the arrays that are drawn: integers where WebGL takes them.
import { ARRAYS, COMPONENTS, FLOAT, streamsOf } from '../../accessors.js';
import { Kind, MalformedError } from '../../blob.js';

const NARROW_BITS = 16; // of positions that are stored as 16-bit integers
export const LARGEST = 65535;

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
