import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import type { PrimitiveDecoder } from './decoder.js';

export * from './stream/three.js';

/**
 * For `GLTFLoader.register`: loads files with EXT_meshlet_edgebreaker.
 *
 * @param decoder a decoder, a pool of Workers, or a promise of one, to share it between files.
 * Default: a new decoder for each file that needs one.
 */
export declare function meshletPlugin(
  decoder?: PrimitiveDecoder | Promise<PrimitiveDecoder>,
): (parser: GLTFParser) => GLTFLoaderPlugin;
