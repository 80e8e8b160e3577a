// An extension for glTF-Transform. Reading decodes every compressed primitive into its accessors;
// writing keeps a blob if its primitive still has exactly the decoded values, and writes plain
// accessors otherwise. It cannot compress: gltf-meshlet compress does.
import { Extension, ExtensionProperty, GLB_BUFFER, PropertyType } from '@gltf-transform/core';
import { accessorArrays, EXTENSION, forCompressed } from './gltf.js';
import { joinVertices, separateVertices } from './join.js';
import { TRANSPORT } from './transport.js';

export const DECODER = 'meshlet.decoder';
export const UNPACKER = 'meshlet.unpacker';

// Reading unpacks packed views; writing leaves them unpacked.
export class EXTMeshletTransport extends Extension {
  static EXTENSION_NAME = TRANSPORT;
  /** @readonly */
  extensionName = TRANSPORT;
  prereadTypes = [PropertyType.BUFFER];
  readDependencies = [UNPACKER];
  #unpacker;

  install(key, dependency) {
    if (key === UNPACKER) this.#unpacker = dependency;
    return this;
  }

  preread({ jsonDoc: { json, resources }, bufferViews }) {
    json.bufferViews.forEach(({ buffer, byteOffset = 0, byteLength, extensions }, number) => {
      const extension = extensions?.[TRANSPORT];
      if (!extension) return;
      if (!this.#unpacker)
        throw new Error(
          `${TRANSPORT} needs its unpacker: ` +
            `io.registerDependencies({ '${UNPACKER}': await createUnpacker() })`,
        );
      const data = resources[json.buffers[buffer].uri ?? GLB_BUFFER];
      const packed = data.subarray(byteOffset, byteOffset + byteLength);
      bufferViews[number] = this.#unpacker.unpack(packed, extension.byteLength);
    });
    return this;
  }

  read() {
    this.dispose(); // nothing of it is left in the document
    return this;
  }

  write() {
    return this;
  }
}

// The blob that a primitive was decoded from.
class CompressedPrimitive extends ExtensionProperty {
  init() {
    this.extensionName = EXTENSION;
    this.propertyType = 'MeshletEdgebreaker';
    this.parentTypes = [PropertyType.PRIMITIVE];
  }

  getDefaults() {
    return Object.assign(super.getDefaults(), {
      bytes: null,
      table: null,
      object: null,
      vertexCount: 0,
    });
  }

  // The values of getDefaults.
  fill(values) {
    for (const [name, value] of Object.entries(values))
      this.set(/** @type {never} */ (name), /** @type {never} */ (value));
  }
}

export class EXTMeshletEdgebreaker extends Extension {
  static EXTENSION_NAME = EXTENSION;
  /** @readonly */
  extensionName = EXTENSION;
  prereadTypes = [PropertyType.PRIMITIVE];
  prewriteTypes = [PropertyType.ACCESSOR];
  readDependencies = [DECODER];
  writeDependencies = [DECODER];
  #decoder;
  #kept = new Map(); // primitive -> its CompressedPrimitive, of the file being written

  install(key, dependency) {
    if (key === DECODER) this.#decoder = dependency;
    return this;
  }

  #needDecoder() {
    if (this.#decoder) return;
    throw new Error(
      `${EXTENSION} needs its decoder: ` +
        `io.registerDependencies({ '${DECODER}': await createDecoder() })`,
    );
  }

  preread(context) {
    this.#needDecoder();
    const { json } = context.jsonDoc;
    forCompressed(json, (primitive, name) => {
      const { bufferView, equalVertices } = primitive.extensions[EXTENSION];
      const buffer = context.buffers[json.bufferViews[bufferView].buffer];
      try {
        const view = context.bufferViews[bufferView];
        const table = tableOf(context, equalVertices);
        for (const [number, array] of this.#arrays(json, primitive, view, table))
          context.accessors[number].setArray(array).setBuffer(buffer);
      } catch (error) {
        throw new Error(`${name}: ${error.message}`, { cause: error });
      }
    });
    return this;
  }

  read(context) {
    context.jsonDoc.json.meshes?.forEach((mesh, m) =>
      mesh.primitives.forEach(({ extensions }, p) => {
        const object = extensions?.[EXTENSION];
        if (!object) return;
        const { bufferView, equalVertices, ...streams } = object;
        const bytes = context.bufferViews[bufferView];
        const blobs = this.#decoder.blobs(bytes);
        const property = new CompressedPrimitive(this.document.getGraph());
        property.fill({
          bytes,
          object: streams,
          table: tableOf(context, equalVertices),
          vertexCount: blobs.reduce((sum, blob) => sum + blob.vertexCount, 0),
        });
        context.meshes[m].listPrimitives()[p].setExtension(EXTENSION, property);
      }),
    );
    return this;
  }

  // Accessor number -> its components, each vertex of the source once. table: of equal vertices.
  #arrays(json, primitive, view, table) {
    const decoded = this.#decoder.decodePrimitive(view);
    const arrays = accessorArrays(json, primitive, decoded);
    const { sourceVertices } = primitive.extensions[EXTENSION];
    if (!table && !(sourceVertices < decoded.vertexCount)) return arrays;
    const { indices, rows } = this.#sourceVertices(view, sourceVertices, table);
    for (const [number, array] of arrays)
      arrays.set(
        number,
        number === primitive.indices
          ? sourceIndices(array, indices, rows.length)
          : chosenRows(array, decoded.vertexCount, rows),
      );
    return arrays;
  }

  // {indices, rows}: a decoded vertex for each vertex of the source.
  #sourceVertices(view, sourceVertices, table) {
    const integers = this.#decoder.decodePrimitive(view, { integers: true });
    if (table) return separateVertices(integers, table);
    let vertices = 0;
    const firsts = this.#decoder.blobs(view).map(({ vertexCount }) => {
      vertices += vertexCount;
      return vertices - vertexCount;
    });
    const { numbers } = joinVertices(integers, firsts, sourceVertices);
    const rows = [];
    numbers.forEach((number, v) => {
      if (number === rows.length) rows.push(v);
    });
    return { indices: integers.indices.map((v) => numbers[v]), rows };
  }

  // Called before accessors are written: those of a primitive that keeps its blob get no bytes.
  prewrite(context) {
    this.#kept = this.#unchanged();
    const views = new Set();
    for (const [primitive, property] of this.#kept) {
      for (const accessor of accessorsOf(primitive)) {
        if (context.accessorIndexMap.has(accessor)) continue;
        const { accessors } = context.jsonDoc.json;
        context.accessorIndexMap.set(accessor, accessors.length);
        const definition = context.createAccessorDef(accessor);
        // The blob may have a vertex more than once.
        if (accessor !== primitive.getIndices()) definition.count = property.get('vertexCount');
        accessors.push(definition);
      }
      const buffer = primitive.getIndices().getBuffer() ?? this.document.getRoot().listBuffers()[0];
      for (const bytes of [property.get('bytes'), property.get('table')]) {
        if (!bytes || views.has(bytes)) continue;
        views.add(bytes);
        const others = context.otherBufferViews.get(buffer) ?? [];
        context.otherBufferViews.set(buffer, [...others, bytes]);
      }
    }
    return this;
  }

  write(context) {
    const { json } = context.jsonDoc;
    for (const mesh of this.document.getRoot().listMeshes()) {
      const { primitives } = json.meshes[context.meshIndexMap.get(mesh)];
      mesh.listPrimitives().forEach((primitive, p) => {
        const property = this.#kept.get(primitive);
        if (!property) return;
        const viewOf = (name) => context.otherBufferViewsIndexMap.get(property.get(name));
        const object = { bufferView: viewOf('bytes'), ...property.get('object') };
        if (property.get('table')) object.equalVertices = { bufferView: viewOf('table') };
        primitives[p].extensions ??= {};
        primitives[p].extensions[EXTENSION] = object;
      });
    }
    if (this.#kept.size > 0) return this;
    for (const list of ['extensionsUsed', 'extensionsRequired']) {
      json[list] = json[list]?.filter((name) => name !== EXTENSION);
      if (json[list]?.length === 0) delete json[list];
    }
    return this;
  }

  // The primitives whose blob is what they contain. Accessors without bytes may belong to no other.
  #unchanged() {
    const kept = new Map();
    const primitives = this.document
      .getRoot()
      .listMeshes()
      .flatMap((mesh) => mesh.listPrimitives());
    for (const primitive of primitives) {
      const property = primitive.getExtension(EXTENSION);
      if (property && this.#equals(primitive, property)) kept.set(primitive, property);
    }
    const root = this.document.getRoot();
    const foreign = (primitive) => {
      const parts = new Set([...kept.keys()].flatMap((p) => [p, ...p.listTargets()]));
      const parents = accessorsOf(primitive).flatMap((accessor) => accessor.listParents());
      return parents.some((p) => p !== root && p.propertyType !== 'Buffer' && !parts.has(p));
    };
    for (let more = true; more; ) {
      const shared = [...kept.keys()].filter(foreign);
      for (const primitive of shared) kept.delete(primitive);
      more = shared.length > 0;
    }
    return kept;
  }

  // Does a primitive have the values of its blob?
  #equals(primitive, property) {
    this.#needDecoder();
    const object = property.get('object');
    if (!sameNames(primitive, object.attributes)) return false;
    const targets = primitive.listTargets();
    if (targets.length !== (object.targets?.length ?? 0)) return false;
    if (!targets.every((target, t) => sameNames(target, object.targets[t]))) return false;
    const accessors = accessorsOf(primitive);
    const numbers = new Map(accessors.map((accessor, number) => [accessor, number]));
    const json = {
      accessors: accessors.map((accessor) => ({
        componentType: accessor.getComponentType(),
        type: accessor.getType(),
        count:
          accessor === primitive.getIndices() ? accessor.getCount() : property.get('vertexCount'),
      })),
    };
    const attributes = (owner) =>
      Object.fromEntries(owner.listSemantics().map((s) => [s, numbers.get(owner.getAttribute(s))]));
    const definition = {
      extensions: { [EXTENSION]: object },
      indices: numbers.get(primitive.getIndices()),
      attributes: attributes(primitive),
      targets: targets.map(attributes),
    };
    try {
      const arrays = this.#arrays(json, definition, property.get('bytes'), property.get('table'));
      return [...arrays].every(([number, array]) => sameBytes(array, accessors[number].getArray()));
    } catch {
      return false; // other types or counts than the blob's
    }
  }
}

// The bytes of the table of equal vertices that a property names; null without the property.
function tableOf(context, equalVertices) {
  if (equalVertices === undefined) return null;
  const table = context.bufferViews[equalVertices?.bufferView];
  if (!table) throw new Error('its table of equal vertices is not there');
  return table;
}

// indices as an array of the same type as decoded ones; as one of a larger type where there are more
// vertices than that holds: a table may have more of them than are decoded.
function sourceIndices(decoded, indices, count) {
  const type = [decoded.constructor, Uint16Array, Uint32Array].find(
    ({ BYTES_PER_ELEMENT: bytes }) => count < 2 ** (8 * bytes),
  );
  return new type(indices);
}

// Some rows of an array of vertices.
function chosenRows(array, vertexCount, rows) {
  const components = array.length / vertexCount;
  const chosen = new array.constructor(components * rows.length);
  rows.forEach((v, row) => {
    chosen.set(array.subarray(components * v, components * (v + 1)), components * row);
  });
  return chosen;
}

function accessorsOf(primitive) {
  const owners = [primitive, ...primitive.listTargets()];
  const attributes = owners.flatMap((owner) => owner.listAttributes());
  return [...new Set([primitive.getIndices(), ...attributes])].filter((accessor) => accessor);
}

function sameNames(owner, streams) {
  return String(owner.listSemantics().sort()) === String(Object.keys(streams ?? {}).sort());
}

function sameBytes(a, b) {
  if (a.byteLength !== b?.byteLength) return false;
  const bytes = ({ buffer, byteOffset, byteLength }) =>
    new Uint8Array(buffer, byteOffset, byteLength);
  const [x, y] = [bytes(a), bytes(b)];
  return x.every((byte, i) => byte === y[i]);
}
