// A Worker of pool.js, in browsers and in Node. The first message is {module}, the compiled
// decoder; each further one is a job, {task, bytes, options}, a method of Decoder. The answers are
// {triangles}, their number in each step,, and {result}, the arrays of a plan, or {error}.
import { createDecoder, MalformedError } from './decoder.js';

const inNode = typeof WorkerGlobalScope === 'undefined';
const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
const port = inNode ? (await import(/* @vite-ignore */ node)).parentPort : globalThis;
let decoder;

port.onmessage = async ({ data: { module, task, bytes, options } }) => {
  if (module) {
    decoder = createDecoder(module);
    return;
  }
  try {
    const plan = (await decoder)[task](bytes, options, (triangles) =>
      port.postMessage({ triangles }),
    );
    const result = plan?.arrays();
    const moved = result ? [result.indices, ...result.values].map(({ buffer }) => buffer) : [];
    port.postMessage({ result }, moved);
  } catch (error) {
    const { message } = error;
    port.postMessage({ error: { message, malformed: error instanceof MalformedError } });
  }
};
