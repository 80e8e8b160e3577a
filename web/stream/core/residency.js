// Which pages are in memory: requests those that are wanted, has them decoded, puts them into the
// pools, and evicts others, within the budget.
import { MalformedError } from '../../blob.js';
import { delayAfter } from '../io/source.js';
import { decodingBytes } from './budget.js';
import { NONE, RESIDENT, STORED } from './page.js';

const REQUESTS = 6; // at a time: what browsers send to one server with HTTP/1.1
let requests = 0; // of all streams of the web page
const REQUEST_BYTES = 131_072; // of neighbouring pages, if that many may wait
const INSERT_MS = 3; // a frame, for copying decoded pages

export class Residency {
  #given;
  #requests = new Set();
  #requested = 0; // bytes on the way
  #decoding = 0; // pages
  #decodingBytes = 0; // with the results that wait for their place
  #stored = 0; // bytes of compressed pages
  #waiting = 0; // of these, bytes of pages that wait for a decoder or their place
  #decoded = []; // pages that wait for their place
  #wasmBytes; // of the largest Worker
  #quiet = 0; // no requests until then: a server has asked for a pause

  // given: {document, decoders, unpackerModule, signal, refuse(primitive, error), onWarning, onChange,
  // onBroken}.
  constructor(primitives, pools, budget, given) {
    this.#given = given;
    this.budget = budget;
    this.#wasmBytes = budget.wasm;
    this.pools = pools;
    this.pages = primitives.flatMap(({ pages }) => pages);
    this.#stored = this.pages.reduce((sum, { bytes }) => sum + (bytes?.length ?? 0), 0);
    this.changes = 0; // of what is resident
  }

  #forget(page) {
    this.#stored -= page.bytes.length;
    page.forget();
  }

  // Requests and decodes what is wanted.
  schedule() {
    const now = performance.now();
    this.#cancel();
    this.#waiting = 0;
    for (const { wanted, bytes, state } of this.pages)
      if (bytes && state !== RESIDENT && (wanted > 0 || state > STORED))
        this.#waiting += bytes.length;
    const wanted = this.pages.filter(
      (page) => page.wanted > 0 && page.state <= STORED && page.attempts.isDue(now),
    );
    wanted.sort((a, b) => b.wanted - a.wanted);
    for (const page of wanted) {
      if (page.state === STORED) this.#decode(page);
      else if (page.state === NONE) this.#request(page);
    }
    this.#trim();
  }

  // Pages that were given up are tried again.
  retry() {
    this.#quiet = 0;
    for (const page of this.pages) page.attempts.reset();
  }

  // Ends requests of which nothing is wanted any more.
  #cancel() {
    for (const request of this.#requests)
      if (request.pages.every(({ wanted }) => wanted === 0)) request.abort.abort();
  }

  // A page with those of its neighbours that are wanted, too: at most so many bytes, if it has less.
  #withNeighbours(page, most) {
    const { pages } = page.owner;
    const end = ({ begin, length }) => begin + length;
    const now = performance.now();
    const joins = (next) =>
      next?.state === NONE &&
      next.wanted > 0 &&
      next.attempts.isDue(now) &&
      next.source === page.source;
    let [first, last] = [page, page];
    for (;;) {
      const [before, after] = [pages[first.number - 1], pages[last.number + 1]];
      if (joins(after) && after.begin === end(last) && end(after) - first.begin <= most)
        last = after;
      else if (joins(before) && end(before) === first.begin && end(last) - before.begin <= most)
        first = before;
      else return pages.slice(first.number, last.number + 1);
    }
  }

  #request(page) {
    // One of each stream, whatever the others do.
    if (requests >= REQUESTS && this.#requests.size > 0) return;
    if (performance.now() < this.#quiet) return;
    const { document } = this.#given;
    const { budget } = this;
    // With memory to decode it, so that its arrival makes #trim forget no page that is wanted.
    const decoding = Math.max(this.#decodingBytes, decodingBytes(page));
    const most = Math.min(budget.waiting - document.held, this.#memory - decoding);
    const pages = this.#withNeighbours(page, Math.min(REQUEST_BYTES, most));
    const length = pages.reduce((sum, one) => sum + one.length, 0);
    const before = this.#requested + this.#waiting;
    if (before > 0 && before + length > most) return;
    this.#requested += length;
    const request = { pages, abort: new AbortController() };
    this.#requests.add(request);
    requests++;
    for (const one of pages) one.request();
    const [{ begin }] = pages;
    page.source
      .read(begin, begin + length, request.abort.signal)
      .then(
        (bytes) => this.#arrived(pages, bytes),
        (error) => this.#failed(request, error),
      )
      .finally(() => {
        this.#requests.delete(request);
        requests--;
        this.#requested -= length;
        this.#given.onChange();
      });
  }

  #arrived(pages, bytes) {
    for (const page of pages) {
      const at = page.begin - pages[0].begin;
      page.arrive(bytes.slice(at, at + page.length));
      this.#stored += page.length;
    }
  }

  #failed({ pages, abort }, error) {
    for (const page of pages) page.fail();
    const { signal, onBroken, onWarning } = this.#given;
    if (abort.signal.aborted || signal.aborted) return;
    if (error.changed) return onBroken(error);
    if (error.retryAfter > 0) this.#quiet = performance.now() + delayAfter(1, error);
    for (const page of pages) this.#postpone(page, error);
    onWarning(error.message);
  }

  // A page that cannot be read or decoded: coarser clusters stand in for it. Without a root page
  // there is no stream.
  #postpone(page, error) {
    const isRoot = page.number < page.owner.tables.rootPages;
    const { onBroken, onChange, signal } = this.#given;
    if (!page.attempts.postpone(error, onChange, signal) && isRoot) onBroken(error);
  }

  // For pages on the way: what the first bytes of files and Workers that have grown leave.
  get #memory() {
    const { waiting, decoding, workers, wasm } = this.budget;
    return waiting + decoding - this.#given.document.held - workers * (this.#wasmBytes - wasm);
  }

  #decode(page) {
    const { owner } = page;
    const size = decodingBytes(page);
    const taken = this.#requested + this.#waiting + this.#decodingBytes;
    if (this.#decodingBytes + this.#requested > 0 && taken + size > this.#memory) return;
    page.decode();
    this.#decoding++;
    this.#decodingBytes += size;
    const { vertices, triangles } = page;
    const clusters = owner.tables.pageClusters(page.number);
    const expected = { vertices, triangles, clusters, streams: owner.streams };
    const packed = page.packed ? { module: this.#given.unpackerModule, size: page.packed } : null;
    const options = { attributes: owner.attributes, expected, packed };
    const job = { task: 'decodePage', bytes: page.bytes, options };
    this.#given.decoders
      .run(job, this.#given.signal)
      .then(
        (decoded) => {
          page.finish();
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
        this.#given.onChange();
      });
  }

  // A page that is malformed, or that a Worker has failed with. Without a root page there are no
  // levels, without Workers there is no stream.
  #bad(page, error) {
    if (this.#given.signal.aborted) return;
    this.#stored -= page.bytes.length;
    page.spoil();
    if (this.#given.decoders.ended) return this.#given.onBroken(error);
    const { owner, number } = page;
    const problem = `${owner.name}: page ${number}: ${error.message}`;
    if (number < owner.tables.rootPages) {
      page.attempts.block();
      return this.#given.refuse(owner, new MalformedError(problem));
    }
    this.#postpone(page, error);
    if (page.attempts.isOver) this.#given.onWarning(problem);
  }

  // Copies decoded pages to their places, as long as a frame has time.
  insertDecoded() {
    const start = performance.now();
    while (this.#decoded.length > 0 && performance.now() - start < INSERT_MS) {
      const { page, decoded, size } = this.#decoded.shift();
      this.#decodingBytes -= size;
      if (this.#makeRoom(page)) {
        page.insert(page.owner.pool.insert(page, decoded));
        this.changes++;
      } else page.dismiss();
    }
  }

  // Evicts pages that are not wanted, least recently needed ones first, until this one fits.
  #makeRoom(page) {
    const { pool } = page.owner;
    if (page.wanted === 0) return false;
    if (pool.fits(page)) return true;
    for (const one of this.unwanted(pool).sort((a, b) => a.used - b.used)) {
      this.evict(one);
      if (pool.fits(page)) return true;
    }
    return false;
  }

  // Resident pages of a pool that nothing needs.
  unwanted(pool) {
    return this.pages.filter(
      ({ state, wanted, owner }) => state === RESIDENT && wanted === 0 && owner.pool === pool,
    );
  }

  evict(page) {
    page.owner.pool.remove(page.place);
    page.evict();
    this.changes++;
  }

  // Forgets compressed bytes beyond the budget, of pages that were needed longest ago first. Of
  // those that are needed now, that of resident pages first, then that of the least urgent ones.
  #trim() {
    const spare = this.budget.maxBytes - (this.bytes.total - this.#stored);
    if (this.#stored <= spare) return;
    const kept = this.pages.filter(
      ({ bytes, state }) => bytes && (state === RESIDENT || state === STORED),
    );
    kept.sort((a, b) => a.used - b.used || b.state - a.state || a.wanted - b.wanted);
    for (const page of kept) {
      if (this.#stored <= spare) return;
      this.#forget(page);
    }
  }

  // Requests and decodings under way.
  get jobs() {
    return this.#requests.size + this.#decoding + this.#decoded.length;
  }

  // Whether decoded pages wait for their place.
  get hasDecoded() {
    return this.#decoded.length > 0;
  }

  // What it holds, by kind. The disk, textures and primitives without levels do not count.
  get bytes() {
    const arrays = this.pools.reduce((sum, pool) => sum + pool.byteLength, 0);
    const bytes = {
      gpu: arrays,
      arrays: this.pools.some(({ index }) => index) ? arrays : 0,
      wasm: this.budget.workers * this.#wasmBytes,
      compressed: this.#stored + this.#given.document.held,
      transit: this.#requested + this.#decodingBytes,
      tables: this.budget.tables,
    };
    bytes.total = Object.values(bytes).reduce((sum, value) => sum + value, 0);
    return bytes;
  }
}
