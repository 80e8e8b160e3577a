// What bench/transport.py runs in Node: unpacks packed views with web/transport.js on one thread.
// Usage: node transport_worker.mjs WEB LIST RUNS. LIST: a file with [[path, resident bytes] ...].
// Prints the seconds of the fastest of RUNS runs.
import { readFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, list, runs] = process.argv.slice(2);
const { createUnpacker } = await import(pathToFileURL(path.join(web, 'transport.js')));
const views = JSON.parse(readFileSync(list)).map(([file, size]) => [
  new Uint8Array(readFileSync(file)),
  size,
]);
const unpacker = await createUnpacker();
let least = Number.POSITIVE_INFINITY;
for (let i = 0; i < Number(runs); i++) {
  const start = performance.now();
  for (const [view, size] of views) unpacker.unpack(view, size);
  least = Math.min(least, (performance.now() - start) / 1000);
}
console.log(least);
