// The tables of EXT_meshlet_lod (specification, section "Tables") as flat arrays, checked.

import { isObject } from '../../accessors.js';
import { MalformedError } from '../../blob.js';

export const LOD = 'EXT_meshlet_lod';
const VERSION = 1;
const PAGE_BYTES = 16;
const GROUP_BYTES = 32;
const RUN_BYTES = 4;
const MAX_GROUPS = 1 << 24;
const MAX_CLUSTERS = 255; // of a group
const MAX_TRIANGLES = 64; // of a cluster
const RUN_GROUP = (1 << 24) - 1; // mask; the rest is the number of clusters
// Groups that are read at a time, at least; gltf_ext/lod/cuts.py counts with it, too. The dragon with
// 14 M triangles has 3068 groups, in tables of 146 kB: 8 pixels of error ask 2 times for 35 kB of
// them, a flight around it 9 times. 64: 33 kB, 10 times, and pages of 2 pixels wait for a second
// part; 192: 37 kB, 8 times.
const LEAST_PART = 128;
const COUNTS = ['pageCount', 'coarsePageCount', 'groupCount', 'runCount'];

function expect(ok, problem) {
  if (!ok) throw new MalformedError(`${LOD} ${problem}`);
}

// The counts of an extension object. null without one, or with another version. Throws
// MalformedError.
export function readCounts(extension) {
  if (extension === undefined) return null;
  expect(isObject(extension), 'is not an object');
  expect(Number.isInteger(extension.version), 'has no valid version');
  if (extension.version !== VERSION) return null;
  for (const name of COUNTS) {
    const value = extension[name];
    expect(Number.isInteger(value) && value >= 0 && value < 2 ** 32, `has no valid ${name}`);
  }
  const { pageCount, coarsePageCount, groupCount, runCount, rootPageCount = null } = extension;
  expect(
    coarsePageCount > 0 &&
      coarsePageCount < pageCount &&
      pageCount <= groupCount &&
      groupCount <= MAX_GROUPS &&
      runCount >= 1 &&
      runCount < 256 * groupCount,
    'has counts that cannot be',
  );
  expect(
    rootPageCount === null ||
      (Number.isInteger(rootPageCount) && rootPageCount > 0 && rootPageCount <= pageCount),
    'has no valid rootPageCount',
  );
  return { pageCount, coarsePageCount, groupCount, runCount, rootPageCount };
}

// Filled by addPages, then addGroups, which takes the groups in parts. Groups from `known` on are not
// there yet: nothing of them is resident.
export class Tables {
  constructor({ pageCount, coarsePageCount, groupCount, runCount, rootPageCount }) {
    this.pageCount = pageCount;
    this.coarsePageCount = coarsePageCount;
    this.groupCount = groupCount;
    this.runCount = runCount;
    this.statedRoots = rootPageCount;
    this.rootPages = 0; // those that hold all top groups which are known
    this.known = 0;
    this.pageLength = new Uint32Array(pageCount);
    this.pageFirst = new Uint32Array(pageCount + 1); // group
    this.pageTriangles = new Uint32Array(pageCount);
    this.pageVertices = new Uint32Array(pageCount);
    this.pageBegin = new Float64Array(pageCount + 1); // byte in the view of its kind
    this.spheres = new Float32Array(4 * groupCount); // centre, radius
    this.error = new Float32Array(groupCount);
    this.page = new Uint32Array(groupCount);
    this.firstCluster = new Uint32Array(groupCount); // in its page
    this.clusters = new Uint8Array(groupCount);
    this.firstRun = new Uint32Array(groupCount + 1);
    this.runGroup = new Uint32Array(runCount);
    this.runClusters = new Uint8Array(runCount);
    this.namers = new Uint32Array(groupCount); // runs that name a group
  }

  // Of these arrays.
  get byteLength() {
    return Object.values(this).reduce((sum, value) => sum + (value?.byteLength ?? 0), 0);
  }

  // Of the view.
  static viewBytes({ pageCount, groupCount, runCount }) {
    return PAGE_BYTES * pageCount + GROUP_BYTES * groupCount + RUN_BYTES * runCount;
  }

  // The places in the view: of pages, and of the groups from `known` on up to last.
  get pageRange() {
    return [0, PAGE_BYTES * this.pageCount];
  }

  groupRange(last) {
    const begin = PAGE_BYTES * this.pageCount;
    return [begin + GROUP_BYTES * this.known, begin + GROUP_BYTES * last];
  }

  // The end of the next part if it has to hold group g: that of a page, as pages are known whole.
  partEnd(g) {
    const least = Math.min(Math.max(g + 1, this.known + LEAST_PART), this.groupCount);
    return this.pageFirst.find((first) => first >= least);
  }

  // The place of the runs of the groups in these bytes, which begin with the next group.
  runRange(groups) {
    const first = this.firstRun[this.known];
    const [, begin] = this.groupRange(this.groupCount);
    const data = new DataView(groups.buffer, groups.byteOffset, groups.byteLength);
    let runs = 0;
    for (let at = 0; at < groups.length; at += GROUP_BYTES) runs += data.getUint8(at + 31);
    expect(first + runs <= this.runCount, 'has runs that belong to no group');
    return [begin + RUN_BYTES * first, begin + RUN_BYTES * (first + runs)];
  }

  addPages(bytes, coarseBytes, fineBytes) {
    const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const { pageCount, coarsePageCount, groupCount, pageFirst, pageBegin } = this;
    let at = 0;
    for (let p = 0; p < pageCount; p++) {
      const row = PAGE_BYTES * p;
      const length = data.getUint32(row, true);
      expect(length > 0 && length % 4 === 0, 'has a page whose length is 0 or not a multiple of 4');
      const first = data.getUint32(row + 4, true);
      expect(
        p === 0 ? first === 0 : first > pageFirst[p - 1] && first < groupCount,
        'has pages without groups, or not in the order of their groups',
      );
      if (p === coarsePageCount) {
        expect(at === coarseBytes, 'does not describe its coarse pages');
        at = 0;
      }
      this.pageLength[p] = length;
      pageFirst[p] = first;
      this.pageTriangles[p] = data.getUint32(row + 8, true);
      this.pageVertices[p] = data.getUint32(row + 12, true);
      pageBegin[p] = at;
      at += length;
    }
    expect(at === fineBytes, 'does not describe its pages of level 0');
    pageFirst[pageCount] = groupCount;
    pageBegin[pageCount] = at;
    for (let p = 0; p < pageCount; p++)
      this.#checkCounts(p, MAX_CLUSTERS * (pageFirst[p + 1] - pageFirst[p]));
  }

  // Memory is planned by these counts.
  #checkCounts(p, clusters) {
    const most = MAX_TRIANGLES * clusters;
    expect(
      this.pageTriangles[p] <= most && this.pageVertices[p] <= 3 * most,
      'has a page with more triangles or vertices than its clusters can have',
    );
  }

  // The groups from `known` on, with all of their runs. The first part has those of the root pages.
  addGroups(bytes, runBytes) {
    const first = this.known;
    const last = first + bytes.length / GROUP_BYTES;
    const runs = new DataView(runBytes.buffer, runBytes.byteOffset, runBytes.byteLength);
    const firstRun = this.firstRun[first];
    for (let r = 0; r < runBytes.length / RUN_BYTES; r++) {
      const packed = runs.getUint32(RUN_BYTES * r, true);
      this.runGroup[firstRun + r] = packed & RUN_GROUP;
      this.runClusters[firstRun + r] = packed >>> 24;
    }
    const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    for (let g = first; g < last; g++) this.#addGroup(g, data, GROUP_BYTES * (g - first));
    expect(
      last < this.groupCount || this.firstRun[last] === this.runCount,
      'has runs that belong to no group',
    );
    for (let g = 0; g < last; g++) this.#checkRuns(g, first, last);
    for (let g = first; g < last; g++) {
      const isTop = this.error[g] === Infinity;
      expect(
        isTop === (this.namers[g] === 0),
        'has groups with a finite error that nothing replaces, or the reverse',
      );
      if (isTop) this.rootPages = this.page[g] + 1;
    }
    for (let p = this.page[first]; this.pageFirst[p + 1] <= last; p++)
      this.#checkCounts(p, this.pageClusters(p));
    this.known = last;
    expect(
      (this.statedRoots ?? this.rootPages) === this.rootPages,
      'has another rootPageCount than its groups',
    );
  }

  #addGroup(g, data, row) {
    const { spheres, pageFirst, page } = this;
    for (let c = 0; c < 4; c++) spheres[4 * g + c] = data.getFloat32(row + 4 * c, true);
    this.error[g] = data.getFloat32(row + 16, true);
    page[g] = data.getUint32(row + 24, true);
    this.firstCluster[g] = data.getUint16(row + 28, true);
    this.clusters[g] = data.getUint8(row + 30);
    const count = data.getUint8(row + 31);
    const p = page[g];
    expect(
      p < this.pageCount && pageFirst[p] <= g && g < pageFirst[p + 1],
      'has groups that are not in the page that lists them',
    );
    expect(this.clusters[g] > 0, 'has a group without clusters');
    const before = pageFirst[p] === g ? 0 : this.firstCluster[g - 1] + this.clusters[g - 1];
    expect(this.firstCluster[g] === before, 'has groups whose clusters do not follow on');
    expect(
      data.getUint32(row + 20, true) === this.firstRun[g],
      'has groups whose runs do not follow on',
    );
    this.firstRun[g + 1] = this.firstRun[g] + count;
    expect(
      spheres.subarray(4 * g, 4 * g + 4).every(Number.isFinite),
      'has a sphere that is not finite',
    );
    expect(
      spheres[4 * g + 3] >= 0 && this.error[g] >= 0,
      'has a radius or an error that is negative or no number',
    );
    expect(
      (count === 0) === p >= this.coarsePageCount,
      'has groups of level 0 in other pages than those of level 0',
    );
  }

  // Of the runs of group g those that name groups in [first, last); with g there, too, all of it.
  #checkRuns(g, first, last) {
    const { spheres, runGroup, runClusters } = this;
    const isNew = g >= first;
    let clusters = 0;
    for (let r = this.firstRun[g]; r < this.firstRun[g + 1]; r++) {
      const finer = runGroup[r];
      if (isNew) {
        expect(finer > g && finer < this.groupCount, 'has a run of a group that is not finer');
        expect(runClusters[r] > 0, 'has a run without clusters');
        clusters += runClusters[r];
        this.namers[finer]++;
      }
      if (finer < first || finer >= last) continue;
      expect(
        this.error[g] >= this.error[finer],
        'has an error that is larger than that of a coarser group',
      );
      const [x, y, z] = [0, 1, 2].map((c) => spheres[4 * g + c] - spheres[4 * finer + c]);
      const reach = Math.sqrt(x * x + y * y + z * z) + spheres[4 * finer + 3];
      expect(
        reach <= spheres[4 * g + 3],
        'has a sphere that reaches beyond that of a coarser group',
      );
    }
    if (isNew && this.firstRun[g + 1] > this.firstRun[g])
      expect(
        clusters === this.clusters[g],
        'has runs that do not make up the clusters of their group',
      );
  }

  // Clusters of a page; its groups are known.
  pageClusters(p) {
    const last = this.pageFirst[p + 1] - 1;
    return this.firstCluster[last] + this.clusters[last];
  }

  // Levels of the groups: 0 without runs, else one more than the highest of the runs.
  levels() {
    const level = new Uint8Array(this.groupCount);
    for (let g = this.known - 1; g >= 0; g--)
      for (let r = this.firstRun[g]; r < this.firstRun[g + 1]; r++)
        level[g] = Math.max(level[g], level[this.runGroup[r]] + 1);
    return level;
  }
}
