import type { AnimationClip, Camera, Group, Object3DEventMap } from 'three';
import type { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import type { Colour, Statistics, StreamOptions } from './streamer.js';

export { SourceError } from './streamer.js';

export interface MeshletStreamOptions extends StreamOptions {
  /** Allowed error on the screen, in pixels; default 1. */
  pixels?: number;
  /** Makes materials and textures: pass one that has your KTX2 loader or manager. */
  loader?: GLTFLoader;
  /** Ends the stream, as `dispose`. */
  signal?: AbortSignal;
}

export interface MeshletStreamEventMap extends Object3DEventMap {
  /** The scene is there; again after the file has changed. */
  load: object;
  /** Data has arrived: call `update`, and draw if it says so. */
  progress: object;
  /** Something went wrong that the stream goes on without. */
  warning: { message: string };
  /** The stream has ended. `ready` rejects with the same error, if it still waits. */
  error: { message: string; error: Error };
}

export interface MeshletStreamStatistics extends Statistics {
  /** Estimated; not in `bytes`. */
  textureBytes: number;
  /** Geometry without levels, which is loaded whole; not in `bytes`. */
  otherBytes: number;
}

/**
 * A glTF file that loads the detail that a camera needs, in a fixed amount of memory.
 *
 * ```
 * const stream = new MeshletStream('model.glb', { maxBytes: 64e6 });
 * scene.add(stream);
 * await stream.ready;
 * renderer.setAnimationLoop(() => {
 *   stream.update(camera, renderer);
 *   renderer.render(scene, camera);
 * });
 * ```
 */
export declare class MeshletStream extends Group<MeshletStreamEventMap> {
  /** @param place a URL, or the bytes of a .glb. */
  constructor(place: string | URL | Blob, options?: MeshletStreamOptions);
  /**
   * Resolves when the coarsest level is there. Rejects if the file cannot be streamed. After a
   * restart or `retry` it is another promise.
   */
  readonly ready: Promise<void>;
  /** As the option. Throws a RangeError unless it is set to a number of at least 0. */
  get pixels(): number;
  set pixels(pixels: number);
  /**
   * As the option; what does not fit any more goes with the next frame. Throws a RangeError unless it is
   * set to a number of at least 1,000,000, and a SourceError if the coarsest level does not fit.
   */
  get maxBytes(): number;
  set maxBytes(maxBytes: number);
  /** Keeps the cut while the camera moves. */
  frozen: boolean;
  /** Shows colours instead of materials. */
  colour: Colour;
  animations: AnimationClip[];
  /** Without a scene, before `ready`: zeros, and not `complete`. */
  readonly statistics: MeshletStreamStatistics;
  /**
   * Chooses what is drawn. Call it before each frame, when all matrices but the stream's own are
   * up to date.
   *
   * @param renderer its viewport says how high the picture is; or this height in pixels. Buffers of a
   * WebGLRenderer hold what was decoded; for all others it also stays in arrays.
   * @returns whether the picture changes.
   */
  update(
    camera: Camera,
    renderer: number | { getViewport: (target: never) => { w: number }; getPixelRatio(): number },
  ): boolean;
  /**
   * Requests again what was given up, such as pages that the server had refused: after a signature
   * was renewed, or when the browser is online again. A stream that has ended with an error opens
   * the file again.
   */
  retry(): void;
  /** Throws: make another stream of the same file. */
  clone(): never;
  /** Frees everything, materials and textures included. At any time, also before `ready`. */
  dispose(): void;
}
