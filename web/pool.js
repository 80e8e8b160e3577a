// A pool of Workers that decode, so that a page does not stall. Needs no SharedArrayBuffer.
import { MalformedError } from './blob.js';
import { compileDecoder, decoderUrl } from './compile.js';

const MOST_WORKERS = 8;
const START_MS = 30_000; // until a Worker has to answer
const files = new WeakMap(); // Worker of a file of ours -> its URL
const scripts = new WeakMap(); // Worker that imports its file -> URL of its own lines

export async function createDecoderPool(
  /** @type {{workers?: number, source?: any, createWorker?: () => any}} */ {
    workers,
    source,
    createWorker = moduleWorker,
  } = {},
) {
  const cores = globalThis.navigator?.hardwareConcurrency ?? 4;
  const count = workers ?? Math.min(cores, MOST_WORKERS);
  if (!Number.isInteger(count) || count < 1)
    throw new RangeError(`a pool cannot have ${count} workers`);
  const module = await compileDecoder(source);
  const pool = new DecoderPool(module, createWorker);
  try {
    await pool.grow(count);
    return pool;
  } catch (error) {
    pool.close(); // with the Workers that did start
    throw error;
  }
}

function moduleWorker() {
  // Bundlers look for this expression.
  const start = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  return startWorker('worker.js', start);
}

// Starts a Worker of a file of the package, in Node or by start() in a browser. For
// gltf-meshlet/stream, too.
export async function startWorker(name, start) {
  const decoder = decoderUrl();
  const url = new URL(name, decoder);
  if (typeof Worker === 'undefined') {
    const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
    const threads = await import(/* webpackIgnore: true */ /* @vite-ignore */ node);
    return new threads.Worker(url);
  }
  // A bundler that has renamed the decoder has moved the Worker's file, too.
  if (!decoder.pathname.endsWith('/decoder.wasm')) return start();
  const worker = url.origin === globalThis.location.origin ? start() : importingWorker(url);
  files.set(worker, url);
  return worker;
}

// Workers begin on the page's own server. What they import may come from others, as from a CDN.
function importingWorker(url) {
  const script = new Blob([`import ${JSON.stringify(url)}`], { type: 'text/javascript' });
  const own = URL.createObjectURL(script);
  const worker = new Worker(own, { type: 'module' });
  scripts.set(worker, own);
  return worker;
}

// A Worker that has answered or ended has read its lines. Some browsers read them later than the call
// that makes the Worker.
function forgetScript(worker) {
  const script = scripts.get(worker);
  if (script && scripts.delete(worker)) URL.revokeObjectURL(script);
}

class DecoderPool {
  #whole; // promise of what decodes whole primitives
  #module;
  #createWorker;
  #members = [];
  #count = 0; // of members, also of those that start or are lost
  #lost = 0; // whose Workers have failed
  #waiting = []; // jobs without a member
  works = false; // a Worker has done a job; for members
  ended = null; // the error of all calls from now on; for gltf-meshlet/stream, too

  constructor(module, createWorker) {
    this.#module = module;
    this.#createWorker = createWorker;
  }

  // Starts Workers until there are so many.
  async grow(count) {
    const more = Math.max(0, count - this.#count);
    this.#count += more;
    await Promise.all(Array.from({ length: more }, () => this.#start()));
  }

  async #start() {
    const member = new Member(await this.#createWorker(), this.#module, this);
    this.#members.push(member);
    if (this.ended) member.end();
    this.next();
  }

  async decodePrimitive(view, options = {}) {
    return (await this.#wholeDecoder()).decodePrimitive(view, options);
  }

  async validate(view, options = {}) {
    return (await this.#wholeDecoder()).validate(view, options);
  }

  // Of whole primitives, which a page that streams may have none of.
  #wholeDecoder() {
    this.#whole ??= import('./parallel.js').then(({ createParallelDecoder }) =>
      createParallelDecoder(this, this.#module),
    );
    return this.#whole;
  }

  // Number of Workers.
  get size() {
    return this.#count;
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
  // another Worker takes the member's place when there is a job for it. For members.
  replace(member, error) {
    if (!this.#members.includes(member)) return; // it has failed before
    if (!this.works) return this.end(error);
    member.end(error);
    this.#members = this.#members.filter((other) => other !== member);
    this.#lost++;
    this.next();
  }

  // Gives waiting jobs to members without one. For members.
  next() {
    for (const member of this.#members)
      if (!member.busy && this.#waiting.length > 0) member.start(this.#waiting.shift());
    if (this.#lost === 0 || this.#waiting.length === 0) return;
    this.#lost--;
    this.#start().catch((error) => this.end(error));
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
      const place = files.has(worker) ? `: ${files.get(worker)}` : '';
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
    this.#begun();
    this.#job?.reject(error);
    this.#worker.terminate();
  }

  #begun() {
    clearTimeout(this.#starting);
    forgetScript(this.#worker);
  }

  #receive({ started, triangles, result, error }) {
    this.#begun();
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
