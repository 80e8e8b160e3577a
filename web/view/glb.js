// .glb files, and .gltf files with the files that they refer to.
import { parseJson } from '../stream/io/document.js';

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BIN_CHUNK = 0x004e4942;
const HEADER_BYTES = 12;
const CHUNK_BYTES = 8;

export function isGlb(buffer) {
  return buffer.byteLength >= 4 && new DataView(buffer).getUint32(0, true) === MAGIC;
}

// The JSON of a .glb or .gltf file. Throws an Error if there is none.
export function readJson(buffer) {
  if (!isGlb(buffer)) return parseJson(new Uint8Array(buffer));
  const data = new DataView(buffer);
  if (buffer.byteLength < HEADER_BYTES + CHUNK_BYTES) throw new Error('the file is cut off');
  if (data.getUint32(4, true) !== 2) throw new Error('it is not a .glb of version 2');
  const length = data.getUint32(HEADER_BYTES, true);
  const begin = HEADER_BYTES + CHUNK_BYTES;
  if (data.getUint32(HEADER_BYTES + 4, true) !== JSON_CHUNK)
    throw new Error('its first chunk is not JSON');
  if (begin + length > buffer.byteLength) throw new Error('the file is cut off');
  return parseJson(new Uint8Array(buffer, begin, length));
}

// Makes a .glb of a .gltf file and the files that were dropped with it. `files`: name -> File.
export async function packGltf(buffer, files) {
  const json = readJson(buffer);
  const parts = [];
  let length = 0;
  const append = (blob) => {
    const begin = length;
    const padding = -blob.size & 3;
    parts.push(blob, new Uint8Array(padding));
    length += blob.size + padding;
    return begin;
  };
  const offsets = [];
  for (const { uri } of json.buffers ?? []) offsets.push(append(await resolve(uri, files)));
  for (const view of json.bufferViews ?? []) {
    if (!(view.buffer in offsets)) throw new Error(`there is no buffer ${view.buffer}`);
    view.byteOffset = (view.byteOffset ?? 0) + offsets[view.buffer];
    view.buffer = 0;
  }
  for (const image of json.images ?? []) {
    if (image.uri === undefined) continue;
    const blob = await resolve(image.uri, files);
    const view = { buffer: 0, byteOffset: append(blob), byteLength: blob.size };
    json.bufferViews ??= [];
    image.bufferView = json.bufferViews.push(view) - 1;
    image.mimeType ??= blob.type;
    delete image.uri;
  }
  if (length > 0) json.buffers = [{ byteLength: length }];
  return writeGlb(json, parts, length);
}

// The file behind a relative URI, found by its name: browsers do not tell its folder.
async function resolve(uri, files) {
  if (typeof uri !== 'string') throw new Error('one of its buffers has no file');
  if (uri.startsWith('data:')) return (await fetch(uri)).blob();
  let path = uri;
  try {
    path = decodeURIComponent(uri);
  } catch {
    // a name with a bare %
  }
  const file = files.get(path.split('/').at(-1));
  if (!file) throw new Error(`it refers to ${path.slice(0, 80)}; open both files together`);
  return file;
}

function writeGlb(json, parts, length) {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const spaces = new Uint8Array(-text.length & 3).fill(0x20);
  const textLength = text.length + spaces.length;
  const total = HEADER_BYTES + CHUNK_BYTES + textLength + (length > 0 ? CHUNK_BYTES + length : 0);
  const head = new Uint32Array([MAGIC, 2, total, textLength, JSON_CHUNK]);
  const binary = length > 0 ? [new Uint32Array([length, BIN_CHUNK]), ...parts] : [];
  return new Blob([head, text, spaces, ...binary]);
}
