// Pages that change their places: when memory moves between pools, when there is less of it, or when an
// engine takes it. Loaded when it is needed: the first picture does without.
// It imports nothing, so that bundlers leave the rest of the package in one piece.

// All pages of a pool lie in another store from now on; null: in arrays. Of a store, {resize(lengths),
// write(number, begin, part), read(number, begin, end), release()}: numbers are those of formats, then of
// the index; lengths, begin and end count elements; resize keeps what was there. wasLost: what held them
// until now is no more.
export function moveTo(pool, store, wasLost) {
  const { store: before, lengths } = pool;
  if (store) pool.store = store;
  else pool.useArrays();
  pool.store.resize(lengths);
  lengths.forEach((length, a) => {
    if (length > 0) pool.store.write(a, 0, before.read(a, 0, length));
  });
  if (!wasLost) before.release();
}

// Gives memory back that is more than the capacity of a pool. Its pages that are wanted fit.
export function shrink(pool, residency) {
  for (const page of residency.unwanted(pool)) residency.evict(page);
  const pages = residency.pages.filter(({ place, owner }) => place && owner.pool === pool);
  const parts = extract(pool, pages);
  const sum = (kind) => pages.reduce((all, { chunks }) => all + chunks[kind], 0);
  pool.clear();
  pool.vertices.grow(sum('vertices'), pool.capacity.vertices);
  pool.triangles.grow(sum('triangles'), pool.capacity.triangles);
  pool.store.resize(pool.lengths);
  pages.forEach((page, i) => {
    page.move(pool.insert(page, parts[i]));
  });
}

// Forgets all pages of a pool, whose store was lost.
export function empty(pool, residency) {
  for (const page of residency.pages)
    if (page.place && page.owner.pool === pool) residency.evict(page);
  pool.clear();
}

// Moves memory between pools: needs (pool -> chunks) are their new capacities. A pool at a time, first
// those that shrink.
export function rebalance(pools, needs, residency) {
  const grows = (pool) => pool.bytesOf(needs.get(pool)) - pool.bytesOf(pool.capacity);
  const same = (a, b) => a.vertices === b.vertices && a.triangles === b.triangles;
  const [pool] = pools
    .filter((one) => !same(one.capacity, needs.get(one)))
    .sort((a, b) => grows(a) - grows(b));
  pool.capacity = needs.get(pool);
  for (const page of residency.unwanted(pool)) residency.evict(page);
  if (pool.isTooLarge) shrink(pool, residency);
}

// Pages as they were given to insert.
function extract({ store, formats, vertices, constructor: { sizes } }, pages) {
  const numbers = new Uint32Array(vertices.count); // of chunks in their page
  const gather = (Type, a, chunks, width) => {
    const all = new Type(chunks.length * width);
    chunks.forEach((chunk, i) => {
      all.set(store.read(a, chunk * width, (chunk + 1) * width), i * width);
    });
    return all;
  };
  return pages.map(({ place: { vertexChunks, triangleChunks, ends } }) => {
    const values = formats.map(({ Type, size }, a) =>
      gather(Type, a, vertexChunks, size * sizes.vertices),
    );
    vertexChunks.forEach((chunk, i) => {
      numbers[chunk] = i;
    });
    const indices = gather(Uint32Array, formats.length, triangleChunks, sizes.triangles)
      .subarray(0, 3 * ends.at(-1))
      .map((v) => sizes.vertices * numbers[(v / sizes.vertices) | 0] + (v % sizes.vertices));
    return { indices, values, triangles: ends.subarray(1).map((end, m) => end - ends[m]) };
  });
}
