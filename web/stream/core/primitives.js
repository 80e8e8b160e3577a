// What streams of a file: primitives, their instances, and the ranges of indices to draw.
import { EXTENSION } from '../../accessors.js';
import { LOD } from '../io/tables.js';
import { Attempts } from './attempts.js';
import { largestScale } from './cut.js';
import { RESIDENT } from './page.js';

// Primitives of the JSON with equal keys have the same data.
export function keyOf({ attributes, indices, extensions, mode }) {
  const view = extensions?.[EXTENSION]?.bufferView;
  return JSON.stringify([view, mode, indices, attributes, extensions?.[LOD]]);
}

// A primitive with levels. key: of primitives of the JSON that share everything.
export class Primitive {
  constructor(key, name, primitive, counts) {
    this.key = key;
    this.name = name;
    this.primitive = primitive;
    this.counts = counts;
    this.places = null; // of the views of tables, coarse pages and fine pages
    this.tables = null;
    this.cut = null;
    this.pages = [];
    this.resident = null; // flags of pages
    this.priority = null; // of pages, in this frame
    this.lacks = 0; // as of a cut, for all instances
    this.attempts = new Attempts(); // to read on in its tables
    this.givenUp = 0; // what it lacked then
    this.instances = [];
    this.pool = null;
    this.streams = null;
    this.attributes = null;
    this.formats = null;
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
        .every(
          ({ state, wanted, attempts }) =>
            state === RESIDENT || wanted === 0 || attempts.failed > 0,
        );
    return this.opened;
  }

  get ready() {
    for (let p = 0; p < this.tables.rootPages; p++) if (!this.resident[p]) return false;
    return true;
  }

  get roots() {
    return this.pages.slice(0, this.tables.statedRoots ?? this.tables.rootPages);
  }
}

// An instance of a primitive; hidden until it is placed. starts, counts, tags: of the ranges of
// indices to draw; version changes with them.
export class Instance {
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
export class Ranges {
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
