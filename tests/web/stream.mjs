// Streams files in Node, without an engine, for test_stream.py.
// Usage: node stream.mjs WEB TASK FILE...; prints JSON.
import { readFileSync } from 'node:fs';
import path from 'node:path';

import { faults, serveFile } from './fault_server.mjs';
import { serve } from './static_server.mjs';
import {
  Cut,
  digest,
  drawn,
  hasProblem,
  hurry,
  hurryTimers,
  IDENTITY,
  LOD,
  largestScale,
  lateWorker,
  MalformedError,
  NONE,
  open,
  openDocument,
  openSource,
  openStreamer,
  PATIENT,
  Page,
  pause,
  placing,
  RESIDENT,
  Residency,
  rest,
  Session,
  SourceError,
  startWorker,
  tablesOf,
  tablesPlace,
  View,
  viewOf,
} from './streaming.mjs';

const [task, ...given] = process.argv.slice(3);
const PLANNED = 11 * 65_536; // bytes of a Worker

// Residency of 40 equal pages of a primitive, without a file. read(page) and decode(page) may reject;
// decode gives the bytes of a Worker's memory. run() ends if so many pages are resident, or with the
// stream. Returns how often each page was read, and what was told.
function fortyPages({
  read = async () => {},
  decode,
  givenUp = [],
  rootPages = 0,
  workers = 4,
  ended = false,
}) {
  const [length, count] = [20_000, 40];
  const pool = { byteLength: 20e6, fits: () => true, insert: () => ({}), remove() {} };
  const tables = { rootPages, pageClusters: (p) => p };
  const owner = { name: 'it', formats: [{ bytes: 16 }], tables, pool, resident: [] };
  const result = { reads: Array(count).fill(0), warnings: [], broken: [], refused: [] };
  const source = {
    async read(begin, end) {
      const pages = owner.pages.slice(begin / length, end / length);
      for (const { number } of pages) result.reads[number]++;
      await pause(10 + 3 * (pages[0].number % 5));
      await Promise.all(pages.map(read));
      return new Uint8Array(end - begin);
    },
  };
  owner.pages = Array.from({ length: count }, (_, number) => {
    const place = { source, begin: number * length, length, packed: 0 };
    const page = new Page(owner, number, { ...place, vertices: 2500, triangles: 5000 });
    page.use(1);
    page.want(count - number);
    if (givenUp.includes(number)) page.attempts.block();
    return page;
  });
  const budget = { workers, wasm: PLANNED, tables: 0, waiting: 512_000, decoding: 150_000 };
  budget.maxBytes = 40e6 + workers * PLANNED + budget.waiting + budget.decoding;
  const residency = new Residency([owner], [pool], budget, {
    document: { held: 0 },
    signal: new AbortController().signal,
    decoders: {
      ended,
      async run({ options }) {
        await pause(3);
        return { memory: await decode(owner.pages[options.expected.clusters]) };
      },
    },
    onWarning: (text) => result.warnings.push(text),
    onBroken: (error) => result.broken.push(error.message),
    refuse: (_, error) => result.refused.push(error.message),
    onChange() {},
  });
  const resident = () => owner.pages.filter(({ state }) => state === RESIDENT).length;
  return async (most = count) => {
    const end = performance.now() + 10_000;
    while (performance.now() < end && resident() < most && result.broken.length === 0) {
      residency.insertDecoded();
      residency.schedule();
      await pause(4);
    }
    return { ...result, resident: resident() };
  };
}

// The JSON of a .glb as that of a .gltf with each mesh twice: of a.bin, and of b.bin.
function twice({ bufferViews, meshes, ...json }) {
  const [buffer] = json.buffers;
  const moved = structuredClone(meshes);
  for (const { primitives } of moved)
    for (const { extensions } of primitives)
      for (const part of [
        extensions.EXT_meshlet_edgebreaker,
        extensions[LOD],
        extensions[LOD].pages,
      ])
        part.bufferView += bufferViews.length;
  const second = bufferViews.map((view) => ({ ...view, buffer: 1 }));
  return {
    ...json,
    buffers: ['a.bin', 'b.bin'].map((uri) => ({ ...buffer, uri })),
    bufferViews: [...bufferViews, ...second],
    meshes: [...meshes, ...moved],
  };
}

// Bytes of [begin, end) that a request's range asks for.
function overlap(range, { begin, end }) {
  const [, first, last] = /=(\d+)-(\d+)/.exec(range);
  return Math.max(0, Math.min(Number(last) + 1, end) - Math.max(Number(first), begin));
}

const tasks = {
  // Of a file, given as two arguments with its lod_*.json: the cuts that differ.
  async cuts(files) {
    const differences = [];
    for (let i = 0; i < files.length; i += 2) {
      const document = await openDocument(new Blob([readFileSync(files[i])]));
      const tables = await tablesOf(document);
      const { primitives } = JSON.parse(readFileSync(files[i + 1], 'utf8'));
      primitives.forEach((expected, p) => {
        if ((expected === null) !== (tables[p] === null)) differences.push(`${files[i]} ${p}`);
        if (!expected) return;
        const one = tables[p];
        if (`${[...one.levels()]}` !== `${expected.levels}` || one.rootPages !== expected.rootPages)
          differences.push(`${files[i]} ${p}: levels`);
        for (const [
          c,
          { error, level, camera, matrix, resident, drawn },
        ] of expected.cuts.entries()) {
          if (level !== undefined) continue;
          const cut = new Cut(one);
          const flags =
            resident && Uint8Array.from({ length: one.pageCount }, (_, n) => +resident.includes(n));
          const view = camera
            ? new View({ ...camera, near: 1e-4 })
            : new View({ eye: null, pixelsPerUnit: 1, near: 1 });
          const placed = { matrix: matrix ?? IDENTITY, scale: largestScale(matrix ?? IDENTITY) };
          cut.walk(view, placed, camera?.threshold ?? error, flags ?? null);
          const found = [];
          cut.forDrawn((page, first, count) => {
            for (let m = first; m < first + count; m++) found.push([page, m]);
          });
          const text = (pairs) => pairs.map(String).sort().join(' ');
          if (text(found) !== text(drawn)) differences.push(`${files[i]} ${p} cut ${c}`);
        }
      });
    }
    return differences;
  },

  // What becomes of malformed files: refused levels, warnings, an error.
  async malformed(files) {
    hurry();
    const results = {};
    for (const file of files) {
      try {
        const streamer = await open(new Blob([readFileSync(file)]));
        await rest(streamer, viewOf(streamer), { pixels: 0, until: hasProblem });
        const { told, refused } = streamer;
        results[path.basename(file)] = {
          refused: refused.map(({ error }) => error.message),
          ...told,
        };
        streamer.close();
      } catch (error) {
        const ours = error instanceof MalformedError || error instanceof SourceError;
        results[path.basename(file)] = { error: error.message, ours };
      }
    }
    return results;
  },

  // The first picture: its error in pixels, the bytes that it has taken, the share of its buffers in
  // those of all detail, and what it has warned of.
  async first([file]) {
    const server = await serveFile(readFileSync(file));
    const streamer = await open(server.url);
    let fetched;
    while (!streamer.ready) {
      ({ fetched } = streamer.statistics);
      streamer.update(null, 1);
      await pause(1);
    }
    streamer.update(viewOf(streamer), 1);
    const { error, bytes } = streamer.statistics;
    await rest(streamer, viewOf(streamer), { pixels: 0 });
    const share = bytes.gpu / streamer.statistics.bytes.gpu;
    streamer.close();
    server.close();
    return { error, fetched, share, warnings: streamer.told.warnings };
  },

  // A file on servers with each fault: what is told, and whether the picture is that of a good one.
  async faults([file]) {
    const bytes = readFileSync(file);
    const run = async ([name, answer]) => {
      const server = await serveFile(bytes, { answer });
      const streamer = await open(server.url, name === 'hangs' ? { stallMs: 3000 } : {});
      await rest(streamer, viewOf(streamer), { pixels: 0.2 });
      const { complete } = streamer.statistics;
      const result = { ...streamer.told, complete, drawn: JSON.stringify(drawn(streamer)) };
      streamer.close();
      server.close();
      return [name, result];
    };
    const results = Object.fromEntries(await Promise.all(Object.entries(faults).map(run)));
    const expected = results.none.drawn;
    for (const result of Object.values(results)) result.drawn = result.drawn === expected;
    return results;
  },

  // A server that compresses ranges, or not, and answers the first requests for the whole file never:
  // what is warned of until all is read, and what an abort gives.
  async stalls([file]) {
    const bytes = readFileSync(file);
    const results = {};
    for (const name of ['compresses ranges', 'none']) {
      const hangs = (times) => (request, response, next, served) => {
        if (!request.headers.range && times-- > 0) return;
        (faults[name] ?? next)(request, response, next, served);
      };
      const read = async (times, options) => {
        const server = await serveFile(bytes, { answer: hangs(times) });
        const reading = openSource(server.url, options).then((source) => source.readAll());
        const end = await Promise.race([reading.catch(({ message }) => message), pause(4000)]);
        server.close();
        return end?.length === bytes.length || end;
      };
      const warnings = [];
      const onWarning = (text) => warnings.push(text.replace(/.*glb: /, ''));
      const all = await read(1, { onWarning, stallMs: 300 });
      const abort = new AbortController();
      setTimeout(() => abort.abort(new Error('stopped')), 300);
      results[name] = { all, warnings, aborted: await read(9, { signal: abort.signal }) };
    }
    return results;
  },

  // Statuses and a file that changes.
  async refusals([file, other]) {
    const bytes = readFileSync(file);
    const failing = (status) => (_request, response) => response.writeHead(status).end();
    const results = {};
    for (const status of [404, 403, 416]) {
      const server = await serveFile(bytes, { answer: failing(status) });
      results[status] = await openSource(server.url).catch(({ message }) => message);
      server.close();
    }
    const server = await serveFile(bytes);
    results.gone = await openStreamer(server.url.replace(/:\d+/, ':9'), {
      signal: AbortSignal.timeout(700),
    }).catch(({ message }) => message);
    const streamer = await open(server.url);
    await rest(streamer, viewOf(streamer, 30));
    Object.assign(server, { bytes: readFileSync(other), etag: '"2"' });
    await rest(streamer, viewOf(streamer), { pixels: 0 });
    results.changed = streamer.told.broken;
    streamer.close();
    // Offline and back: requests fail, then all is as before.
    Object.assign(server, { bytes, etag: '"1"' });
    const again = await open(server.url);
    await rest(again, viewOf(again, 30));
    server.answer = (request) => request.socket.destroy();
    await rest(again, viewOf(again), { pixels: 0.2, until: hasProblem });
    results.offline = { complete: again.complete, warned: again.told.warnings.length > 0 };
    server.answer = undefined;
    await rest(again, viewOf(again), { pixels: 0.2 });
    results.back = again.complete;
    again.close();
    server.close();
    return results;
  },

  // Requests and decodings under way on a server that has stopped to answer, before and after what
  // they are for leaves the view.
  async cancels([file]) {
    const server = await serveFile(readFileSync(file));
    const streamer = await open(server.url);
    await rest(streamer, viewOf(streamer, 30));
    server.answer = () => {};
    streamer.update(viewOf(streamer), 0.2);
    const before = streamer.statistics.waiting;
    streamer.update(viewOf(streamer, 30), 1);
    await pause(100);
    const after = streamer.statistics.waiting;
    streamer.close();
    server.close();
    return { before, after, warnings: streamer.told.warnings };
  },

  // A flight around a file within a budget: the largest total, whether the end is the same by
  // another path and on a slow machine, and whether a stream with memory for all draws the same at that error. resized:
  // pools to or from which memory has moved.
  async budget([file, maxBytes]) {
    const server = await serveFile(readFileSync(file));
    const ends = [];
    let most = 0;
    let resized = 0;
    let last;
    const turns = [0.5, 1, 2, 3, 4, 5, 6];
    for (const [angles, createWorker] of [[[]], [turns], [turns, lateWorker]]) {
      const streamer = await open(server.url, { maxBytes: Number(maxBytes), createWorker });
      const capacities = streamer.pools.map(({ capacity }) => capacity);
      for (const angle of angles)
        for (let frame = 0; frame < 15; frame++) {
          streamer.update(viewOf(streamer, 1.1 + angle / 6, angle), 1);
          most = Math.max(most, streamer.statistics.bytes.total);
          await pause(3);
        }
      most = Math.max(most, await rest(streamer, viewOf(streamer, 1.2)));
      ends.push(JSON.stringify([drawn(streamer), streamer.complete, digest(streamer)]));
      last = streamer.statistics;
      resized += streamer.pools.filter(({ capacity }, p) => capacity !== capacities[p]).length;
      streamer.close();
    }
    const { threshold, triangles } = last;
    const roomy = await open(server.url);
    await rest(roomy, viewOf(roomy, 1.2), { pixels: threshold });
    ends.push(JSON.stringify([drawn(roomy), roomy.complete, digest(roomy)]));
    roomy.close();
    server.close();
    const same = ends.every((end) => end === ends[0]);
    return { most, same, resized, threshold, triangles };
  },

  // Why levels are refused whose tables give a page more triangles or vertices than fit into its
  // clusters: first and last page, one too many and as many as can be said.
  async counts([file]) {
    const bytes = readFileSync(file);
    const { begin, tables } = await tablesPlace(bytes);
    const reasons = [];
    for (const page of [0, tables.pageCount - 1]) {
      const most = 64 * tables.pageClusters(page);
      const fields = [
        [8, most],
        [12, 3 * most],
      ];
      for (const [field, allowed] of fields)
        for (const count of [allowed + 1, 4e9]) {
          const copy = Buffer.from(bytes);
          copy.writeUInt32LE(count, begin + 16 * page + field);
          const streamer = await open(new Blob([copy])).catch(({ message }) => ({ message }));
          reasons.push(streamer.message ?? streamer.refused[0]?.error.message);
          streamer.close?.();
        }
    }
    return reasons;
  },

  // Why levels are refused whose tables are packed.
  async packedTables([file]) {
    const bytes = readFileSync(file);
    const length = bytes.readUInt32LE(12);
    const json = JSON.parse(bytes.subarray(20, 20 + length));
    const view = json.bufferViews[json.meshes[0].primitives[0].extensions[LOD].bufferView];
    view.extensions = { EXT_meshlet_transport: { byteLength: view.byteLength } };
    json.buffers[0].uri = `data:;base64,${bytes.toString('base64', 28 + length)}`;
    const streamer = await open(new Blob([JSON.stringify(json)]));
    return streamer.refused.map(({ error }) => error.message);
  },

  // What `ready` of a session tells that is closed while it opens, and while it waits to start again;
  // what openStreamer tells of a signal that is aborted already. requests: after these.
  async endsEarly([file]) {
    const server = await serveFile(readFileSync(file));
    const told = (promise) =>
      Promise.race([promise.catch(({ message }) => message), pause(2000).then(() => 'nothing')]);
    const engine = { load() {}, show() {}, clear() {}, tell() {} };
    const results = { requests: 0 };
    const signal = AbortSignal.abort(new Error('aborted'));
    results.aborted = await told(openStreamer(server.url, { signal }));
    results.requests += server.log.length;
    server.answer = () => {};
    const opening = new Session(server.url, {}, engine);
    await pause(100);
    opening.close();
    results.opening = await told(opening.ready);
    server.answer = undefined;
    const changes = async () => {
      throw new SourceError('the file has changed', { changed: true });
    };
    const restarts = await new Promise((resolve) => {
      const tell = (type) => type === 'warning' && resolve(session);
      const session = new Session(server.url, {}, { ...engine, load: changes, tell });
    });
    await pause(10);
    restarts.close();
    const before = server.log.length;
    results.restarting = await told(restarts.ready);
    results.requests += server.log.length - before;
    server.close();
    return results;
  },

  // Parts of the tables, [known groups, group to be known], that do not end with a page, or before
  // that group.
  async wholePages([file]) {
    const document = await openDocument(new Blob([readFileSync(file)]));
    const [tables] = await tablesOf(document);
    const wrong = [];
    for (const known of tables.pageFirst) {
      tables.known = known;
      for (let g = known; g < tables.groupCount; g++) {
        const end = tables.partEnd(g);
        if (end <= g || !tables.pageFirst.includes(end)) wrong.push([known, g]);
      }
    }
    return wrong;
  },

  // A file at rest, seen from far away and then from near: what each has asked for of the tables,
  // {bytes, requests, known}, after the first request; view: bytes of the tables.
  async tableParts([file]) {
    const bytes = readFileSync(file);
    const view = await tablesPlace(bytes);
    const server = await serveFile(bytes);
    const streamer = await open(server.url);
    const results = { view: view.end - view.begin };
    for (const [name, distance] of [
      ['far', 40],
      ['near', 1.05],
    ]) {
      await rest(streamer, viewOf(streamer, distance));
      const sizes = server.log.slice(1).map((range) => overlap(range, view));
      const [{ tables }] = streamer.primitives;
      results[name] = {
        bytes: sizes.reduce((sum, size) => sum + size, 0),
        requests: sizes.filter((size) => size > 0).length,
        known: tables.known / tables.groupCount,
      };
    }
    streamer.close();
    server.close();
    return results;
  },

  // Places of a flight, far and near, at which a stream at rest draws another cut than whole tables
  // say; known: the share of the groups at each place.
  async tableFlight([file]) {
    const bytes = readFileSync(file);
    const { tables: whole } = await tablesPlace(bytes);
    const server = await serveFile(bytes);
    const streamer = await open(server.url);
    const [{ tables, instances }] = streamer.primitives;
    const result = { wrong: [], known: [] };
    for (const [angle, distance] of [40, 8, 20, 4, 30, 3, 1.1, 40].entries()) {
      const view = viewOf(streamer, distance, angle);
      await rest(streamer, view);
      const cut = new Cut(whole);
      cut.walk(view, instances[0], 1, null);
      const expected = [];
      cut.forDrawn((page, first, count) => expected.push([page, first, count]));
      const [[found]] = drawn(streamer);
      const same = `${found}` === `${expected.sort((a, b) => a[0] - b[0] || a[1] - b[1])}`;
      if (!same || !streamer.complete) result.wrong.push(distance);
      result.known.push(tables.known / tables.groupCount);
    }
    streamer.close();
    server.close();
    return result;
  },

  // The levels that a stream shows from far away, after it has shown them in one colour, and those by
  // whole tables.
  async shownLevels([file]) {
    const bytes = readFileSync(file);
    const { tables: whole } = await tablesPlace(bytes);
    const server = await serveFile(bytes);
    const streamer = await open(server.url);
    const view = viewOf(streamer, 8);
    await rest(streamer, view);
    streamer.colour = 'level';
    streamer.update(view, 1);
    await rest(streamer, view);
    const [{ cut, instances }] = streamer.primitives;
    const levels = whole.levels();
    const expected = new Set();
    cut.forDrawn((_page, _first, _count, group) => expected.add(levels[group]));
    const sorted = (values) => [...new Set(values)].sort();
    streamer.close();
    server.close();
    return [sorted(instances[0].tags), sorted(expected)];
  },

  // A file whose last group is malformed: what is told of a view from far away, and from near.
  async laterMalformed([file]) {
    const bytes = Buffer.from(readFileSync(file));
    const { begin, tables } = await tablesPlace(bytes);
    const [, end] = tables.groupRange(tables.groupCount);
    bytes.writeUInt8(0, begin + end - 2); // clusters
    const streamer = await open(new Blob([bytes]));
    const result = {};
    for (const [name, distance, pixels] of [
      ['far', 40, 1],
      ['near', 1.05, 0],
    ]) {
      await rest(streamer, viewOf(streamer, distance), { pixels });
      const refused = streamer.refused.map(({ error }) => error.message);
      result[name] = { complete: streamer.complete, refused, ...structuredClone(streamer.told) };
    }
    streamer.close();
    return result;
  },

  // A file on a server that answers requests for tables with a status, after the view from far away,
  // so many times: what is told of the view from near; known: whether all that it needs is.
  async laterFaults([file]) {
    hurry();
    const bytes = readFileSync(file);
    const view = await tablesPlace(bytes);
    const result = {};
    for (const [status, times] of [
      [503, 7],
      [404, 2],
      [404, 1e9],
    ]) {
      const server = await serveFile(bytes);
      const streamer = await open(server.url, PATIENT);
      await rest(streamer, viewOf(streamer, 40));
      let left = times;
      server.answer = (request, response, next) => {
        if (overlap(request.headers.range, view) === 0 || left-- <= 0) return next();
        response.writeHead(status).end();
      };
      await rest(streamer, viewOf(streamer, 1.05), { limit: times > 7 ? 3000 : 60_000 });
      const { complete, triangles } = streamer.statistics;
      result[`${status} ${times}`] = { ...streamer.told, complete, triangles };
      streamer.close();
      server.close();
    }
    return result;
  },

  // A file as a .gltf with two .bin files that are the same, a primitive of each. The server refuses
  // later tables of the second: what is told of a view, and the share of the groups that each
  // primitive knows; recovered: of a view of finer detail when it refuses nothing any more.
  async twoFiles([file]) {
    hurry();
    const bytes = readFileSync(file);
    const length = bytes.readUInt32LE(12);
    const json = JSON.parse(bytes.subarray(20, 20 + length));
    const begin = 28 + length;
    const place = await tablesPlace(bytes);
    const view = { begin: place.begin - begin, end: place.end - begin };
    const gltf = Buffer.from(JSON.stringify(twice(json)));
    let refuses = false;
    const answer = (request, response, next, served) => {
      served.bytes = request.url.endsWith('.bin') ? bytes.subarray(begin) : gltf;
      const isLater = refuses && request.url === '/b.bin';
      if (!isLater || overlap(request.headers.range, view) === 0) return next();
      response.writeHead(403).end();
    };
    const server = await serveFile(gltf, { answer });
    const streamer = await open(server.url, PATIENT);
    const known = () => streamer.primitives.map(({ tables }) => tables.known / tables.groupCount);
    refuses = true;
    await rest(streamer, viewOf(streamer, 4.8), { limit: 3000 });
    const result = { ...structuredClone(streamer.told), known: known() };
    refuses = false;
    await rest(streamer, viewOf(streamer, 1.05), { pixels: 0, limit: 60_000 });
    result.recovered = { complete: streamer.complete, known: known() };
    streamer.close();
    server.close();
    return result;
  },

  // The first bytes of a file that a stream keeps at rest, in views from far to near: {held, known,
  // groups, next: the place of the first group that is not known}.
  async heads([file]) {
    const bytes = readFileSync(file);
    const { begin } = await tablesPlace(bytes);
    const server = await serveFile(bytes);
    const streamer = await open(server.url);
    const [{ tables, pages }] = streamer.primitives;
    const results = [];
    for (const distance of [40, 20, 10, 6, 4, 3, 1.1]) {
      await rest(streamer, viewOf(streamer, distance));
      const stored = pages.reduce((sum, page) => sum + (page.bytes?.length ?? 0), 0);
      const held = streamer.statistics.bytes.compressed - stored;
      const next = begin + tables.groupRange(tables.known)[0];
      results.push({ held, next, known: tables.known, groups: tables.groupCount });
    }
    streamer.close();
    server.close();
    return results;
  },

  // Groups that streams know at rest, at each of some errors of an orthographic view.
  async knownGroups([file, ...errors]) {
    const server = await serveFile(readFileSync(file));
    const found = [];
    for (const error of errors) {
      const streamer = await open(server.url);
      const view = new View({ eye: null, pixelsPerUnit: 1, near: 1 });
      await rest(streamer, view, { pixels: Number(error) });
      found.push(streamer.primitives[0].tables.known);
      streamer.close();
    }
    server.close();
    return found;
  },

  // Workers that take more memory than planned.
  grown: () => fortyPages({ decode: async () => PLANNED + 131_072 })(),

  // Pages that were given up, between others.
  givenUp: () => fortyPages({ decode: async () => PLANNED, givenUp: [1, 2, 30] })(37),

  // A server that refuses a root page.
  refusedRoot() {
    const read = async ({ number }) => {
      if (number === 3) throw new SourceError('the server answered 404');
    };
    return fortyPages({ read, decode: async () => PLANNED, rootPages: 4 })();
  },

  // Workers that cannot go on.
  dead: () =>
    fortyPages({
      decode: async () => {
        throw new Error('a Worker failed');
      },
      ended: true,
    })(),

  // A session on a file of which a page kills each Worker that decodes it: what it told, the
  // pages that are missing at the end, and how often that page was decoded.
  async killers([file]) {
    hurry();
    const bytes = readFileSync(file);
    const server = await serveFile(bytes);
    let killer = null;
    let kills = 0;
    const createWorker = () => {
      const worker = startWorker();
      const post = worker.postMessage.bind(worker);
      worker.postMessage = (message, transfer) => {
        if (!killer?.equals(message.bytes ?? Buffer.alloc(0))) return post(message, transfer);
        kills++;
        worker.emit('error', new Error('out of memory'));
      };
      return worker;
    };
    const told = { load: [], warning: [], error: [] };
    const session = new Session(server.url, { ...PATIENT, createWorker }, placing(told));
    await session.ready;
    const [{ pages }] = session.streamer.primitives;
    const page = pages.find(
      ({ number, owner, state }) => number > owner.firstPages && state === NONE,
    );
    killer = bytes.subarray(page.begin, page.begin + page.length);
    const view = viewOf(session.streamer);
    const end = Date.now() + 10_000;
    let last;
    do {
      session.streamer?.update(view, 0);
      await pause(300);
      last = session.streamer?.statistics;
    } while (Date.now() < end && (kills < 3 || last?.waiting !== 0));
    session.close();
    server.close();
    return { ...told, number: page.number, missing: last?.missing, kills };
  },

  // What a session told, up to ten pictures, on a server that gives the file another ETag after each
  // one. seconds: how long a picture lasts, at least.
  async flapping([file, seconds]) {
    hurryTimers();
    const told = { load: [], warning: [], error: [] };
    const { now } = performance;
    let late = 0;
    performance.now = () => now.call(performance) + late;
    const server = await serveFile(readFileSync(file));
    const session = new Session(server.url, PATIENT, placing(told));
    await session.ready;
    while (told.load.length < 10 && told.error.length === 0) {
      late = 1000 * seconds * told.load.length;
      server.etag = `"picture ${told.load.length}"`;
      session.streamer?.update(viewOf(session.streamer), 0);
      await pause(300);
    }
    session.close();
    server.close();
    return told;
  },

  // Whether all is there at the end if a page updates only when the stream says so, and has time for
  // one decoded page a frame.
  async onDemand([file, maxBytes]) {
    let asked = true;
    const onChange = () => {
      asked = true;
    };
    const server = await serveFile(readFileSync(file));
    const streamer = await open(server.url, { maxBytes: Number(maxBytes), onChange });
    const end = performance.now() + 60_000;
    const { now } = performance;
    let late = 0;
    performance.now = () => {
      late += 2;
      return now.call(performance) + late;
    };
    while (now.call(performance) < end && !(streamer.complete && !asked)) {
      if (asked) {
        asked = false;
        streamer.update(viewOf(streamer, 1.2), 0.5);
      }
      await pause(1);
    }
    const { complete } = streamer;
    streamer.close();
    server.close();
    return complete;
  },

  // Whether files show the same triangles of the same pages.
  async same(files) {
    const ends = [];
    for (const file of files) {
      const server = await serve('', '', path.dirname(file));
      const streamer = await open(`${server.url}/files/${path.basename(file)}`);
      await rest(streamer, viewOf(streamer), { pixels: 0.2 });
      ends.push(JSON.stringify([drawn(streamer), streamer.complete, digest(streamer)]));
      streamer.close();
      server.close();
    }
    return ends.every((end) => end === ends[0]) && ends[0].includes('true');
  },

  // Mutants of a file: what they end as. Fails with any exception that is not ours.
  async mutants([file, count, seed]) {
    const original = readFileSync(file);
    let state = Number(seed);
    const random = (below) => {
      state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
      return Math.floor((state / 2 ** 32) * below);
    };
    const ends = { refused: 0, opened: 0, failed: 0, most: 0 };
    for (let i = 0; i < Number(count); i++) {
      const bytes = Buffer.from(original);
      for (let n = 1 + random(3); n > 0; n--) {
        const at = random(2) ? random(6000) % bytes.length : random(bytes.length);
        bytes[at] = random(2) ? random(256) : bytes[at] ^ (1 << random(8));
      }
      const blob = new Blob([random(20) ? bytes : bytes.subarray(0, random(bytes.length))]);
      try {
        const streamer = await open(blob, { maxBytes: 8e6 });
        ends.most = Math.max(
          ends.most,
          await rest(streamer, viewOf(streamer), { pixels: 0, limit: 25 }),
        );
        if (streamer.refused.length > 0) ends.refused++;
        else ends.opened++;
        streamer.close();
      } catch (error) {
        if (!(error instanceof MalformedError || error instanceof SourceError)) throw error;
        ends.failed++;
      }
    }
    return ends;
  },
};

process.stdout.write(JSON.stringify(await tasks[task](given)));
process.exit(0); // Workers of closed pools may still end
