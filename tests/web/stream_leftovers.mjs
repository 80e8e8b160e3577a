// What streams and pools in Node leave behind or wait for without need, for test_stream_leftovers.py.
// Usage: node stream_leftovers.mjs WEB TASK FILE...; prints JSON.
import { EventEmitter, getEventListeners } from 'node:events';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

import { serveFile } from './fault_server.mjs';
import {
  open,
  openStreamer,
  PATIENT,
  pause,
  placing,
  rest,
  Session,
  viewOf,
} from './streaming.mjs';

const [web, task, ...given] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(web, name)));
const told = (promise) => promise.then(() => 'nothing', String);

// A Worker that starts at once and does each job, but for those that it dies of.
class StandIn extends EventEmitter {
  constructor({ starts = true, dies = false } = {}) {
    super();
    Object.assign(this, { starts, dies });
  }

  postMessage({ task: isJob }) {
    if (!this.starts) return;
    queueMicrotask(() => {
      if (!isJob) this.emit('message', { started: true });
      else if (this.dies) this.emit('error', new Error('dead'));
      else this.emit('message', { result: 1 });
    });
  }

  terminate() {}
}

const tasks = {
  // A pool of two Workers of which one dies of its first job, when the other has done one. Those that
  // take its place never answer. What jobs tell: that one, and two more, one after the other.
  async idleWorker() {
    const { setTimeout: later } = globalThis;
    globalThis.setTimeout = (action, milliseconds, ...more) =>
      later(action, milliseconds === 30_000 ? 1 : milliseconds, ...more);
    const { createDecoderPool } = await load('pool.js');
    const workers = [new StandIn(), new StandIn({ dies: true })];
    const createWorker = () => workers.shift() ?? new StandIn({ starts: false });
    const pool = await createDecoderPool({ workers: 2, createWorker });
    const run = () => told(pool.run({ task: 'validate', bytes: new Uint8Array(4) }));
    const result = [await run(), ...(await Promise.all([run(), run()]))];
    await pause(20);
    return [...result, await run()];
  },

  // Timers that are left after a stream has ended whose server has asked for a pause.
  async timers([file]) {
    const server = await serveFile(readFileSync(file));
    const streamer = await open(server.url);
    await rest(streamer, viewOf(streamer, 30));
    const timers = () => process.getActiveResourcesInfo().filter((name) => name === 'Timeout');
    server.answer = (_request, response) => response.writeHead(503, { 'retry-after': '60' }).end();
    streamer.update(viewOf(streamer), 0.2);
    while (streamer.told.warnings.length === 0) await pause(5);
    const before = timers().length;
    streamer.close();
    server.close();
    await pause(20);
    return [before, timers().length];
  },

  // The object URLs of Workers from another origin, as a browser has them: those that were made, and
  // those that are left after the Workers have answered, or ended before.
  async scripts() {
    const urls = new Set();
    let made = 0;
    const { createObjectURL, revokeObjectURL } = URL;
    URL.createObjectURL = (blob) => {
      const url = createObjectURL.call(URL, blob);
      urls.add(url);
      made++;
      return url;
    };
    URL.revokeObjectURL = (url) => urls.delete(url) && revokeObjectURL.call(URL, url);
    const left = [];
    for (const starts of [true, false]) {
      globalThis.location = { origin: 'http://page.example', href: 'http://page.example/' };
      globalThis.Worker = class {
        postMessage() {
          if (starts) queueMicrotask(() => this.onmessage({ data: { started: true } }));
        }
        terminate() {}
      };
      const { createDecoderPool } = await load('pool.js');
      const pool = await createDecoderPool({ workers: 2 });
      await pause(5);
      if (!starts) pool.close();
      left.push(urls.size);
    }
    return { made, left };
  },

  // A .gltf whose server hides Content-Range, and that has more bytes than a JSON may have.
  async hiddenLength() {
    const server = createServer(({ headers }, response) => {
      const length = headers.range ? 32_768 : 2 ** 28 + 1;
      response.writeHead(headers.range ? 206 : 200, { 'content-length': length });
      response.write(Buffer.alloc(32_768, '{'));
    });
    await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
    const place = `http://127.0.0.1:${server.address().port}/model.gltf`;
    const ended = await told(openStreamer(place, { stallMs: 500 }));
    server.closeAllConnections();
    server.close();
    return ended.replace(place, 'PLACE');
  },

  // Servers that share a file but not its time: what a stream tells with a strong ETag, and with a
  // weak one.
  async modified([file]) {
    const bytes = readFileSync(file);
    const result = [];
    for (const etag of ['"1"', 'W/"1"']) {
      const server = await serveFile(bytes, {
        answer(_request, response, next) {
          const seconds = 1_700_000_000 + server.log.length;
          response.setHeader('last-modified', new Date(1000 * seconds).toUTCString());
          next();
        },
      });
      server.etag = etag;
      result.push((await told(openStreamer(server.url))).replace(server.url, 'PLACE'));
      server.close();
    }
    return result;
  },

  // A place that is no URL: what a session tells, and the listeners that it leaves.
  async noPlace() {
    const { signal } = new AbortController();
    let problem;
    try {
      new Session('http://[', { signal }, { ...placing({}), dispose() {} });
    } catch (error) {
      problem = error.name;
    }
    return { problem, listeners: getEventListeners(signal, 'abort').length };
  },

  // What a stream tells whose page closes it while an adapter waits, before it fills the scene.
  async closedWhileShown([file]) {
    const engine = { ...placing({}), dispose() {} };
    engine.show = async (_streamer, _loaded, each) => {
      session.close();
      await each([1], () => {
        throw new TypeError('it is freed');
      });
    };
    const session = new Session(new Blob([readFileSync(file)]), {}, engine);
    return told(session.ready);
  },

  // What a stream tells whose page aborts it without a reason, while it opens.
  async aborted([file]) {
    const results = [];
    for (const aborts of [1, 2, 3]) {
      const server = await serveFile(readFileSync(file));
      const abort = new AbortController();
      let requests = 0;
      const counted = (...more) => {
        if (++requests === aborts) abort.abort(null);
        return fetch(...more);
      };
      const options = { ...PATIENT, signal: abort.signal, fetch: counted };
      const one = openStreamer(server.url, options);
      results.push(await told(one));
      server.close();
    }
    return results;
  },

  // A server of modules that never answers.
  async hangingModule([file]) {
    const { timeout } = AbortSignal;
    const waits = [];
    AbortSignal.timeout = (milliseconds) => {
      waits.push(milliseconds);
      return timeout.call(AbortSignal, 50);
    };
    const server = await serveFile(readFileSync(file), { answer() {} });
    const options = { source: server.url };
    const ended = await Promise.race([
      told(openStreamer(new Blob([readFileSync(file)]), options)),
      pause(5000).then(() => 'it waits'),
    ]);
    server.close();
    return { waits, ended: ended.replace(server.url, 'PLACE') };
  },
};

process.stdout.write(JSON.stringify(await tasks[task](given)));
process.exit(0); // Workers of closed pools may still end
