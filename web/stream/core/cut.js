// Cuts by the rule of EXT_meshlet_lod, for one camera and all instances of a primitive. Flat
// arrays; only groups whose coarser groups are all needed are looked at.

// Detail outside of the view, as a share of that inside: a camera that turns finds something.
const OUTSIDE = 0.1;
const MOST_PLANES = 4 * 6; // numbers of a view's planes

// A camera in the coordinates of an instance's matrix: eye (null: orthographic), pixelsPerUnit,
// near, and planes, four numbers each, that look into the view; null for all directions.
export class View {
  constructor({ eye, pixelsPerUnit, near, planes = null }) {
    if (planes?.length > MOST_PLANES) throw new RangeError('a view has at most six planes');
    this.eye = eye;
    this.pixelsPerUnit = pixelsPerUnit;
    this.near = near;
    this.planes = planes;
  }
}

// The largest singular value of the upper left 3 x 3 part of a matrix, column by column: the root
// of the largest eigenvalue of its transpose times itself.
export function largestScale(m) {
  const dot = (i, j) =>
    m[4 * i] * m[4 * j] + m[4 * i + 1] * m[4 * j + 1] + m[4 * i + 2] * m[4 * j + 2];
  const [a, b, c] = [dot(0, 0), dot(1, 1), dot(2, 2)];
  const [d, e, f] = [dot(0, 1), dot(1, 2), dot(0, 2)];
  const off = d * d + e * e + f * f;
  const mean = (a + b + c) / 3;
  if (off <= 1e-24 * mean * mean) return Math.sqrt(Math.max(a, b, c));
  const p = Math.sqrt(((a - mean) ** 2 + (b - mean) ** 2 + (c - mean) ** 2 + 2 * off) / 6);
  const [x, y, z] = [(a - mean) / p, (b - mean) / p, (c - mean) / p];
  const [u, v, w] = [d / p, e / p, f / p];
  const half = (x * (y * z - v * v) - u * (u * z - v * w) + w * (u * v - y * w)) / 2;
  return Math.sqrt(mean + 2 * p * Math.cos(Math.acos(Math.min(Math.max(half, -1), 1)) / 3));
}

export class Cut {
  #tables;
  #tops = [];
  #bounds = null; // centre and radius of a sphere around all groups
  #seen; // namers of a group that are needed
  #blocked; // a coarser group is not active
  #touched; // groups whose seen or blocked differ from those of a new walk
  #queue;
  #length = 0; // of the queue
  // Of the walk: the view, the instance's matrix and scale, the planes that cut the bounds, and
  // pixels of an error of one unit at distance one.
  #view = null;
  #matrix = null;
  #scale = 0;
  #planes = new Float64Array(MOST_PLANES);
  #planesEnd = 0;
  #pixelsPerError = 0;

  // tables: with the groups of the root pages, at least. active: of the last instance; groups with 1
  // have active[g] of the specification.
  constructor(tables) {
    const { groupCount, spheres, namers, known } = tables;
    this.#tables = tables;
    this.#seen = new Uint32Array(groupCount);
    this.#blocked = new Uint8Array(groupCount);
    this.#touched = new Uint32Array(groupCount);
    this.#queue = new Uint32Array(groupCount);
    this.active = new Uint8Array(groupCount);
    this.worst = 0; // error of the last cut, in pixels
    this.lacks = 0; // the last group that it has to know, if it is not known; else 0
    for (let g = 0; g < known; g++) {
      if (namers[g] > 0) continue;
      this.#tops.push(g); // its sphere holds those of all finer groups
      const [x, y, z, radius] = spheres.subarray(4 * g, 4 * g + 4);
      this.#bounds ??= [x, y, z, radius];
      const [a, b, c, reach] = this.#bounds;
      this.#bounds[3] = Math.max(reach, Math.hypot(x - a, y - b, z - c) + radius);
    }
  }

  get byteLength() {
    return 14 * this.#tables.groupCount;
  }

  // Walks an instance, {matrix, scale: largestScale(matrix)}. pixels > threshold is needed.
  // resident: of each page, 0 or not 0; null for all. priority: receives the largest pixels of each
  // page's needed groups; may be null.
  walk(view, { matrix, scale }, threshold, resident, priority = null) {
    const { known, page, firstRun, runGroup, namers, error: errors } = this.#tables;
    const queue = this.#queue;
    const seen = this.#seen;
    const blocked = this.#blocked;
    const active = this.active;
    const touched = this.#touched;
    for (let i = 0; i < this.#length; i++) active[queue[i]] = 0;
    let length = 0;
    for (const g of this.#tops) queue[length++] = g;
    this.#prepare(view, matrix, scale);
    let touches = 0;
    let worst = 0;
    let lacks = 0;
    for (let i = 0; i < length; i++) {
      const g = queue[i];
      const p = page[g];
      const error = errors[g] === Infinity ? Infinity : this.#pixels(g);
      if (error <= threshold) {
        if (error > worst) worst = error;
        continue;
      }
      if (priority !== null && error > priority[p]) priority[p] = error;
      const here = blocked[g] === 0 && (resident === null || resident[p] !== 0);
      active[g] = here ? 1 : 0;
      if (!here && error > worst) worst = error;
      for (let r = firstRun[g]; r < firstRun[g + 1]; r++) {
        const finer = runGroup[r];
        if (finer >= known) {
          if (error > worst) worst = error; // not less than that of the finer group
          if (finer > lacks) lacks = finer;
          continue;
        }
        if (seen[finer] === 0) touched[touches++] = finer;
        if (!here) blocked[finer] = 1;
        if (++seen[finer] === namers[finer]) queue[length++] = finer;
      }
    }
    for (let i = 0; i < touches; i++) {
      seen[touched[i]] = 0;
      blocked[touched[i]] = 0;
    }
    this.#length = length;
    this.worst = worst;
    this.lacks = lacks;
  }

  // Groups need to be tested only against the planes that cut the bounds of all.
  #prepare(view, m, scale) {
    const { pixelsPerUnit, planes } = view;
    this.#view = view;
    this.#matrix = m;
    this.#scale = scale;
    this.#planesEnd = 0;
    this.#pixelsPerError = scale * pixelsPerUnit;
    if (planes === null || this.#bounds === null) return;
    const [a, b, c, reach] = this.#bounds;
    const x = m[0] * a + m[4] * b + m[8] * c + m[12];
    const y = m[1] * a + m[5] * b + m[9] * c + m[13];
    const z = m[2] * a + m[6] * b + m[10] * c + m[14];
    const radius = reach * scale;
    for (let i = 0; i < planes.length; i += 4) {
      const height = planes[i] * x + planes[i + 1] * y + planes[i + 2] * z + planes[i + 3];
      if (height < -radius) {
        this.#planesEnd = 0;
        this.#pixelsPerError *= OUTSIDE;
        return;
      }
      if (height > radius) continue;
      for (let k = 0; k < 4; k++) this.#planes[this.#planesEnd++] = planes[i + k];
    }
  }

  #pixels(g) {
    const { spheres, error } = this.#tables;
    const { eye, near } = this.#view;
    const m = this.#matrix;
    const planes = this.#planes;
    const cx = spheres[4 * g];
    const cy = spheres[4 * g + 1];
    const cz = spheres[4 * g + 2];
    const x = m[0] * cx + m[4] * cy + m[8] * cz + m[12];
    const y = m[1] * cx + m[5] * cy + m[9] * cz + m[13];
    const z = m[2] * cx + m[6] * cy + m[10] * cz + m[14];
    const radius = spheres[4 * g + 3] * this.#scale;
    let pixels = error[g] * this.#pixelsPerError;
    if (eye !== null) {
      const dx = eye[0] - x;
      const dy = eye[1] - y;
      const dz = eye[2] - z;
      const distance = Math.sqrt(dx * dx + dy * dy + dz * dz) - radius;
      pixels /= Math.max(distance, near);
    }
    for (let i = 0; i < this.#planesEnd; i += 4)
      if (planes[i] * x + planes[i + 1] * y + planes[i + 2] * z + planes[i + 3] < -radius)
        return OUTSIDE * pixels;
    return pixels;
  }

  // Calls draw(page, first cluster, clusters, group) for what the last walk shows.
  forDrawn(draw) {
    const { page, firstCluster, clusters, firstRun, runGroup, runClusters } = this.#tables;
    const queue = this.#queue;
    const active = this.active;
    for (let i = 0; i < this.#length; i++) {
      const g = queue[i];
      if (active[g] === 0) continue;
      let cluster = firstCluster[g];
      if (firstRun[g] === firstRun[g + 1]) draw(page[g], cluster, clusters[g], g);
      for (let r = firstRun[g]; r < firstRun[g + 1]; r++) {
        if (active[runGroup[r]] === 0) draw(page[g], cluster, runClusters[r], g);
        cluster += runClusters[r];
      }
    }
  }
}
