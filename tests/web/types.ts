// Uses every declaration of the package; compiled by tsc --noEmit. Lines marked "refused" must not
// compile without the comment before them.

import type { Scene } from '@babylonjs/core/scene.js';
import { registerGLTFExtension } from '@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js';
import { NodeIO } from '@gltf-transform/core';
import type { DecodedMeshlet, DecodedPrimitive, Decoder, PrimitiveDecoder } from 'gltf-meshlet';
import { createDecoder, Kind, MalformedError } from 'gltf-meshlet';
import { registerMeshletExtension } from 'gltf-meshlet/babylon';
import { DECODER, EXTMeshletEdgebreaker } from 'gltf-meshlet/gltf-transform';
import type { DecoderPool } from 'gltf-meshlet/pool';
import { createDecoderPool } from 'gltf-meshlet/pool';
import { MeshletStream as BabylonStream } from 'gltf-meshlet/stream/babylon';
import type { Streamer } from 'gltf-meshlet/stream/core';
import { openStreamer } from 'gltf-meshlet/stream/core';
import { MeshletStream, meshletPlugin } from 'gltf-meshlet/three';
import { PerspectiveCamera, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const view = new Uint8Array(0);
const decoder: Decoder = await createDecoder(fetch('decoder.wasm'));
const primitive: DecodedPrimitive = decoder.decodePrimitive(view, { integers: true });
const numbers: number[] = primitive.streams.map((stream) => stream.values[0] + Kind.OCT);
const meshlet: DecodedMeshlet = decoder.decodeMeshlet(view, numbers.length);
decoder.validate(meshlet.triangles);

const pool: DecoderPool = await createDecoderPool({ workers: 2 });
const { signal } = new AbortController();
const again: DecodedPrimitive = await pool.decodePrimitive(view, {
  signal,
  onProgress: (share) => console.log(share.toFixed(1), again.triangleCount),
});
await pool.validate(view).catch((error) => error instanceof MalformedError);
pool.close();

const either: PrimitiveDecoder[] = [decoder, pool];
new GLTFLoader().register(meshletPlugin(either[0])).register(meshletPlugin());
registerMeshletExtension(registerGLTFExtension, createDecoderPool());
new NodeIO().registerExtensions([EXTMeshletEdgebreaker]).registerDependencies({ [DECODER]: pool });

const stream = new MeshletStream('model.glb', { maxBytes: 8e6, pixels: 2, signal });
stream.addEventListener('warning', ({ message }) => console.log(message.length));
await stream.ready;
stream.colour = stream.update(new PerspectiveCamera(), new WebGLRenderer()) ? 'level' : 'none';
console.log(stream.statistics.bytes.total + stream.statistics.textureBytes);
const signed: typeof fetch = (url, init) => fetch(`${url}?signature=1`, init);
new MeshletStream('model.glb', { fetch: signed, maxWholeBytes: 1e8 }).retry();
stream.dispose();
declare const scene: Scene;
const babylon = new BabylonStream('model.glb', scene, { maxBytes: 8e6, pixels: 2, signal });
babylon.onErrorObservable.add(({ message }) => console.log(message.length));
console.log(scene.activeCamera && babylon.update(scene.activeCamera), babylon.statistics.error);
babylon.position.x = 1;
babylon.retry();
const core: Streamer = await openStreamer(new Blob([]), { onWarning: console.log });
const { starts } = core.addInstance(core.primitives[0]);
core.retry();
core.update({ eye: null, pixelsPerUnit: 1, near: starts[0], planes: null }, 1);

// @ts-expect-error refused: no such colour
stream.colour = 'red';
// @ts-expect-error refused: not a number
stream.pixels = '1';
// @ts-expect-error refused: a stream of Babylon.js needs a scene
new BabylonStream('model.glb');
// @ts-expect-error refused: no such option
createDecoderPool({ threads: 2 });
// @ts-expect-error refused: a pool answers with promises
const indices: Uint32Array = pool.decodePrimitive(view).indices;
// @ts-expect-error refused: not a decoder
meshletPlugin({ decode: () => indices });
