// A blob decoded as ranges of its meshlets at the same time; for pool.js.
import { KEPT_BYTES, MalformedError } from './decoder.js';

// More ranges than one for so many meshlets are not worth their messages.
const LEAST_MESHLETS = 512;

// From a range to the next its meshlets grow by this factor: the page's thread copies one range
// while the next one's Worker still decodes, in about a fifth of the time that decoding takes.
const GROWTH = 1.25;

// As OuterVertex and Kept of codec/decode: a range numbers the vertices of earlier ranges downwards
// from OUTER_FIRST, an int32; how `place` counts; the bytes of what is kept of a meshlet.
const OUTER_FIRST = -2;
const OUTER_REFERENCE = 65;
const OUTER_LAST = 64;
const KEPT_START = 256; // after the vertex numbers
const KEPT_END = 320;

// The first i of n ranges, as a share of all.
function shareOf(i, n) {
  return (GROWTH ** i - 1) / (GROWTH ** n - 1);
}

// At most `count` ranges of a blob's meshlets, as options of Decoder.decodeRange.
export function rangesOf({ meshlets, begin }, count, least = LEAST_MESHLETS) {
  const n = Math.max(1, Math.min(count, Math.floor(meshlets / least)));
  const ends = Array.from({ length: n }, (_, i) => Math.round(meshlets * shareOf(i + 1, n)));
  const ranges = [...new Set(ends)].filter((end) => end > 0);
  return ranges.map((end, i) => ({
    begin: i > 0 ? ranges[i - 1] : 0,
    end,
    first: ranges.length > 1 ? 0 : begin.vertices, // a single range can number them as the view does
    keep: i + 1 < ranges.length,
  }));
}

// Leading blobs, at least one, with no more triangles than the first of n ranges would have.
export function headOf(blobs, n) {
  const most = blobs.at(-1).end.triangles * shareOf(1, n);
  const others = blobs.findIndex(({ end }, i) => i > 0 && end.triangles > most);
  return others < 0 ? blobs : blobs.slice(0, others);
}

// Joins the decoded ranges of a blob in the plan's result. The parts of a range wait for the arrays
// of the result, and until the ranges before it have ended, which tells where they belong.
export class Joint {
  #plan;
  #blob;
  #ranges;
  #joined = 0; // ranges that are in the result
  #at = { triangles: 0, vertices: 0 }; // in these

  constructor(plan, blob, ranges) {
    this.#plan = plan;
    this.#blob = blob;
    this.#ranges = ranges.map((range) => ({ ...range, parts: [], outer: [], ended: false }));
  }

  // A decoded part of range i, in order.
  add(i, part) {
    this.#ranges[i].parts.push(part);
    this.advance();
  }

  // Range i has ended; its counts and what it keeps, of Decoder.decodeRange.
  end(i, result) {
    const { kept } = result;
    const keptNumbers = kept && new Int32Array(kept.buffer);
    Object.assign(this.#ranges[i], result, { keptNumbers, ended: true });
    this.advance();
  }

  // Throws unless the joined ranges have as many vertices as the blob.
  check() {
    const { begin, end } = this.#blob;
    if (this.#at.vertices !== end.vertices - begin.vertices)
      throw new MalformedError('the ranges have other vertices than the blob');
  }

  // Inserts what need not wait any more.
  advance() {
    while (this.#plan.result.indices && this.#joined < this.#ranges.length) {
      const range = this.#ranges[this.#joined];
      range.base = this.#blob.begin.vertices + this.#at.vertices - range.first;
      for (const part of range.parts.splice(0)) this.#insert(range, part);
      if (!range.ended) return;
      this.#at.triangles += range.triangles;
      this.#at.vertices += range.vertices;
      this.#joined++;
    }
  }

  #insert(range, part) {
    const { begin, end } = this.#blob;
    const triangles = this.#at.triangles + part.at.triangles;
    const vertices = this.#at.vertices + part.at.vertices;
    if (begin.vertices + vertices + part.vertexCount > end.vertices) return; // check() will throw
    const { outer } = part;
    for (let i = 0; i < outer.length; i += 2)
      range.outer.push(this.#numberOf(outer[i], outer[i + 1]));
    if (range.base > 0) renumber(part.indices, range);
    this.#plan.insert(this.#blob, part, { triangles, vertices });
  }

  // The view's number of a vertex of a joined range.
  #numberOf(meshlet, place) {
    const range = this.#ranges.find(({ end }) => meshlet < end);
    const { kept, keptNumbers } = range;
    const record = KEPT_BYTES * (meshlet % (kept.length / KEPT_BYTES));
    const slot = Math.floor(place / OUTER_REFERENCE);
    const vertex = place % OUTER_REFERENCE;
    const isLast = vertex === OUTER_LAST;
    const own = isLast ? kept[record + KEPT_END + slot] : kept[record + KEPT_START + slot] + vertex;
    return numbered(keptNumbers[record / 4 + own], range);
  }
}

// From a range's number of a vertex to the view's.
function numbered(number, { base, outer }) {
  return number >= 0 ? number + base : outer[OUTER_FIRST - number];
}

// The same for all. With a call for each, joining half of dragon took 12 ms instead of 3.
function renumber(indices, { base, outer }) {
  const numbers = new Int32Array(indices.buffer);
  const { length } = numbers;
  for (let i = 0; i < length; i++) {
    const number = numbers[i];
    numbers[i] = number >= 0 ? number + base : outer[OUTER_FIRST - number];
  }
}
