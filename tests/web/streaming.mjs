// The package's modules and what tests of streams in Node share. The first argument of a script that
// imports this is the folder of the package.
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Worker } from 'node:worker_threads';

const [web] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
export const { createDecoder, MalformedError } = await load('decoder.js');
export const { delayAfter, openSource, SourceError } = await load('stream/io/source.js');
export const { openDocument } = await load('stream/io/document.js');
export const { readCounts, Tables, LOD } = await load('stream/io/tables.js');
export const { Cut, View, largestScale } = await load('stream/core/cut.js');
export const { openStreamer } = await load('stream/core/streamer.js');
export const { Session } = await load('stream/engine/session.js');
export const { Residency } = await load('stream/core/residency.js');
export const { NONE, Page, RESIDENT, STORED } = await load('stream/core/page.js');
await createDecoder(); // fails early without decoder.wasm

// A Worker of streams.
export const startWorker = () => new Worker(pathToFileURL(path.join(web, 'stream', 'worker.js')));
export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
export const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// Makes pauses shorter, such as those before another try; but not the time that Workers have to
// start, of which a busy machine needs some.
export function hurryTimers() {
  const { setTimeout: later } = globalThis;
  globalThis.setTimeout = (action, milliseconds, ...more) =>
    later(action, milliseconds < 30_000 ? milliseconds / 100 : milliseconds, ...more);
}

// Makes clocks faster, too, but for Date.
export function hurry() {
  hurryTimers();
  const { now } = performance;
  performance.now = () => 100 * now.call(performance);
}
export const PATIENT = { stallMs: 1e7 }; // options of streams in a hurry, on a busy machine

// Looks at the first primitive from `distance` radii, at an angle.
export function viewOf(streamer, distance = 2.5, angle = 0) {
  const [x, y, z, radius] = streamer.primitives[0]?.tables.spheres ?? [0, 0, 0, 1];
  const far = distance * radius;
  const eye = [x + far * Math.sin(angle), y, z + far * Math.cos(angle)];
  return new View({ eye, pixelsPerUnit: 1000, near: radius / 1000 });
}

// Opens a file; gives each primitive one instance. told: warnings, and what has broken the stream.
export async function open(place, options = {}) {
  const told = { warnings: [], broken: [] };
  const streamer = await openStreamer(place, {
    stallMs: 20_000,
    onWarning: (text) => told.warnings.push(text),
    onBroken: (error) => told.broken.push(error.message),
    ...options,
  });
  for (const one of streamer.primitives) streamer.addInstance(one).place(IDENTITY);
  return Object.assign(streamer, { told });
}

// A Worker that begins late, as on a busy machine.
export function lateWorker() {
  const worker = startWorker();
  const post = worker.postMessage.bind(worker);
  worker.postMessage = (...given) => setTimeout(post, 20, ...given);
  return worker;
}

// Whether a stream has told of anything: some problems it only warns of, and tries again.
export const hasProblem = ({ told, refused }) =>
  told.warnings.length + told.broken.length + refused.length > 0;

// Updates until nothing is missing, until the condition holds, or for so many milliseconds. Returns
// the largest total of bytes.
export async function rest(
  streamer,
  view,
  { pixels = 1, limit = 300_000, until = () => false } = {},
) {
  const end = Date.now() + limit;
  let most = 0;
  while (Date.now() < end && streamer.told.broken.length === 0 && !until(streamer)) {
    streamer.update(view, pixels);
    const { complete, waiting, bytes } = streamer.statistics;
    most = Math.max(most, bytes.total);
    if (complete && waiting === 0) break;
    await pause(3);
  }
  return most;
}

// What a session calls of an engine; told: the messages of each type.
export function placing(told) {
  return {
    load() {},
    show(streamer) {
      for (const one of streamer.primitives) streamer.addInstance(one).place(IDENTITY);
    },
    clear() {},
    tell: (type, message) => told[type]?.push(message),
  };
}

// What is drawn: [page, meshlets] of each primitive.
export function drawn(streamer) {
  return streamer.primitives.map(({ cut, instances: [instance] }) => {
    const ranges = [];
    cut.forDrawn((p, first, count) => ranges.push([p, first, count]));
    return [ranges.sort((a, b) => a[0] - b[0] || a[1] - b[1]), instance.triangles];
  });
}

// A number for the triangles that are drawn, in any order, by the positions in the arrays.
export function digest(streamer) {
  let sum = 0;
  for (const { pool, formats, instances } of streamer.primitives) {
    const a = formats.findIndex(({ name }) => name === 'POSITION');
    const { size } = formats[a];
    for (const { starts, counts } of instances)
      starts.forEach((start, r) => {
        for (let i = start; i < start + counts[r]; i += 3) {
          let hash = 7;
          for (let n = 0; n < 3 * size; n++) {
            const vertex = pool.index[i + Math.floor(n / size)];
            hash = Math.imul(hash, 31) + pool.arrays[a][size * vertex + (n % size)];
          }
          sum = (sum + hash) | 0;
        }
      });
  }
  return sum;
}

// The tables of the primitives of a file, all of them read; null without levels.
export async function tablesOf(document) {
  const found = [];
  for (const mesh of document.json.meshes)
    for (const { extensions } of mesh.primitives) {
      const counts = readCounts(extensions?.[LOD]);
      if (!counts) {
        found.push(null);
        continue;
      }
      const bytes = await document.readView(extensions[LOD].bufferView);
      const size = async (view) => (await document.readView(view)).length;
      const tables = new Tables(counts);
      const [fine, coarse] = [
        extensions.EXT_meshlet_edgebreaker.bufferView,
        extensions[LOD].pages.bufferView,
      ];
      tables.addPages(bytes.subarray(...tables.pageRange), await size(coarse), await size(fine));
      const groups = bytes.subarray(...tables.groupRange(counts.groupCount));
      tables.addGroups(groups, bytes.subarray(...tables.runRange(groups)));
      found.push(tables);
    }
  return found;
}

// The place of the tables of a file's first primitive in it: {begin, end, tables}.
export async function tablesPlace(bytes) {
  const document = await openDocument(new Blob([bytes]));
  const [tables] = await tablesOf(document);
  const { bufferView } = document.json.meshes[0].primitives[0].extensions[LOD];
  return { ...(await document.place(bufferView)), tables };
}
