// Streams a file into a scene of three.js. GLTFLoader makes nodes, materials, textures and
// animations; primitives with levels are drawn as ranges of shared arrays.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Frustum,
  Group,
  Matrix4,
  Mesh,
  Object3D,
  Sphere,
  Vector3,
  Vector4,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { EXTENSION } from '../../accessors.js';
import { View } from '../core/cut.js';
import { forStreamed, streamOf } from './session.js';

// Of attributes, where they differ from glTF's in lower case.
const NAMES = {
  TEXCOORD_0: 'uv',
  TEXCOORD_1: 'uv1',
  TEXCOORD_2: 'uv2',
  TEXCOORD_3: 'uv3',
  COLOR_0: 'color',
};
const STUB_COUNT = 3; // vertices of what GLTFLoader gets instead of a primitive
const PALETTE = 16; // colours of meshlets, levels and pages

const scratch = new Matrix4();

/** @typedef {InstanceType<ReturnType<typeof streamOf>>} Stream */
const StreamGroup = /** @type {new (...given: any[]) => Group & Stream} */ (streamOf(Group));

export class MeshletStream extends StreamGroup {
  #loader;
  #holders = []; // Holder
  #meshes = []; // of them, StreamedMesh
  #attributes = new Map(); // pool -> attributes of three, the last one of the index
  #buffers = null; // RendererBuffers
  #palettes = new Map(); // material -> what shows colours instead
  /** @type {'none' | 'page' | 'level' | 'meshlet'} */
  #colour = 'none';
  #loaded = null; // what GLTFLoader made
  #besides = { textureBytes: 0, otherBytes: 0 };
  #extras = null; // the module

  constructor(place, { pixels = 1, loader = new GLTFLoader(), ...options } = {}) {
    super(place, pixels);
    this.#loader = loader;
    this.start(options, {
      load: (...given) => this.#load(...given),
      show: (...given) => this.#show(...given),
      clear: () => this.#clear(),
      tell: (type, message, error) => this.dispatchEvent({ type, message, error }),
    });
  }

  // --- loading ---

  // Makes the scene. GLTFLoader gets primitives with levels as stubs of zeros.
  async #load(streamer, json, base) {
    const stubs = stubPrimitives(json, streamer.primitives);
    // What has no levels is decoded whole. Most files that stream have none of that.
    const isNeeded = JSON.stringify(json.meshes ?? []).includes(EXTENSION);
    const whole = isNeeded ? await import('../../three_plugin.js') : null;
    const register = (parser) => {
      const plugin = whole?.meshletPlugin(streamer.decoders)(parser);
      const read = async (number) => (await streamer.readView(number)).buffer;
      return {
        name: EXTENSION,
        beforeRoot: () => plugin?.beforeRoot(),
        loadBufferView: (number) => plugin?.loadBufferView(number) ?? read(number),
      };
    };
    this.#loader.register(register);
    const parsing = this.#loader.parseAsync(json, base);
    this.#loader.unregister(register);
    const gltf = await parsing;
    this.#loaded = gltf;
    const positions = new Map();
    for (const [primitive, number] of stubs)
      positions.set(await gltf.parser.getDependency('accessor', number), primitive);
    return { gltf, positions };
  }

  async #show(streamer, { gltf, positions }, each) {
    const root = gltf.scene ?? gltf.scenes?.[0];
    if (!root) throw new Error('it has no scene');
    for (const pool of streamer.pools) this.#adopt(pool);
    const found = [];
    root.traverse((mesh) => {
      const primitive = positions.get(mesh.geometry?.attributes.position);
      if (primitive) found.push([mesh, primitive]);
    });
    await each(found, ([mesh, primitive]) => this.#replace(mesh, streamer, primitive));
    this.animations = gltf.animations;
    this.add(root);
    streamer.colour = this.#colour;
    this.#addExtras();
  }

  // What the first picture does without.
  async #addExtras() {
    try {
      this.#extras ??= await import('./three_extras.js');
    } catch (error) {
      return this.#warn(error);
    }
    this.#setMaterials();
    this.#besides = this.#extras.bytesBesides(this);
  }

  // Buffers of three for the arrays of a pool. Only what is written goes to the GPU.
  #adopt(pool) {
    const { arrays, index } = pool;
    const attribute = (array, { size, normalized }) =>
      new BufferAttribute(array, size, normalized).setUsage(DynamicDrawUsage);
    this.#setBuffers(pool, [
      ...pool.formats.map((format, a) => attribute(arrays[a], format)),
      attribute(index, { size: 1, normalized: false }),
    ]);
    pool.resized = () => this.#adopt(pool);
    pool.written = (array, begin, end) => {
      const written = this.#attributes.get(pool).find((one) => one.array === array);
      written.addUpdateRange(begin, end - begin);
      written.needsUpdate = true;
    };
  }

  #setBuffers(pool, attributes) {
    this.#attributes.set(pool, attributes);
    for (const mesh of this.#meshes)
      if (mesh.primitive.pool === pool) this.#fill(mesh.geometry, mesh.primitive);
  }

  // Puts an object in the place of a mesh, with a child for each of its instances.
  #replace(mesh, streamer, primitive) {
    const holder = new Holder().copy(mesh, false);
    holder.uuid = mesh.uuid; // animations may name it
    this.#holders.push(holder);
    for (const child of [...mesh.children]) holder.add(child);
    const { parent } = mesh;
    parent.children[parent.children.indexOf(mesh)] = holder;
    holder.parent = parent;
    mesh.parent = null;
    for (let i = 0; i < (mesh.isInstancedMesh ? mesh.count : 1); i++) {
      const local = new Matrix4();
      if (mesh.isInstancedMesh) mesh.getMatrixAt(i, local);
      const instance = streamer.addInstance(primitive);
      const drawn = new StreamedMesh(
        this.#geometryOf(mesh, primitive),
        mesh.material,
        instance,
        local,
      );
      drawn.name = mesh.name;
      holder.add(drawn);
      holder.streamed.push(drawn);
      this.#meshes.push(drawn);
    }
  }

  #geometryOf(mesh, primitive) {
    const geometry = new BufferGeometry();
    this.#fill(geometry, primitive);
    const box = mesh.geometry.boundingBox?.clone() ?? new Box3();
    geometry.boundingBox = box.applyMatrix4(decoding(primitive).invert());
    geometry.boundingSphere = geometry.boundingBox.getBoundingSphere(new Sphere());
    return geometry;
  }

  // Sets the buffers of a geometry to those of a pool.
  #fill(geometry, { pool, formats }) {
    // Those of before; but those of a store are its own.
    if (!geometry.index?.isGLBufferAttribute) geometry.dispose();
    const attributes = this.#attributes.get(pool);
    formats.forEach(({ name }, a) =>
      geometry.setAttribute(NAMES[name] ?? name.toLowerCase(), attributes[a]),
    );
    geometry.setIndex(attributes.at(-1));
  }

  // From the first frame on, decoded pages lie in buffers of its renderer. Returns whether there is
  // something to draw.
  #useBuffersOf(renderer, streamer) {
    if (!this.#buffers && renderer.isWebGLRenderer) {
      const mine = { use: () => true, release() {} };
      this.#buffers = mine;
      // Without it, as when the page has gone offline, arrays do.
      import('./webgl_buffers.js').then(({ RendererBuffers }) => {
        if (this.#buffers !== mine) return;
        const set = (pool, attributes) => this.#setBuffers(pool, attributes);
        this.#buffers = new RendererBuffers(renderer, streamer, set);
      }, this.#warn);
    }
    return this.#buffers?.use(renderer) ?? true;
  }

  #warn = ({ message }) => this.dispatchEvent(/** @type {any} */ ({ type: 'warning', message }));

  // --- drawing ---

  // Call before each frame. renderer: also the height of the picture in pixels. Returns whether
  // the picture changes.
  update(camera, renderer) {
    const { streamer } = this.session;
    if (!streamer || !this.#useBuffersOf(renderer, streamer)) return false;
    if (!this.frozen) this.updateWorldMatrix(true, true);
    for (const holder of this.#holders) holder.place();
    const view = this.frozen ? null : viewOf(camera, renderer);
    streamer.update(view, this.pixels);
    let changed = false;
    for (const mesh of this.#meshes) changed = mesh.setRanges(this.#colour === 'none') || changed;
    return changed;
  }

  get statistics() {
    return { ...super.statistics, ...this.#besides };
  }

  // none, page, level or meshlet: a colour for each of them instead of the materials.
  get colour() {
    return this.#colour;
  }

  set colour(colour) {
    this.#colour = colour;
    const { streamer } = this.session;
    if (!streamer) return;
    streamer.colour = colour;
    this.#setMaterials();
  }

  #setMaterials() {
    if (this.#colour !== 'none' && !this.#extras) return; // until they are there
    for (const mesh of this.#meshes)
      mesh.material = this.#colour === 'none' ? [mesh.plain] : this.#paletteOf(mesh);
  }

  #paletteOf({ plain, geometry }) {
    if (!this.#palettes.has(plain))
      this.#palettes.set(plain, this.#extras.paletteOf(plain, geometry, PALETTE));
    return this.#palettes.get(plain);
  }

  // --- end ---

  #clear() {
    this.clear();
    for (const mesh of this.#meshes) {
      mesh.geometry.dispose();
      mesh.material = mesh.plain; // which is freed below
    }
    this.#buffers?.release();
    this.#buffers = null;
    this.#attributes.clear();
    this.#holders = [];
    this.#meshes = [];
    for (const material of [...this.#palettes.values()].flat()) material.dispose();
    this.#palettes.clear();
    for (const scene of this.#loaded?.scenes ?? [])
      scene.traverse((object) => {
        const { geometry, material, skeleton } = object;
        geometry?.dispose();
        skeleton?.dispose();
        if (object.isInstancedMesh) object.dispose();
        for (const one of [material ?? []].flat()) {
          for (const value of Object.values(one)) if (value?.isTexture) value.dispose();
          one.dispose();
        }
      });
    this.#loaded = null;
  }

  dispose() {
    this.session.close();
  }
}

// Stands in the place of a mesh of the file; the parent of its instances.
class Holder extends Object3D {
  streamed = [];
  #placed = new Matrix4();

  // Tells the instances where they are, as far as that has changed.
  place() {
    let visible = true;
    for (let object = /** @type {Object3D} */ (this); object; object = object.parent)
      visible &&= object.visible;
    const moved = !this.#placed.equals(this.matrixWorld);
    this.#placed.copy(this.matrixWorld);
    for (const mesh of this.streamed)
      mesh.place(visible && mesh.visible ? this.matrixWorld : null, moved);
  }
}

// An instance of a primitive with levels. `local`: from POSITION to the parent, as mesh.matrix is
// from what the arrays hold. Groups of the geometry are what is drawn.
class StreamedMesh extends Mesh {
  #instance;
  #local;
  #shown = false;
  #version = -1;

  constructor(geometry, material, instance, local) {
    super(geometry, [material]);
    this.plain = material;
    this.isStreamed = true;
    this.primitive = instance.primitive;
    this.#instance = instance;
    this.#local = local;
    this.matrix.copy(local).multiply(decoding(instance.primitive));
    this.matrixAutoUpdate = false;
    this.matrixWorldNeedsUpdate = true;
  }

  // Tells the instance where it is. parent: its matrix; null: hidden. moved: has it changed?
  place(parent, moved) {
    const shown = parent !== null;
    if (shown === this.#shown && !(shown && moved)) return;
    this.#shown = shown;
    this.#instance.place(shown ? scratch.multiplyMatrices(parent, this.#local).elements : null);
  }

  setRanges(isPlain) {
    const { version, starts, counts, tags } = this.#instance;
    if (version === this.#version) return false;
    this.#version = version;
    this.geometry.clearGroups();
    for (let i = 0; i < starts.length; i++)
      this.geometry.addGroup(starts[i], counts[i], isPlain ? 0 : tags[i] % PALETTE);
    return true;
  }
}

// From what the arrays hold to POSITION.
function decoding({ formats }) {
  const { scale = 1, offset = [0, 0, 0] } = formats.find(({ name }) => name === 'POSITION');
  const [x, y, z] = offset;
  return new Matrix4().makeScale(scale, scale, scale).setPosition(x, y, z);
}

function viewOf(camera, renderer) {
  camera.updateWorldMatrix(true, false);
  const inverse = scratch.copy(camera.matrixWorld).invert();
  const projection = camera.projectionMatrix;
  const height =
    typeof renderer === 'number'
      ? renderer
      : renderer.getViewport(new Vector4()).w * renderer.getPixelRatio();
  const frustum = new Frustum().setFromProjectionMatrix(
    new Matrix4().multiplyMatrices(projection, inverse),
    camera.coordinateSystem,
    camera.reversedDepth,
  );
  const eye = new Vector3().setFromMatrixPosition(camera.matrixWorld);
  return new View({
    eye: camera.isOrthographicCamera ? null : eye.toArray(),
    pixelsPerUnit: (height / 2) * projection.elements[5],
    near: camera.near,
    planes: frustum.planes.flatMap(({ normal, constant }) => [...normal.toArray(), constant]),
  });
}

// Replaces the primitives of a JSON that are streamed. Returns pairs of them and the accessors of
// their positions.
function stubPrimitives(json, primitives) {
  const stubs = new Map();
  forStreamed(json, primitives, (primitive, streamed) => {
    delete primitive.indices;
    if (!stubs.has(streamed)) stubs.set(streamed, stubAttributes(json, primitive));
    primitive.attributes = stubs.get(streamed);
  });
  return new Map([...stubs].map(([one, attributes]) => [one, attributes.POSITION]));
}

function stubAttributes(json, { attributes }) {
  return Object.fromEntries(
    Object.entries(attributes).map(([name, number]) => {
      const { componentType, type, normalized, min, max } = json.accessors[number];
      const stub = { componentType, type, normalized, min, max, count: STUB_COUNT };
      return [name, json.accessors.push(stub) - 1];
    }),
  );
}
