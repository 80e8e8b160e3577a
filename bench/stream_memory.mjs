// Memory of streams of a file with levels, in bytes and bytes a triangle: for the first picture, for a
// view of at least 31,092 triangles, with all of it resident, and of 20 streams of such a view together.
// Needs web/decoder.wasm (make web); no engine and no pictures: a stand-in takes the place of buffers on
// the GPU, as three.js with WebGL and Babylon.js have them. With `arrays`, pages also lie in arrays, as
// with WebGPU.
// Usage: node bench/stream_memory.mjs FILE.glb [MAX_BYTES] [arrays]; prints JSON.
import { readFileSync } from 'node:fs';

import { View } from '../web/stream/core/cut.js';
import { openStreamer } from '../web/stream/core/streamer.js';

const [file, maxBytes = 64e6, mode] = process.argv.slice(2);
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const ALL = new View({ eye: null, pixelsPerUnit: 1, near: 1 }); // orthographic, in all directions
const VIEW_TRIANGLES = 31_092;
const STREAMS = 20;
const STREAM_BYTES = 16e6;
const FAR = 1e9; // pixels of error: the first picture only

// Buffers of a GPU, which hold nothing here.
const standIn = () => ({
  resize() {},
  write() {},
  read: (_number, begin, end) => new Float32Array(end - begin),
  release() {},
});

async function open(bytes) {
  const streamer = await openStreamer(new Blob([readFileSync(file)]), { maxBytes: bytes });
  for (const one of streamer.primitives) streamer.addInstance(one).place(IDENTITY);
  return streamer;
}

// Updates until a condition holds. Returns the most bytes meanwhile.
async function until(streamer, isOver, pixels) {
  let most = 0;
  for (;;) {
    streamer.update(ALL, pixels);
    most = Math.max(most, streamer.statistics.bytes.total);
    if (isOver(streamer.statistics)) return most;
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
}

const isAtRest = ({ complete, waiting }) => complete && waiting === 0;

async function toBuffers(streamer) {
  await until(streamer, ({ waiting }) => streamer.ready && waiting === 0, FAR);
  if (mode !== 'arrays') await streamer.moveTo(standIn);
}

// The largest error, but for steps of a tenth, that shows so many triangles. The error of the groups
// is in units of the file.
async function errorOf(streamer) {
  let error = streamer.primitives[0].tables.spheres[3];
  for (;;) {
    await until(streamer, isAtRest, error);
    if (streamer.statistics.triangles >= VIEW_TRIANGLES) return error;
    error /= 1.1;
  }
}

function memory(streamer, most) {
  const { triangles, resident, bytes, threshold } = streamer.statistics;
  const perTriangle = (bytes.gpu + bytes.arrays) / triangles;
  return {
    triangles,
    resident,
    threshold,
    bytes,
    most,
    perTriangle: Math.round(10 * perTriangle) / 10,
  };
}

const result = {};
const one = await open(Number(maxBytes));
await toBuffers(one);
one.update(ALL, FAR);
result.first = memory(one, one.statistics.bytes.total);
const error = await errorOf(one);
result.view = memory(one, one.statistics.bytes.total);
result.all = memory(one, await until(one, isAtRest, 0));
one.close();

const several = await Promise.all(Array.from({ length: STREAMS }, () => open(STREAM_BYTES)));
for (const streamer of several) {
  await toBuffers(streamer);
  await until(streamer, isAtRest, error);
}
const sum = (name) => several.reduce((all, { statistics }) => all + statistics.bytes[name], 0);
const { wasm } = several[0].statistics.bytes;
const triangles = several.reduce((all, { statistics }) => all + statistics.triangles, 0);
result.several = {
  streams: STREAMS,
  triangles,
  workers: several[0].decoders.size,
  bytes: sum('total') - sum('wasm') + wasm, // Workers are shared
};
process.stdout.write(`${JSON.stringify(result, null, 1)}\n`);
process.exit(0);
