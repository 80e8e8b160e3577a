// From the bytes of a file to what can be drawn. Knows no camera, canvas or web page.
import { compileDecoder } from '../compile.js';
import { createDecoder } from '../decoder.js';
import { EXTENSION, vertexBytes } from '../gltf.js';
import { createDecoderPool } from '../pool.js';
import { meshletPlugin } from '../three_plugin.js';
import { isGlb, readJson } from './glb.js';
import { paint, paintPlain } from './materials.js';
import { colouredGeometry } from './meshlets.js';
import {
  Box3,
  DoubleSide,
  GLTFLoader,
  LoadingManager,
  Mesh,
  MeshStandardMaterial,
  OBJLoader,
  PLYLoader,
  STLLoader,
} from './vendor.js';

const MESH_LOADERS = { obj: OBJLoader, ply: PLYLoader, stl: STLLoader };
// Decoders of these would double the size of the web page.
const UNREADABLE = {
  KHR_draco_mesh_compression: 'Draco',
  EXT_meshopt_compression: 'meshopt',
  KHR_meshopt_compression: 'meshopt',
  KHR_texture_basisu: 'Basis Universal textures',
};

const TRIANGLE_BYTES = 12; // of 32-bit indices

let decoders; // promise, shared by all files

// pool: decodes primitives in Workers. single: decodes meshlets here.
async function createDecoders() {
  const module = await compileDecoder();
  const [pool, single] = await Promise.all([
    createDecoderPool({ source: module }),
    createDecoder(module),
  ]);
  return { pool, single };
}

// Loads a file. type: its suffix. Throws an Error that says what is wrong with it.
export async function load(buffer, type = 'glb') {
  const start = performance.now();
  const content = type in MESH_LOADERS ? loadMesh(buffer, type) : await loadGltf(buffer);
  const loaded = new Loaded(content);
  loaded.times.build = performance.now() - start - loaded.times.decode;
  return loaded;
}

function loadMesh(buffer, type) {
  const data = type === 'obj' ? new TextDecoder().decode(buffer) : buffer;
  let parsed;
  try {
    parsed = new MESH_LOADERS[type]().parse(data);
  } catch {
    throw new Error(`it cannot be read as .${type}`);
  }
  const root = parsed.isBufferGeometry ? new Mesh(parsed) : parsed;
  root.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { normal, color } = mesh.geometry.attributes;
    mesh.material = new MeshStandardMaterial({
      side: DoubleSide,
      flatShading: normal === undefined,
      vertexColors: color !== undefined,
    });
    paint(mesh.material);
  });
  return { root, clips: [], warnings: [], compressed: new Map(), times: { decode: 0 } };
}

async function loadGltf(buffer) {
  const json = readJson(buffer);
  for (const name of json.extensionsUsed ?? [])
    if (UNREADABLE[name])
      throw new Error(`it uses ${UNREADABLE[name]}, which this page cannot read`);
  const times = { decode: 0 };
  const manager = new LoadingManager();
  const failed = new Set();
  manager.onError = (url) => failed.add(url);
  const loader = new GLTFLoader(manager);
  const decoded = new Map(); // ArrayBuffer of a view -> what was decoded from it
  if (json.extensionsUsed?.includes(EXTENSION)) {
    decoders ??= createDecoders();
    decoders.catch(() => (decoders = undefined)); // try again for the next file
    const timed = timing(await decoders, times, decoded);
    loader.register(meshletPlugin(timed));
  }
  loader.register(refuseUnknownExtensions);
  const data = isGlb(buffer) ? buffer : new TextDecoder().decode(buffer);
  const gltf = await loader.parseAsync(data, '');
  const root = gltf.scene ?? gltf.scenes[0];
  if (!root) throw new Error('it has no scene');
  const warnings = failed.size ? [`${failed.size} of its textures cannot be read`] : [];
  const compressed = await compressedGeometries(gltf.parser, decoded);
  return { root, clips: gltf.animations, warnings, compressed, times };
}

// A decoder that measures its time and remembers what it has decoded.
function timing({ pool, single }, times, decoded) {
  let begin;
  return {
    async decodePrimitive(view) {
      begin ??= performance.now();
      const primitive = await pool.decodePrimitive(view);
      times.decode = performance.now() - begin; // from the first to the last: they overlap
      const { triangleCount, vertexCount, meshletCount } = primitive;
      decoded.set(view.buffer, { view, triangleCount, vertexCount, meshletCount, decoder: single });
      return primitive;
    },
  };
}

function refuseUnknownExtensions(parser) {
  return {
    name: 'refuseUnknownExtensions',
    async beforeRoot() {
      for (const name of parser.json.extensionsRequired ?? [])
        if (!(name in parser.extensions) && !(name in parser.plugins))
          throw new Error(`it requires ${name}, which this page cannot read`);
    },
  };
}

// Geometry -> what was decoded into it, with rawBytes: the size of its vertices before compression
// and of its triangles, as gltf-meshlet inspect counts them.
async function compressedGeometries(parser, decoded) {
  const geometries = new Map();
  for (const { primitive, promise } of Object.values(parser.primitiveCache)) {
    const view = primitive.extensions?.[EXTENSION]?.bufferView;
    if (view === undefined) continue;
    const found = decoded.get(await parser.getDependency('bufferView', view));
    const { sourceVertices = found.vertexCount } = primitive.extensions[EXTENSION];
    found.rawBytes =
      vertexBytes(parser.json, primitive) * sourceVertices + TRIANGLE_BYTES * found.triangleCount;
    geometries.set(await promise, found);
  }
  return geometries;
}

// A file that is ready to be drawn: root (an Object3D), clips (animations), box, counts, times in
// milliseconds {decode, build}, warnings.
class Loaded {
  #compressed;
  #meshes = []; // {mesh, material, geometry, flat}: as loaded, and the material that shows meshlets
  #coloured = new Map(); // geometry -> its copy in the meshlets' colours

  constructor({ root, clips, warnings, compressed, times }) {
    this.root = root;
    this.clips = clips;
    this.warnings = warnings;
    this.times = times;
    this.#compressed = compressed;
    root.updateMatrixWorld(true);
    paintPlain(root);
    root.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.frustumCulled = false; // animations leave the bounds
      const { material, geometry } = mesh;
      const flat = meshletMaterial(geometry, material, compressed.has(geometry));
      this.#meshes.push({ mesh, material, geometry, flat });
    });
    this.box = new Box3().setFromObject(root);
    this.counts = this.#count();
    if (this.counts.triangles === 0) throw new Error('it holds no triangles');
    if (![...this.box.min, ...this.box.max].every(Number.isFinite))
      throw new Error('its positions are not finite');
  }

  #count() {
    const views = new Set(this.#compressed.values());
    const geometries = new Set(this.#meshes.map(({ geometry }) => geometry));
    const sum = (items, value) => [...items].reduce((total, item) => total + value(item), 0);
    const bytes = sum(views, ({ view }) => view.byteLength);
    const encoded = sum(views, ({ triangleCount }) => triangleCount);
    return {
      triangles: sum(geometries, (g) => (g.index ?? g.attributes.position).count / 3),
      vertices: sum(geometries, (g) => g.attributes.position.count),
      meshlets: sum(views, ({ meshletCount }) => meshletCount),
      bitsPerTriangle: encoded > 0 ? (8 * bytes) / encoded : 0,
      bytes,
      rawBytes: sum(views, ({ rawBytes }) => rawBytes),
    };
  }

  // Shows the meshlets' colours, or the file's own materials. What is not compressed turns grey.
  colourMeshlets(on) {
    for (const { mesh, geometry, material, flat } of this.#meshes) {
      mesh.geometry = on ? this.#colouredGeometry(geometry) : geometry;
      mesh.material = on ? flat : material;
    }
  }

  #colouredGeometry(geometry) {
    const found = this.#compressed.get(geometry);
    if (!found) return geometry;
    if (!this.#coloured.has(geometry)) {
      const { view, meshletCount, decoder } = found;
      const counts = Array.from(
        { length: meshletCount },
        (_, m) => decoder.decodeMeshlet(view, m).triangleCount,
      );
      this.#coloured.set(geometry, colouredGeometry(geometry, counts));
    }
    return this.#coloured.get(geometry);
  }

  dispose() {
    for (const { mesh, material, geometry, flat } of this.#meshes) {
      geometry.dispose();
      for (const one of [material, flat].flat()) {
        for (const value of Object.values(one)) if (value?.isTexture) value.dispose();
        one.dispose();
      }
      mesh.skeleton?.dispose();
      mesh.dispose?.(); // the places of instances
    }
    for (const geometry of this.#coloured.values()) geometry.dispose();
  }
}

function meshletMaterial(geometry, material, coloured) {
  return new MeshStandardMaterial({
    color: coloured ? 0xffffff : 0x808080,
    vertexColors: coloured,
    roughness: 0.75,
    side: [material].flat()[0].side,
    flatShading: geometry.attributes.normal === undefined,
  });
}
