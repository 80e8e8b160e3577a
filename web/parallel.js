// Decodes a whole primitive in a pool of Workers: each blob of its view is a job.
//
// The first job, the head, may have several blobs: its Worker makes the arrays of the whole
// primitive, decodes its share in place and hands the arrays over. The other Workers send their
// decoded blobs, which the page's thread copies into the arrays. So there are these arrays and the
// blobs that wait for the head, at most as many bytes again.
import { createDecoder } from './decoder.js';

// The heads of one, two, three .. Workers have the first share of parts that grow by this factor:
// the page's thread copies a blob in about a fifth of the time that decoding it takes.
const GROWTH = 1.25;

export async function createParallelDecoder(pool, module) {
  return new ParallelDecoder(pool, await createDecoder(module));
}

class ParallelDecoder {
  #pool;
  #planner; // reads headers only

  constructor(pool, planner) {
    this.#pool = pool;
    this.#planner = planner;
  }

  async decodePrimitive(view, { integers = false, signal, onProgress }) {
    const plan = this.#planner.plan(view, integers);
    const { blobs, total } = plan;
    let triangles = 0;
    const onTriangles = (count) => {
      triangles += count;
      onProgress?.(Math.min(1, triangles / total.triangles));
    };
    const run = (bytes, options) =>
      this.#pool.run(
        { task: 'decodeBlobs', bytes, options: { integers, ...options }, onTriangles },
        signal,
      );
    const head = headOf(blobs, this.#pool.size);
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

  async validate(view, { signal }) {
    const plan = this.#planner.plan(view, false);
    const validateBlob = async (blob) => {
      try {
        await this.#pool.run({ task: 'validate', bytes: blob.bytes }, signal);
      } catch (error) {
        throw plan.blame(blob, error);
      }
    };
    await all(plan.blobs.map(validateBlob));
  }
}

// Waits for all; throws the first one's error, in the order of the view.
async function all(promises) {
  const settled = await Promise.allSettled(promises);
  for (const one of settled) if (one.status === 'rejected') throw one.reason;
}

// Leading blobs, at least one: the share of the first of n Workers.
function headOf(blobs, n) {
  const most = (blobs.at(-1).end.triangles * (GROWTH - 1)) / (GROWTH ** n - 1);
  const others = blobs.findIndex(({ end }, i) => i > 0 && end.triangles > most);
  return others < 0 ? blobs : blobs.slice(0, others);
}
