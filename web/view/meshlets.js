// Geometry in which each meshlet has its own vertices, so that it can have its own colour.
import { BufferAttribute, BufferGeometry, Color } from './vendor.js';

const GOLDEN_RATIO = 0.618034;

// `index`: the vertices of the triangles, meshlet after meshlet. `counts`: triangles per meshlet.
// Returns {index, source, meshlets}: new indices; per new vertex its old number and its meshlet.
export function splitVertices(index, vertexCount, counts) {
  const seen = new Uint32Array(vertexCount); // meshlet + 1 that met a vertex last
  const renamed = new Uint32Array(vertexCount);
  const split = new Uint32Array(index.length);
  const source = new Uint32Array(index.length);
  const meshlets = new Uint32Array(index.length);
  let at = 0;
  let vertices = 0;
  counts.forEach((count, meshlet) => {
    for (const end = at + 3 * count; at < end; at++) {
      const vertex = index[at];
      if (seen[vertex] !== meshlet + 1) {
        seen[vertex] = meshlet + 1;
        renamed[vertex] = vertices;
        source[vertices] = vertex;
        meshlets[vertices++] = meshlet;
      }
      split[at] = renamed[vertex];
    }
  });
  return {
    index: split,
    source: source.slice(0, vertices),
    meshlets: meshlets.slice(0, vertices),
  };
}

// A copy of an indexed geometry with a colour for each meshlet.
export function colouredGeometry(geometry, counts) {
  const { index, source, meshlets } = splitVertices(
    geometry.index.array,
    geometry.attributes.position.count,
    counts,
  );
  const coloured = new BufferGeometry();
  coloured.setIndex(new BufferAttribute(index, 1));
  for (const [name, attribute] of Object.entries(geometry.attributes))
    coloured.setAttribute(name, gathered(attribute, source));
  for (const [name, targets] of Object.entries(geometry.morphAttributes))
    coloured.morphAttributes[name] = targets.map((target) => gathered(target, source));
  coloured.morphTargetsRelative = geometry.morphTargetsRelative;
  coloured.boundingBox = geometry.boundingBox?.clone() ?? null;
  coloured.boundingSphere = geometry.boundingSphere?.clone() ?? null;
  const palette = colours(counts.length);
  const values = new Uint8Array(4 * source.length);
  meshlets.forEach((meshlet, v) =>
    values.set(palette.subarray(4 * meshlet, 4 * meshlet + 4), 4 * v),
  );
  coloured.setAttribute('color', new BufferAttribute(values, 4, true));
  return coloured;
}

function gathered(attribute, source) {
  const { itemSize, normalized } = attribute;
  const array = new attribute.array.constructor(itemSize * source.length);
  const { array: from, stride = itemSize } = attribute.data ?? attribute; // interleaved or not
  source.forEach((vertex, to) => {
    for (let c = 0; c < itemSize; c++)
      array[itemSize * to + c] = from[stride * vertex + (attribute.offset ?? 0) + c];
  });
  return new BufferAttribute(array, itemSize, normalized);
}

// RGBA, 8 bits each. Consecutive meshlets, which are neighbours, get hues far apart.
function colours(count) {
  const palette = new Uint8Array(4 * count);
  const colour = new Color();
  for (let m = 0; m < count; m++) {
    colour.setHSL((m * GOLDEN_RATIO) % 1, 0.5 + 0.1 * (m % 4), 0.3 + 0.08 * (m % 3));
    palette.set([...colour.toArray().map((c) => Math.round(255 * c)), 255], 4 * m);
  }
  return palette;
}
