// Arrays for the decoded pages of one layout, which grow up to a size. Pages lie in chunks of vertices and of
// triangles, which need not follow one another: there is no fragmentation, and a page fits exactly
// if enough chunks are free.

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

export class GeometryPool {
  #vertices;
  #triangles;

  // pages: those that may come. Has room for `always`, which are some of them, and for a share, 0 to
  // 1, of the others. Takes memory when it needs it.
  constructor(formats, pages, always, share) {
    this.formats = formats;
    const capacity = (kind) => {
      const sum = (some) => some.reduce((all, { chunks }) => all + chunks[kind], 0);
      return sum(always) + Math.floor((sum(pages) - sum(always)) * share);
    };
    this.written = (_array, _begin, _end) => {}; // called with an array and the elements [begin, end) that were written
    this.resized = () => {}; // called when there are new arrays, with what the earlier ones held
    this.capacity = { vertices: capacity('vertices'), triangles: capacity('triangles') };
    this.#clear();
  }

  #clear() {
    this.#vertices = new Chunks();
    this.#triangles = new Chunks();
    this.arrays = this.formats.map(({ Type }) => new Type(0));
    this.index = new Uint32Array(0);
  }

  // Makes memory for a page, which fits: at least twice as much as there was.
  #grow({ vertices, triangles }) {
    const moreVertices = this.#vertices.grow(vertices, this.capacity.vertices);
    const moreTriangles = this.#triangles.grow(triangles, this.capacity.triangles);
    if (!moreVertices && !moreTriangles) return;
    const larger = (array, length) => {
      if (array.length === length) return array;
      const copy = new array.constructor(length);
      copy.set(array);
      return copy;
    };
    this.arrays = this.formats.map(({ size }, a) =>
      larger(this.arrays[a], size * VERTEX_CHUNK * this.#vertices.count),
    );
    this.index = larger(this.index, 3 * TRIANGLE_CHUNK * this.#triangles.count);
    this.resized();
  }

  // pages: those that lie here, which will fit. They get new places if it has more memory than that.
  resize(capacity, pages) {
    this.capacity = capacity;
    const { vertices, triangles } = capacity;
    if (this.#vertices.count <= vertices && this.#triangles.count <= triangles) return;
    const { arrays, index } = this;
    const numbers = new Uint32Array(this.#vertices.count); // of chunks in their page
    this.#clear();
    const sum = (kind) => pages.reduce((all, { chunks }) => all + chunks[kind], 0);
    this.#grow({ vertices: sum('vertices'), triangles: sum('triangles') });
    for (const page of pages)
      page.move(this.insert(page, this.#extract(page.place, arrays, index, numbers)));
  }

  // Bytes with a capacity.
  bytesOf(capacity) {
    return chunkBytes(this.formats, capacity);
  }

  get byteLength() {
    return this.arrays.reduce((sum, array) => sum + array.byteLength, this.index.byteLength);
  }

  // Whether it could hold so many chunks.
  holds({ vertices, triangles }) {
    return vertices <= this.capacity.vertices && triangles <= this.capacity.triangles;
  }

  fits({ chunks }) {
    return this.holds({
      vertices: this.#vertices.used + chunks.vertices,
      triangles: this.#triangles.used + chunks.triangles,
    });
  }

  // Copies a decoded page, which fits. Returns its place.
  insert({ chunks }, { indices, values, triangles }) {
    this.#grow(chunks);
    const vertexChunks = this.#vertices.take(chunks.vertices);
    const triangleChunks = this.#triangles.take(chunks.triangles);
    this.formats.forEach(({ size }, a) =>
      this.#copy(values[a], this.arrays[a], vertexChunks, size * VERTEX_CHUNK),
    );
    const place = (vertex) =>
      VERTEX_CHUNK * vertexChunks[(vertex / VERTEX_CHUNK) | 0] + (vertex % VERTEX_CHUNK);
    this.#copy(indices, this.index, triangleChunks, 3 * TRIANGLE_CHUNK, place);
    const ends = new Uint32Array(triangles.length + 1); // triangles before each meshlet
    for (let m = 0; m < triangles.length; m++) ends[m + 1] = ends[m] + triangles[m];
    return { vertexChunks, triangleChunks, ends };
  }

  // A page as it was given to insert; arrays, index: those it lies in. numbers: scratch.
  #extract({ vertexChunks, triangleChunks, ends }, arrays, index, numbers) {
    const gather = (from, chunks, width) => {
      const all = new from.constructor(chunks.length * width);
      chunks.forEach((chunk, i) => {
        all.set(from.subarray(chunk * width, (chunk + 1) * width), i * width);
      });
      return all;
    };
    const values = this.formats.map(({ size }, a) =>
      gather(arrays[a], vertexChunks, size * VERTEX_CHUNK),
    );
    vertexChunks.forEach((chunk, i) => {
      numbers[chunk] = i;
    });
    const indices = gather(index, triangleChunks, 3 * TRIANGLE_CHUNK)
      .subarray(0, 3 * ends.at(-1))
      .map((v) => VERTEX_CHUNK * numbers[(v / VERTEX_CHUNK) | 0] + (v % VERTEX_CHUNK));
    return { indices, values, triangles: ends.subarray(1).map((end, m) => end - ends[m]) };
  }

  // Copies to chunks of so many elements; convert: what becomes of an element.
  #copy(from, to, chunks, width, convert = null) {
    for (let i = 0, end; i < chunks.length; i = end) {
      for (end = i + 1; chunks[end] === chunks[i] + end - i; ) end++;
      const part = from.subarray(i * width, end * width);
      const begin = chunks[i] * width;
      if (convert) for (let k = 0; k < part.length; k++) to[begin + k] = convert(part[k]);
      else to.set(part, begin);
      this.written(to, begin, begin + part.length);
    }
  }

  remove({ vertexChunks, triangleChunks }) {
    this.#vertices.give(vertexChunks);
    this.#triangles.give(triangleChunks);
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
