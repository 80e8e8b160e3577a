// Memory of a stream of a file with levels, for its first picture and with all of it resident, in
// bytes and bytes a triangle. Needs web/decoder.wasm (make web); no engine, and no pictures.
// Usage: node bench/stream_memory.mjs FILE.glb [MAX_BYTES]; prints JSON.
import { readFileSync } from 'node:fs';

import { View } from '../web/stream/core/cut.js';
import { openStreamer } from '../web/stream/core/streamer.js';

const [file, maxBytes = 64e6] = process.argv.slice(2);
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const ALL = new View({ eye: null, pixelsPerUnit: 1, near: 1 }); // orthographic, in all directions

const streamer = await openStreamer(new Blob([readFileSync(file)]), { maxBytes: Number(maxBytes) });
for (const one of streamer.primitives) streamer.addInstance(one).place(IDENTITY);

// Updates until a condition holds. Returns the most bytes meanwhile.
async function until(isOver, view, pixels) {
  let most = 0;
  for (;;) {
    streamer.update(view, pixels);
    most = Math.max(most, streamer.statistics.bytes.total);
    if (isOver(streamer.statistics)) return most;
    await new Promise((resolve) => setTimeout(resolve, 2));
  }
}

function memory(most) {
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

const FAR = 1e9; // pixels of error: the first picture only
const first = await until(({ waiting }) => streamer.ready && waiting === 0, ALL, FAR);
streamer.update(ALL, FAR);
// All pages of level 0 are drawn at no error at all.
const result = { first: memory(first) };
const all = await until(({ complete, waiting }) => complete && waiting === 0, ALL, 0);
result.all = memory(all);
streamer.close();
process.stdout.write(`${JSON.stringify(result, null, 1)}\n`);
process.exit(0);
