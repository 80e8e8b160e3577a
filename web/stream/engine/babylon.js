// Streams a file into a scene of Babylon.js. Its glTF loader makes nodes, materials, textures and
// animations; primitives with levels are drawn as ranges of shared buffers.
import { Camera } from '@babylonjs/core/Cameras/camera.js';
import { BoundingInfo } from '@babylonjs/core/Culling/boundingInfo.js';
import { LoadAssetContainerAsync } from '@babylonjs/core/Loading/sceneLoader.js';
import { Frustum } from '@babylonjs/core/Maths/math.frustum.js';
import { Matrix, Quaternion, Vector3 } from '@babylonjs/core/Maths/math.vector.js';
import { VertexBuffer } from '@babylonjs/core/Meshes/buffer.js';
import { Geometry } from '@babylonjs/core/Meshes/geometry.js';
import { Mesh } from '@babylonjs/core/Meshes/mesh.js';
import { TransformNode } from '@babylonjs/core/Meshes/transformNode.js';
import { WebGLDataBuffer } from '@babylonjs/core/Meshes/WebGL/webGLDataBuffer.js';
import { Observable } from '@babylonjs/core/Misc/observable.js';
import {
  registerGLTFExtension,
  unregisterGLTFExtension,
} from '@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js';
import '@babylonjs/loaders/glTF/2.0/index.js';
import { ARRAYS, EXTENSION } from '../../accessors.js';
import { MeshletExtension } from '../../babylon.js';
import { View } from '../core/cut.js';
import { forStreamed, streamOf } from './session.js';
import { WebGLStore } from './webgl_store.js';

const KINDS = {
  POSITION: VertexBuffer.PositionKind,
  NORMAL: VertexBuffer.NormalKind,
  TANGENT: VertexBuffer.TangentKind,
  TEXCOORD_0: VertexBuffer.UVKind,
  TEXCOORD_1: VertexBuffer.UV2Kind,
  TEXCOORD_2: VertexBuffer.UV3Kind,
  TEXCOORD_3: VertexBuffer.UV4Kind,
  COLOR_0: VertexBuffer.ColorKind,
};
let loads = 0;

/** @typedef {InstanceType<ReturnType<typeof streamOf>>} Stream */
const StreamNode = /** @type {new (...given: any[]) => TransformNode & Stream} */ (
  streamOf(TransformNode)
);

export class MeshletStream extends StreamNode {
  #container = null; // what the loader made
  #meshes = []; // StreamedMesh
  #geometries = new Map(); // pool -> Geometry
  #isLost = false; // the WebGL context
  #observers = []; // of the context
  #stores = new Map(); // pool -> WebGLStore

  constructor(place, scene, { pixels = 1, ...options } = {}) {
    super(place, pixels, 'MeshletStream', scene);
    this.animationGroups = [];
    this.onLoadObservable = new Observable();
    this.onProgressObservable = new Observable();
    this.onWarningObservable = new Observable();
    this.onErrorObservable = new Observable();
    const observables = {
      load: this.onLoadObservable,
      progress: this.onProgressObservable,
      warning: this.onWarningObservable,
      error: this.onErrorObservable,
    };
    this.start(options, {
      load: (...given) => this.#load(...given),
      show: (...given) => this.#show(...given),
      clear: () => this.#clear(),
      tell: (type, message, error) => observables[type].notifyObservers(error ?? message),
    });
  }

  getClassName() {
    return 'MeshletStream';
  }

  // Makes the scene. found: meshes without geometry -> streamed primitives.
  async #load(streamer, json, base) {
    const name = `MESHLET_STREAM_${loads++}`;
    const found = new Map();
    forStreamed(json, streamer.primitives, (primitive, streamed) => {
      primitive.extensions[name] = streamer.primitives.indexOf(streamed);
    });
    const used = json.extensionsUsed?.filter((one) => one !== EXTENSION) ?? [];
    json.extensionsUsed = [...used, name]; // with our extension only, of this file only
    registerGLTFExtension(name, true, (loader) => {
      return new StreamExtension(name, loader, streamer, found);
    });
    try {
      const options = { pluginExtension: '.gltf', rootUrl: base };
      const source = `data:${JSON.stringify(json)}`;
      this.#container = await LoadAssetContainerAsync(source, this.getScene(), options);
      return { container: this.#container, found };
    } finally {
      unregisterGLTFExtension(name);
    }
  }

  async #show(streamer, { container, found }, each) {
    if (contextOf(this.getScene().getEngine()))
      // Without the module, as when the page has gone offline, arrays do.
      await this.#moveToBuffers(streamer).catch(({ message }) =>
        this.onWarningObservable.notifyObservers(message),
      );
    if (this.#stores.size === 0) for (const pool of streamer.pools) this.#adopt(pool);
    this.#watchContext(streamer);
    await each(container.meshes.slice(), (holder) => {
      const primitive = found.get(holder.isAnInstance ? holder.sourceMesh : holder);
      if (primitive) this.#fill(holder, streamer, primitive);
    });
    container.addAllToScene(); // while no node has a parent outside, of which Babylon would warn
    for (const node of container.rootNodes) node.parent = this;
    this.animationGroups = container.animationGroups;
  }

  // Gives a mesh without geometry a child for each of its instances.
  #fill(holder, streamer, primitive) {
    const box = boxOf(streamer.json, primitive);
    holder.setBoundingInfo(new BoundingInfo(box[0], box[1]));
    const locals = holder.hasThinInstances ? holder.thinInstanceGetWorldMatrices() : [null];
    for (const local of locals) {
      const instance = streamer.addInstance(primitive);
      const valuesOf = (number) => this.#valuesOf(primitive.pool, number);
      const mesh = new StreamedMesh(holder, local, instance, box, valuesOf);
      mesh.setGeometry(this.#geometries.get(primitive.pool));
      this.#meshes.push(mesh);
    }
  }

  // Decoded pages lie in buffers of the engine, without copies in arrays. wasLost: those of before.
  async #moveToBuffers(streamer, wasLost = false) {
    const engine = this.getScene().getEngine();
    const gl = contextOf(engine);
    const storeOf = (pool) => {
      const changed = () => this.#setBuffers(pool, store.buffers.map(bufferOf));
      const store = new WebGLStore(gl, pool.formats, changed);
      this.#stores.set(pool, store);
      return store;
    };
    await streamer.moveTo(storeOf, wasLost);
  }

  // Buffers of Babylon for the arrays of a pool. Only what is written goes to the GPU.
  #adopt(pool) {
    const engine = this.getScene().getEngine();
    const vertices = pool.arrays.map((array) => engine.createDynamicVertexBuffer(array));
    const index = engine.createIndexBuffer(pool.index, true);
    this.#setBuffers(pool, [...vertices, index]);
    pool.resized = () => this.#adopt(pool);
    const { arrays } = pool;
    pool.written = (array, begin, end) => {
      const part = array.subarray(begin, end);
      const at = begin * array.BYTES_PER_ELEMENT;
      if (array === pool.index) engine.updateDynamicIndexBuffer(index, part, at);
      else engine.updateDynamicVertexBuffer(vertices[arrays.indexOf(array)], part, at);
    };
  }

  // buffers: of Babylon; the last one is the index.
  #setBuffers(pool, buffers) {
    const engine = this.getScene().getEngine();
    const before = this.#geometries.get(pool);
    const geometry = new Geometry(Geometry.RandomId(), this.getScene());
    const { vertices, indices } = pool.counts;
    pool.formats.forEach(({ name, size, components, normalized, bytes, Type }, a) => {
      if (!KINDS[name]) return;
      const options = {
        size: name === 'COLOR_0' ? size : components,
        stride: bytes,
        useBytes: true,
        type: Number(Object.keys(ARRAYS).find((type) => ARRAYS[type] === Type)),
        normalized,
      };
      const buffer = new VertexBuffer(engine, buffers[a], KINDS[name], options);
      geometry.setVerticesBuffer(buffer, vertices);
    });
    geometry.setIndexBuffer(buffers.at(-1), vertices, indices, true);
    this.#geometries.set(pool, geometry);
    for (const mesh of this.#meshes) if (mesh.geometry === before) mesh.setGeometry(geometry);
    before?.dispose();
  }

  // What a pool holds: of a format, or after them of the index.
  #valuesOf(pool, number) {
    return this.#stores.get(pool)?.copy(number) ?? [...pool.arrays, pool.index][number];
  }

  // Babylon knows no data of the pools' buffers, so that it cannot fill those of a new context.
  #watchContext(streamer) {
    const engine = this.getScene().getEngine();
    const restore = () => {
      this.#isLost = false;
      if (this.#stores.size > 0) this.#moveToBuffers(streamer, true);
      else for (const pool of streamer.pools) this.#adopt(pool);
    };
    this.#observers = [
      engine.onContextLostObservable.add(() => (this.#isLost = true)),
      engine.onContextRestoredObservable.add(restore),
    ];
  }

  // Call before each frame. Returns whether the picture changes.
  update(camera) {
    const { streamer } = this.session;
    if (!streamer || this.#isLost) return false;
    for (const mesh of this.#meshes) mesh.place();
    streamer.update(this.frozen ? null : viewOf(camera), this.pixels);
    let changed = false;
    for (const mesh of this.#meshes) changed = mesh.setRanges() || changed;
    return changed;
  }

  #clear() {
    for (const observer of this.#observers.splice(0)) observer.remove();
    for (const mesh of this.#meshes) mesh.dispose();
    this.#meshes = [];
    for (const geometry of this.#geometries.values()) geometry.dispose();
    this.#geometries.clear();
    for (const store of this.#stores.values()) store.release();
    this.#stores.clear();
    this.#container?.dispose();
    this.#container = null;
    this.animationGroups = [];
    this.#isLost = false; // observers of the next scene tell
  }

  dispose(...given) {
    this.session.close();
    super.dispose(...given);
  }
}

// Of a file that streams: its primitives without levels are decoded whole, those with levels become
// meshes without geometry.
class StreamExtension {
  #streamer;
  #found;
  #decoding;

  constructor(name, loader, streamer, found) {
    this.name = name;
    this.enabled = true;
    this.#streamer = streamer;
    this.#found = found;
    this.#decoding = new MeshletExtension(loader, streamer.decoders);
  }

  dispose() {}

  onLoading() {
    this.#decoding.onLoading();
  }

  loadBufferViewAsync(context, view) {
    return this.#decoding.loadBufferViewAsync(context, view) ?? this.#streamer.readView(view.index);
  }

  // The loader's hook for compressed geometry.
  _loadVertexDataAsync(_context, /** @type {any} */ { extensions, attributes }, mesh) {
    const number = extensions?.[this.name];
    if (number === undefined) return null;
    const { accessors } = this.#streamer.json;
    mesh.hasVertexAlpha = accessors[attributes.COLOR_0]?.type === 'VEC4';
    this.#found.set(mesh, this.#streamer.primitives[number]);
    return Promise.resolve(new Geometry(mesh.name, mesh.getScene()));
  }
}

// An instance of a primitive with levels.
class StreamedMesh extends Mesh {
  #holder;
  #instance;
  #valuesOf;
  #local; // from POSITION to the holder
  #box; // in the units of the arrays
  #placed = Matrix.Zero();
  #shown = false;
  #version = -1;

  // local: of the instance; null: the holder itself. box: minimum and maximum of POSITION. valuesOf:
  // number of a format, or after them of the index -> what its buffer holds.
  constructor(holder, local, instance, box, valuesOf) {
    super(holder.name, holder.getScene(), holder);
    this.#holder = holder;
    this.#instance = instance;
    this.#valuesOf = valuesOf;
    this.#local = local ?? Matrix.Identity();
    const { formats } = instance.primitive;
    const { scale = 1, offset = [0, 0, 0] } = formats.find(({ name }) => name === 'POSITION');
    this.#box = box.map((corner) => corner.subtract(Vector3.FromArray(offset)).scale(1 / scale));
    this.rotationQuaternion = new Quaternion();
    Matrix.Scaling(scale, scale, scale)
      .multiply(Matrix.Translation(offset[0], offset[1], offset[2]))
      .multiply(this.#local)
      .decompose(this.scaling, this.rotationQuaternion, this.position);
    this.sideOrientation = holder.sideOrientation;
    this.hasVertexAlpha = holder.hasVertexAlpha;
  }

  setGeometry(geometry) {
    geometry.applyToMesh(this);
    this.setBoundingInfo(new BoundingInfo(this.#box[0], this.#box[1]));
    const [subMesh] = this.subMeshes;
    subMesh.setBoundingInfo(this.getBoundingInfo());
    subMesh.intersects = (ray, _positions, _indices, isFast, accepts) =>
      this.#intersect(ray, isFast, accepts);
    this.#version = -1;
  }

  // Tells the instance where it is, as far as that has changed.
  place() {
    const holder = this.#holder;
    this.material = holder.material;
    this.isVisible = holder.isVisible;
    const shown = holder.isVisible && holder.isEnabled();
    const world = holder.computeWorldMatrix(true);
    if (shown === this.#shown && !(shown && !world.equals(this.#placed))) return;
    this.#shown = shown;
    this.#placed.copyFrom(world);
    this.#instance.place(shown ? this.#local.multiply(world).m : null);
  }

  setRanges() {
    const { version, counts } = this.#instance;
    if (version === this.#version) return false;
    this.#version = version;
    this.subMeshes[0].indexCount = counts.reduce((sum, count) => sum + count, 0);
    return true;
  }

  // In place of Babylon's: all ranges of the instance.
  _draw(_subMesh, fillMode, instances) {
    const { starts, counts } = this.#instance;
    const engine = this.getEngine();
    for (let i = 0; i < starts.length; i++)
      engine.drawElementsType(fillMode, starts[i], counts[i], instances);
    return this;
  }

  // Picking reads what the pool's buffers hold.
  _generatePointsArray() {
    return true;
  }

  #intersect(ray, isFast, accepts) {
    const { starts, counts, primitive } = this.#instance;
    const { formats } = primitive;
    const position = formats.findIndex(({ name }) => name === 'POSITION');
    const { size, normalized } = formats[position];
    const array = this.#valuesOf(position);
    const index = this.#valuesOf(formats.length);
    const unit = normalized ? 1 / largestOf(array) : 1;
    const corners = [new Vector3(), new Vector3(), new Vector3()];
    let nearest = null;
    for (let r = 0; r < starts.length; r++)
      for (let i = starts[r]; i < starts[r] + counts[r]; i += 3) {
        for (let c = 0; c < 3; c++) {
          const at = size * index[i + c];
          corners[c].set(array[at] * unit, array[at + 1] * unit, array[at + 2] * unit);
        }
        if (accepts && !accepts(...corners, ray, i, i + 1, i + 2)) continue;
        const hit = ray.intersectsTriangle(...corners);
        if (!hit || hit.distance < 0 || hit.distance >= (nearest?.distance ?? Infinity)) continue;
        nearest = hit;
        nearest.faceId = i / 3;
        if (isFast) return nearest;
      }
    return nearest;
  }
}

const largestOf = ({ BYTES_PER_ELEMENT: width, constructor: { name } }) =>
  2 ** (8 * width - (name.startsWith('Uint') ? 0 : 1)) - 1;

// The minimum and the maximum of a primitive's positions.
function boxOf(json, { primitive }) {
  const { min, max, normalized, componentType } = json.accessors[primitive.attributes.POSITION];
  const unit = normalized ? 1 / largestOf(new ARRAYS[componentType](0)) : 1;
  return [min, max].map((corner) => Vector3.FromArray(corner ?? [0, 0, 0]).scale(unit));
}

// null: not of WebGL 2.
const contextOf = (engine) =>
  engine.isWebGPU ? null : (engine.getRenderingCanvas()?.getContext('webgl2') ?? null);

// A buffer of WebGL, of which Babylon does not dispose.
function bufferOf(buffer) {
  const wrapped = new WebGLDataBuffer(buffer);
  wrapped.references = Number.POSITIVE_INFINITY;
  return wrapped;
}

function viewOf(camera) {
  const projection = camera.getProjectionMatrix(true);
  const height = camera.getEngine().getRenderHeight() * camera.viewport.height;
  const planes = Frustum.GetPlanes(camera.getViewMatrix(true).multiply(projection));
  return new View({
    eye: camera.mode === Camera.ORTHOGRAPHIC_CAMERA ? null : camera.globalPosition.asArray(),
    pixelsPerUnit: (height / 2) * projection.m[5],
    near: camera.minZ,
    planes: planes.flatMap(({ normal, d }) => [...normal.asArray(), d]),
  });
}
