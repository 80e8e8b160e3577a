// A Worker of pool.js, in browsers and in Node. The first message is {module}, the compiled
// decoder, and the answer {started}; each further one is a job, {task, bytes, options}. Its answers
// are {triangles}, their number in each step, and {result}, or {error}.
import { MalformedError, startDecoder } from './decoder.js';

const inNode = !('WorkerGlobalScope' in globalThis);
const node = 'node:worker_threads'; // in a variable, so that bundlers leave it alone
let port;
let decoder;
let unpacker;

// Name -> what does a job, action(decoder, bytes, options, {onTriangles, unpackerOf}). The result's
// arrays, {indices, values} or bytes, move to the page's thread.
const tasks = new Map();
export const addTask = (name, action) => tasks.set(name, action);
addTask('decodeBlobs', (own, bytes, options, { onTriangles }) =>
  own.decodeBlobs(bytes, options, onTriangles).arrays(),
);
addTask('validate', (own, bytes) => own.validate(bytes));
// A page of a packed view. module: the compiled unpacker.
addTask('unpack', async (_own, bytes, { size, module }) =>
  (await unpackerOf(module)).unpackPage({ bytes, size }).slice(),
);

// The Worker's only unpacker.
function unpackerOf(module) {
  unpacker ??= import('./transport.js').then(({ createUnpacker }) => createUnpacker(module));
  return unpacker;
}

function arraysOf(result) {
  if (!result) return [];
  return result.indices ? [result.indices, ...result.values] : [result];
}

async function receive({ data: { module, task, bytes, options } }) {
  if (module) {
    decoder = startDecoder(module);
    port.postMessage({ started: true });
    return;
  }
  try {
    const onTriangles = (triangles) => port.postMessage({ triangles });
    const tools = { onTriangles, unpackerOf };
    const result = await tasks.get(task)(await decoder, bytes, options, tools);
    port.postMessage(
      { result },
      arraysOf(result).map(({ buffer }) => buffer),
    );
  } catch (error) {
    const { message } = error;
    port.postMessage({ error: { message, malformed: error instanceof MalformedError } });
  }
}

function start(given) {
  port = given;
  port.onmessage = receive;
}

// Without a top-level await: Node 20 crashes if a Worker ends during one.
if (inNode)
  import(/* webpackIgnore: true */ /* @vite-ignore */ node).then(({ parentPort }) =>
    start(parentPort),
  );
else start(globalThis);
