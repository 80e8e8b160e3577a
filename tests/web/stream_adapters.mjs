// Streams files in Node with three.js or with Babylon's engine without pictures, for
// test_stream_adapters.py.
// Usage: node stream_adapters.mjs FOLDER TASK FILE; FOLDER has the packages, installed. Prints JSON.
import { readFileSync } from 'node:fs';
import { register } from 'node:module';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

import { serveFile } from './fault_server.mjs';

const [folder, task, file] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.join(folder, 'node_modules', name)));
const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

// As much of WebGL as buffers need. Lost, it forgets them.
class BufferContext {
  ELEMENT_ARRAY_BUFFER = 1;
  COPY_READ_BUFFER = 2;
  COPY_WRITE_BUFFER = 3;
  isLost = false;
  #bound = new Map();

  isContextLost() {
    return this.isLost;
  }

  getParameter() {
    return null;
  }

  bindVertexArray() {}

  createBuffer() {
    return { bytes: new Uint8Array(0) };
  }

  deleteBuffer(buffer) {
    buffer.bytes = new Uint8Array(0);
  }

  bindBuffer(target, buffer) {
    this.#bound.set(target, buffer);
  }

  bufferData(target, length) {
    this.#bound.get(target).bytes = new Uint8Array(length);
  }

  copyBufferSubData(from, to, _begin, _at, length) {
    this.#bound.get(to).bytes.set(this.#bound.get(from).bytes.subarray(0, length));
  }

  bufferSubData(target, at, { buffer, byteOffset, byteLength }) {
    this.#bound.get(target).bytes.set(new Uint8Array(buffer, byteOffset, byteLength), at);
  }

  getBufferSubData(target, at, part) {
    if (this.isLost) return;
    const bytes = new Uint8Array(part.buffer);
    bytes.set(this.#bound.get(target).bytes.subarray(at, at + bytes.length));
  }
}

const rendererOf = (context) => ({
  isWebGLRenderer: true,
  domElement: new EventTarget(),
  getContext: () => context,
  getViewport: (viewport) => viewport.set(0, 0, 800, 600),
  getPixelRatio: () => 1,
});

// How many vertices a stream in three.js draws.
function verticesOf(stream) {
  const drawn = new Set();
  stream.traverse(({ geometry }) => {
    if (!geometry?.index) return;
    const { array } = geometry.index;
    for (const { start, count } of geometry.groups)
      for (const vertex of array.subarray(start, start + count)) drawn.add(vertex);
  });
  return drawn.size;
}

// A scene of Babylon, and what Babylon has said.
async function babylonScene() {
  const core = (name) => load(`@babylonjs/core/${name}.js`);
  const { Logger } = await core('Misc/logger');
  const { NullEngine } = await core('Engines/nullEngine');
  const { Scene } = await core('scene');
  const said = [];
  Logger.Log = () => {};
  Logger.Warn = (text) => said.push(text);
  Logger.Error = (text) => said.push(text);
  return { scene: new Scene(new NullEngine()), said };
}

async function streamOf(engine, place, options) {
  if (engine === 'three') {
    const { MeshletStream } = await load('gltf-meshlet/stream/three.js');
    return { stream: new MeshletStream(place, options), said: [] };
  }
  const { MeshletStream } = await load('gltf-meshlet/stream/babylon.js');
  const { scene, said } = await babylonScene();
  return { stream: new MeshletStream(place, scene, options), scene, said };
}

const blob = () => new Blob([readFileSync(file)]);
const problemOf = (action) => {
  try {
    return action() ?? 'nothing';
  } catch (error) {
    return String(error);
  }
};
const countsOf = ({ meshes, geometries, materials, transformNodes }) =>
  [meshes, geometries, materials, transformNodes].map(({ length }) => length);

const tasks = {
  // For each engine: what wrong values of `pixels` and a copy tell, and `pixels` afterwards.
  async properties() {
    const result = {};
    for (const engine of ['three', 'babylon']) {
      const { stream } = await streamOf(engine, blob(), { pixels: 2 });
      const set = problemOf(() => {
        stream.pixels = Number.NaN;
      });
      const copied = problemOf(() => stream.clone());
      const made = await streamOf(engine, blob(), { pixels: '1' }).then(() => 'nothing', String);
      result[engine] = { set, copied, made, pixels: stream.pixels };
      await stream.ready;
      stream.dispose();
    }
    return result;
  },

  // What is in Babylon's scene after a stream with a wrong option, and of a place that is no URL.
  async refused() {
    const { scene } = await babylonScene();
    const { MeshletStream } = await load('gltf-meshlet/stream/babylon.js');
    const made = problemOf(() => new MeshletStream(blob(), scene, { pixels: -1 }));
    const placed = problemOf(() => new MeshletStream('http://[', scene));
    return { made, placed, left: countsOf(scene) };
  },

  // For each engine: the names of the statistics before the first picture and after it, and whether a
  // server's error is of the class that the module exports.
  async statistics() {
    const namesOf = ({ bytes, ...more }) => [Object.keys(more).sort(), Object.keys(bytes).sort()];
    const result = {};
    for (const engine of ['three', 'babylon']) {
      const { SourceError } = await load(`gltf-meshlet/stream/${engine}.js`);
      const { stream } = await streamOf(engine, blob(), {});
      const before = namesOf(stream.statistics);
      await stream.ready;
      const after = namesOf(stream.statistics);
      stream.dispose();
      const server = await serveFile(Buffer.alloc(0));
      const { stream: empty } = await streamOf(engine, server.url, {});
      const isOurs = await empty.ready.catch((error) => error instanceof SourceError);
      server.close();
      result[engine] = { before, after, isOurs };
    }
    return result;
  },

  // Of a stream in three.js that ends while it shows colours: its materials, and those freed.
  async coloured() {
    const { stream } = await streamOf('three', blob(), {});
    await stream.ready;
    const materials = new Set();
    stream.traverse(({ material }) => {
      for (const one of [material ?? []].flat()) materials.add(one);
    });
    let freed = 0;
    for (const one of materials) one.addEventListener('dispose', () => freed++);
    stream.colour = 'level';
    let colours = 0;
    while (colours < 2) {
      await pause(5); // until the colours are there
      stream.traverse(({ material }) => {
        colours = Math.max(colours, [material ?? []].flat().length);
      });
    }
    stream.dispose();
    return { made: materials.size, freed };
  },

  // What Babylon says of a stream from its beginning to its end, and what is left of it.
  async quiet() {
    const { stream, scene, said } = await streamOf('babylon', blob(), {});
    await stream.ready;
    const made = countsOf(scene);
    stream.dispose();
    return { said, made, left: countsOf(scene) };
  },

  // How many vertices a stream in three.js draws in one renderer, and in another one whose first frame
  // comes between the loss of the first one's context and its event.
  async lostRenderer() {
    const { PerspectiveCamera } = await load('three/build/three.module.js');
    const { stream } = await streamOf('three', blob(), {});
    await stream.ready;
    const camera = new PerspectiveCamera(35);
    camera.position.set(0, 0, 5);
    const isInArrays = () => stream.statistics.bytes.arrays > 0;
    const restIn = async (renderer, hasArrays) => {
      do {
        stream.update(camera, renderer);
        await pause(5);
      } while (isInArrays() !== hasArrays || !stream.statistics.complete);
      stream.update(camera, renderer);
      return verticesOf(stream);
    };
    const [context, other] = [new BufferContext(), new BufferContext()];
    const first = await restIn(rendererOf(context), false);
    context.isLost = true;
    const second = await restIn(rendererOf(other), true);
    stream.dispose();
    return [first, second];
  },

  // Of a stream in three.js of instances without levels: their meshes, and those freed.
  async instances() {
    const { stream } = await streamOf('three', blob(), {});
    await stream.ready;
    let [made, freed] = [0, 0];
    stream.traverse((mesh) => {
      if (!mesh.isInstancedMesh) return;
      made++;
      mesh.addEventListener('dispose', () => freed++);
    });
    stream.dispose();
    return { made, freed };
  },

  // What a stream in Babylon's WebGL tells if the module that moves pages does not come.
  async offline() {
    const hook = `export const resolve = (name, context, next) => {
      if (name.endsWith('/moves.js')) throw new Error('offline');
      return next(name, context);
    };`;
    register(`data:text/javascript,${encodeURIComponent(hook)}`);
    const { stream, scene } = await streamOf('babylon', blob(), {});
    scene.getEngine().getRenderingCanvas = () => ({ getContext: () => ({}) });
    const warnings = [];
    stream.onWarningObservable.add((message) => warnings.push(message));
    const ready = await stream.ready.then(() => 'nothing', String);
    return { ready, warnings };
  },

  // What is left in Babylon's scene of a stream that ends when its loader is done, and pages are on
  // the way.
  async early() {
    const server = await serveFile(readFileSync(file));
    const { scene } = await babylonScene();
    const { MeshletStream } = await load('gltf-meshlet/stream/babylon.js');
    const containers = [];
    const { AssetContainer } = await load('@babylonjs/core/assetContainer.js');
    const { dispose } = AssetContainer.prototype;
    AssetContainer.prototype.dispose = function (...given) {
      containers.push(this);
      return dispose.apply(this, given);
    };
    const { Worker } = await import('node:worker_threads');
    const url = pathToFileURL(path.join(folder, 'node_modules/gltf-meshlet/stream/worker.js'));
    // Decodes never, so that there is no first picture.
    const createWorker = () => {
      const worker = new Worker(url);
      const post = worker.postMessage.bind(worker);
      worker.postMessage = (message, ...more) => !message.task && post(message, ...more);
      return worker;
    };
    const stream = new MeshletStream(server.url, scene, { createWorker });
    const errors = [];
    stream.onErrorObservable.add(({ message }) => errors.push(message));
    const ready = stream.ready.then(() => 'nothing', String);
    await pause(1000);
    stream.dispose();
    const result = { ready: await ready, errors, freed: containers.length, left: countsOf(scene) };
    server.close();
    return result;
  },
};

process.stdout.write(JSON.stringify(await tasks[task]()));
process.exit(0); // Workers may still end
