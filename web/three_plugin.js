// A plugin for three.js: new GLTFLoader().register(meshletPlugin()). GLTFLoader builds geometries,
// skins and morph targets as from any file: it gets decoded components as buffer views.
import { EXTENSION, virtualViews } from './gltf.js';
import { TRANSPORT, unpacking } from './transport.js';

export function meshletPlugin(decoder, { quantized = false } = {}) {
  return (parser) => new MeshletPlugin(parser, decoder, quantized);
}

class MeshletPlugin {
  #parser;
  #decoder;
  #views = new Map();
  #quantized;
  #unpacked; // number of a packed view -> promise of its bytes

  constructor(parser, decoder, quantized) {
    this.name = EXTENSION; // GLTFLoader knows extensions by their plugin's name
    this.#parser = parser;
    this.#decoder = decoder;
    this.#quantized = quantized;
    // GLTFLoader would warn of it: this plugin has another name.
    const { json } = parser;
    json.extensionsRequired = json.extensionsRequired?.filter((name) => name !== TRANSPORT);
    const load = async (number) => {
      const { buffer, byteOffset, byteLength } = json.bufferViews[number];
      return new Uint8Array(await parser.getDependency('buffer', buffer), byteOffset, byteLength);
    };
    this.#unpacked = unpacking(json, load, decoder);
  }

  // Called by GLTFLoader before it reads the file's objects. A decoder that fails ends loading.
  async beforeRoot() {
    const { json } = this.#parser;
    if (!json.extensionsUsed?.includes(EXTENSION)) return;
    // Loaded when it is needed: a stream gives a pool.
    const decoder = await (this.#decoder ??
      import('./decoder.js').then(({ createDecoder }) => createDecoder()));
    const load = async (number) =>
      new Uint8Array(await this.#parser.getDependency('bufferView', number));
    this.#views = virtualViews(json, load, decoder, this.#quantized);
  }

  // Called by GLTFLoader for each buffer view; null leaves it to the loader.
  loadBufferView(index) {
    const packed = this.#parser.json.bufferViews[index].extensions?.[TRANSPORT];
    const bytes = packed ? this.#unpacked(index) : this.#views.get(index)?.();
    return bytes?.then(({ buffer }) => buffer) ?? null;
  }
}
