// A GLTFLoader plugin for three's WebGPURenderer: compressed meshes are decoded on the GPU, into
// the buffers that the renderer draws from. No geometry is read back or exists on the CPU. An
// example: float accessors only, without skins and morph targets.

import { createDecoder } from 'gltf-meshlet';
import { TRANSPORT, unpacking } from 'gltf-meshlet/transport';
import { decodeToGPU } from 'gltf-meshlet/webgpu';
import * as THREE from 'three/webgpu';

const EXTENSION = 'EXT_meshlet_edgebreaker';
const FLOAT = 5126;
const NAMES = { POSITION: 'position', NORMAL: 'normal', TEXCOORD_0: 'uv', COLOR_0: 'color' };

// The renderer must be initialised: await renderer.init().
export function gpuMeshlets(renderer, options = {}) {
  const decoder = createDecoder();
  return (parser) => ({
    name: EXTENSION,

    // Called by GLTFLoader for each buffer view; null leaves it to the loader. Unpacks views that
    // are packed for download.
    loadBufferView(index) {
      const { bufferViews } = parser.json;
      if (!bufferViews[index].extensions?.[TRANSPORT]) return null;
      const load = async (number) => {
        const { buffer, byteOffset, byteLength } = bufferViews[number];
        return new Uint8Array(await parser.getDependency('buffer', buffer), byteOffset, byteLength);
      };
      return unpacking(parser.json, load)(index).then(({ buffer }) => buffer);
    },

    // Called by GLTFLoader for each mesh; null leaves it to the loader.
    loadMesh(index) {
      const { primitives } = parser.json.meshes[index];
      if (!primitives.some(({ extensions }) => extensions?.[EXTENSION])) return null;
      return loadPrimitives(renderer, parser, primitives, decoder, options);
    },
  });
}

async function loadPrimitives(renderer, parser, primitives, decoder, options) {
  const group = new THREE.Group();
  for (const primitive of primitives) {
    const extension = primitive.extensions[EXTENSION];
    const view = await parser.getDependency('bufferView', extension.bufferView);
    const material =
      primitive.material === undefined
        ? new THREE.MeshStandardMaterial({ metalness: 1, roughness: 1 }) // glTF's default
        : await parser.getDependency('material', primitive.material);
    for (const { bytes } of (await decoder).blobs(new Uint8Array(view))) {
      const decoded = await decodeToGPU(renderer.backend.device, bytes, { decoder, ...options });
      await decoded.check(); // 8 bytes: a damaged file is an error, not a mesh with holes
      const mesh = new THREE.Mesh(geometryOf(renderer, parser.json, primitive, decoded), material);
      parser.assignFinalMaterial(mesh);
      group.add(mesh);
    }
  }
  return group;
}

// A geometry whose attributes are GPU buffers. geometry.dispose() frees them.
function geometryOf(renderer, json, primitive, decoded) {
  const geometry = new THREE.BufferGeometry();
  const adopt = (attribute, buffer) => {
    renderer.backend.get(attribute).buffer = buffer;
    return attribute;
  };
  const none = new Float32Array(0);
  for (const [name, stream] of Object.entries(primitive.extensions[EXTENSION].attributes)) {
    const accessor = json.accessors[primitive.attributes[name]];
    if (!NAMES[name] || accessor.componentType !== FLOAT) continue;
    const { width, buffer } = decoded.streams[stream];
    geometry.setAttribute(NAMES[name], adopt(new THREE.BufferAttribute(none, width), buffer));
  }
  geometry.setIndex(adopt(new THREE.BufferAttribute(new Uint32Array(0), 1), decoded.indices));
  geometry.setIndirect(
    adopt(new THREE.IndirectStorageBufferAttribute(new Uint32Array(5), 5), decoded.indirect),
  );
  const { min, max } = json.accessors[primitive.attributes.POSITION];
  geometry.boundingBox = new THREE.Box3(new THREE.Vector3(...min), new THREE.Vector3(...max));
  geometry.boundingSphere = geometry.boundingBox.getBoundingSphere(new THREE.Sphere());
  return geometry;
}
