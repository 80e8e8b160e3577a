// Finds the decoded vertices that are one vertex of the source (specification, "Joining
// vertices"). The rule is that of codec/common/join_vertices.cpp, which also knows which vertices
// share a position by a reference.

import { MalformedError } from './blob.js';

const MOST_COMPARED = 16; // open edges of one place that are matched with care
const MOST_TRIED = 8; // vertices of one place that another one may join

// decoded: of decodePrimitive, with integers. firsts: number of each blob's first vertex.
// sourceVertices: number of the source's vertices. Returns {numbers, count}: the number of each
// vertex, equal for those that are one, in order of first occurrence; how many there are.
export function joinVertices(decoded, firsts, sourceVertices) {
  const joiner = new Joiner(decoded, firsts, Math.max(sourceVertices, 1));
  joiner.run();
  return joiner.numbered();
}

// Vertices that the source has apart although all their integers are equal (specification, "Equal
// vertices"). decoded: as above; table: the bytes. Returns {indices, rows}: for each of the source's
// vertices one that is decoded.
export function separateVertices({ indices, vertexCount, streams }, table) {
  const first = placesOf(streams, vertexCount);
  const rows = [];
  const places = new Uint32Array(vertexCount);
  first.forEach((f, v) => {
    places[v] = f === v ? rows.push(v) - 1 : places[f];
  });
  const corners = rows.map(() => []);
  const separated = Uint32Array.from(indices, (v, corner) => {
    corners[places[v]].push(corner);
    return places[v];
  });
  const count = rows.length;
  const bits = new Bits(table);
  if (bits.count > count) throw new MalformedError(NOT_THERE);
  const gaps = bits.unary().map((quotient) => quotient * 2 ** bits.parameter);
  for (let n = 0; n < gaps.length; n++) gaps[n] += bits.take(bits.parameter);
  const copies = bits.unary();
  let place = -1;
  for (let n = 0; n < gaps.length; n++) {
    place += 1 + gaps[n];
    const vertices = 2 + copies[n];
    if (!(place < count && vertices <= corners[place].length)) throw new MalformedError(NOT_THERE);
    const width = 32 - Math.clz32(vertices - 1);
    for (const corner of corners[place].slice(1)) {
      const rank = bits.take(width);
      if (rank >= vertices) throw new MalformedError(NOT_THERE);
      if (rank > 0) separated[corner] = rows.length + rank - 1;
    }
    for (let copy = 1; copy < vertices; copy++) rows.push(rows[place]);
  }
  return { indices: separated, rows };
}

const NOT_THERE = 'its table of equal vertices names vertices that are not there';
const CUT_OFF = 'its table of equal vertices is cut off';

class Bits {
  #table;
  #at = 40;

  constructor(table) {
    if (table.length < 5) throw new MalformedError(CUT_OFF);
    this.#table = table;
    this.count = new DataView(table.buffer, table.byteOffset).getUint32(0, true);
    this.parameter = table[4];
    if (this.parameter > 31) throw new MalformedError(NOT_THERE);
  }

  take(width) {
    let value = 0;
    for (let bit = 0; bit < width; bit++, this.#at++) {
      const byte = this.#table[this.#at >> 3];
      if (byte === undefined) throw new MalformedError(CUT_OFF);
      value += ((byte >> (this.#at & 7)) & 1) * 2 ** bit;
    }
    return value;
  }

  // Of each place, the zeros before a one.
  unary() {
    const numbers = [];
    while (numbers.length < this.count) {
      let zeros = 0;
      while (this.take(1) === 0) zeros++;
      numbers.push(zeros);
    }
    return numbers;
  }
}

class Joiner {
  constructor({ indices, vertexCount, streams }, firsts, sourceVertices) {
    this.indices = indices;
    this.firsts = firsts;
    this.sourceVertices = sourceVertices;
    this.left = vertexCount;
    this.target = 0;
    this.parent = Uint32Array.from({ length: vertexCount }, (_, v) => v);
    this.place = placesOf(streams, vertexCount); // of each vertex: the first one equal to it
    this.members = new Map(); // place -> its vertices, if it has several
    this.place.forEach((place, v) => {
      if (place === v) return;
      if (!this.members.has(place)) this.members.set(place, [place]);
      this.members.get(place).push(v);
    });
    this.others = new Map(); // root of a set -> vertices that are not in it
    this.collapsed = new Set(); // places of edges without length
    this.matches = []; // two open edges on each other, in opposite directions
  }

  run() {
    let places = this.left;
    for (const members of this.members.values()) places -= members.length - 1;
    if (this.sourceVertices <= places) {
      this.parent.set(this.place);
      return;
    }
    this.target = this.sourceVertices;
    this.#findMatches();
    for (const match of this.matches)
      if (this.#blobOf(match.a.from) !== this.#blobOf(match.b.from)) this.#joinEnds(match);
    this.#joinTouching(false);
    this.#joinWithoutClosing();
    for (const match of this.matches) this.#joinEnds(match);
    this.#joinTouching(true);
  }

  numbered() {
    const { parent } = this;
    for (let v = 0; v < parent.length; v++) parent[v] = this.#find(v);
    let count = 0;
    for (let v = 0; v < parent.length; v++)
      parent[v] = parent[v] === v ? count++ : parent[parent[v]];
    return { numbers: parent, count };
  }

  #blobOf(v) {
    let [low, high] = [0, this.firsts.length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.firsts[middle] <= v) low = middle;
      else high = middle;
    }
    return low;
  }

  #findMatches() {
    const edges = this.#edges();
    let open = [];
    for (let i = 0, end; i < edges.length; i = end) {
      const first = edges[i];
      for (end = i; end < edges.length && samePlaces(edges[end], first); )
        end = addOpen(edges, end, open);
      if (first.low === first.high) this.#matchCollapsed(open);
      else this.#matchOpposite(open);
      open = [];
    }
  }

  // The edges at vertices that are not alone at their place, sorted by places, then by vertices.
  #edges() {
    const { indices, place, members } = this;
    const edges = [];
    for (let i = 0; i < indices.length; i++) {
      const [from, to] = [indices[i], indices[i % 3 === 2 ? i - 2 : i + 1]];
      const [start, end] = [place[from], place[to]];
      if (from === to || !(members.has(start) || members.has(end))) continue;
      edges.push({ low: Math.min(start, end), high: Math.max(start, end), from, to });
      if (start !== end) continue;
      this.#separate(from, to);
      this.collapsed.add(start);
    }
    const key = ({ low, high, from, to }) => {
      return [low, high, Math.min(from, to), Math.max(from, to), from];
    };
    return edges
      .map((edge) => ({ edge, key: key(edge) }))
      .sort((a, b) => {
        const at = a.key.findIndex((number, k) => number !== b.key[k]);
        return at < 0 ? 0 : a.key[at] - b.key[at];
      })
      .map(({ edge }) => edge);
  }

  #matchCollapsed(open) {
    for (let i = 1; i < open.length; i += 2) this.matches.push({ a: open[i - 1], b: open[i] });
  }

  #matchOpposite(open) {
    const forth = open.filter((edge) => this.place[edge.from] === edge.low);
    const back = open.filter((edge) => this.place[edge.from] !== edge.low);
    const withCare = Math.max(forth.length, back.length) <= MOST_COMPARED;
    for (let i = 0; i < Math.min(forth.length, back.length); i++) {
      const a = forth[i];
      // One that has a vertex in common is the likelier one.
      const likely = (b, k) => k >= i && (a.from === b.to || a.to === b.from);
      const best = withCare ? back.findIndex(likely) : i;
      if (best > i) [back[i], back[best]] = [back[best], back[i]];
      this.matches.push({ a, b: back[i] });
    }
  }

  // Joins vertices that no edges connect. all: also where it is doubtful.
  #joinTouching(all) {
    const doubtful = new Set(all ? [] : this.collapsed);
    if (!all)
      for (const { a, b } of this.matches) {
        if (this.#find(a.from) !== this.#find(b.to)) doubtful.add(this.place[a.from]);
        if (this.#find(a.to) !== this.#find(b.from)) doubtful.add(this.place[a.to]);
      }
    for (const [place, members] of this.members) {
      if (doubtful.has(place)) continue;
      const roots = [];
      for (const v of members) {
        const joins = (root) => this.#find(v) === this.#find(root) || this.#join(v, root);
        if (!roots.slice(0, MOST_TRIED).some(joins)) roots.push(v);
      }
    }
  }

  // Joins ends of matches unless that closes an edge; those with one match first.
  #joinWithoutClosing() {
    const ends = new Map(); // pair of vertices -> the other ends of their matches
    const add = (a, b, others) => {
      if (this.#find(a) === this.#find(b)) return;
      const name = `${Math.min(a, b)} ${Math.max(a, b)}`;
      if (!ends.has(name)) ends.set(name, { a: Math.min(a, b), b: Math.max(a, b), others: [] });
      ends.get(name).others.push(others);
    };
    for (const { a, b } of this.matches) {
      add(a.from, b.to, [a.to, b.from]);
      add(a.to, b.from, [a.from, b.to]);
    }
    const pairs = [...ends.values()].sort((x, y) => x.a - y.a || x.b - y.b);
    const closes = ([a, b]) => this.#find(a) === this.#find(b);
    for (const single of [true, false])
      for (const { a, b, others } of pairs)
        if ((others.length === 1) === single && !others.some(closes)) this.#join(a, b);
  }

  #joinEnds({ a, b }) {
    this.#join(a.from, b.to);
    this.#join(a.to, b.from);
  }

  #find(v) {
    const { parent } = this;
    while (parent[v] !== v) v = parent[v] = parent[parent[v]];
    return v;
  }

  #join(a, b) {
    const [v, w] = [this.#find(a), this.#find(b)].sort((x, y) => x - y);
    if (v === w || this.left <= this.target || this.#areApart(v, w)) return false;
    this.parent[w] = v;
    this.left--;
    const moved = this.others.get(w);
    if (!moved) return true;
    this.others.delete(w);
    const [less, more] = [moved, this.others.get(v) ?? []].sort((x, y) => x.length - y.length);
    for (const vertex of less) more.push(vertex);
    this.others.set(v, more);
    return true;
  }

  // Corners of one triangle are different vertices.
  #separate(v, w) {
    for (const [one, other] of [
      [v, w],
      [w, v],
    ]) {
      if (!this.others.has(one)) this.others.set(one, []);
      this.others.get(one).push(other);
    }
  }

  #areApart(v, w) {
    const [a, b] = [this.others.get(v), this.others.get(w)];
    if (!a || !b) return false;
    return a.length <= b.length
      ? a.some((vertex) => this.#find(vertex) === w)
      : b.some((vertex) => this.#find(vertex) === v);
  }
}

const samePlaces = (a, b) => a.low === b.low && a.high === b.high;

// Adds what is left of the edges between two vertices, from `first` on, when pairs in opposite
// directions are gone. Returns the number of the edge after them.
function addOpen(edges, first, open) {
  const { from, to } = edges[first];
  const between = (e) => (e.from === from && e.to === to) || (e.from === to && e.to === from);
  let end = first;
  let same = 0;
  for (; end < edges.length && between(edges[end]); end++) same += Number(edges[end].from === from);
  const other = end - first - same;
  for (let n = other; n < same; n++) open.push(edges[first]);
  for (let n = same; n < other; n++) open.push(edges[end - 1]);
  return end;
}

// Of each vertex: the first one with the same integers.
function placesOf(streams, count) {
  const places = new Uint32Array(count);
  let slots = 16;
  while (slots < 2 * count) slots *= 2;
  const table = new Int32Array(slots).fill(-1);
  const equal = (v, w) =>
    streams.every(({ values, elements: n }) => {
      for (let c = 0; c < n; c++) if (values[n * v + c] !== values[n * w + c]) return false;
      return true;
    });
  for (let v = 0; v < count; v++) {
    let hash = 0;
    for (const { values, elements: n } of streams)
      for (let c = 0; c < n; c++) {
        hash = Math.imul(hash ^ values[n * v + c], 0x9e3779b1);
        hash ^= hash >>> 15;
      }
    let slot = hash & (slots - 1);
    while (table[slot] >= 0 && !equal(table[slot], v)) slot = (slot + 1) & (slots - 1);
    if (table[slot] < 0) table[slot] = v;
    places[v] = table[slot];
  }
  return places;
}
