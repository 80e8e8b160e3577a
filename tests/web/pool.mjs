// Decodes views with web/pool.js, with several numbers of Workers, beside web/decoder.js.
// Usage: node pool.mjs WEB LIST; LIST as for digest.mjs. Prints a line per difference.
import { readFile } from 'node:fs/promises';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [web, listFile] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const { MalformedError, createDecoder } = await load('decoder.js');
const { createDecoderPool } = await load('pool.js');
const list = JSON.parse(await readFile(listFile, 'utf8'));
const packed = new Uint8Array(await readFile(list.packed));
const decoder = await createDecoder();

const outcome = async (action) => {
  try {
    return await action();
  } catch (error) {
    if (error instanceof MalformedError) return error.message;
    throw error;
  }
};
const text = (outcome) =>
  JSON.stringify(outcome, (_key, value) =>
    ArrayBuffer.isView(value) ? Buffer.from(value.buffer).toString('base64') : value,
  );

for (const workers of list.workers) {
  const pool = await createDecoderPool({ workers });
  await Promise.all(
    list.views.map(async ([offset, length], number) => {
      const view = packed.slice(offset, offset + length);
      const valid = await outcome(() => decoder.validate(view));
      if (valid !== (await outcome(() => pool.validate(view))))
        console.log(`view ${number}, ${workers} Workers: validates differently`);
      for (const integers of [false, true]) {
        const one = await outcome(() => decoder.decodePrimitive(view, { integers }));
        const many = await outcome(() => pool.decodePrimitive(view, { integers }));
        if (text(one) !== text(many)) console.log(`view ${number}, ${workers} Workers: differs`);
      }
    }),
  );
  pool.close();
}
