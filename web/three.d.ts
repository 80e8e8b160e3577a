import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import type { Decoder } from './decoder.js';

/**
 * For `GLTFLoader.register`: loads files with EXT_meshlet_edgebreaker.
 *
 * @param decoder default: a new decoder for each file that needs one. Give one, or its promise, to
 * share it between files.
 */
export declare function meshletPlugin(
  decoder?: Decoder | Promise<Decoder>,
): (parser: GLTFParser) => GLTFLoaderPlugin;
