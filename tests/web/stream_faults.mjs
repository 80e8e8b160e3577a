// Streams files in Node from bad servers, with wrong options, and ended at any moment, for
// test_stream_faults.py.
// Usage: node stream_faults.mjs WEB TASK FILE...; prints JSON.
import { getEventListeners, once } from 'node:events';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Worker } from 'node:worker_threads';
import { gzipSync } from 'node:zlib';

import { serveFile } from './fault_server.mjs';
import {
  delayAfter,
  hurry,
  IDENTITY,
  open,
  openSource,
  openStreamer,
  PATIENT,
  pause,
  placing,
  RESIDENT,
  rest,
  Session,
  viewOf,
} from './streaming.mjs';

const [web, task, ...given] = process.argv.slice(2);
const told = (promise) => promise.then(() => 'nothing', String);

// Timers of so many milliseconds end at once.
function skipTimers(skipped) {
  const { setTimeout: later } = globalThis;
  globalThis.setTimeout = (action, milliseconds, ...more) =>
    later(action, milliseconds === skipped ? 1 : milliseconds, ...more);
}

// What a session told, with an engine that shows nothing.
function session(place, options = {}, engine = {}) {
  const messages = { load: [], warning: [], error: [] };
  const one = new Session(place, { ...PATIENT, ...options }, { ...placing(messages), ...engine });
  return Object.assign(one, { messages });
}

// A .glb with a part of its JSON changed, of the same length.
function changed(file, from, to) {
  const bytes = readFileSync(file);
  const at = bytes.indexOf(from);
  if (at < 0 || from.length !== to.length) throw new Error(`${from} is not in ${file}`);
  bytes.write(to, at);
  return bytes;
}

const tasks = {
  // A Worker that never answers.
  async silentWorker([file]) {
    skipTimers(30_000);
    const createWorker = () => new Worker('setInterval(() => {}, 1e6)', { eval: true });
    const one = session(new Blob([readFileSync(file)]), { createWorker });
    const ready = await told(one.ready);
    return { ready, error: one.messages.error };
  },

  // What each wrong value of an option tells, and the threshold of a right one afterwards.
  async options([file]) {
    const blob = new Blob([readFileSync(file)]);
    const values = [Number.NaN, -1, '64', null, Number.POSITIVE_INFINITY];
    const result = {};
    for (const name of ['maxBytes', 'stallMs', 'maxWholeBytes'])
      result[name] = await Promise.all(
        values.map((value) => told(openStreamer(blob, { [name]: value }))),
      );
    const streamer = await open(blob);
    const view = viewOf(streamer);
    result.pixels = values.map((value) => {
      try {
        return streamer.update(view, value);
      } catch (error) {
        return String(error);
      }
    });
    await rest(streamer, view);
    result.threshold = streamer.statistics.threshold;
    return result;
  },

  // A server that refuses pages from the first picture on, until `granted`: whether all is there
  // before and after a retry, and what was told.
  async refused([file, status]) {
    hurry();
    const server = await serveFile(readFileSync(file));
    const streamer = await open(server.url, PATIENT);
    await rest(streamer, viewOf(streamer, 30));
    server.answer = (_request, response) => response.writeHead(Number(status)).end();
    const view = viewOf(streamer);
    const givenUp = ({ primitives: [{ pages }] }) =>
      pages.every(
        ({ state, wanted, attempts }) => state === RESIDENT || wanted === 0 || attempts.isOver,
      );
    streamer.update(view, 0.2);
    await rest(streamer, view, { pixels: 0.2, limit: 20_000, until: givenUp });
    server.answer = undefined;
    await rest(streamer, view, { pixels: 0.2, limit: 500 });
    const before = streamer.complete;
    streamer.retry();
    await rest(streamer, view, { pixels: 0.2 });
    const result = { before, after: streamer.complete, ...streamer.told };
    streamer.close();
    server.close();
    return result;
  },

  // A server that wants a signature, which expires every third request. A fetch of the page's own
  // renews it.
  async signed([file]) {
    let valid = 1;
    const server = await serveFile(readFileSync(file), {
      answer(request, response, next) {
        if (server.log.length % 3 === 0) valid++;
        if (request.url.endsWith(`?signature=${valid}`)) return next();
        response.writeHead(403).end();
      },
    });
    let signature = 1;
    const signedFetch = async (url, init) => {
      for (;;) {
        const response = await fetch(`${url}?signature=${signature}`, init);
        if (response.status !== 403) return response;
        signature = valid;
      }
    };
    const streamer = await open(server.url, { fetch: signedFetch });
    await rest(streamer, viewOf(streamer), { pixels: 0.2 });
    const { complete } = streamer;
    streamer.close();
    server.close();
    return { complete, signature, ...streamer.told };
  },

  // A session that a server refuses, and retries when it does not: `ready` before and after.
  async reopened([file]) {
    const server = await serveFile(readFileSync(file), {
      answer: (_request, response) => response.writeHead(403).end(),
    });
    const one = session(server.url);
    const ready = [await told(one.ready)];
    one.retry();
    ready.push(await told(one.ready));
    server.answer = undefined;
    one.retry();
    one.retry(); // while it opens: nothing
    ready.push(await told(one.ready));
    one.close();
    server.close();
    return { ready, ...one.messages };
  },

  // Seconds until the next try after a server has asked to come back later, for each way to say so;
  // opened: until a file is open that is there a second later; pages: of those that it refuses.
  async retryAfter([file]) {
    const server = await serveFile(readFileSync(file));
    const later = (value) => (_request, response) =>
      response.writeHead(503, { 'retry-after': value }).end();
    const source = await openSource(server.url);
    const result = { seconds: [] };
    const date = new Date(Date.now() + 60_000).toUTCString();
    for (const value of ['7', date, '86400', 'soon', '']) {
      server.answer = later(value);
      const error = await source.read(40_000, 40_010).catch((refused) => refused);
      result.seconds.push(delayAfter(1, error) / 1000);
    }
    server.answer = (request, response) => {
      server.answer = undefined;
      later('1')(request, response);
    };
    const start = performance.now();
    const streamer = await open(server.url);
    result.opened = (performance.now() - start) / 1000;
    await rest(streamer, viewOf(streamer, 30));
    server.answer = later('60');
    streamer.update(viewOf(streamer), 0.2);
    const [{ pages }] = streamer.primitives;
    const hasFailed = ({ attempts }) => attempts.failed > 0;
    while (!pages.some(hasFailed)) await pause(5);
    const { attempts } = pages.find(hasFailed);
    const now = performance.now();
    result.pages = [40, 61].map((seconds) => attempts.isDue(now + 1000 * seconds));
    streamer.close();
    server.close();
    return result;
  },

  // A file that is stored compressed, as Chromium reads it: a part cannot be unpacked, so that fetch
  // fails. And a server that answers nothing.
  async storedCompressed([file]) {
    hurry();
    const bytes = readFileSync(file);
    const packed = gzipSync(bytes);
    const server = await serveFile(bytes, {
      answer(request, response) {
        const headers = { 'content-encoding': 'gzip', 'content-length': packed.length };
        response.writeHead(200, headers).end(request.method === 'HEAD' ? undefined : packed);
      },
    });
    const likeChromium = async (url, init) => {
      if (init.headers?.Range) throw new TypeError('Failed to fetch');
      return fetch(url, init);
    };
    const streamer = await open(server.url, { ...PATIENT, fetch: likeChromium });
    await rest(streamer, viewOf(streamer), { pixels: 0.2 });
    const offline = async () => {
      throw new TypeError('Failed to fetch');
    };
    const result = { complete: streamer.complete, ...streamer.told };
    result.offline = await told(openSource(server.url, { ...PATIENT, fetch: offline }));
    streamer.close();
    server.close();
    return result;
  },

  // What sessions tell of a server that gives another ETag from the second request on, from the third
  // one on, and a weak one every other time.
  async etags([file]) {
    hurry();
    const bytes = readFileSync(file);
    const results = {};
    const etagOf = {
      second: (n) => (n < 2 ? '"1"' : '"2"'),
      third: (n) => (n < 3 ? '"1"' : '"2"'),
      weak: (n) => (n % 2 ? '"1"' : 'W/"1"'),
    };
    for (const [name, etag] of Object.entries(etagOf)) {
      const server = await serveFile(bytes, {
        answer(_request, _response, next) {
          server.etag = etag(server.log.length);
          next();
        },
      });
      const one = session(server.url);
      results[name] = { ready: await told(one.ready), ...one.messages };
      one.close();
      server.close();
    }
    return results;
  },

  // A server that answers all requests with a file that does not end: what is told, and how much was
  // read.
  async endless() {
    const chunk = Buffer.alloc(65_536, 'glTF');
    const server = createServer(async (_request, response) => {
      response.writeHead(200);
      while (!response.destroyed) {
        response.write(chunk);
        await pause(0);
      }
    });
    server.listen(0, '127.0.0.1');
    await once(server, 'listening');
    const place = `http://127.0.0.1:${server.address().port}/model.glb`;
    const streaming = openStreamer(place, { maxWholeBytes: 1e6 });
    const result = (await told(streaming)).replace(place, 'PLACE');
    server.closeAllConnections();
    server.close();
    return result;
  },

  // What is told of an empty file, of a web page in a file's place, and of a .glb that is cut off.
  async noFile([file]) {
    const page = '<!doctype html><title>Not here</title>';
    const files = [Buffer.alloc(0), Buffer.from(page), readFileSync(file).subarray(0, 15)];
    const result = [];
    for (const bytes of files) {
      const server = await serveFile(bytes);
      result.push((await told(openStreamer(server.url))).replace(server.url, 'PLACE'));
      server.close();
    }
    return [...result, await told(openStreamer(new Blob([page])))];
  },

  // The warnings of a file whose levels have another version, and of one without levels.
  async noLevels([file, plain]) {
    const places = [changed(file, '"version":1', '"version":7'), readFileSync(plain)];
    const results = [];
    for (const place of places) {
      const one = session(new Blob([place]));
      await one.ready;
      results.push(one.messages.warning);
      one.close();
    }
    return results;
  },

  // Listeners at a page's signal: of open streams, and of those that have ended.
  async signals([file]) {
    const blob = new Blob([readFileSync(file)]);
    const { signal } = new AbortController();
    const streams = [1, 2, 3].map(() => session(blob, { signal }, { dispose() {} }));
    await Promise.all(streams.map(({ ready }) => ready));
    const counts = [getEventListeners(signal, 'abort').length];
    for (const one of streams) one.close();
    counts.push(getEventListeners(signal, 'abort').length);
    const abort = new AbortController();
    const ended = await new Promise((resolve) => {
      session(blob, { signal: abort.signal }, { dispose: () => resolve(true) });
      abort.abort();
    });
    return { counts, ended };
  },

  // Sessions that end after each of the first timers, answers and calls of the engine: what the
  // engine made and did not free, the errors that were told, and the moments that were tried.
  async endsAnywhere([file]) {
    const unhandled = [];
    process.on('unhandledRejection', (error) => unhandled.push(String(error)));
    const server = await serveFile(readFileSync(file));
    const result = { left: [], errors: [], ready: new Set(), moments: 0 };
    for (let moment = 0; result.moments === moment; moment++) {
      let steps = 0;
      let made = 0;
      let one = null;
      const step = () => {
        if (steps++ !== moment) return;
        result.moments++;
        if (one) one.close();
        else queueMicrotask(() => one.close());
      };
      const answered = async (url, init) => {
        step();
        const response = await fetch(url, init);
        step();
        return response;
      };
      const engine = {
        async load() {
          step();
          await pause(1);
          made++;
          step();
        },
        async show(streamer, _loaded, each) {
          step();
          await each(streamer.primitives, (primitive) => {
            step();
            streamer.addInstance(primitive).place(IDENTITY);
          });
          step();
        },
        clear() {
          made = 0;
        },
      };
      const messages = { load: [], warning: [], error: [], progress: [] };
      const { tell } = placing(messages);
      engine.tell = (type, ...more) => {
        tell(type, ...more);
        step();
      };
      one = session(server.url, { fetch: answered }, engine);
      result.ready.add(await told(one.ready));
      one.streamer?.update(viewOf(one.streamer), 1);
      await pause(20);
      if (result.moments === moment + 1 && made) result.left.push(moment);
      result.errors.push(...messages.error);
      one.close();
    }
    server.close();
    return { ...result, ready: [...result.ready], unhandled };
  },

  // WebAssembly modules in a Worker that has decoded packed pages, and then unpacks one.
  async unpackers([file]) {
    const counts = new Int32Array(new SharedArrayBuffer(4));
    const script = `
      const { workerData } = require('node:worker_threads');
      const { instantiate } = WebAssembly;
      WebAssembly.instantiate = (...given) => {
        Atomics.add(workerData.counts, 0, 1);
        return instantiate(...given);
      };
      import(workerData.url);
    `;
    const url = String(pathToFileURL(path.join(web, 'stream', 'worker.js')));
    const createWorker = () => new Worker(script, { eval: true, workerData: { counts, url } });
    const streamer = await open(new Blob([readFileSync(file)]), { createWorker, maxBytes: 8e6 });
    await rest(streamer, viewOf(streamer), { pixels: 0 });
    const page = streamer.primitives.flatMap(({ pages }) => pages).find(({ packed }) => packed);
    const { bytes, unpackerModule } = await packedPage(streamer, page);
    const options = { size: page.packed, module: unpackerModule };
    const unpacked = await streamer.decoders.run({ task: 'unpack', bytes, options });
    return { modules: counts[0], same: unpacked.length === page.packed };
  },
};

// The bytes of a packed page, and the module that unpacks it.
async function packedPage(_streamer, { source, begin, length }) {
  const { compileUnpacker } = await import(pathToFileURL(path.join(web, 'transport.js')));
  const bytes = await source.read(begin, begin + length);
  return { bytes, unpackerModule: await compileUnpacker() };
}

process.stdout.write(JSON.stringify(await tasks[task](given)));
process.exit(0); // Workers of closed pools may still end
