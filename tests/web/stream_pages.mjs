// Pages and their residency under random events, and the Workers of several streams, for
// test_stream_pages.py.
// Usage: node stream_pages.mjs WEB TASK ROUNDS, or FILE; prints JSON.
import { readFileSync } from 'node:fs';
import {
  NONE,
  open,
  Page,
  pause,
  RESIDENT,
  Residency,
  rest,
  SourceError,
  STORED,
  startWorker,
  viewOf,
} from './streaming.mjs';

const [task, rounds] = process.argv.slice(3);
let seed = 1;
const random = (below) => {
  seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
  return Math.floor((seed / 2 ** 32) * below);
};
const LENGTH = 1000;
const PLACE = { source: null, begin: 0, length: LENGTH, packed: 0, vertices: 100, triangles: 200 };

const tasks = {
  // The states that a page was in, and after each random event of a name: [state, event, state, has
  // bytes, has a place, is resident]; the state is null if the event was refused.
  transitions() {
    const events = ['request', 'fail', 'arrive', 'forget', 'decode', 'spoil', 'finish'];
    events.push('dismiss', 'insert', 'move', 'evict');
    const steps = [];
    const owner = { resident: [0] };
    const page = new Page(owner, 0, PLACE);
    for (let n = 0; n < Number(rounds); n++) {
      const before = page.state;
      const event = events[random(events.length)];
      let refused = false;
      try {
        page[event](event === 'arrive' ? new Uint8Array(LENGTH) : {});
      } catch {
        refused = true;
      }
      const { state, bytes, place } = page;
      if (refused && state !== before) throw new Error(`${event} was refused, and is in effect`);
      steps.push([before, event, refused ? null : state, bytes !== null, place !== null]);
      if (owner.resident[0] !== Number(state === RESIDENT)) throw new Error('the flag differs');
    }
    return steps;
  },

  // Residency of pages that are wanted and not wanted, of servers and Workers that fail, and of a
  // pool that holds ten: what does not add up.
  async residency() {
    const wrong = [];
    const held = new Set();
    const pool = {
      byteLength: 0,
      fits: () => held.size < 10,
      insert(page) {
        held.add(page.number);
        return { number: page.number };
      },
      remove: ({ number }) => held.delete(number),
    };
    const tables = { rootPages: 0, pageClusters: () => 1 };
    const owner = { name: 'it', formats: [{ bytes: 16 }], tables, pool, resident: [] };
    const source = {
      async read(begin, end, signal) {
        await pause(random(4));
        signal.throwIfAborted();
        if (random(4) === 0) throw new SourceError('no', { retry: random(2) === 0 });
        return new Uint8Array(end - begin);
      },
    };
    owner.pages = Array.from({ length: 30 }, (_, number) => {
      const place = { ...PLACE, source, begin: number * LENGTH };
      return new Page(owner, number, place);
    });
    const decoders = {
      async run() {
        await pause(random(4));
        if (random(4) === 0) throw new Error('malformed');
        return { memory: 0 };
      },
    };
    const budget = { maxBytes: 60_000, workers: 1, wasm: 0, tables: 0, waiting: 9000 };
    budget.decoding = 9000;
    const residency = new Residency([owner], [pool], budget, {
      document: { held: 0 },
      signal: new AbortController().signal,
      decoders,
      onWarning() {},
      onBroken: (error) => wrong.push(error.message),
      refuse: (_, error) => wrong.push(error.message),
      onChange() {},
    });
    const check = () => {
      const stored = owner.pages.reduce((sum, { bytes }) => sum + (bytes?.length ?? 0), 0);
      const { bytes } = residency;
      if (bytes.compressed !== stored)
        wrong.push(`${bytes.compressed} bytes in place of ${stored}`);
      for (const { number, state } of owner.pages)
        if ((state === RESIDENT) !== held.has(number)) wrong.push(`page ${number} in the pool`);
    };
    const states = new Set();
    for (let n = 0; n < Number(rounds); n++) {
      const page = owner.pages[random(30)];
      page.want(random(2) * random(100));
      page.use(n);
      if (random(20) === 0) residency.retry();
      if (random(10) === 0) for (const one of residency.unwanted(pool)) residency.evict(one);
      for (const { state } of owner.pages) states.add(state);
      residency.insertDecoded();
      residency.schedule();
      for (const { state } of owner.pages) states.add(state);
      check();
      if (random(3) === 0) await pause(1);
    }
    for (const page of owner.pages) page.want(0);
    residency.schedule();
    while (residency.jobs > 0) {
      await pause(5);
      residency.insertDecoded();
    }
    check();
    const rest = owner.pages.filter(({ state }) => ![NONE, STORED, RESIDENT].includes(state));
    return { wrong, states: states.size, rest: rest.length, transit: residency.bytes.transit };
  },

  // Twenty streams of a file, all but one of which end: Workers that they have started and ended, the
  // bytes of their buffers and arrays at a first picture and at last, and whether each shows all.
  async sharing() {
    const blob = new Blob([readFileSync(rounds)]);
    const counts = { started: 0, ended: 0 };
    const createWorker = () => {
      counts.started++;
      return startWorker().on('exit', () => counts.ended++);
    };
    const options = { maxBytes: 16e6, createWorker };
    const streams = await Promise.all(Array.from({ length: 20 }, () => open(blob, options)));
    const sum = () =>
      streams.reduce((all, { statistics: { bytes } }) => all + bytes.gpu + bytes.arrays, 0);
    const showAll = async (some, pixels) => {
      await Promise.all(some.map((one) => rest(one, viewOf(one), { pixels })));
      return some.every(({ complete }) => complete);
    };
    const result = { first: await showAll(streams, 1000), firstBytes: sum() };
    for (const one of streams.slice(1)) one.close();
    await pause(50);
    result.kept = { ...counts };
    result.last = await showAll(streams.slice(0, 1), 0);
    streams[0].close();
    streams[0].close();
    await pause(200);
    const another = await open(blob, options);
    result.another = await showAll([another], 1000);
    another.close();
    await pause(200);
    return { ...result, counts };
  },

  // A stream beside one whose Workers do not start, and the next one when they do.
  async failing() {
    const blob = new Blob([readFileSync(rounds)]);
    let fails = true;
    const createWorker = () => {
      if (fails) throw new Error('no Workers here');
      return startWorker();
    };
    const tried = () =>
      open(blob, { createWorker }).then(
        () => 'open',
        ({ message }) => message,
      );
    const results = await Promise.all([tried(), tried()]);
    fails = false;
    return [...results, await tried()];
  },
};

process.on('unhandledRejection', (error) => {
  console.error(error);
  process.exit(1);
});
// Workers may still end.
process.stdout.write(JSON.stringify(await tasks[task]()), () => process.exit(0));
