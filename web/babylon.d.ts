import type { registerGLTFExtension } from '@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js';
import type { PrimitiveDecoder } from './decoder.js';

/**
 * Lets Babylon.js load files with EXT_meshlet_edgebreaker. Call it once, before loading.
 *
 * @param register Babylon's `registerGLTFExtension`.
 * @param decoder a decoder, a pool of Workers, or a promise of one, for all files. Default: a new
 * decoder for each file that needs one.
 */
export declare function registerMeshletExtension(
  register: typeof registerGLTFExtension,
  decoder?: PrimitiveDecoder | Promise<PrimitiveDecoder>,
): void;
