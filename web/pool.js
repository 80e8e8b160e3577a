// Decodes in a pool of Workers, so that a page does not stall: each blob of a view is a job, or each
// range of meshlets where there are fewer blobs than Workers. Needs no SharedArrayBuffer.
import { MalformedError, compileDecoder, createDecoder } from './decoder.js';
import { Joint, rangesOf } from './ranges.js';

const MOST_WORKERS = 8;

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
    let triangles = 0;
    const decode = async (blob, range, onPart) => {
      const job = { task: 'decodeRange', options: { integers, ...range }, onPart };
      const decoded = await this.#run(job, plan, blob, signal);
      triangles += decoded.triangles;
      onProgress?.(Math.min(1, triangles / plan.result.triangleCount));
      return decoded;
    };
    const count = Math.ceil(this.#members.length / plan.blobs.length);
    await all(plan.blobs.map((blob) => decodeBlob(plan, blob, rangesOf(blob, count), decode)));
    return plan.result;
  }

  async validate(view, { signal } = {}) {
    const plan = this.#plan(view, false, signal);
    await all(plan.blobs.map((blob) => this.#run({ task: 'validate' }, plan, blob, signal)));
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

  // given: task, options and onPart of a job.
  async #run(given, plan, blob, signal) {
    let abort;
    try {
      return await new Promise((resolve, reject) => {
        const job = { ...given, bytes: blob.bytes, resolve, reject };
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
    const bytes = job.bytes.slice();
    this.#worker.postMessage({ task: job.task, bytes, options: job.options }, [bytes.buffer]);
  }

  end(error) {
    this.#job?.reject(error);
    this.#worker.terminate();
  }

  #receive({ part, result, error }) {
    const { onPart, resolve, reject } = this.#job;
    if (part) return onPart(part);
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

// Decodes a blob; decode(blob, range, onPart) does so with a range.
async function decodeBlob(plan, blob, ranges, decode) {
  const joint = new Joint(plan, blob, ranges);
  const decodeRange = async (range, i) =>
    joint.end(i, await decode(blob, range, (part) => joint.add(i, part)));
  try {
    await all(ranges.map(decodeRange));
    joint.check();
  } catch (error) {
    if (ranges.length === 1 || !(error instanceof MalformedError)) throw error;
    // One range for all may find another problem first, and that is the one to report.
    await decodeBlob(plan, blob, rangesOf(blob, 1), decode);
  }
}
