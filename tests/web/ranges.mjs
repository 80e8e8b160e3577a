// Decodes the blobs of views as ranges of few meshlets and joins them, beside web/decoder.js.
// Usage: node ranges.mjs WEB LIST; LIST as for digest.mjs, with "ranges": numbers of ranges. Prints
// a line per difference, then how often several ranges were joined.
import { readFile } from 'node:fs/promises';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, listFile] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const { createDecoder } = await load('decoder.js');
const { Joint, rangesOf } = await load('ranges.js');
const list = JSON.parse(await readFile(listFile, 'utf8'));
const packed = new Uint8Array(await readFile(list.packed));
const decoder = await createDecoder();
const bytes = (array) => Buffer.from(array.buffer).toString('base64');
const text = ({ indices, streams }) => [indices, ...streams.map((s) => s.values)].map(bytes).join();
let joined = 0;

// Ranges end in any order: here the last one first.
function decodeRanges(view, integers, count) {
  const plan = decoder.plan(view, integers);
  plan.allocate();
  for (const blob of plan.blobs) {
    const ranges = rangesOf(blob, count, 1);
    const joint = new Joint(plan, blob, ranges);
    for (const i of [...ranges.keys()].reverse()) {
      const onPart = (part) => joint.add(i, part);
      joint.end(i, decoder.decodeRange(blob.bytes, { integers, ...ranges[i] }, onPart));
    }
    joint.check();
    joined += ranges.length > 1;
  }
  return plan.result;
}

list.views.forEach(([offset, length], number) => {
  const view = packed.slice(offset, offset + length);
  for (const integers of [false, true]) {
    const whole = text(decoder.decodePrimitive(view, { integers }));
    for (const count of list.ranges)
      if (text(decodeRanges(view, integers, count)) !== whole)
        console.log(`view ${number}, ${count} ranges: differs`);
  }
});
console.log(joined);
