// A Worker of pool.js, in browsers and in Node. The first message is {module}, the compiled
// decoder; each further one is a job, {task, bytes, options}, answered by {part}s and {result} or
// {error}.
import { MalformedError, createDecoder } from './decoder.js';

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
    const onPart = (part) => {
      const moved = [part.indices, ...part.values].map(({ buffer }) => buffer);
      port.postMessage({ part }, moved);
    };
    port.postMessage({ result: (await decoder)[task](bytes, options, onPart) });
  } catch (error) {
    const { message } = error;
    port.postMessage({ error: { message, malformed: error instanceof MalformedError } });
  }
};
