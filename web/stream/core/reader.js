// Opens what streams of a document: finds primitives with levels, reads their tables and the pages
// of the first picture. A primitive whose levels are malformed is refused.

import { EXTENSION } from '../../accessors.js';
import { MalformedError, readStreams, sameStreams } from '../../blob.js';
import { readPlaces, transport } from '../io/document.js';
import { LOD, readCounts, Tables } from '../io/tables.js';
import { tooSmall } from './budget.js';
import { Cut } from './cut.js';
import { formatsOf } from './formats.js';
import { Page } from './page.js';
import { keyOf, Primitive } from './primitives.js';

// Of the pages of the first picture, of all primitives: the coarsest level alone may be shapeless.
const FIRST_BYTES = 96 * 1024;
const HEADER_BYTES = 32 + 28 * 64; // of a blob, at most

// A malformed file makes errors of the language, too.
export function ours(error) {
  const language = [TypeError, RangeError, SyntaxError, ReferenceError];
  if (!language.some((Type) => error instanceof Type)) return error;
  const malformed = new MalformedError(`its JSON is malformed (${error.message})`);
  malformed.cause = error;
  return malformed;
}

export class Reader {
  #document;
  #maxBytes;
  #onWarning;
  #unpacker = null; // for the first pages

  constructor(document, { maxBytes, onWarning }) {
    this.#document = document;
    this.#maxBytes = maxBytes;
    this.#onWarning = onWarning;
    this.primitives = [];
    this.refused = []; // {name, key, error}: primitives whose levels cannot be used
    this.unpackerModule = null; // of a packed file
  }

  // exclude: keys of primitives.
  async open(exclude) {
    this.primitives = this.#candidates(exclude);
    await this.#readTables();
    await this.#readFirstPages();
    this.#unpacker = null; // Workers have their own
    this.#forgetHeads();
  }

  // Forgets the first bytes of files, but where they hold groups that are not known yet.
  #forgetHeads() {
    const kept = this.primitives.map(({ tables, places: [{ source, begin }] }) => {
      const [first, end] = tables.groupRange(tables.groupCount);
      return first < end && begin + first < source.held && source;
    });
    this.#document.forgetHeads(kept);
  }

  // The primitives whose levels can be streamed: without skins and morph targets.
  #candidates(exclude) {
    const { json } = this.#document;
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
          else
            this.#onWarning(`${name}: levels of unknown version ${levels.version}; loaded whole`);
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
      this.#onWarning(`${name}: ${error.message}; shown without levels`);
      return false;
    }
  }

  // Runs action(primitive, index) for each; drops those that fail.
  #forEach(action) {
    this.primitives = this.primitives.filter((one, i) =>
      this.#attempt(one.name, one.key, () => action(one, i)),
    );
  }

  async #readTables() {
    for (const one of this.primitives) {
      const { [EXTENSION]: compressed, [LOD]: levels } = one.primitive.extensions;
      const numbers = [levels.bufferView, levels.pages?.bufferView, compressed.bufferView];
      one.places = await Promise.allSettled(numbers.map((n) => this.#document.place(n)));
    }
    this.#forEach((one) => {
      one.places = one.places.map(({ value, reason }) => {
        if (reason) throw reason;
        return value;
      });
      const levels = one.primitive.extensions[LOD];
      for (const { bufferView } of [levels, levels.pages])
        checkView(this.#document.json.bufferViews[bufferView]);
      const [tables] = one.places;
      if (tables.isPacked) throw new MalformedError(`${LOD} has tables that are packed`);
      if (Tables.viewBytes(one.counts) !== tables.size)
        throw new MalformedError(`${LOD} has tables of another length than its counts say`);
    });
    const total = this.primitives.reduce((sum, { counts }) => sum + Tables.viewBytes(counts), 0);
    if (2 * total > this.#maxBytes)
      throw tooSmall(this.#maxBytes, `its tables have ${total} bytes`);
    const pages = await readParts(this.primitives, (one) => {
      one.tables ??= new Tables(one.counts);
      return one.tables.pageRange;
    });
    this.#forEach((one) => {
      const [, coarse, fine] = one.places;
      one.tables.addPages(pages.get(one), coarse.size, fine.size);
    });
    await this.#readPackedTables();
    this.#forEach((one) => this.#makePages(one));
    // At least the groups of the root pages and of the first picture. All, if the file does not tell
    // which pages are root pages, or if its first bytes hold all.
    await this.#readGroups(this.primitives, ({ tables, firstPages, places: [{ source, end }] }) =>
      tables.statedRoots === null || end <= source.held
        ? tables.groupCount
        : tables.partEnd(tables.pageFirst[Math.max(tables.statedRoots, firstPages)] - 1),
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
    if (packed.length === 0) return;
    const { createUnpacker, packedTable } = await transport();
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
    this.unpackerModule = await this.#document.unpackerModule();
    this.#unpacker = await createUnpacker(this.unpackerModule);
  }

  // Adds groups up to last(primitive) to some primitives.
  async #readGroups(some, last) {
    const groups = await readParts(some, (one) => one.tables.groupRange(last(one)));
    const ranges = new Map();
    this.#forEach((one) => {
      if (groups.has(one)) ranges.set(one, one.tables.runRange(groups.get(one)));
    });
    const runs = await readParts([...ranges.keys()], (one) => ranges.get(one));
    this.#forEach((one) => {
      if (runs.has(one)) one.tables.addGroups(groups.get(one), runs.get(one));
    });
  }

  // Reads on to the groups of a primitive that the last walk lacks. Throws MalformedError,
  // SourceError.
  async readMore(one) {
    await this.#readGroups([one], ({ tables, lacks }) => tables.partEnd(lacks));
    if (!this.primitives.includes(one)) throw new MalformedError('its levels are malformed');
    one.levels = null;
    this.#forgetHeads();
  }

  // The first page of each primitive says how all of its pages are stored, level 0 included.
  async #readFirstPages() {
    const places = this.primitives.map(({ pages, firstPages }) => {
      const [{ source, begin }] = pages;
      const last = pages[firstPages - 1];
      return { source, begin, end: last.begin + last.length };
    });
    const total = places.reduce((sum, { begin, end }) => sum + end - begin, 0);
    if (4 * total > this.#maxBytes) throw tooSmall(this.#maxBytes, 'its first pages do not fit');
    const headers = this.primitives.map(({ pages, tables }) => {
      const { source, begin, length, packed } = pages[tables.coarsePageCount];
      return { source, begin, end: begin + (packed ? 0 : Math.min(length, HEADER_BYTES)) };
    });
    const bytes = await readPlaces([...places, ...headers]);
    this.#forEach((one, i) => {
      const { json } = this.#document;
      const { attributes } = one.primitive;
      const streams = one.primitive.extensions[EXTENSION].attributes;
      storeFirst(one, bytes[i]);
      const [{ bytes: page, packed: size }] = one.pages;
      const unpacked = size ? this.#unpacker.unpackPage({ bytes: page, size }).slice() : page;
      one.streams = readStreams(unpacked);
      const header = bytes[places.length + i]; // pages are checked again when they are decoded
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
      const at = tables.pageBegin[p];
      const plain = { begin: at, end: at + size, size, raw: true };
      const place = table ? table[isFine ? p - tables.coarsePageCount : p] : plain;
      if (place.size !== size)
        throw new MalformedError('a packed page has another length than the tables say');
      const made = {
        source,
        begin: begin + place.begin,
        length: place.end - place.begin,
        packed: place.raw ? 0 : size,
        vertices: tables.pageVertices[p],
        triangles: tables.pageTriangles[p],
      };
      one.pages.push(new Page(one, p, made));
    }
    // In the first picture: the pages in its share of bytes, and root pages that are there anyway.
    const [{ source, begin }] = one.pages;
    const share = FIRST_BYTES / this.primitives.length;
    const comes = ({ number, begin: at, length }) =>
      at + length <= begin + share || (number < tables.statedRoots && at + length <= source.held);
    one.firstPages = 1;
    while (one.firstPages < tables.coarsePageCount && comes(one.pages[one.firstPages]))
      one.firstPages++;
  }
}

// Reads a part of the tables of each of some primitives: range(primitive) is [begin, end) in its
// view. Returns a Map.
async function readParts(some, range) {
  const places = some.map((one) => {
    const [{ source, begin: start }] = one.places;
    const [begin, end] = range(one);
    return { source, begin: start + begin, end: start + end };
  });
  const bytes = await readPlaces(places);
  return new Map(some.map((one, i) => [one, bytes[i]]));
}

function storeFirst({ pages }, bytes) {
  for (let p = 0, at = 0; at < bytes.length; at += pages[p++].length)
    pages[p].arrive(bytes.slice(at, at + pages[p].length));
}

// What formatsOf reads of an accessor.
function plain(accessor) {
  const { componentType, type, normalized } = accessor ?? {};
  return { componentType, type, normalized };
}

function checkView({ byteStride, target, byteOffset = 0, extensions }) {
  if (byteStride !== undefined || target !== undefined || byteOffset % 4 !== 0)
    throw new MalformedError(
      `${LOD} has a buffer view with a byteStride, a target or another offset than a multiple of 4`,
    );
  if (extensions?.EXT_meshopt_compression || extensions?.KHR_meshopt_compression)
    throw new MalformedError(`${LOD} has a buffer view that is compressed`);
}
