// Uses every declaration of the package; compiled by tsc --noEmit. Lines marked "refused" must not
// compile without the comment before them.

import { registerGLTFExtension } from '@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js';
import { NodeIO } from '@gltf-transform/core';
import type { DecodedMeshlet, DecodedPrimitive, Decoder, PrimitiveDecoder } from 'gltf-meshlet';
import { createDecoder, Kind, MalformedError } from 'gltf-meshlet';
import { registerMeshletExtension } from 'gltf-meshlet/babylon';
import { DECODER, EXTMeshletEdgebreaker } from 'gltf-meshlet/gltf-transform';
import type { DecoderPool } from 'gltf-meshlet/pool';
import { createDecoderPool } from 'gltf-meshlet/pool';
import { meshletPlugin } from 'gltf-meshlet/three';
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

// @ts-expect-error refused: no such option
createDecoderPool({ threads: 2 });
// @ts-expect-error refused: a pool answers with promises
const indices: Uint32Array = pool.decodePrimitive(view).indices;
// @ts-expect-error refused: not a decoder
meshletPlugin({ decode: () => indices });
