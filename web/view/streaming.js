// Models with levels of detail: what stage.js draws, from the library's MeshletStream.
import { openDocument } from '../stream/io/document.js';
import { LOD } from '../stream/io/tables.js';
import { MeshletStream } from '../stream/three.js';
import { paintPlain } from './materials.js';
import { Box3 } from './vendor.js';

// {levels, blob} of the file at a place, a URL or a Blob: whether it has levels, and the whole file
// if the server has sent it; else null. fetch: for openStream, which gets the same answers. Errors
// are for those who open it.
export async function look(place, signal) {
  const { remember, replay } = answers();
  try {
    const { json, blob } = await openDocument(place, { signal, fetch: remember });
    return { levels: json.extensionsUsed?.includes(LOD) ?? false, blob, fetch: replay };
  } catch {
    return { levels: false, blob: null };
  }
}

// Two functions like fetch: the second gives the answers of the first again, once each.
function answers() {
  const known = new Map();
  const keyOf = (url, { headers }) => `${url} ${headers?.Range}`;
  const remember = async (url, init) => {
    const response = await fetch(url, init);
    // Of a whole file there is a Blob instead.
    if (response.status === 206) known.set(keyOf(url, init), response.clone());
    return response;
  };
  const replay = async (url, init) => {
    const key = keyOf(url, init);
    const response = known.get(key);
    known.delete(key);
    return response ?? fetch(url, init);
  };
  return { remember, replay };
}

// Opens a model like `load` of loading.js. options: those of MeshletStream; onChange, called when
// the picture may change.
export async function openStream(place, { onChange, ...options }) {
  const start = performance.now();
  /** @type {any} */
  const stream = new MeshletStream(place, options);
  const warnings = [];
  stream.addEventListener('warning', ({ message }) => warnings.push(message));
  stream.addEventListener('progress', onChange);
  await stream.ready;
  return new Streamed(stream, warnings, performance.now() - start);
}

class Streamed {
  constructor(stream, warnings, build) {
    this.stream = stream;
    paintPlain(stream);
    this.root = stream;
    this.clips = stream.animations;
    this.warnings = warnings;
    this.times = { decode: 0, build };
    this.box = new Box3().setFromObject(stream);
    this.counts = { triangles: stream.statistics.fullTriangles };
  }

  // colour: of MeshletStream.
  colourMeshlets(on, colour) {
    this.stream.colour = on ? colour : 'none';
  }

  // Before a frame.
  update(camera, renderer) {
    this.stream.update(camera, renderer);
  }

  dispose() {
    this.stream.dispose();
  }
}
