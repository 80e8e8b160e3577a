// What streams in Node request, and what they tell of requests that fail, for
// test_stream_sources.py.
// Usage: node stream_sources.mjs WEB TASK FILE; prints JSON.
import { readFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

import { serveFile } from './fault_server.mjs';
import {
  hurry,
  open,
  openDocument,
  openSource,
  openStreamer,
  PATIENT,
  pause,
  placing,
  Session,
  SourceError,
  viewOf,
} from './streaming.mjs';

const [web, task, file] = process.argv.slice(2);
const told = (promise) => promise.then(() => 'nothing', String);

const tasks = {
  // Of headers that are given in each form of fetch: those that arrive.
  async headers() {
    const given = { Authorization: 'Bearer 1' };
    const seen = [];
    const server = await serveFile(readFileSync(file), {
      answer(request, _response, next) {
        seen.push([request.headers.authorization, request.headers.range]);
        next();
      },
    });
    for (const headers of [given, Object.entries(given), new Headers(given)])
      await openSource(server.url, { requestInit: { headers } });
    server.close();
    return seen;
  },

  // A server without ranges, as Chromium tells of it: errors of a stream become another one. How often
  // it was asked for a file that is too large, with its length and without, and what was told.
  async tooLarge() {
    hurry();
    const { blob } = Response.prototype;
    Response.prototype.blob = function () {
      return blob.call(this).catch(() => Promise.reject(new TypeError('Failed to fetch')));
    };
    const result = [];
    for (const name of ['content-length', 'x-length']) {
      const server = await serveFile(Buffer.alloc(0), {
        answer: (_request, response) =>
          response.writeHead(200, { [name]: 2e6 }).end(Buffer.alloc(2e6)),
      });
      const problem = await told(openSource(server.url, { ...PATIENT, maxWholeBytes: 1e6 }));
      result.push({ problem, requests: server.log.length });
      server.close();
    }
    return result;
  },

  // Answers that are refused and do not end: what is told, and how many connections stay open.
  async refusedAnswers() {
    let open = 0;
    const server = await serveFile(readFileSync(file));
    const source = await openSource(server.url);
    source.forgetHead();
    const problems = [];
    const answers = [
      [206, { etag: '"2"' }],
      [206, { 'content-range': 'bytes 8-9/1932' }],
      [403, {}],
    ];
    for (const [status, headers] of answers) {
      server.answer = (_request, response) => {
        open++;
        response.writeHead(status, headers).write('some');
        response.on('close', () => open--);
      };
      problems.push((await told(source.read(0, 8))).replace(server.url, 'PLACE'));
    }
    for (let i = 0; open > 0 && i < 200; i++) await pause(10);
    server.close();
    return { problems, open };
  },

  // Pages that a server would send later, each by a request of its own: how often it is asked, until
  // then and after a retry.
  async busyServer() {
    const streamer = await open(new Blob([readFileSync(file)]), { maxBytes: 64e6 });
    const view = viewOf(streamer);
    let requests = 0;
    const read = async () => {
      requests++;
      throw new SourceError('later', { retry: true, retryAfter: 60_000 });
    };
    const [{ pages }] = streamer.primitives;
    for (const page of pages) page.source = { read };
    const ask = async () => {
      for (let i = 0; i < 50; i++, await pause(1)) streamer.update(view, 0);
      return requests;
    };
    const result = { pages: pages.length, asked: await ask() };
    streamer.retry();
    return { ...result, again: await ask() };
  },

  // What is told of a fetch of the page's own that throws.
  async ownFetch() {
    const fetch = async () => {
      throw new Error('nobody is logged in');
    };
    hurry();
    return told(openSource('http://host/model.glb', { ...PATIENT, fetch }));
  },

  // The secrets that arrive at the server of a .gltf, and at another one that it names.
  async secrets() {
    const seen = {};
    const see = (name) => ({
      answer(request, _response, next) {
        seen[name] ??= request.headers.authorization ?? 'none';
        next();
      },
    });
    const other = await serveFile(Buffer.from('abcd'), see('other'));
    const json = {
      buffers: [
        { byteLength: 4, uri: other.url },
        { byteLength: 4, uri: 'own.bin' },
      ],
      bufferViews: [0, 1].map((buffer) => ({ buffer, byteLength: 4 })),
    };
    const server = await serveFile(Buffer.from(JSON.stringify(json)), see('file'));
    const requestInit = { headers: { Authorization: 'secret' } };
    const document = await openDocument(server.url, { requestInit });
    Object.assign(server, see('own'));
    for (const view of [0, 1]) await document.readView(view);
    other.close();
    server.close();
    return seen;
  },

  // A server that breaks its first two connections: how many of its answers were ranges, and what
  // was told.
  async brokenStart() {
    hurry();
    const warnings = [];
    const server = await serveFile(readFileSync(file), {
      answer(request, response, next) {
        if (request.headers.range && server.log.length <= 2) response.destroy();
        else next();
      },
    });
    const onWarning = (text) => warnings.push(text.replace(server.url, 'PLACE'));
    const source = await openSource(server.url, { ...PATIENT, onWarning });
    server.close();
    return { whole: source.blob !== null, warnings };
  },

  // A file of another origin that is a little larger when compressed, which other origins hide.
  async hiddenCompression() {
    const bytes = readFileSync(file);
    const fetch = async () => {
      const headers = { 'content-length': bytes.length + 20 };
      return Object.defineProperty(new Response(bytes, { headers }), 'type', { value: 'cors' });
    };
    return told(openSource('http://host/model.glb', { ...PATIENT, fetch }));
  },

  // Whether a file opens with the longest pauses that can be asked for.
  async patience() {
    const server = await serveFile(readFileSync(file));
    const result = await told(openSource(server.url, { stallMs: Number.MAX_SAFE_INTEGER }));
    server.close();
    return result;
  },

  // What is told of a decoder that cannot be reached, and of Workers that do not start.
  async noDecoder() {
    const blob = new Blob([readFileSync(file)]);
    const source = 'http://127.0.0.1:1/decoder.wasm';
    const createWorker = () => {
      throw new TypeError('Workers are not allowed');
    };
    const streams = [{ source }, { createWorker }].map((options) => openStreamer(blob, options));
    return Promise.all(streams.map(told));
  },

  // A stream whose decoder is a Response, and that opens again.
  async responseTwice() {
    const server = await serveFile(readFileSync(file), {
      answer: (_request, response) => response.writeHead(403).end(),
    });
    const source = new Response(readFileSync(path.join(web, 'decoder.wasm')));
    const one = new Session(server.url, { ...PATIENT, source }, placing({}));
    const ready = [await told(one.ready)];
    server.answer = undefined;
    one.retry();
    ready.push(await told(one.ready));
    one.close();
    server.close();
    return ready.map((text) => text.replace(server.url, 'PLACE'));
  },

  // Sessions that end while a warning is told, and at the end of an engine's `show`: what `ready`
  // tells, how often the picture was told, whether anything is left, and seconds until then.
  async ends() {
    const server = await serveFile(readFileSync(file), {
      answer: (_request, response) => response.writeHead(503, { 'retry-after': '30' }).end(),
    });
    const blob = new Blob([readFileSync(file)]);
    const result = {};
    for (const [moment, place] of [
      ['warning', server.url],
      ['show', blob],
    ]) {
      const messages = { load: [] };
      const { tell, ...engine } = placing(messages);
      let left = 0;
      const start = performance.now();
      const one = new Session(place, PATIENT, {
        ...engine,
        async show() {
          left++;
          one.close();
          left++;
        },
        clear: () => (left = 0),
        tell(type, message) {
          tell(type, message);
          if (type === moment) one.close();
        },
      });
      const ready = await told(one.ready);
      const seconds = (performance.now() - start) / 1000;
      result[moment] = { ready, loads: messages.load.length, left, seconds };
    }
    server.close();
    return result;
  },

  // A stream that has ended with malformed levels, and opens again when the file is mended: primitives
  // with levels.
  async mended() {
    hurry();
    const bytes = readFileSync(file);
    const streamer = await open(new Blob([bytes]));
    const [{ begin, length }] = streamer.primitives[0].pages;
    streamer.close();
    const bad = Buffer.from(bytes).fill(255, begin + 200, begin + length);
    const server = await serveFile(bad);
    const one = new Session(server.url, PATIENT, {
      ...placing({}),
      load({ primitives }) {
        if (primitives.length === 0) throw new Error('loaded whole');
      },
    });
    const ready = [await told(one.ready)];
    server.bytes = bytes;
    one.retry();
    ready.push(await told(one.ready));
    one.close();
    server.close();
    return ready;
  },

  // Workers of a pool of which one does not start: those that did, and those that were ended.
  async oneWorkerFails() {
    const { createDecoderPool } = await import(pathToFileURL(path.join(web, 'pool.js')));
    const result = { started: 0, ended: 0 };
    const createWorker = () => {
      if (result.started === 2) throw new Error('no more Workers');
      result.started++;
      return { postMessage() {}, terminate: () => result.ended++ };
    };
    result.problem = await told(createDecoderPool({ workers: 3, createWorker }));
    await pause(1);
    return result;
  },

  // The script of a Worker for a package on another server, whose path has an apostrophe.
  async apostrophe() {
    const { startWorker } = await import(pathToFileURL(path.join(web, 'pool.js')));
    const scripts = [];
    globalThis.location = new URL('https://page/');
    globalThis.Worker = class {};
    URL.createObjectURL = (blob) => scripts.push(blob);
    await startWorker("o'brien/worker.js");
    return scripts[0].text();
  },
};

process.stdout.write(JSON.stringify(await tasks[task]()));
process.exit(0); // Workers of closed pools may still end
