// Where models come from: the page's own server, the folder of an exported page, or files that the
// user drops. A model is {name, compressed, original, seconds, warnings}; compressed and original
// are {bytes, read}, or null where there is none. read(): promise of an ArrayBuffer; bytes: size of
// the user's file. seconds: what compressing took, or null.
import { EXTENSION } from '../gltf.js';
import { isGlb, packGltf, readJson } from './glb.js';

const MODELS = 'models.json';
const MESHES = ['obj', 'ply', 'stl'];
export const SUFFIXES = ['glb', 'gltf', ...MESHES];

export class Models {
  #server = false;

  // The models that the page starts with. Throws an Error if the list cannot be read.
  async start() {
    const { server, models } = await (await get(MODELS)).json();
    this.#server = server;
    return models.map(remote);
  }

  get compresses() {
    return this.#server;
  }

  // The models of dropped files. The others are files that a .gltf refers to.
  async fromFiles(files) {
    const models = files.filter((file) => SUFFIXES.includes(suffixOf(file.name)));
    if (models.length === 0)
      throw new Error(`no model among the files; use one of .${SUFFIXES.join(' .')}`);
    const named = new Map(files.map((file) => [file.name, file]));
    return Promise.all(models.map((file) => local(file, named)));
  }

  // The compressed form of a model that is not compressed. Throws an Error with the reason if the
  // server cannot compress it.
  async compress(model, signal) {
    const { name, type, blob } = model.plain;
    const sent = `${name.replace(/\.[^.]*$/, '')}.${type}`;
    const response = await fetch(`compress?name=${encodeURIComponent(sent)}`, {
      method: 'POST',
      body: blob,
      signal,
    }).catch((error) => {
      throw signal.aborted ? error : new Error('the server does not answer; is it still running?');
    });
    const answer = await response.json();
    if (!response.ok) throw new Error(answer.error);
    const compressed = remote(answer);
    // The server keeps the files of one upload only.
    const [first, second] = await Promise.all([
      compressed.compressed.read(),
      compressed.original.read(),
    ]);
    return {
      ...compressed,
      name,
      compressed: { ...compressed.compressed, read: async () => first },
      original: { bytes: model.original.bytes, read: async () => second },
    };
  }
}

export function suffixOf(name) {
  return name.split('.').at(-1).toLowerCase();
}

async function get(url) {
  const response = await fetch(url).catch(() => {
    throw new Error('the server does not answer; is it still running?');
  });
  if (!response.ok) throw new Error(`the server answered ${response.status} for ${url}`);
  return response;
}

function remote(model) {
  const file = (entry) =>
    entry && { bytes: entry.bytes, read: async () => (await get(entry.file)).arrayBuffer() };
  return {
    name: model.name,
    compressed: file(model.compressed),
    original: file(model.original),
    seconds: model.seconds,
    warnings: model.warnings,
  };
}

// A model of a file. `plain`, if it is not compressed: what can be sent to the server.
async function local(file, named) {
  const type = suffixOf(file.name);
  const model = {
    name: file.name,
    compressed: null,
    original: null,
    seconds: null,
    warnings: [],
  };
  if (MESHES.includes(type)) return { ...model, ...plain(file, type, file.size, file) };
  const buffer = await file.arrayBuffer();
  const blob = isGlb(buffer) ? file : await packGltf(buffer, named);
  const bytes = isGlb(buffer) ? file.size : blob.size;
  const compressed = (readJson(buffer).extensionsUsed ?? []).includes(EXTENSION);
  if (compressed) return { ...model, compressed: { bytes, read: () => blob.arrayBuffer() } };
  return { ...model, ...plain(file, 'glb', bytes, blob) };
}

function plain(file, type, bytes, blob) {
  return {
    plain: { name: file.name, type, blob },
    original: { bytes, type, read: () => blob.arrayBuffer() },
  };
}
