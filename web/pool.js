// Decodes in a pool of Workers, so that a page does not stall: each blob of a view is a job, or each
// range of meshlets where there are fewer blobs than Workers. Needs no SharedArrayBuffer.
//
// The first job, the head, is a larger one: its Worker makes the arrays of the whole primitive,
// decodes its share in place and hands the arrays over. The other Workers send copies of what they
// have decoded, part by part; the page's thread copies them into the arrays. So there are these
// arrays and the parts that wait for the head or for others, at most as many bytes again.
import { compileDecoder, createDecoder, MalformedError } from './decoder.js';
import { headOf, Joint, rangesOf } from './ranges.js';

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
    const report = (counts) => {
      triangles += counts.triangles;
      onProgress?.(Math.min(1, triangles / plan.total.triangles));
    };
    const decodeHead = async (blobs, { end, keep }) => {
      const bytes = view.subarray(
        0,
        blobs.reduce((sum, blob) => sum + blob.bytes.length, 0),
      );
      const options = { integers, total: plan.total, end, keep };
      const given = { task: 'decodeHead', bytes, options, onPart: report };
      const { indices, values, ...result } = await this.#run(given, signal);
      plan.adopt({ indices, values });
      return result;
    };
    const decodeRange = async (blob, range, onPart) => {
      const options = { integers, ...range };
      const given = { task: 'decodeRange', bytes: blob.bytes, options, onPart };
      const result = await this.#run(given, signal);
      report(result);
      return result;
    };
    const [everything] = rangesOf(plan.blobs.at(-1), 1);
    try {
      await decodeParts(plan, this.#members.length, decodeHead, decodeRange);
    } catch (error) {
      if (!(error instanceof MalformedError)) throw error;
      // Without parts another problem may come first, or none, and that is the answer.
      await decodeHead(plan.blobs, everything);
    }
    return plan.result;
  }

  async validate(view, { signal } = {}) {
    const plan = this.#plan(view, false, signal);
    const validateBlob = async (blob) => {
      try {
        await this.#run({ task: 'validate', bytes: blob.bytes }, signal);
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

  // given: task, bytes, options and onPart of a job.
  async #run(given, signal) {
    let abort;
    try {
      return await new Promise((resolve, reject) => {
        const job = { ...given, resolve, reject };
        abort = () => {
          this.#waiting = this.#waiting.filter((other) => other !== job);
          job.onPart = () => {};
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
    const bytes = new Uint8Array(job.bytes); // a copy; slice() of a Buffer of Node is none
    this.#worker.postMessage({ task: job.task, bytes, options: job.options }, [bytes.buffer]);
  }

  end(error) {
    this.#job?.reject(error);
    this.#worker.terminate();
  }

  #receive({ part, result, error }) {
    const { onPart, resolve, reject } = this.#job;
    if (part) {
      try {
        onPart(part);
      } catch (thrown) {
        reject(thrown); // by the caller's onProgress
      }
      return;
    }
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

// Decodes a plan's blobs with `count` Workers; decodeHead(blobs, range of the last one) and
// decodeRange(blob, range, onPart) do so with parts.
async function decodeParts(plan, count, decodeHead, decodeRange) {
  const each = Math.ceil(count / plan.blobs.length);
  const head = each > 1 ? plan.blobs.slice(0, 1) : headOf(plan.blobs, count);
  const parts = plan.blobs.slice(head.length - 1).map((blob) => {
    const ranges = rangesOf(blob, each);
    return { blob, ranges, joint: new Joint(plan, blob, ranges) };
  });
  const decode = async ({ blob, ranges, joint }, i) => {
    const range = ranges[i];
    if (blob === head.at(-1) && i === 0) {
      joint.end(i, await decodeHead(head, range));
      for (const other of parts) other.joint.advance();
    } else {
      joint.end(i, await decodeRange(blob, range, (part) => joint.add(i, part)));
    }
  };
  await all(parts.flatMap((part) => part.ranges.map((_, i) => decode(part, i))));
  for (const { joint } of parts) joint.check();
}
