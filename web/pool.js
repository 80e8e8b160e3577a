// Decodes in a pool of Workers, so that a page does not stall: each blob of a view is a job, or each
// range of meshlets where there are fewer blobs than Workers. Needs no SharedArrayBuffer.
import { MalformedError, compileDecoder, createDecoder } from './decoder.js';

const MOST_WORKERS = 8;
// A smaller range is not worth a message.
const LEAST_MESHLETS = 512;
// A range begins with the vertex numbers of all meshlets before it. To find those of a meshlet takes
// this share of the time of decoding it (dragon, in Node 20).
const NUMBERING = 0.3;

export async function createDecoderPool({ workers, source, createWorker = moduleWorker } = {}) {
  const cores = globalThis.navigator?.hardwareConcurrency ?? 4;
  const count = workers ?? Math.min(cores, MOST_WORKERS);
  if (!Number.isInteger(count) || count < 1)
    throw new RangeError(`a pool cannot have ${count} workers`);
  const module = await compileDecoder(source);
  const started = await Promise.all(Array.from({ length: count }, () => createWorker()));
  return new DecoderPool(await createDecoder(module), module, started);
}

async function moduleWorker() {
  if (typeof Worker !== 'undefined')
    return new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
  const threads = await import(/* @vite-ignore */ node);
  return new threads.Worker(new URL('./worker.js', import.meta.url));
}

class DecoderPool {
  #planner; // reads headers only
  #members;
  #waiting = []; // jobs without a member
  #ended = null; // the error of all calls from now on

  constructor(planner, module, workers) {
    this.#planner = planner;
    this.#members = workers.map((worker) => new Member(worker, module, this));
  }

  async decodePrimitive(view, { integers = false, signal, onProgress } = {}) {
    const plan = this.#plan(view, integers, signal);
    const { triangleCount } = plan.result;
    let triangles = 0;
    const decode = async ({ blob, begin, end }) => {
      const options = { integers, begin, end, before: blob.begin.vertices };
      const part = await this.#run('decodePart', plan, blob, options, signal);
      plan.insert(blob, part);
      triangles += part.indices.length / 3;
      onProgress?.(triangles / triangleCount);
    };
    await all(plan.blobs.flatMap((blob) => ranges(blob, this.#rangesOf(plan))).map(decode));
    return plan.result;
  }

  async validate(view, { signal } = {}) {
    const plan = this.#plan(view, false, signal);
    await all(plan.blobs.map((blob) => this.#run('validate', plan, blob, undefined, signal)));
  }

  close() {
    this.end(new Error('the decoder pool is closed'));
  }

  // Rejects all jobs, now and later. For members.
  end(error) {
    if (this.#ended) return;
    this.#ended = error;
    for (const job of this.#waiting.splice(0)) job.reject(error);
    for (const member of this.#members) member.end(error);
  }

  // Gives waiting jobs to members without one. For members.
  next() {
    for (const member of this.#members)
      if (!member.busy && this.#waiting.length > 0) member.start(this.#waiting.shift());
  }

  #plan(view, integers, signal) {
    signal?.throwIfAborted();
    if (this.#ended) throw this.#ended;
    return this.#planner.plan(view, integers);
  }

  #rangesOf({ blobs }) {
    return Math.ceil(this.#members.length / blobs.length);
  }

  async #run(task, plan, blob, options, signal) {
    let abort;
    try {
      return await new Promise((resolve, reject) => {
        const job = { task, bytes: blob.bytes, options, resolve, reject };
        abort = () => {
          this.#waiting = this.#waiting.filter((other) => other !== job);
          reject(signal.reason);
        };
        signal?.addEventListener('abort', abort);
        this.#waiting.push(job);
        this.next();
      });
    } catch (error) {
      throw plan.blame(blob, error);
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

  constructor(worker, module, pool) {
    this.#worker = worker;
    this.#pool = pool;
    const failed = ({ message }) =>
      pool.end(new Error(`a decoder's Worker failed: ${message ?? 'its script cannot be loaded'}`));
    if (worker.on) {
      worker.on('message', (answer) => this.#finish(answer)).on('error', failed); // Node
    } else {
      worker.onmessage = ({ data }) => this.#finish(data);
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
    const bytes = job.bytes.slice();
    this.#worker.postMessage({ task: job.task, bytes, options: job.options }, [bytes.buffer]);
  }

  end(error) {
    this.#job?.reject(error);
    this.#worker.terminate();
  }

  #finish({ result, error }) {
    const { resolve, reject } = this.#job;
    this.#job = null;
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

// At most `count` ranges of a blob's meshlets that take about the same time.
function ranges(blob, count) {
  const { meshlets } = blob;
  const n = Math.max(1, Math.min(count, Math.floor(meshlets / LEAST_MESHLETS)));
  const end = (i) =>
    Math.round((meshlets * (1 - (1 - NUMBERING) ** i)) / (1 - (1 - NUMBERING) ** n));
  return Array.from({ length: n }, (_, i) => ({ blob, begin: end(i), end: end(i + 1) }));
}
