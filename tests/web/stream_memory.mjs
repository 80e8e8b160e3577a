// Memory of streams in Node that changes while they are open, for test_stream_memory.py.
// Usage: node stream_memory.mjs WEB TASK FILE; prints JSON.
import { readFileSync } from 'node:fs';

import { digest, drawn, open, Page, pause, Residency, rest, viewOf } from './streaming.mjs';

const [, task, file] = process.argv.slice(2);
const blob = new Blob([readFileSync(file)]);
const PIXELS = 0.2;

// Arrays in the place of an engine's buffers.
class Store {
  released = false;

  constructor(pool) {
    this.arrays = [...pool.formats.map(({ Type }) => new Type(0)), new Uint32Array(0)];
  }

  resize(lengths) {
    this.arrays = this.arrays.map((array, a) => {
      const other = new array.constructor(lengths[a]);
      other.set(array.subarray(0, lengths[a]));
      return other;
    });
  }

  write(a, begin, part) {
    this.arrays[a].set(part, begin);
  }

  read(a, begin, end) {
    return this.arrays[a].slice(begin, end);
  }

  release() {
    this.released = true;
  }
}

// What a stream shows and holds at rest; stores: of its pools, if they have some.
async function shown(streamer, stores = null) {
  await rest(streamer, viewOf(streamer), { pixels: PIXELS });
  const { primitives, statistics } = streamer;
  const { threshold, triangles, complete, bytes } = statistics;
  const arrays = stores && new Map(streamer.pools.map((pool) => [pool, stores.get(pool).arrays]));
  const stand = primitives.map((one) => {
    const held = arrays?.get(one.pool) ?? [...one.pool.arrays, one.pool.index];
    return {
      ...one,
      formats: one.formats,
      instances: one.instances,
      pool: { arrays: held, index: held.at(-1) },
    };
  });
  return {
    triangles,
    threshold,
    complete,
    bytes,
    drawn: JSON.stringify(drawn(streamer)),
    digest: digest({ primitives: stand }),
  };
}

const tasks = {
  // A stream with much memory, then little, then much again; and new ones with as much.
  async changed() {
    const amounts = [64e6, 2.5e6, 64e6];
    const streamer = await open(blob, { maxBytes: amounts[0] });
    const changing = [];
    for (const bytes of amounts) {
      streamer.maxBytes = bytes;
      changing.push(await shown(streamer));
    }
    const fresh = [];
    for (const maxBytes of amounts.slice(0, 2))
      fresh.push(await shown(await open(blob, { maxBytes })));
    let refused;
    try {
      streamer.maxBytes = 1e6;
    } catch (error) {
      refused = error.message;
    }
    return { changing, fresh, refused, after: streamer.maxBytes, told: streamer.told };
  },

  // A stream in arrays, in stores, in others after those were lost, and in arrays again.
  async stores() {
    const streamer = await open(blob, { maxBytes: 64e6 });
    const result = [await shown(streamer)];
    let stores = new Map();
    const released = [];
    const storeOf = (pool) => {
      stores.set(pool, new Store(pool));
      return stores.get(pool);
    };
    await streamer.moveTo(storeOf);
    result.push(await shown(streamer, stores));
    const before = [...stores.values()];
    stores = new Map();
    await streamer.moveTo(storeOf, true);
    result.push(await shown(streamer, stores));
    released.push(before.some((store) => store.released));
    const later = [...stores.values()];
    await streamer.moveTo(null);
    result.push(await shown(streamer));
    released.push(later.every((store) => store.released));
    return { result, released, told: streamer.told };
  },

  // Three streams that want ten pages each, of places that do not answer: requests of each; and of the
  // last one when the first has ended its own.
  async requests() {
    const budget = { maxBytes: 1e9, workers: 1, wasm: 0, tables: 0, waiting: 1e6, decoding: 1e6 };
    const document = { held: 0 };
    const make = () => {
      const owner = { formats: [], pages: [], tables: { rootPages: 0 } };
      const stop = [];
      let count = 0;
      const read = () => {
        count++;
        return new Promise((_, reject) => {
          stop.push(reject);
        });
      };
      for (let n = 0; n < 10; n++) {
        const place = { source: { read }, begin: 0, length: 100, packed: 0 };
        owner.pages.push(new Page(owner, n, { ...place, vertices: 3, triangles: 1 }));
        owner.pages[n].want(1);
      }
      const { signal } = new AbortController();
      const nothing = () => {};
      const given = { document, signal, onChange: nothing, onWarning: nothing, onBroken: nothing };
      const residency = new Residency([owner], [], budget, given);
      residency.schedule();
      return { residency, stop, counted: () => count };
    };
    const streams = [make(), make(), make()];
    const before = streams.map(({ counted }) => counted());
    for (const reject of streams[0].stop) reject(new Error('it ends'));
    await pause(5);
    const [, , last] = streams;
    last.residency.schedule();
    return { before, after: last.counted() };
  },
};

process.stdout.write(JSON.stringify(await tasks[task]()));
process.exit(0); // Workers may still end
