// Streams the primitives with levels of a file: chooses cuts for a camera, and keeps the pages that
// they need in arrays, in a fixed amount of memory. Knows no engine: an adapter gives the instances'
// matrices and the camera, and draws the ranges of the arrays.
import { MalformedError } from '../../blob.js';
import { startWorker } from '../../pool.js';
import { openDocument } from '../io/document.js';
import { SourceError } from '../io/source.js';
import { divideRoom, makePools, planBudget, workersOf } from './budget.js';
import { checkMaxBytes, checkNumber } from './options.js';
import { RESIDENT } from './page.js';
import { Instance, Ranges } from './primitives.js';
import { ours, Reader } from './reader.js';
import { Residency } from './residency.js';
import { borrowWorkers } from './workers.js';

export const DEFAULT_BYTES = 64e6;
// From one frame of a flight to the next the threshold falls by less than this, mostly.
const NEAR_THRESHOLD = 0.8;

export async function openStreamer(place, options = {}) {
  const streamer = new Streamer(options);
  try {
    await streamer.open(place);
    return streamer;
  } catch (error) {
    streamer.close();
    throw streamer.decoders ? named(ours(error), place) : error;
  }
}

// Errors of a file's content, with its place. Without decoders it is none of the file's.
function named(error, place) {
  if (!(error instanceof MalformedError)) return error;
  const name = place instanceof Blob ? 'the file' : place;
  return new MalformedError(`${name}: ${error.message}`);
}

export class Streamer {
  #options;
  #maxBytes;
  #document = null;
  #reader = null;
  #residency = null;
  #copies = 2; // of decoded pages
  #moves = null; // the module
  #isMoving = false;
  #release = () => {}; // of Workers
  #abort = new AbortController();
  #frame = 0;
  #changes = 0; // of what is drawn, but for residency
  #lastWork = ''; // what the last walk was for
  #lastView = null;
  #missing = 0;
  #error = 0; // of what is drawn, in pixels
  #fitting = { threshold: 0, needs: new Map() }; // if memory moves between the pools
  #ranges = new Ranges();

  constructor({ maxBytes = DEFAULT_BYTES, ...options }) {
    checkMaxBytes(maxBytes);
    for (const name of ['stallMs', 'maxWholeBytes'])
      if (options[name] !== undefined) checkNumber(name, options[name], 1);
    this.#options = { ...options };
    for (const name of ['onWarning', 'onChange', 'onBroken'])
      this.#options[name] = (told) => this.#abort.signal.aborted || options[name]?.(told);
    this.#maxBytes = maxBytes;
    this.decoders = null;
    this.threshold = 0; // pixels, as raised to fit
    /** @type {'none' | 'page' | 'level' | 'meshlet'} */
    this.colour = 'none'; // tags of ranges: none, page, level or meshlet
    const { signal } = options;
    // Until it is closed: else the page's signal keeps it in memory.
    signal?.addEventListener('abort', () => this.close(signal.reason), {
      signal: this.#abort.signal,
    });
    if (signal?.aborted) this.close(signal.reason);
  }

  get json() {
    return this.#document.json;
  }

  get primitives() {
    return this.#reader.primitives;
  }

  get refused() {
    return this.#reader.refused;
  }

  get pools() {
    return this.#residency.pools;
  }

  readView(number) {
    return this.#document.readView(number);
  }

  // --- opening ---

  async open(place) {
    const { onWarning, source, createWorker, exclude } = this.#options;
    const { signal } = this.#abort;
    signal.throwIfAborted();
    const workers = workersOf(this.#maxBytes);
    const { starting, release } = borrowWorkers(workers, source, createWorker ?? pageWorker);
    this.#release = release;
    try {
      this.#document = await openDocument(place, { ...this.#options, signal });
    } finally {
      this.decoders = await starting;
    }
    signal.throwIfAborted();
    this.#reader = new Reader(this.#document, { maxBytes: this.#maxBytes, onWarning });
    await this.#reader.open(new Set(exclude));
    this.#divideMemory();
  }

  #plan(maxBytes, copies) {
    return planBudget(this.primitives, maxBytes, this.#document.held, copies);
  }

  #divideMemory() {
    const { primitives, unpackerModule } = this.#reader;
    const budget = this.#plan(this.#maxBytes, this.#copies);
    const pools = makePools(primitives);
    for (const [pool, capacity] of divideRoom(primitives, pools, budget.room))
      pool.capacity = capacity;
    this.#residency = new Residency(primitives, pools, budget, {
      ...this.#options,
      document: this.#document,
      decoders: this.decoders,
      unpackerModule,
      signal: this.#abort.signal,
      refuse: ({ name, key }, error) => {
        this.refused.push({ name, key, error });
        this.#options.onBroken(error);
      },
    });
  }

  get maxBytes() {
    return this.#maxBytes;
  }

  // What does not fit any more goes with the next update. Throws SourceError if the coarsest level
  // does not fit.
  set maxBytes(maxBytes) {
    checkMaxBytes(maxBytes);
    this.#change(maxBytes, this.#copies);
    this.decoders.grow(workersOf(maxBytes)).catch(() => {}); // which tells it by itself
  }

  #change(maxBytes, copies) {
    const budget = this.#plan(maxBytes, copies);
    this.#residency.budget = budget;
    for (const [pool, capacity] of divideRoom(this.primitives, this.pools, budget.room))
      pool.capacity = capacity;
    this.#maxBytes = maxBytes;
    this.#copies = copies;
    this.#changes++;
    this.#options.onChange();
  }

  // Moves decoded pages to buffers of an engine, so that no copy of them stays in arrays. storeOf:
  // pool -> store, see moves.js; null: to arrays. wasLost: what they held is no more, and is decoded again.
  async moveTo(storeOf, wasLost = false) {
    this.#isMoving = true;
    const { empty, moveTo } = await this.#load().finally(() => {
      this.#isMoving = false;
    });
    if (this.#abort.signal.aborted) return;
    for (const pool of this.pools) {
      if (wasLost) empty(pool, this.#residency);
      moveTo(pool, storeOf?.(pool) ?? null, wasLost);
    }
    this.#change(this.#maxBytes, storeOf ? 1 : 2);
  }

  async #load() {
    this.#moves ??= await import('./moves.js');
    return this.#moves;
  }

  // Reads the tables of a primitive on to where the last walk has to know them. Those that are
  // malformed end the stream. What was given up is tried again when a view needs another group.
  async #readTables(one) {
    const { attempts, lacks } = one;
    if (lacks === 0 || lacks === one.givenUp || !attempts.isDue(performance.now())) return;
    const { onBroken, onChange, onWarning } = this.#options;
    attempts.block(); // not before this part is there
    try {
      await this.#reader.readMore(one);
      attempts.reset();
      this.#changes++;
    } catch (error) {
      if (!(error instanceof SourceError) || error.changed) return onBroken(error);
      onWarning(error.message);
      if (!attempts.postpone(error, onChange, this.#abort.signal)) {
        attempts.reset();
        one.givenUp = lacks;
      }
    }
    onChange();
  }

  // What was given up is tried again, as after a signature has been renewed.
  retry() {
    for (const one of this.primitives) one.givenUp = 0;
    this.#residency.retry();
    this.#options.onChange();
  }

  // --- instances ---

  addInstance(primitive) {
    const instance = new Instance(primitive);
    primitive.instances.push(instance);
    this.#changes++;
    return instance;
  }

  get #instances() {
    return this.primitives.flatMap(({ instances }) => instances);
  }

  // Whether the first picture's pages are there, or have been.
  get ready() {
    return this.primitives.every((one) => one.open());
  }

  // Whether nothing is missing for the last view.
  get complete() {
    const fits =
      !this.#isMoving && !this.#unbalanced && this.pools.every((pool) => !pool.isTooLarge);
    return this.ready && fits && this.#missing === 0 && !this.#lacksGroups;
  }

  // Whether the last walk needed groups that are not known.
  get #lacksGroups() {
    return this.primitives.some(({ lacks }) => lacks > 0);
  }

  // --- a frame ---

  // view: a View; null keeps the last one. pixels: the allowed error. Returns whether the ranges of
  // an instance have changed.
  update(view, pixels) {
    if (this.#abort.signal.aborted) return false;
    checkNumber('pixels', pixels, 0);
    this.#residency.insertDecoded();
    this.#lastView = view ?? this.#lastView;
    const moved = this.#moved();
    const changes = this.#changes + this.#residency.changes;
    const work = JSON.stringify([this.#lastView, pixels, this.colour, changes, this.ready]);
    let changed = false;
    if (moved || work !== this.#lastWork) {
      this.#frame++;
      changed = this.#choose(pixels);
      for (const pool of this.pools.filter((one) => one.isTooLarge))
        changed = this.#move(({ shrink }) => shrink(pool, this.#residency)) || changed;
      this.#lastWork = work;
    } else if (this.#mayRebalance) {
      const { needs } = this.#fitting;
      changed = this.#move((moves) => moves.rebalance(this.pools, needs, this.#residency));
    }
    if (this.ready) for (const one of this.primitives) this.#readTables(one);
    this.#residency.schedule();
    // For pages that update only when they are told.
    if (this.#residency.hasDecoded || this.#mayRebalance) setTimeout(this.#options.onChange);
    return changed;
  }

  // Whether an instance has changed since the last frame.
  #moved() {
    const instances = this.#instances;
    const moved = instances.some((one) => one.moved);
    for (const one of instances) one.moved = false;
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
        priority.fill(Infinity, 0, tables.rootPages);
      }
      const isKnown = tables.known === tables.groupCount;
      one.lacks = this.colour === 'level' && !isKnown ? tables.groupCount - 1 : 0;
      for (const instance of instances) {
        if (!instance.visible || !this.#lastView) continue;
        cut.walk(this.#lastView, instance, threshold, resident, ranks ? priority : null);
        one.lacks = Math.max(one.lacks, cut.lacks);
        if (!shows) continue;
        if (ready) this.#error = Math.max(this.#error, cut.worst);
        if (this.#setRanges(instance, ready)) changed = true;
      }
    }
    return changed;
  }

  // Marks the pages that are needed above a threshold, raised until they fit into the pools.
  #fit(pixels) {
    const wanted = this.#residency.pages.filter((page) => {
      page.want(page.owner.priority[page.number]);
      return page.wanted > 0;
    });
    wanted.sort((a, b) => b.wanted - a.wanted);
    const needs = new Map(this.pools.map((pool) => [pool, { vertices: 0, triangles: 0 }]));
    let left = this.#residency.budget.room;
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
      if (page.wanted <= this.threshold) page.want(0);
      else {
        page.use(this.#frame);
        if (page.state !== RESIDENT) this.#missing++;
      }
    }
  }

  // Whether more detail fits if memory moves between the pools. Frames of a flight do without.
  get #unbalanced() {
    return this.pools.length > 1 && this.#fitting.threshold < this.threshold;
  }

  get #mayRebalance() {
    const { jobs } = this.#residency;
    return this.#unbalanced && this.#missing === 0 && jobs === 0 && !this.#lacksGroups;
  }

  // Pages get other places, so that what is drawn has other ranges. Returns whether any has changed.
  // action: of moves.js, now or in a later frame.
  #move(action) {
    if (!this.#moves) {
      const again = () => {
        this.#changes++;
        this.#options.onChange();
      };
      this.#load().then(again, ({ message }) => this.#options.onWarning(message));
      return false;
    }
    action(this.#moves);
    for (const one of this.#instances) one.starts = [];
    this.#changes++;
    return this.#walk(this.threshold, false, true);
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

  #tag(primitive, page, group) {
    if (this.colour === 'page') return page;
    if (this.colour !== 'level') return 0;
    primitive.levels ??= primitive.tables.levels();
    return primitive.levels[group];
  }

  // --- what it holds ---

  get statistics() {
    const { pages, jobs, bytes } = this.#residency;
    const visible = this.#instances.filter((one) => one.visible);
    const fine = pages.filter(({ number, owner }) => number >= owner.tables.coarsePageCount);
    const trianglesOf = (some) => some.reduce((sum, { triangles }) => sum + triangles, 0);
    return {
      fetched: this.#document.fetched,
      requests: this.#document.requests,
      waiting: jobs,
      pages: pages.length,
      resident: pages.filter(({ state }) => state === RESIDENT).length,
      missing: this.#missing,
      triangles: trianglesOf(visible),
      fullTriangles: trianglesOf(fine),
      ranges: visible.reduce((sum, { starts }) => sum + starts.length, 0),
      threshold: this.threshold,
      error: this.#error,
      complete: this.complete,
      bytes,
    };
  }

  close(reason = null) {
    this.#abort.abort(reason ?? new SourceError('the stream is closed'));
    this.#release();
    this.#release = () => {};
  }
}

function pageWorker() {
  // Bundlers look for this expression.
  const start = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  return startWorker('stream/core/worker.js', start);
}
