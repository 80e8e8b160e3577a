// Where models come from: the web page's own server, the folder of an exported web page, or files
// that the user drops. A model is {name, compressed, original, seconds, warnings}; compressed and
// original are {bytes, read, place}, or null where there is none. read(): promise of an
// ArrayBuffer; place: of compressed files, a URL or a Blob; bytes: size of the user's file.
// seconds: what compressing took, or null.
import { EXTENSION } from '../gltf.js';
import { isGlb, packGltf, readJson } from './glb.js';

const MODELS = 'models.json';
const NOTHING = { compressed: null, original: null, seconds: null, warnings: [] };
const MESHES = ['obj', 'ply', 'stl'];
export const SUFFIXES = ['glb', 'gltf', ...MESHES];

export class Models {
  #server = false;

  // The models that the web page starts with. Throws an Error if the list cannot be read.
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
    const { compressed, original, ...rest } = remote(answer);
    // The server keeps the files of one upload only.
    for (const file of [compressed, original]) {
      const content = await file.read();
      file.read = async () => content;
      file.place = new Blob([content]);
    }
    return { ...rest, name, compressed, original: { ...original, bytes: model.original.bytes } };
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
    entry && {
      bytes: entry.bytes,
      read: async () => (await get(entry.file)).arrayBuffer(),
      place: new URL(entry.file, location.href),
    };
  return { ...model, compressed: file(model.compressed), original: file(model.original) };
}

// A model of a file. `plain`, if it is not compressed: what can be sent to the server.
async function local(file, named) {
  const type = suffixOf(file.name);
  const model = { ...NOTHING, name: file.name };
  if (MESHES.includes(type)) return { ...model, ...plain(file, type, file.size, file) };
  const buffer = await file.arrayBuffer();
  const blob = isGlb(buffer) ? file : await packGltf(buffer, named);
  const bytes = isGlb(buffer) ? file.size : blob.size;
  if (readJson(buffer).extensionsUsed?.includes(EXTENSION))
    return { ...model, compressed: { bytes, read: () => blob.arrayBuffer(), place: blob } };
  return { ...model, ...plain(file, 'glb', bytes, blob) };
}

function plain(file, type, bytes, blob) {
  return {
    plain: { name: file.name, type, blob },
    original: { bytes, type, read: () => blob.arrayBuffer() },
  };
}
