// Decodes in a pool of Workers, so that a page does not stall: each blob of a view is a job. Needs
// no SharedArrayBuffer.
//
// The first job, the head, may have several blobs: its Worker makes the arrays of the whole
// primitive, decodes its share in place and hands the arrays over. The other Workers send their
// decoded blobs, which the page's thread copies into the arrays. So there are these arrays and the
// blobs that wait for the head, at most as many bytes again.
import { MalformedError } from './blob.js';
import { compileDecoder } from './compile.js';

const MOST_WORKERS = 8;
const START_MS = 30_000; // until a Worker has to answer
// The heads of one, two, three .. Workers have the first share of parts that grow by this factor:
// the page's thread copies a blob in about a fifth of the time that decoding it takes.
const GROWTH = 1.25;
const files = new WeakMap(); // Worker of a file of ours -> its URL, unless a bundler has renamed it

export async function createDecoderPool({ workers, source, createWorker = moduleWorker } = {}) {
  const cores = globalThis.navigator?.hardwareConcurrency ?? 4;
  const count = workers ?? Math.min(cores, MOST_WORKERS);
  if (!Number.isInteger(count) || count < 1)
    throw new RangeError(`a pool cannot have ${count} workers`);
  const module = await compileDecoder(source);
  const starting = Array.from({ length: count }, async () => createWorker());
  try {
    return new DecoderPool(module, await Promise.all(starting), createWorker);
  } catch (error) {
    for (const one of starting) one.then((worker) => worker.terminate()).catch(() => {});
    throw error;
  }
}

function moduleWorker() {
  // Bundlers look for this expression.
  const start = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  return startWorker(import.meta.url, start);
}

// Starts a Worker of worker.js beside a file of ours, in Node or by start() in a browser. base: URL
// of that file; a bundler may have put another one. For gltf-meshlet/stream, too.
export async function startWorker(base, start) {
  const name = './worker.js'; // in a variable, so that bundlers do not copy the file
  if (typeof Worker === 'undefined') {
    const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
    const threads = await import(/* webpackIgnore: true */ /* @vite-ignore */ node);
    return new threads.Worker(new URL(name, base));
  }
  if (!/^https?:/.test(base)) return start();
  const url = new URL(name, base);
  const worker = url.origin === globalThis.location.origin ? start() : importingWorker(url);
  files.set(worker, url);
  return worker;
}

// Workers begin on the page's own server. What they import may come from others, as from a CDN.
function importingWorker(url) {
  const script = new Blob([`import ${JSON.stringify(url)}`], { type: 'text/javascript' });
  return new Worker(URL.createObjectURL(script), { type: 'module' });
}

class DecoderPool {
  #planner; // promise of a decoder that reads headers only; a stream needs none
  #module;
  #createWorker;
  #members;
  #waiting = []; // jobs without a member
  works = false; // a Worker has done a job; for members
  ended = null; // the error of all calls from now on; for gltf-meshlet/stream, too

  constructor(module, workers, createWorker) {
    this.#module = module;
    this.#createWorker = createWorker;
    this.#members = workers.map((worker) => new Member(worker, module, this));
  }

  async decodePrimitive(view, { integers = false, signal, onProgress } = {}) {
    const plan = await this.#plan(view, integers);
    const { blobs, total } = plan;
    let triangles = 0;
    const onTriangles = (count) => {
      triangles += count;
      onProgress?.(Math.min(1, triangles / total.triangles));
    };
    const run = (bytes, options) =>
      this.run(
        { task: 'decodeBlobs', bytes, options: { integers, ...options }, onTriangles },
        signal,
      );
    const head = headOf(blobs, this.#members.length);
    const headBytes = head.reduce((sum, { bytes }) => sum + bytes.length, 0);
    const headEnds = run(view.subarray(0, headBytes), { total }).then(
      (arrays) => plan.adopt(arrays),
      (error) => {
        throw head.length === 1 ? plan.blame(blobs[0], error) : error;
      },
    );
    const decodeBlob = async (blob) => {
      const decoded = run(blob.bytes, { firstVertex: blob.begin.vertices });
      const arrays = await decoded.catch((error) => {
        throw plan.blame(blob, error);
      });
      await headEnds;
      plan.insert(arrays, blob.begin);
    };
    await all([headEnds, ...blobs.slice(head.length).map(decodeBlob)]);
    return plan.result;
  }

  async #plan(view, integers) {
    this.#planner ??= import('./decoder.js').then(({ createDecoder }) =>
      createDecoder(this.#module),
    );
    return (await this.#planner).plan(view, integers);
  }

  async validate(view, { signal } = {}) {
    const plan = await this.#plan(view, false);
    const validateBlob = async (blob) => {
      try {
        await this.run({ task: 'validate', bytes: blob.bytes }, signal);
      } catch (error) {
        throw plan.blame(blob, error);
      }
    };
    await all(plan.blobs.map(validateBlob));
  }

  close() {
    this.end(new Error('the decoder pool is closed'));
  }

  // Rejects all jobs, now and later. For members.
  end(error) {
    if (this.ended) return;
    this.ended = error;
    for (const job of this.#waiting.splice(0)) job.reject(error);
    for (const member of this.#members) member.end(error);
  }

  // A member's Worker has failed. Where Workers do work, its job is to blame: only that rejects, and
  // another Worker takes the member's place. For members.
  async replace(member, error) {
    if (!this.#members.includes(member)) return; // it has failed before
    if (!member.busy || !this.works) return this.end(error);
    member.end(error);
    this.#members = this.#members.filter((other) => other !== member);
    try {
      const other = new Member(await this.#createWorker(), this.#module, this);
      this.#members.push(other);
      if (this.ended) other.end();
      this.next();
    } catch (failed) {
      this.end(failed);
    }
  }

  // Gives waiting jobs to members without one. For members.
  next() {
    for (const member of this.#members)
      if (!member.busy && this.#waiting.length > 0) member.start(this.#waiting.shift());
  }

  // Does a job: task, bytes, options and onTriangles. For this class and gltf-meshlet/stream.
  async run(given, signal) {
    if (this.ended) throw this.ended;
    signal?.throwIfAborted();
    let abort;
    try {
      return await new Promise((resolve, reject) => {
        const job = { ...given, resolve, reject };
        abort = () => {
          this.#waiting = this.#waiting.filter((other) => other !== job);
          job.onTriangles = () => {};
          reject(signal.reason);
        };
        signal?.addEventListener('abort', abort);
        this.#waiting.push(job);
        this.next();
      });
    } finally {
      signal?.removeEventListener('abort', abort);
    }
  }
}

// A Worker and its job. An aborted job runs to its end; nobody waits for it.
class Member {
  #worker;
  #pool;
  #job = null;
  #starting; // ends the wait for its first answer

  constructor(worker, module, pool) {
    this.#worker = worker;
    this.#pool = pool;
    const failed = ({ message }) => {
      clearTimeout(this.#starting);
      const place = files.has(worker) ? ` (without a bundler, ${files.get(worker)})` : '';
      const problem = message ?? `its file was not loaded${place}`;
      pool.replace(this, new Error(`a decoder's Worker failed: ${problem}`));
    };
    const silent = `no answer in ${START_MS / 1000} seconds; does its file import the package's?`;
    this.#starting = setTimeout(() => failed({ message: silent }), START_MS);
    this.#starting.unref?.();
    if (worker.on) {
      worker.on('message', (answer) => this.#receive(answer)).on('error', failed); // Node
    } else {
      worker.onmessage = ({ data }) => this.#receive(data);
      worker.onerror = failed;
    }
    worker.unref?.(); // an idle pool does not keep Node running
    worker.postMessage({ module });
  }

  get busy() {
    return this.#job !== null;
  }

  start(job) {
    this.#job = job;
    this.#worker.ref?.();
    const bytes = new Uint8Array(job.bytes); // a copy; slice() of a Buffer of Node is none
    this.#worker.postMessage({ task: job.task, bytes, options: job.options }, [bytes.buffer]);
  }

  end(error) {
    clearTimeout(this.#starting);
    this.#job?.reject(error);
    this.#worker.terminate();
  }

  #receive({ started, triangles, result, error }) {
    clearTimeout(this.#starting);
    if (started) return;
    const { onTriangles, resolve, reject } = this.#job;
    if (triangles !== undefined) {
      try {
        onTriangles(triangles);
      } catch (thrown) {
        reject(thrown); // by the caller's onProgress
      }
      return;
    }
    this.#job = null;
    this.#pool.works = true;
    this.#worker.unref?.();
    if (!error) resolve(result);
    else reject(error.malformed ? new MalformedError(error.message) : new Error(error.message));
    this.#pool.next();
  }
}

// Waits for all; throws the first one's error, in the order of the view.
async function all(promises) {
  const settled = await Promise.allSettled(promises);
  for (const { status, reason } of settled) if (status === 'rejected') throw reason;
}

// Leading blobs, at least one: the share of the first of n Workers.
function headOf(blobs, n) {
  const most = (blobs.at(-1).end.triangles * (GROWTH - 1)) / (GROWTH ** n - 1);
  const others = blobs.findIndex(({ end }, i) => i > 0 && end.triangles > most);
  return others < 0 ? blobs : blobs.slice(0, others);
}
