// A plugin for Babylon.js. It imports nothing of Babylon: the caller passes its registration
// function, from the npm package or from the global BABYLON.
import { EXTENSION, virtualViews } from './gltf.js';
import { TRANSPORT, unpacking } from './transport.js';

export function registerMeshletExtension(registerGLTFExtension, decoder) {
  // Packed views are unpacked with the meshlets; the loader only has to know the name.
  registerGLTFExtension(TRANSPORT, true, () => ({ name: TRANSPORT, enabled: true, dispose() {} }));
  registerGLTFExtension(EXTENSION, true, (loader) => new MeshletExtension(loader, decoder));
}

export class MeshletExtension {
  #loader;
  #decoder;
  #views = new Map();

  constructor(loader, decoder) {
    this.name = EXTENSION;
    this.enabled = loader.isExtensionUsed(EXTENSION);
    this.#loader = loader;
    this.#decoder = decoder;
  }

  dispose() {
    this.#loader = null;
    this.#views.clear();
  }

  // Called by the loader before it reads the file's objects.
  onLoading() {
    const loader = this.#loader;
    const { gltf } = loader;
    const load = async (number) => {
      const view = gltf.bufferViews[number];
      const data = await loader.loadBufferViewAsync(`/bufferViews/${number}`, view);
      return new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
    };
    const decoder =
      this.#decoder ?? import('./decoder.js').then(({ createDecoder }) => createDecoder());
    this.#views = virtualViews(gltf, unpacking(gltf, load, decoder), decoder);
    for (const number of this.#views.keys()) gltf.bufferViews[number].index = number;
  }

  // Called by the loader for each buffer view; null leaves it to the loader.
  loadBufferViewAsync(_context, bufferView) {
    return this.#views.get(bufferView.index)?.() ?? null;
  }
}
