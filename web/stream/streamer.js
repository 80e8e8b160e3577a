// Streams the primitives with levels of a file: chooses cuts for a camera, requests and decodes
// pages, and keeps them in arrays, in a fixed amount of memory. Knows no engine: an adapter gives
// the instances' matrices and the camera, and draws the ranges of the arrays.
import { compileDecoder, MalformedError, readStreams, sameStreams } from '../decoder.js';
import { EXTENSION } from '../gltf.js';
import { createDecoderPool } from '../pool.js';
import { createUnpacker, packedTable } from '../transport.js';
import { Cut, largestScale } from './cut.js';
import { openDocument, readPlaces } from './document.js';
import { GeometryPool, geometryBytes } from './geometry.js';
import { formatsOf, indexType } from './page.js';
import { delayAfter, SourceError } from './source.js';
import { LOD, readCounts, Tables } from './tables.js';

const MEGABYTE = 1e6;
const COPIES = 2; // of decoded pages: an array of ours, and the buffer on the GPU
const WORKER_BYTES = 11 * 65_536; // of WebAssembly, after pages of 32 KiB
const UNPACKER_BYTES = 0.13 * MEGABYTE; // of its WebAssembly at first,
const UNPACKING = 140; // and for each byte of the largest unpacked page: 95 to 130 were measured
const MOST_WORKERS = 4;
const SMALL = 24 * MEGABYTE; // budgets with one Worker
// Of the budget, for bytes that are requested or wait for a decoder.
const WAITING = 0.01;
const LEAST_WAITING = 0.07 * MEGABYTE; // two pages
const MOST_WAITING = 3 * MEGABYTE;
const REQUESTS = 6; // at a time: what browsers send to one server with HTTP/1.1
const REQUEST_BYTES = 131_072; // of neighbouring pages, if that many may wait
const TRIES = 3; // of a page that is malformed, or refused by the server
const INSERT_MS = 3; // a frame, for copying decoded pages
// From one frame of a flight to the next the threshold falls by less than this, mostly.
const NEAR_THRESHOLD = 0.8;

// Of the pages of the first picture, of all primitives: the coarsest level alone may be shapeless.
const FIRST_BYTES = 96 * 1024;
const HEADER_BYTES = 32 + 28 * 64; // of a blob, at most

const NONE = 0;
const REQUESTED = 1;
const STORED = 2; // compressed bytes are in memory
const DECODING_NOW = 3;
const DECODED = 4; // waits for its place
const RESIDENT = 5;

export async function openStreamer(place, options = {}) {
  const streamer = new Streamer(options);
  try {
    await streamer.open(place);
    return streamer;
  } catch (error) {
    streamer.close();
    throw ours(error);
  }
}

// A malformed file makes errors of the language, too.
function ours(error) {
  const language = [TypeError, RangeError, SyntaxError, ReferenceError];
  if (!language.some((Type) => error instanceof Type)) return error;
  const malformed = new MalformedError(`its JSON is malformed (${error.message})`);
  malformed.cause = error;
  return malformed;
}

// A primitive with levels. key: of primitives of the JSON that share everything.
class Primitive {
  constructor(key, name, primitive, counts) {
    Object.assign(this, { key, name, primitive, counts });
    this.tables = null;
    this.cut = null;
    this.pages = [];
    this.resident = null; // flags of pages
    this.priority = null; // of pages, in this frame
    this.instances = [];
    this.pool = null;
    this.streams = null;
    this.attributes = null;
    this.levels = null;
    this.firstPages = 0; // of the first picture
    this.opened = false; // they have been there
  }

  // Whether the pages of the first picture are there, but for those that do not fit or fail.
  open() {
    const { pages, firstPages, ready } = this;
    this.opened ||=
      ready &&
      pages
        .slice(0, firstPages)
        .every(({ state, wanted, tries }) => state === RESIDENT || wanted === 0 || tries > 0);
    return this.opened;
  }

  get ready() {
    for (let p = 0; p < this.tables.rootPages; p++) if (!this.resident[p]) return false;
    return true;
  }
}

// An instance of a primitive; hidden until it is placed. starts, counts, tags: of the ranges of
// indices to draw; version changes with them.
class Instance {
  constructor(primitive) {
    this.primitive = primitive;
    this.matrix = new Float64Array(16);
    this.scale = 0; // of the matrix
    this.visible = false;
    this.moved = true; // since the last frame
    this.starts = [];
    this.counts = [];
    this.tags = [];
    this.triangles = 0;
    this.version = 0;
  }

  // matrix: column by column, from POSITION to the camera's coordinates; null hides the instance.
  place(matrix) {
    this.moved ||= this.visible || matrix !== null;
    this.visible = matrix !== null;
    if (!matrix) return;
    this.matrix.set(matrix);
    this.scale = largestScale(this.matrix);
  }
}

// Ranges of indices as they are found; neighbours with the same tag become one.
class Ranges {
  starts = [];
  counts = [];
  tags = [];
  length = 0;
  triangles = 0;
  tag = 0; // of ranges that are added

  clear() {
    this.length = 0;
    this.triangles = 0;
  }

  add(start, count) {
    const last = this.length - 1;
    this.triangles += count / 3;
    if (
      last >= 0 &&
      this.starts[last] + this.counts[last] === start &&
      this.tags[last] === this.tag
    ) {
      this.counts[last] += count;
      return;
    }
    this.starts[this.length] = start;
    this.counts[this.length] = count;
    this.tags[this.length++] = this.tag;
  }

  // Copies them to an instance. Returns whether they differ from those it had.
  show(instance) {
    const { starts, counts, tags, length } = this;
    let same = instance.starts.length === length;
    for (let i = 0; same && i < length; i++)
      same =
        starts[i] === instance.starts[i] &&
        counts[i] === instance.counts[i] &&
        tags[i] === instance.tags[i];
    if (same) return false;
    instance.starts = starts.slice(0, length);
    instance.counts = counts.slice(0, length);
    instance.tags = tags.slice(0, length);
    instance.triangles = this.triangles;
    instance.version++;
    return true;
  }
}

export class Streamer {
  #options;
  #document = null;
  #decoders = null;
  #abort = new AbortController();
  #requests = new Set();
  #pages = []; // of all primitives
  #frame = 0;
  #changes = 0; // of residency
  #lastWork = -1; // what the last walk was for
  #lastView = null;
  #budget = null;
  #requested = 0; // bytes on the way
  #decodingBytes = 0; // with the results that wait for their place
  #stored = 0; // bytes of compressed pages
  #waiting = 0; // of these, bytes of pages that wait for a decoder or their place
  #decoded = []; // pages that wait for their place
  #pools = [];
  #missing = 0;
  #started = false; // to read the other groups
  #unpackerModule = null; // of a packed file
  #unpacker = null; // for the first pages
  #error = 0; // of what is drawn, in pixels

  constructor({ maxBytes = 64 * MEGABYTE, ...options }) {
    if (!(maxBytes >= MEGABYTE)) throw new RangeError('maxBytes must be at least 1,000,000');
    this.#options = options;
    this.maxBytes = maxBytes;
    this.primitives = [];
    this.refused = []; // {name, error}: primitives whose levels cannot be used
    this.threshold = 0; // pixels, as raised to fit
    this.colour = 'none'; // tags of ranges: none, page, level or meshlet
    options.signal?.addEventListener('abort', () => this.close());
  }

  get json() {
    return this.#document.json;
  }

  get decoders() {
    return this.#decoders;
  }

  readView(number) {
    return this.#document.readView(number);
  }

  get pools() {
    return this.#pools;
  }

  // --- opening ---

  async open(place) {
    const { requestInit, stallMs, onWarning, unpacker } = this.#options;
    const { source, createWorker, exclude } = this.#options;
    const { signal } = this.#abort;
    const small = this.maxBytes <= SMALL;
    const cores = globalThis.navigator?.hardwareConcurrency ?? 2;
    const workers = small ? 1 : Math.min(Math.max(cores - 1, 1), MOST_WORKERS);
    this.workers = workers;
    const starting = createDecoderPool({
      workers,
      source: source ?? compileDecoder(),
      createWorker: createWorker ?? pageWorker,
    });
    starting.catch(() => {});
    try {
      this.#document = await openDocument(place, {
        signal,
        requestInit,
        stallMs,
        onWarning,
        unpacker,
      });
    } finally {
      this.#decoders = await starting;
      if (signal.aborted) this.#decoders.close();
    }
    signal.throwIfAborted();
    this.primitives = this.#candidates(new Set(exclude));
    await this.#readTables();
    await this.#readFirstPages();
    this.#makePools();
  }

  // The primitives whose levels can be streamed: without skins and morph targets.
  #candidates(exclude) {
    const { json } = this;
    const skinned = new Set();
    for (const { mesh, skin } of json.nodes ?? []) if (skin !== undefined) skinned.add(mesh);
    const found = new Map();
    json.meshes?.forEach((mesh, m) =>
      mesh.primitives.forEach((primitive, p) => {
        const name = `mesh ${m} primitive ${p}`;
        const { [EXTENSION]: compressed, [LOD]: levels } = primitive.extensions ?? {};
        const key = keyOf(primitive);
        if (!compressed || levels === undefined || found.has(key) || exclude.has(key)) return;
        if (skinned.has(m) || primitive.targets || (primitive.mode ?? 4) !== 4) return;
        this.#attempt(name, key, () => {
          const counts = readCounts(levels);
          if (counts) found.set(key, new Primitive(key, name, primitive, counts));
        });
      }),
    );
    return [...found.values()];
  }

  // Runs an action on the levels of a primitive; a malformed one refuses them.
  #attempt(name, key, action) {
    try {
      action();
      return true;
    } catch (caught) {
      const error = ours(caught);
      if (!(error instanceof MalformedError)) throw error;
      this.refused.push({ name, key, error });
      this.#options.onWarning?.(`${name}: ${error.message}; shown without levels`);
      return false;
    }
  }

  // Runs an action for each primitive; drops those that fail.
  #forEach(action) {
    this.primitives = this.primitives.filter((one, i) =>
      this.#attempt(one.name, one.key, () => action(one, i)),
    );
  }

  async #readTables() {
    const views = new Map();
    for (const one of this.primitives) {
      const { [EXTENSION]: compressed, [LOD]: levels } = one.primitive.extensions;
      const numbers = [levels.bufferView, levels.pages?.bufferView, compressed.bufferView];
      const places = await Promise.allSettled(numbers.map((n) => this.#document.place(n)));
      views.set(one, places);
    }
    this.#forEach((one) => {
      one.places = views.get(one).map(({ value, reason }) => {
        if (reason) throw reason;
        return value;
      });
      for (const number of [
        one.primitive.extensions[LOD].bufferView,
        one.primitive.extensions[LOD].pages.bufferView,
      ])
        checkView(this.json.bufferViews[number]);
      const [tables] = one.places;
      if (Tables.viewBytes(one.counts) !== tables.size)
        throw new MalformedError(`${LOD} has tables of another length than its counts say`);
    });
    const total = this.primitives.reduce((sum, { counts }) => sum + Tables.viewBytes(counts), 0);
    if (2 * total > this.maxBytes) throw tooSmall(this.maxBytes, `its tables have ${total} bytes`);
    const pages = await this.#readParts((one) => {
      one.tables ??= new Tables(one.counts);
      return one.tables.pageRange;
    });
    this.#forEach((one) => {
      const [, coarse, fine] = one.places;
      one.tables.addPages(pages.get(one), coarse.size, fine.size);
    });
    await this.#readPackedTables();
    // The groups of the root pages, and those that the first bytes of the file hold anyway.
    await this.#readGroups(({ tables, places: [{ source, begin }] }) =>
      Math.min(
        Math.max(tables.firstPart, tables.groupsWithin(source.held - begin)),
        tables.groupCount,
      ),
    );
    this.#forEach((one) => {
      one.cut = new Cut(one.tables);
      const { pageCount } = one.counts;
      one.resident = new Uint8Array(pageCount);
      one.priority = new Float64Array(pageCount);
    });
  }

  // The places of packed pages.
  async #readPackedTables() {
    const packed = this.primitives.flatMap(({ counts, places: [, coarse, fine] }) => {
      coarse.pages = counts.coarsePageCount;
      fine.pages = counts.pageCount - coarse.pages;
      return [coarse, fine].filter(({ isPacked }) => isPacked);
    });
    const bytes = await readPlaces(
      packed.map(({ source, begin, end, pages }) => {
        return { source, begin, end: Math.min(end, begin + 4 + 8 * pages) };
      }),
    );
    this.#forEach(({ places }) => {
      for (const place of places) {
        if (!place.isPacked) continue;
        place.table = packedTable(bytes[packed.indexOf(place)], place.end - place.begin);
        if (place.table.length !== place.pages)
          throw new MalformedError('a packed view has another number of pages than its levels');
      }
    });
    if (packed.length === 0) return;
    this.#unpackerModule = await this.#document.unpackerModule();
    this.#unpacker = await createUnpacker(this.#unpackerModule);
  }

  // Reads a part of the tables of each primitive: ranges(primitive) is [begin, end) in its view.
  async #readParts(ranges) {
    const places = this.primitives.map((one) => {
      const [begin, end] = ranges(one);
      const { source, begin: start } = one.places[0];
      return { source, begin: start + begin, end: start + end };
    });
    const bytes = await readPlaces(places);
    return new Map(this.primitives.map((one, i) => [one, bytes[i]]));
  }

  // Adds groups up to last(primitive).
  async #readGroups(last) {
    const groups = await this.#readParts((one) =>
      one.tables.groupRange(one.tables.known, last(one)),
    );
    const counts = new Map();
    this.#forEach((one) => counts.set(one, one.tables.runsOf(groups.get(one))));
    const runs = await this.#readParts((one) => {
      const first = one.tables.firstRun[one.tables.known];
      return one.tables.runRange(first, first + counts.get(one));
    });
    this.#forEach((one) => {
      if (groups.get(one).length > 0) one.tables.addGroups(groups.get(one), runs.get(one));
    });
  }

  // The groups that are not in the root pages. Those that are malformed end the stream.
  #readOtherGroups() {
    this.#started = true;
    const before = new Map(this.primitives.map((one) => [one, one.tables.known]));
    const run = async () => {
      const refused = this.refused.length;
      await this.#readGroups(({ tables }) => tables.groupCount);
      if (this.refused.length > refused) throw new MalformedError('its levels are malformed');
      for (const one of this.primitives) {
        if (before.get(one) === one.tables.known) continue;
        one.cut.grow(before.get(one));
        one.levels = null;
      }
      this.#document.forgetHeads();
      this.#changes++;
      this.#options.onChange?.();
    };
    const attempt = (tries) =>
      run().catch((error) => {
        if (this.#abort.signal.aborted) return;
        if (!error.retry) return this.#options.onBroken?.(error);
        this.#options.onWarning?.(`${error.message}; trying again`);
        setTimeout(() => this.#abort.signal.aborted || attempt(tries + 1), delayAfter(tries));
      });
    attempt(1);
  }

  // The first page of each primitive says how all of its pages are stored, level 0 included.
  async #readFirstPages() {
    this.#forEach((one) => this.#makePages(one));
    const share = FIRST_BYTES / this.primitives.length;
    const place = (one) => {
      const { pages, tables } = one;
      const [{ source, begin }] = pages;
      const roots = tables.statedRoots ?? tables.rootPages;
      const comes = (p, { begin: start, length }) =>
        tables.knowsPage(p) && // else its groups do not tell whether it is well formed
        (start + length <= begin + share || (p < roots && start + length <= source.held));
      let count = 1;
      while (count < tables.coarsePageCount && comes(count, pages[count])) count++;
      one.firstPages = count;
      const last = pages[count - 1];
      return { source, begin, end: last.begin + last.length };
    };
    const places = this.primitives.map(place);
    const total = places.reduce((sum, { begin, end }) => sum + end - begin, 0);
    if (4 * total > this.maxBytes) throw tooSmall(this.maxBytes, 'its first pages do not fit');
    const headers = this.primitives.map(({ pages, tables }) => {
      const { source, begin, length, packed } = pages[tables.coarsePageCount];
      return { source, begin, end: begin + (packed ? 0 : Math.min(length, HEADER_BYTES)) };
    });
    const bytes = await readPlaces([...places, ...headers]);
    const first = new Map(this.primitives.map((one, i) => [one, bytes[i]]));
    const fine = new Map(this.primitives.map((one, i) => [one, bytes[places.length + i]]));
    this.#forEach((one) => {
      const { json } = this;
      const { attributes } = one.primitive;
      const streams = one.primitive.extensions[EXTENSION].attributes;
      this.#storeFirst(one, first.get(one));
      one.streams = readStreams(this.#unpacked(one.pages[0]));
      const header = fine.get(one); // pages are checked again when they are decoded
      if (header.length > 0 && !sameStreams(one.streams, readStreams(header)))
        throw new MalformedError(`${LOD} has pages with other streams than level 0`);
      one.attributes = Object.entries(attributes).map(([name, number]) => {
        return { name, first: streams[name], accessor: plain(json.accessors[number]) };
      });
      one.formats = formatsOf(one.attributes, one.streams);
      if (one.formats.every(({ name }) => name !== 'POSITION'))
        throw new MalformedError('it has no positions');
    });
  }

  #makePages(one) {
    const { tables, places } = one;
    for (let p = 0; p < tables.pageCount; p++) {
      const isFine = p >= tables.coarsePageCount;
      const { source, begin, table } = places[isFine ? 2 : 1];
      const size = tables.pageLength[p];
      const plain = {
        begin: tables.pageBegin[p],
        end: tables.pageBegin[p] + size,
        size,
        raw: true,
      };
      const place = table ? table[isFine ? p - tables.coarsePageCount : p] : plain;
      if (place.size !== size)
        throw new MalformedError('a packed page has another length than the tables say');
      one.pages.push({
        owner: one,
        number: p,
        source,
        begin: begin + place.begin,
        length: place.end - place.begin,
        packed: place.raw ? 0 : size, // unpacked bytes
        vertices: tables.pageVertices[p],
        triangles: tables.pageTriangles[p],
        state: NONE,
        bytes: null,
        used: 0, // frame in which it was needed last
        wanted: 0, // pixels
        tries: 0,
        retryAt: 0,
      });
    }
  }

  #storeFirst({ pages }, bytes) {
    for (let p = 0, at = 0; at < bytes.length; at += pages[p++].length)
      this.#store(pages[p], bytes.slice(at, at + pages[p].length));
  }

  #unpacked({ bytes, packed }) {
    if (!packed) return bytes;
    return this.#unpacker.unpackPage({ bytes, size: packed }).slice();
  }

  #makePools() {
    const layouts = new Map();
    for (const one of this.primitives) {
      const layout = one.formats
        .map((f) => [f.name, f.Type.name, f.size, f.normalized].join())
        .join();
      if (!layouts.has(layout)) layouts.set(layout, []);
      layouts.get(layout).push(one);
    }
    this.#pages = this.primitives.flatMap(({ pages }) => pages);
    this.#started = this.#knowsAll;
    if (this.#started) this.#document.forgetHeads();
    const tables = this.primitives.reduce(
      (sum, one) => sum + one.tables.byteLength + one.cut.byteLength + 9 * one.pages.length,
      0,
    );
    this.#unpacker = null; // Workers have their own
    const packed = this.#pages.reduce((most, page) => Math.max(most, page.packed), 0);
    if (packed > 0) this.#wasmBytes += UNPACKER_BYTES + UNPACKING * packed;
    const workers = this.workers * this.#wasmBytes;
    const rootsOf = ({ pages, tables: { statedRoots, rootPages } }) =>
      pages.slice(0, statedRoots ?? rootPages);
    const mostOf = (pages) => pages.reduce((most, page) => Math.max(most, decodingBytes(page)), 0);
    const decoding = mostOf(this.#pages);
    const waiting = Math.max(
      LEAST_WAITING,
      Math.min(WAITING * this.maxBytes, MOST_WAITING),
      // The coarsest pages are there already.
      this.#stored + this.#document.held + mostOf(this.primitives.flatMap(rootsOf)) - decoding,
    );
    const room = (this.maxBytes - tables - workers - waiting - decoding) / COPIES;
    const sum = (pagesOf) =>
      this.primitives.reduce((all, one) => all + this.#bytesOf(one, pagesOf(one)), 0);
    if (sum(rootsOf) > room) throw tooSmall(this.maxBytes, 'its coarsest level does not fit');
    const total = sum(({ pages }) => pages);
    const shareBeyond = (pagesOf) =>
      Math.min(1, (room - sum(pagesOf)) / Math.max(total - sum(pagesOf), 1));
    // Each primitive has the same share of the room, for its coarsest pages: cuts have their mix of
    // vertices and triangles.
    const share = shareBeyond(rootsOf);
    const coarsest = (one) => {
      const roots = rootsOf(one).length;
      let left = share * this.#bytesOf(one, one.pages.slice(roots));
      const beyond = one.pages.findIndex((page, p) => {
        if (p >= roots) left -= this.#bytesOf(one, [page]);
        return left < 0;
      });
      return beyond < 0 ? one.pages : one.pages.slice(0, beyond);
    };
    const rest = shareBeyond(coarsest);
    this.#budget = { tables, waiting, decoding, room, wasm: this.#wasmBytes };
    for (const ones of layouts.values()) {
      const pages = ones.flatMap((one) => one.pages);
      const pool = new GeometryPool(ones[0].formats, pages, ones.flatMap(coarsest), rest);
      for (const one of ones) one.pool = pool;
      this.#pools.push(pool);
    }
  }

  #bytesOf(one, pages) {
    return pages.reduce(
      (sum, { vertices, triangles }) => sum + geometryBytes(one.formats, vertices, triangles),
      0,
    );
  }

  // --- instances ---

  addInstance(primitive) {
    const instance = new Instance(primitive);
    primitive.instances.push(instance);
    this.#changes++;
    return instance;
  }

  // Whether the first picture's pages are there, or have been.
  get ready() {
    return this.primitives.every((one) => one.open());
  }

  // Whether nothing is missing for the last view.
  get complete() {
    return this.ready && !this.#unbalanced && this.#missing === 0 && this.#knowsAll;
  }

  get #knowsAll() {
    return this.primitives.every(({ tables }) => tables.known === tables.groupCount);
  }

  // --- a frame ---

  // view: a View; null keeps the last one. pixels: the allowed error. Returns whether the ranges of
  // an instance have changed.
  update(view, pixels) {
    if (this.#abort.signal.aborted) return false;
    this.#insertDecoded();
    if (!this.#started && this.ready) this.#readOtherGroups(); // not before the first picture
    this.#lastView = view ?? this.#lastView;
    const moved = this.#moved();
    const work = () => JSON.stringify([this.#lastView, pixels, this.colour, this.#changes]);
    let changed = false;
    if (moved || work() !== this.#lastWork) {
      this.#frame++;
      changed = this.#choose(pixels);
      this.#lastWork = work();
    } else if (this.#mayRebalance) this.#rebalance();
    this.#schedule();
    // For pages that update only when they are told.
    if (this.#decoded.length > 0 || this.#mayRebalance) setTimeout(() => this.#changed());
    return changed;
  }

  // Whether an instance has changed since the last frame.
  #moved() {
    let moved = false;
    for (const { instances } of this.primitives)
      for (const instance of instances) {
        moved ||= instance.moved;
        instance.moved = false;
      }
    return moved;
  }

  // Chooses the threshold, the pages that the view needs, and the ranges of all instances. Returns
  // whether any ranges have changed. What fits takes one walk. If the last frame's threshold was
  // raised, so will be this one's: the first walk leaves out the detail far below it.
  #choose(pixels) {
    const guess = Math.max(pixels, NEAR_THRESHOLD * this.#fitting.threshold);
    let changed = this.#walk(guess, true, guess === pixels);
    this.#fit(guess);
    if (this.#fitting.threshold === guess && guess > pixels) {
      changed = this.#walk(pixels, true, true);
      this.#fit(pixels);
    }
    if (this.threshold > pixels) changed = this.#walk(this.threshold, false, true) || changed;
    return changed;
  }

  // Walks all instances. ranks: finds the errors of pages on the screen. shows: sets the ranges;
  // returns whether any has changed.
  #walk(threshold, ranks, shows) {
    let changed = false;
    this.#error = 0;
    for (const one of this.primitives) {
      const { cut, instances, tables, resident, priority, ready } = one;
      if (ranks) {
        priority.fill(0);
        if (!one.opened) priority.fill(Number.MAX_VALUE, 0, one.firstPages);
        priority.fill(Number.POSITIVE_INFINITY, 0, tables.rootPages);
      }
      for (const instance of instances) {
        if (!instance.visible || !this.#lastView) continue;
        cut.walk(this.#lastView, instance, threshold, resident, ranks ? priority : null);
        if (!shows) continue;
        if (ready) this.#error = Math.max(this.#error, cut.worst);
        if (this.#setRanges(instance, ready)) changed = true;
      }
    }
    return changed;
  }

  // Marks the pages that are needed above a threshold, raised until they fit into the pools.
  #fit(pixels) {
    const wanted = this.#pages.filter((page) => {
      page.wanted = page.owner.priority[page.number];
      return page.wanted > 0;
    });
    wanted.sort((a, b) => b.wanted - a.wanted);
    const needs = new Map(this.#pools.map((pool) => [pool, { vertices: 0, triangles: 0 }]));
    let left = this.#budget.room;
    let fitting = pixels; // the threshold, if memory moves between the pools
    this.threshold = pixels;
    for (const { wanted: error, chunks, owner } of wanted) {
      if (error <= fitting) break;
      const { pool } = owner;
      left -= pool.bytesOf(chunks);
      if (left < 0) fitting = error;
      else {
        const need = needs.get(pool);
        need.vertices += chunks.vertices;
        need.triangles += chunks.triangles;
        if (pool.holds(need)) continue;
      }
      this.threshold = Math.max(this.threshold, error);
    }
    this.#fitting = { threshold: fitting, needs };
    this.#missing = 0;
    for (const page of wanted) {
      if (page.wanted <= this.threshold) page.wanted = 0;
      else {
        page.used = this.#frame;
        if (page.state !== RESIDENT) this.#missing++;
      }
    }
  }
  #fitting = { threshold: 0, needs: new Map() };

  // Whether more detail fits if memory moves between the pools. Frames of a flight do without.
  get #unbalanced() {
    return this.#pools.length > 1 && this.#fitting.threshold < this.threshold;
  }

  get #mayRebalance() {
    return this.#unbalanced && this.#missing === 0 && this.#jobs === 0;
  }

  // Moves memory between the pools. A pool at a time, first those that shrink.
  #rebalance() {
    const { needs } = this.#fitting;
    const grows = (pool) => pool.bytesOf(needs.get(pool)) - pool.byteLength;
    const same = (a, b) => a.vertices === b.vertices && a.triangles === b.triangles;
    const [pool] = this.#pools
      .filter((one) => !same(one.capacity, needs.get(one)))
      .sort((a, b) => grows(a) - grows(b));
    for (const page of this.#unwanted(pool)) this.#evict(page);
    const pages = this.#pages.filter((p) => p.state === RESIDENT && p.owner.pool === pool);
    pool.resize(needs.get(pool), pages);
    for (const { instances } of this.primitives)
      for (const instance of instances) if (instance.primitive.pool === pool) instance.starts = [];
    this.#changes++;
  }

  #setRanges(instance, ready) {
    const { primitive } = instance;
    const { pages, pool, cut } = primitive;
    const ranges = this.#ranges;
    ranges.clear();
    if (ready)
      cut.forDrawn((p, first, count, group) => {
        const { place } = pages[p];
        if (this.colour === 'meshlet')
          for (let m = first; m < first + count; m++) {
            ranges.tag = m;
            pool.addRanges(place, m, 1, ranges);
          }
        else {
          ranges.tag = this.#tag(primitive, p, group);
          pool.addRanges(place, first, count, ranges);
        }
      });
    return ranges.show(instance);
  }
  #ranges = new Ranges();

  #tag(primitive, page, group) {
    if (this.colour === 'page') return page;
    if (this.colour !== 'level') return 0;
    primitive.levels ??= primitive.tables.levels();
    return primitive.levels[group];
  }

  // --- pages ---

  #store(page, bytes) {
    page.bytes = bytes;
    page.state = STORED;
    this.#stored += bytes.length;
  }

  #forget(page) {
    this.#stored -= page.bytes.length;
    page.bytes = null;
    if (page.state === STORED) page.state = NONE;
  }

  #schedule() {
    const now = performance.now();
    this.#cancel();
    this.#waiting = 0;
    for (const { wanted, bytes, state } of this.#pages)
      if (bytes && state !== RESIDENT && (wanted > 0 || state > STORED))
        this.#waiting += bytes.length;
    const wanted = this.#pages.filter(
      (page) => page.wanted > 0 && page.state <= STORED && page.retryAt <= now,
    );
    wanted.sort((a, b) => b.wanted - a.wanted);
    for (const page of wanted) {
      if (page.state === STORED) this.#decode(page);
      else if (page.state === NONE) this.#request(page);
    }
    this.#trim();
  }

  // Ends requests of which nothing is wanted any more.
  #cancel() {
    for (const request of this.#requests)
      if (request.pages.every(({ wanted }) => wanted === 0)) request.abort.abort();
  }

  // Requests a page with those of its neighbours that are wanted, too.
  #request(page) {
    if (this.#requests.size >= REQUESTS) return;
    const { pages } = page.owner;
    const pagesOf = [page];
    const most = Math.min(REQUEST_BYTES, this.#budget.waiting);
    let length = page.length;
    const extend = (next, add) => {
      const after = pagesOf.at(-1);
      const before = pagesOf[0];
      while (
        next &&
        next.state === NONE &&
        next.wanted > 0 &&
        next.source === page.source &&
        (next.begin === after.begin + after.length || next.begin + next.length === before.begin) &&
        length + next.length <= most
      ) {
        length += next.length;
        return add(next);
      }
      return false;
    };
    while (extend(pages[pagesOf.at(-1).number + 1], (next) => pagesOf.push(next)));
    while (extend(pages[pagesOf[0].number - 1], (next) => pagesOf.unshift(next)));
    const before = this.#requested + this.#waiting;
    if (before > 0 && before + this.#document.held + length > this.#budget.waiting) return;
    if (this.#decodingBytes > 0 && length > this.#spare) return;
    this.#requested += length;
    const request = { pages: pagesOf, abort: new AbortController() };
    this.#requests.add(request);
    for (const one of pagesOf) one.state = REQUESTED;
    const begin = pagesOf[0].begin;
    page.source
      .read(begin, begin + length, request.abort.signal)
      .then(
        (bytes) => this.#arrived(pagesOf, bytes),
        (error) => this.#failed(request, error),
      )
      .finally(() => {
        this.#requests.delete(request);
        this.#requested -= length;
        this.#changed();
      });
  }

  #arrived(pages, bytes) {
    for (const page of pages) {
      const at = page.begin - pages[0].begin;
      this.#store(page, bytes.slice(at, at + page.length));
    }
  }

  #failed({ pages, abort }, error) {
    for (const page of pages) page.state = NONE;
    if (abort.signal.aborted || this.#abort.signal.aborted) return;
    if (error instanceof SourceError && error.changed) {
      this.#options.onBroken?.(error);
      return;
    }
    for (const page of pages) this.#postpone(page, error.retry);
    this.#options.onWarning?.(error.message);
  }

  // A page that cannot be read or decoded: coarser clusters stand in for it. It is tried again,
  // and given up after a few times if that does not promise to help.
  #postpone(page, mayHelp) {
    page.tries++;
    const delay = mayHelp || page.tries < TRIES ? delayAfter(page.tries) : Number.POSITIVE_INFINITY;
    if (delay === Number.POSITIVE_INFINITY) {
      page.retryAt = delay;
      return;
    }
    page.retryAt = performance.now() + delay;
    setTimeout(() => this.#changed(), delay + 1);
  }

  // Of the memory for pages on the way: what neither these take nor Workers that have grown.
  get #spare() {
    const { waiting, decoding, wasm } = this.#budget;
    const taken = this.#requested + this.#waiting + this.#document.held + this.#decodingBytes;
    return waiting + decoding - taken - this.workers * (this.#wasmBytes - wasm);
  }

  #decode(page) {
    const { owner } = page;
    const size = decodingBytes(page);
    if (this.#decodingBytes + this.#requested > 0 && size > this.#spare) return;
    page.state = DECODING_NOW;
    this.#decoding++;
    this.#decodingBytes += size;
    const { vertices, triangles } = page;
    const clusters = owner.tables.pageClusters(page.number);
    const expected = { vertices, triangles, clusters, streams: owner.streams };
    const packed = page.packed ? { module: this.#unpackerModule, size: page.packed } : null;
    const options = { attributes: owner.attributes, expected, packed };
    const job = { task: 'decodePage', bytes: page.bytes, options, onTriangles() {} };
    this.#decoders
      .run(job, this.#abort.signal)
      .then(
        (decoded) => {
          page.state = DECODED;
          this.#decoded.push({ page, decoded, size });
          this.#wasmBytes = Math.max(this.#wasmBytes, decoded.memory);
        },
        (error) => {
          this.#decodingBytes -= size;
          this.#bad(page, error);
        },
      )
      .finally(() => {
        this.#decoding--;
        this.#changed();
      });
  }
  #decoding = 0;
  #wasmBytes = WORKER_BYTES;

  // A malformed page. Without a root page there are no levels.
  #bad(page, error) {
    if (this.#abort.signal.aborted) return;
    page.state = STORED;
    this.#forget(page);
    page.state = NONE;
    const { owner, number } = page;
    const problem = `${owner.name}: page ${number}: ${error.message}`;
    if (number < owner.tables.rootPages) {
      page.retryAt = Number.POSITIVE_INFINITY;
      this.refused.push({ name: owner.name, key: owner.key, error: new MalformedError(problem) });
      this.#options.onBroken?.(new MalformedError(problem));
      return;
    }
    this.#options.onWarning?.(problem);
    this.#postpone(page, false);
  }

  // Copies decoded pages to their places, as long as a frame has time.
  #insertDecoded() {
    const start = performance.now();
    while (this.#decoded.length > 0 && performance.now() - start < INSERT_MS) {
      const { page, decoded, size } = this.#decoded.shift();
      this.#decodingBytes -= size;
      page.state = STORED;
      if (!this.#makeRoom(page)) continue;
      page.place = page.owner.pool.insert(page, decoded);
      page.state = RESIDENT;
      page.owner.resident[page.number] = 1;
      page.tries = 0;
      this.#changes++;
    }
  }

  // Evicts pages that are not wanted, least recently needed ones first, until this one fits.
  #makeRoom(page) {
    const { pool } = page.owner;
    if (page.wanted === 0) return false;
    if (pool.fits(page)) return true;
    for (const one of this.#unwanted(pool).sort((a, b) => a.used - b.used)) {
      this.#evict(one);
      if (pool.fits(page)) return true;
    }
    return false;
  }

  #unwanted(pool) {
    return this.#pages.filter(
      ({ state, wanted, owner }) => state === RESIDENT && wanted === 0 && owner.pool === pool,
    );
  }

  #evict(page) {
    page.owner.pool.remove(page.place);
    page.place = null;
    page.state = page.bytes ? STORED : NONE;
    page.owner.resident[page.number] = 0;
    this.#changes++;
  }

  // Forgets compressed bytes beyond the budget, of pages that were needed longest ago first. Of
  // those that are needed now, that of resident pages first, then that of the least urgent ones.
  #trim() {
    const spare = this.maxBytes - (this.bytes.total - this.#stored);
    if (this.#stored <= spare) return;
    const kept = this.#pages.filter(
      ({ bytes, state }) => bytes && (state === RESIDENT || state === STORED),
    );
    kept.sort((a, b) => a.used - b.used || b.state - a.state || a.wanted - b.wanted);
    for (const page of kept) {
      if (this.#stored <= spare) return;
      this.#forget(page);
    }
  }

  #changed() {
    if (!this.#abort.signal.aborted) this.#options.onChange?.();
  }

  // --- what it holds ---

  // By kind. The disk, textures and primitives without levels do not count.
  get bytes() {
    const arrays = this.#pools.reduce((sum, pool) => sum + pool.byteLength, 0);
    const bytes = {
      gpu: arrays,
      arrays,
      wasm: this.workers * this.#wasmBytes + (this.#unpacker?.memoryBytes ?? 0),
      compressed: this.#stored + (this.#document?.held ?? 0),
      transit: this.#requested + this.#decodingBytes,
      tables: this.#budget?.tables ?? 0,
    };
    bytes.total = Object.values(bytes).reduce((sum, value) => sum + value, 0);
    return bytes;
  }

  // Requests and decodings under way.
  get #jobs() {
    return this.#requests.size + this.#decoding + this.#decoded.length;
  }

  get statistics() {
    let triangles = 0;
    let ranges = 0;
    for (const { instances } of this.primitives)
      for (const instance of instances)
        if (instance.visible) {
          triangles += instance.triangles;
          ranges += instance.starts.length;
        }
    return {
      fetched: this.#document?.fetched ?? 0,
      requests: this.#document?.requests ?? 0,
      waiting: this.#jobs,
      pages: this.#pages.length,
      resident: this.#pages.filter(({ state }) => state === RESIDENT).length,
      missing: this.#missing,
      triangles,
      fullTriangles: this.#fullTriangles,
      ranges,
      threshold: this.threshold,
      error: this.#error,
      complete: this.complete,
      bytes: this.bytes,
    };
  }

  // Of level 0, each primitive once.
  get #fullTriangles() {
    let sum = 0;
    for (const { tables } of this.primitives)
      for (let p = tables.coarsePageCount; p < tables.pageCount; p++)
        sum += tables.pageTriangles[p];
    return sum;
  }

  close() {
    this.#abort.abort(new SourceError('the stream is closed'));
    this.#decoders?.close();
  }
}

// Primitives of the JSON with equal keys have the same data.
export function keyOf({ attributes, indices, extensions, mode }) {
  const view = extensions?.[EXTENSION]?.bufferView;
  return JSON.stringify([view, mode, indices, attributes, extensions?.[LOD]]);
}

// What formatsOf reads of an accessor.
function plain(accessor) {
  const { componentType, type, normalized } = accessor ?? {};
  return { componentType, type, normalized };
}

// What a page takes while it is decoded, beside the memory of WebAssembly: a copy of its bytes, also
// unpacked, and its arrays.
function decodingBytes({ owner, vertices, triangles, length, packed }) {
  const vertexBytes = owner.formats.reduce((sum, { bytes }) => sum + bytes, 0);
  const indexBytes = 3 * indexType(vertices).BYTES_PER_ELEMENT;
  return length + packed + vertexBytes * vertices + indexBytes * triangles;
}

function checkView(view) {
  const compressed = ['EXT_meshopt_compression', 'KHR_meshopt_compression'];
  if (
    view.byteStride !== undefined ||
    view.target !== undefined ||
    (view.byteOffset ?? 0) % 4 !== 0
  )
    throw new MalformedError(
      `${LOD} has a buffer view with a byteStride, a target or another offset than a multiple of 4`,
    );
  if (compressed.some((name) => view.extensions?.[name]))
    throw new MalformedError(`${LOD} has a buffer view that is compressed`);
}

function tooSmall(maxBytes, why) {
  return new SourceError(`maxBytes ${maxBytes} is too small for this file: ${why}; allow more`);
}

async function pageWorker() {
  if (typeof Worker !== 'undefined')
    return new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
  const threads = await import(/* @vite-ignore */ node);
  return new threads.Worker(new URL('./worker.js', import.meta.url));
}
