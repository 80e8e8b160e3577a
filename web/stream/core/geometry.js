// Memory for the decoded pages of one layout, which grows up to a size. Pages lie in chunks of
// vertices and of triangles, which need not follow one another: there is no fragmentation, and a page
// fits exactly if enough chunks are free.

// Half a chunk is lost for each page: 1 % of pages of 32 KiB, 5 % of the coarsest of 58 small models.
const VERTEX_CHUNK = 64;
const TRIANGLE_CHUNK = 128;
const INDEX_BYTES = 4;

export const chunksOf = (vertices, triangles) => ({
  vertices: Math.ceil(vertices / VERTEX_CHUNK),
  triangles: Math.ceil(triangles / TRIANGLE_CHUNK),
});

// Bytes of chunks, {vertices, triangles}.
function chunkBytes(formats, { vertices, triangles }) {
  const vertexBytes = formats.reduce((sum, { bytes }) => sum + bytes, 0);
  return vertices * VERTEX_CHUNK * vertexBytes + triangles * TRIANGLE_CHUNK * 3 * INDEX_BYTES;
}

// Bytes of pages with so many vertices and triangles.
export const geometryBytes = (formats, vertices, triangles) =>
  chunkBytes(formats, chunksOf(vertices, triangles));

// The capacity of a pool for some pages: with room for `always`, which are some of them, and for a
// share, 0 to 1, of the others.
export function capacityOf(pages, always, share) {
  const capacity = (kind) => {
    const sum = (some) => some.reduce((all, { chunks }) => all + chunks[kind], 0);
    return sum(always) + Math.floor((sum(pages) - sum(always)) * share);
  };
  return { vertices: capacity('vertices'), triangles: capacity('triangles') };
}

// Where a pool's pages lie unless an engine has moved them: in arrays, of which it makes buffers.
class Arrays {
  #pool;

  constructor(pool) {
    this.#pool = pool;
    this.all = [...pool.formats.map(({ Type }) => new Type(0)), new Uint32Array(0)];
  }

  resize(lengths) {
    this.all = this.all.map((array, a) => {
      if (array.length === lengths[a]) return array;
      const other = new array.constructor(lengths[a]);
      other.set(array.subarray(0, lengths[a]));
      return other;
    });
    this.#pool.resized();
  }

  write(a, begin, part) {
    this.all[a].set(part, begin);
    this.#pool.written(this.all[a], begin, begin + part.length);
  }

  read(a, begin, end) {
    return this.all[a].subarray(begin, end);
  }

  release() {}
}

// moves.js changes its store, too.
export class GeometryPool {
  // Takes memory when it needs it.
  constructor(formats, capacity) {
    this.formats = formats;
    this.capacity = capacity;
    // Called with an array and the elements [begin, end) that were written.
    this.written = (_array, _begin, _end) => {};
    this.resized = () => {}; // called when there are new arrays, with what the earlier ones held
    this.useArrays();
    this.clear();
  }

  // Of a chunk; for moves.js.
  static sizes = { vertices: VERTEX_CHUNK, triangles: 3 * TRIANGLE_CHUNK };

  useArrays() {
    this.store = new Arrays(this);
  }

  clear() {
    this.vertices = new Chunks();
    this.triangles = new Chunks();
  }

  // Of the formats; none if the pages lie in buffers of an engine.
  get arrays() {
    return this.store.all?.slice(0, -1) ?? [];
  }

  get index() {
    return this.store.all?.at(-1) ?? null;
  }

  get counts() {
    const { vertices, triangles } = this;
    return {
      vertices: VERTEX_CHUNK * vertices.count,
      indices: 3 * TRIANGLE_CHUNK * triangles.count,
    };
  }

  // Elements of each array, and of the index.
  get lengths() {
    const { vertices, indices } = this.counts;
    return [...this.formats.map(({ size }) => size * vertices), indices];
  }

  // Makes memory for a page, which fits: at least twice as much as there was.
  #grow({ vertices, triangles }) {
    const moreVertices = this.vertices.grow(vertices, this.capacity.vertices);
    const moreTriangles = this.triangles.grow(triangles, this.capacity.triangles);
    if (moreVertices || moreTriangles) this.store.resize(this.lengths);
  }

  // Whether it has more memory than its capacity, which may have become less.
  get isTooLarge() {
    const { vertices, triangles } = this.capacity;
    return this.vertices.count > vertices || this.triangles.count > triangles;
  }

  // Bytes with a capacity.
  bytesOf(capacity) {
    return chunkBytes(this.formats, capacity);
  }

  get byteLength() {
    return this.bytesOf({ vertices: this.vertices.count, triangles: this.triangles.count });
  }

  // Whether it could hold so many chunks.
  holds({ vertices, triangles }) {
    return vertices <= this.capacity.vertices && triangles <= this.capacity.triangles;
  }

  fits({ chunks }) {
    return this.holds({
      vertices: this.vertices.used + chunks.vertices,
      triangles: this.triangles.used + chunks.triangles,
    });
  }

  // Copies a decoded page, which fits. Returns its place.
  insert({ chunks }, { indices, values, triangles }) {
    this.#grow(chunks);
    const vertexChunks = this.vertices.take(chunks.vertices);
    const triangleChunks = this.triangles.take(chunks.triangles);
    this.formats.forEach(({ size }, a) =>
      this.#copy(values[a], a, vertexChunks, size * VERTEX_CHUNK),
    );
    const placed = new Uint32Array(indices.length);
    for (let i = 0; i < indices.length; i++)
      placed[i] =
        VERTEX_CHUNK * vertexChunks[(indices[i] / VERTEX_CHUNK) | 0] + (indices[i] % VERTEX_CHUNK);
    this.#copy(placed, this.formats.length, triangleChunks, 3 * TRIANGLE_CHUNK);
    const ends = new Uint32Array(triangles.length + 1); // triangles before each meshlet
    for (let m = 0; m < triangles.length; m++) ends[m + 1] = ends[m] + triangles[m];
    return { vertexChunks, triangleChunks, ends };
  }

  // Copies to chunks of so many elements.
  #copy(from, a, chunks, width) {
    for (let i = 0, end; i < chunks.length; i = end) {
      for (end = i + 1; chunks[end] === chunks[i] + end - i; ) end++;
      this.store.write(a, chunks[i] * width, from.subarray(i * width, end * width));
    }
  }

  remove({ vertexChunks, triangleChunks }) {
    this.vertices.give(vertexChunks);
    this.triangles.give(triangleChunks);
  }

  // Calls ranges.add(first index, number of indices) for the meshlets [first, first + count) of a
  // page.
  addRanges({ triangleChunks, ends }, first, count, ranges) {
    let at = ends[first];
    const end = ends[first + count];
    while (at < end) {
      const chunk = (at / TRIANGLE_CHUNK) | 0;
      const stop = Math.min(end, (chunk + 1) * TRIANGLE_CHUNK);
      const begin = triangleChunks[chunk] * TRIANGLE_CHUNK + (at % TRIANGLE_CHUNK);
      ranges.add(3 * begin, 3 * (stop - at));
      at = stop;
    }
  }
}

// Which of the chunks are free.
class Chunks {
  #taken = new Uint8Array(0);
  used = 0;

  get count() {
    return this.#taken.length;
  }

  // Makes some free: so many more fit, and there are at most so many. Returns whether there are more.
  grow(more, most) {
    const needed = this.used + more;
    if (needed <= this.count) return false;
    const taken = new Uint8Array(Math.max(needed, Math.min(2 * this.count, most)));
    taken.set(this.#taken);
    this.#taken = taken;
    return true;
  }

  // The numbers of chunks: the first that follow one another, else the first that are free.
  take(count) {
    const used = this.#taken;
    let begin = 0;
    while (begin + count <= used.length) {
      const stop = used.subarray(begin, begin + count).lastIndexOf(1);
      if (stop < 0) break;
      begin += stop + 1;
    }
    if (begin + count > used.length) begin = 0;
    const taken = new Uint32Array(count);
    for (let chunk = begin, n = 0; n < count; chunk++) {
      if (used[chunk]) continue;
      used[chunk] = 1;
      taken[n++] = chunk;
    }
    this.used += count;
    return taken;
  }

  give(chunks) {
    for (const chunk of chunks) this.#taken[chunk] = 0;
    this.used -= chunks.length;
  }
}
