// What the adapters for engines share: opens a file, waits for the first picture, puts the scene
// together, and starts again if the file changes.
import { EXTENSION, TRANSPORT } from '../../accessors.js';
import { checkMaxBytes, checkNumber } from '../core/options.js';
import { keyOf } from '../core/primitives.js';
import { DEFAULT_BYTES, openStreamer } from '../core/streamer.js';
import { delayAfter, pause } from '../io/source.js';
import { LOD } from '../io/tables.js';

const RESTARTS = 5; // without a picture in between that lasts
const LASTING_MS = 60_000; // longer than the pauses before all restarts take together
const NO_LEVELS = `no primitive has levels that can be streamed (${LOD}): all of it is loaded at once`;
const TASK_MS = 10; // of making the scene, at a time

// Of a stream without a scene.
const noStatistics = () => ({
  fetched: 0,
  requests: 0,
  waiting: 0,
  pages: 0,
  resident: 0,
  missing: 0,
  triangles: 0,
  fullTriangles: 0,
  ranges: 0,
  threshold: 0,
  error: 0,
  complete: false,
  bytes: { gpu: 0, arrays: 0, wasm: 0, compressed: 0, transit: 0, tables: 0, total: 0 },
});

// A Blob, or an absolute URL. Throws TypeError.
const placeOf = (place) =>
  place instanceof Blob ? place : String(new URL(place, globalThis.location?.href));

// What MeshletStream is in all engines, as a class of an engine's nodes.
export const streamOf = (Node) =>
  class extends Node {
    #place;
    #pixels;
    session = null; // for adapters
    frozen = false; // keeps the cut

    // Wrong arguments leave nothing in the engine's scene. more: arguments of the node.
    constructor(place, pixels, ...more) {
      const absolute = placeOf(place);
      checkNumber('pixels', pixels, 0);
      super(...more);
      this.#place = absolute;
      this.#pixels = pixels;
    }

    // engine: as of Session, without `dispose`. For adapters.
    start(options, engine) {
      const dispose = () => this.dispose();
      this.session = new Session(this.#place, options, { ...engine, dispose });
      if (options.signal?.aborted) this.dispose();
    }

    // Resolves with the first picture; another promise after each retry of a stream that has ended.
    get ready() {
      return this.session.ready;
    }

    get pixels() {
      return this.#pixels;
    }

    set pixels(pixels) {
      checkNumber('pixels', pixels, 0);
      this.#pixels = pixels;
    }

    get statistics() {
      return this.session.streamer?.statistics ?? noStatistics();
    }

    get maxBytes() {
      return this.session.maxBytes;
    }

    set maxBytes(maxBytes) {
      this.session.maxBytes = maxBytes;
    }

    retry() {
      this.session.retry();
    }

    /** @returns {never} */
    clone() {
      throw new Error('a MeshletStream has no copies: make another one of the same file');
    }
  };

const nextTask = () => new Promise((resolve) => setTimeout(resolve));

export class Session {
  #place;
  #options;
  #engine;
  #signal; // the page's
  #abort = new AbortController();
  #restarts = 0;
  #refused = []; // keys of primitives of this file whose levels turned out to be malformed
  #shown = 0; // when the picture came
  #wake = (_value = null) => {};
  #isOver = false; // it has ended with an error

  // streamer: null unless its scene is shown. engine: an adapter's
  //   load(streamer, json, base): makes the scene from a JSON without the streamed primitives'
  //     extensions, see forStreamed; readView of the streamer gives its buffer views, unpacked;
  //   show(streamer, loaded, each): adds it; each(items, action) keeps the page responsive;
  //   clear(): frees all of it, also what load has made and nobody shows yet;
  //   dispose(): the page's signal ends the stream;
  //   tell(type, message, error), of types warning, progress, load and error.
  constructor(place, { signal, ...options }, engine) {
    this.#place = placeOf(place);
    this.#signal = signal;
    signal?.addEventListener('abort', engine.dispose, { signal: this.#abort.signal });
    this.#options = { ...options, signal: this.#abort.signal };
    this.#engine = engine;
    this.streamer = null;
    this.#begin(this.#start());
  }

  // starting: a promise of the first picture.
  #begin(starting) {
    this.ready = starting;
    this.#isOver = false;
    this.#tellFailure(starting);
  }

  get maxBytes() {
    return this.#options.maxBytes ?? DEFAULT_BYTES;
  }

  // Counts from the first picture on.
  set maxBytes(maxBytes) {
    checkMaxBytes(maxBytes);
    if (this.streamer) this.streamer.maxBytes = maxBytes;
    this.#options.maxBytes = maxBytes;
  }

  // What was given up is tried again; a stream that has ended with an error begins again.
  retry() {
    if (this.#abort.signal.aborted) return;
    this.#restarts = 0;
    if (this.streamer) this.streamer.retry();
    else if (this.#isOver) {
      this.#refused = [];
      this.#begin(this.#start());
    }
  }

  #tellFailure(promise) {
    promise.catch((error) => {
      this.#isOver = true;
      if (!this.#abort.signal.aborted) this.#engine.tell('error', error.message, error);
    });
  }

  async #start() {
    const engine = this.#engine;
    let streamer = null;
    let broken = null;
    const events = {
      onWarning: (message) => engine.tell('warning', message),
      onChange: () => {
        this.#wake();
        engine.tell('progress');
      },
      onBroken: (error) => {
        broken = error;
        this.#wake();
        if (streamer && streamer === this.streamer) this.#restart(error);
      },
    };
    const check = () => {
      this.#abort.signal.throwIfAborted();
      if (broken) throw broken;
    };
    try {
      streamer = await openStreamer(this.#place, {
        ...this.#options,
        ...events,
        exclude: this.#refused,
      });
      check();
      if (streamer.primitives.length === 0) engine.tell('warning', NO_LEVELS);
      const base = this.#place instanceof Blob ? '' : String(new URL('.', this.#place));
      const loaded = await engine.load(streamer, unpackedJson(streamer.json), base);
      for (;;) {
        check();
        const waiting = new Promise((resolve) => {
          this.#wake = resolve;
        });
        streamer.update(null, 1);
        if (streamer.ready) break;
        await waiting;
      }
      await nextTask();
      check();
      await engine.show(streamer, loaded, (items, action) => inTasks(items, action, check));
      check();
      if (streamer.maxBytes !== this.maxBytes) streamer.maxBytes = this.maxBytes;
      this.streamer = streamer;
      engine.tell('load');
    } catch (error) {
      streamer?.close();
      engine.clear();
      const refused = streamer?.refused ?? [];
      if (!error.changed && refused.length === 0) throw error;
      return this.#again(refused, error);
    }
    this.#shown = performance.now();
    await nextTask();
  }

  // Starts again after an error of a streamer, later each time, and not for ever.
  async #again(refused, error) {
    if (this.#abort.signal.aborted || ++this.#restarts > RESTARTS) throw error;
    this.#engine.tell('warning', `${error.message}; starting again`);
    this.#refused = error.changed ? [] : [...this.#refused, ...refused.map(({ key }) => key)];
    await pause(delayAfter(this.#restarts), this.#abort.signal);
    return this.#start();
  }

  // The file has changed, its levels turned out to be malformed, or Workers cannot go on.
  #restart(error) {
    const { refused } = this.streamer;
    if (performance.now() - this.#shown > LASTING_MS) this.#restarts = 0;
    this.#end();
    this.#begin(this.#again(refused, error));
  }

  #end() {
    this.streamer?.close();
    this.streamer = null;
    this.#engine.clear();
  }

  close() {
    this.#abort.abort(this.#signal?.reason ?? new Error('the stream is disposed'));
    this.#wake();
    this.#end();
  }
}

// In several tasks. check() throws if it is in vain.
async function inTasks(items, action, check) {
  check();
  let start = performance.now();
  for (const item of items) {
    action(item);
    if (performance.now() - start < TASK_MS) continue;
    await nextTask();
    check();
    start = performance.now();
  }
}

// A copy of a JSON as if its buffer views were not packed. What the streamer reads itself is no
// requirement to an engine's loader.
function unpackedJson(original) {
  const json = structuredClone(original);
  const known = [EXTENSION, TRANSPORT, LOD];
  json.extensionsRequired = json.extensionsRequired?.filter((name) => !known.includes(name));
  for (const view of json.bufferViews ?? []) {
    view.byteLength = view.extensions?.[TRANSPORT]?.byteLength ?? view.byteLength;
    delete view.extensions?.[TRANSPORT];
  }
  return json;
}

// Calls action(primitive of the JSON, streamed primitive) for all that are streamed, without their
// extensions.
export function forStreamed(json, primitives, action) {
  const byKey = new Map(primitives.map((one) => [one.key, one]));
  for (const mesh of json.meshes ?? [])
    for (const primitive of mesh.primitives) {
      const streamed = byKey.get(keyOf(primitive));
      if (!streamed || !primitive.extensions[LOD]) continue;
      delete primitive.extensions[EXTENSION];
      delete primitive.extensions[LOD];
      action(primitive, streamed);
    }
}
