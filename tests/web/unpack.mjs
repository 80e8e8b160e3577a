// Unpacks the vectors of a folder with web/transport.js, on this thread and in Workers, then
// MUTATIONS random mutations of them on this thread.
// Usage: node unpack.mjs WEB FOLDER [MUTATIONS [SEED]]. Prints a line per difference.
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, folder, mutations = '0', seed = '1'] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const { createDecoderPool } = await load('pool.js');
const { TRANSPORT, createPageUnpacker, createUnpacker, packedPages, unpacking } =
  await load('transport.js');
const files = readdirSync(folder)
  .filter((name) => name.endsWith('.bin'))
  .map((name) => path.join(folder, name));
const views = files.map((file) => new Uint8Array(readFileSync(file)));
const unpacker = await createUnpacker();
const pool = await createDecoderPool({ workers: 2 });

const lengthOf = (view) => packedPages(view).reduce((sum, { size }) => sum + size, 0);
const ways = {
  'on this thread': (view) => unpacker.unpack(view, lengthOf(view)),
  'in Workers': (view) => {
    const extensions = { [TRANSPORT]: { byteLength: lengthOf(view) } };
    const json = { extensionsUsed: [TRANSPORT], bufferViews: [{ extensions }] };
    return unpacking(json, async () => view, pool)(0);
  },
};

// The resident bytes, or null if they are refused as they should be.
async function outcome(unpack) {
  try {
    return await unpack();
  } catch (error) {
    if (error.name !== 'MalformedError' || error.message.includes('memory')) throw error;
    return null;
  }
}

for (const [number, file] of files.entries()) {
  const resident = file.replace('.bin', '.resident');
  const expected = existsSync(resident) ? readFileSync(resident) : null;
  for (const [way, unpack] of Object.entries(ways)) {
    const bytes = await outcome(() => unpack(views[number]));
    const same = expected && bytes ? expected.equals(bytes) : bytes === expected;
    if (!same) console.log(`${file} differs ${way}`);
  }
}
const unpackPage = await createPageUnpacker(pool);
const first = packedPages(views[files.findIndex((file) => file.includes('valid_pages'))])[0];
if ((await unpackPage(first)).length !== first.size) console.log('a page alone differs');
pool.close();

let state = 30 + Number(seed);
const below = (n) => {
  state = (Math.imul(state, 1664525) + 1013904223) >>> 0; // Numerical Recipes
  return Math.floor((state / 2 ** 32) * n);
};
let unpacked = 0;
for (let i = 0; i < Number(mutations); i++) {
  const view = views[below(views.length)].slice();
  if (view.length === 0) continue;
  const pages = view.length > 4 ? view[1] : 0;
  const table = below(8) && 4 + 8 * pages < view.length ? 4 + 8 * pages : 0; // mostly left alone
  for (let changes = 1 + below(4); changes > 0; changes--) {
    const at = table + below(view.length - table);
    view[at] = below(2) ? view[at] ^ (1 << below(8)) : below(256);
  }
  if (await outcome(() => ways['on this thread'](view))) unpacked++;
}
if (Number(mutations)) console.error(`${mutations} mutations, ${unpacked} unpacked`);
