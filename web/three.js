// A plugin for three.js: new GLTFLoader().register(meshletPlugin()). GLTFLoader builds geometries,
// skins and morph targets as from any file: each accessor of a compressed primitive gets a buffer
// view that exists only in the loader, and whose bytes are the decoded components.
import { createDecoder } from './decoder.js';
import { EXTENSION, accessorArrays, accessorNumbers } from './gltf.js';

export function meshletPlugin(decoder) {
  return (parser) => new MeshletPlugin(parser, decoder);
}

class MeshletPlugin {
  #parser;
  #decoder;
  #views = new Map(); // number of a buffer view -> () => promise of its bytes

  constructor(parser, decoder) {
    this.name = EXTENSION; // GLTFLoader knows extensions by their plugin's name
    this.#parser = parser;
    this.#decoder = decoder;
  }

  // Called by GLTFLoader before it reads the file's objects. A decoder that fails ends loading.
  async beforeRoot() {
    const { json } = this.#parser;
    if (!json.extensionsUsed?.includes(EXTENSION)) return;
    const decoder = await (this.#decoder ?? createDecoder());
    const shared = new Set(); // primitives with the same view and accessors are decoded once
    json.meshes?.forEach((mesh, m) =>
      mesh.primitives.forEach((primitive, p) => {
        const extension = primitive.extensions?.[EXTENSION];
        if (!extension) return;
        const numbers = accessorNumbers(primitive);
        const key = [extension.bufferView, ...numbers].join();
        if (shared.has(key)) return;
        shared.add(key);
        let arrays;
        const decode = () =>
          (arrays ??= this.#decode(decoder, primitive, `mesh ${m} primitive ${p}`));
        for (const number of numbers) this.#replace(json, number, decode);
      }),
    );
  }

  async #decode(decoder, primitive, where) {
    const { json } = this.#parser;
    const view = await this.#parser.getDependency(
      'bufferView',
      primitive.extensions[EXTENSION].bufferView,
    );
    try {
      return accessorArrays(json, primitive, decoder.decodePrimitive(new Uint8Array(view)));
    } catch (error) {
      throw new Error(`${where}: ${error.message}`, { cause: error });
    }
  }

  // Gives an accessor a buffer view of its own. A fallback's is not read.
  #replace(json, number, decode) {
    const accessor = json.accessors[number];
    accessor.bufferView = json.bufferViews.push({ buffer: 0, byteLength: 0 }) - 1;
    accessor.byteOffset = 0;
    delete accessor.sparse;
    this.#views.set(accessor.bufferView, async () => (await decode()).get(number).buffer);
  }

  // Called by GLTFLoader for each buffer view; null leaves it to the loader.
  loadBufferView(index) {
    return this.#views.get(index)?.() ?? null;
  }
}
