// Decoded pages in buffers of a renderer of three.js, and attributes for them. Loaded with the first
// frame.
import { BufferAttribute, GLBufferAttribute } from 'three';
import { WebGLStore } from './webgl_store.js';

// Constants of WebGL.
const TYPES = new Map(
  /** @type {[any, number][]} */ ([
    [Int8Array, 5120],
    [Uint8Array, 5121],
    [Int16Array, 5122],
    [Uint16Array, 5123],
    [Uint32Array, 5125],
    [Float32Array, 5126],
  ]),
);

// Keeps the decoded pages of a stream in buffers of a renderer; if another one comes, in arrays.
export class RendererBuffers {
  #renderer;
  #streamer;
  #isLost;
  #stores = [];
  #events = new AbortController();
  #storeOf;

  // setBuffers(pool, attributes): the last one is the index.
  constructor(renderer, streamer, setBuffers) {
    const gl = renderer.getContext();
    this.#renderer = renderer;
    this.#streamer = streamer;
    this.#isLost = gl.isContextLost();
    this.#storeOf = (pool) => {
      const changed = (lengths) => setBuffers(pool, attributesOf(store, pool.formats, lengths));
      const store = new WebGLStore(gl, pool.formats, changed);
      this.#stores.push(store);
      return store;
    };
    const lose = () => {
      this.#isLost = true;
    };
    renderer.domElement.addEventListener('webglcontextlost', lose, {
      signal: this.#events.signal,
    });
    if (!this.#isLost) this.#move(this.#storeOf, false);
  }

  // Before a frame. Returns whether there is something to draw.
  use(renderer) {
    if (renderer !== this.#renderer) {
      if (this.#renderer) {
        // The event may still be to come.
        const wasLost = this.#isLost || this.#renderer.getContext().isContextLost();
        this.#move(null, wasLost).then(() => this.release());
      }
      this.#renderer = null;
      this.#isLost = false;
    }
    if (!this.#isLost) return true;
    if (renderer.getContext().isContextLost()) return false;
    this.#isLost = false;
    this.#stores = [];
    this.#move(this.#storeOf, true);
    return true;
  }

  // Pages stay where they are if a module cannot be loaded.
  #move(storeOf, wasLost) {
    return this.#streamer.moveTo(storeOf, wasLost).catch(() => {});
  }

  release() {
    this.#events.abort();
    for (const store of this.#stores) store.release();
  }
}

// Attributes of formats, and the index.
function attributesOf(store, formats, lengths) {
  const index = { Type: Uint32Array, size: 1, normalized: false };
  return [...formats, index].map(
    (format, a) => new StoredAttribute(store, a, lengths[a] / format.size, format),
  );
}

// An attribute, or the index, whose values lie in a store only. Whoever asks for them, such as picking,
// gets a copy.
class StoredAttribute extends GLBufferAttribute {
  #store;
  #number;

  constructor(store, number, count, { Type, size, normalized }) {
    super(store.buffers[number], TYPES.get(Type), size, Type.BYTES_PER_ELEMENT, count);
    this.normalized = normalized;
    this.#store = store;
    this.#number = number;
    const version = { get: () => store.writes, set() {} }; // three sets it to 0
    Object.defineProperty(this, 'version', version);
  }

  get array() {
    return this.#store.copy(this.#number);
  }

  get #values() {
    return new BufferAttribute(this.array, this.itemSize, this.normalized);
  }

  getComponent(i, c) {
    return this.#values.getComponent(i, c);
  }

  getX(i) {
    return this.#values.getX(i);
  }

  getY(i) {
    return this.#values.getY(i);
  }

  getZ(i) {
    return this.#values.getZ(i);
  }

  getW(i) {
    return this.#values.getW(i);
  }
}
