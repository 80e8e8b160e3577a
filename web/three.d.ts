import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import type { PrimitiveDecoder } from './decoder.js';

export * from './stream/three.js';

/**
 * For `GLTFLoader.register`: loads files with EXT_meshlet_edgebreaker.
 *
 * @param decoder a decoder, a pool of Workers, or a promise of one, to share it between files.
 * Default: a new decoder for each file that needs one.
 * @param options.quantized normals and tangents, and texture coordinates and colours whose `min` and
 * `max` the file tells to lie in 0 to 1, become normalised integers of 16 bits; default: floats, as in
 * the file.
 */
export declare function meshletPlugin(
  decoder?: PrimitiveDecoder | Promise<PrimitiveDecoder>,
  options?: { quantized?: boolean },
): (parser: GLTFParser) => GLTFLoaderPlugin;
