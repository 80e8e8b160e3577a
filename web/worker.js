// A Worker of pool.js, in browsers and in Node. The first message is {module}, the compiled
// decoder; each further one is a job, {task, bytes, options}, answered by {part}s and {result} or
// {error}.
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
  const answer = (message, { indices, values = [] }) => {
    const moved = indices ? [indices, ...values].map(({ buffer }) => buffer) : [];
    port.postMessage(message, moved);
  };
  try {
    const result = (await decoder)[task](bytes, options, (part) => answer({ part }, part));
    answer({ result }, result ?? {});
  } catch (error) {
    const { message } = error;
    port.postMessage({ error: { message, malformed: error instanceof MalformedError } });
  }
};
