import type { AnimationGroup } from '@babylonjs/core/Animations/animationGroup.js';
import type { Camera } from '@babylonjs/core/Cameras/camera.js';
import { TransformNode } from '@babylonjs/core/Meshes/transformNode.js';
import type { Observable } from '@babylonjs/core/Misc/observable.js';
import type { Scene } from '@babylonjs/core/scene.js';
import type { Statistics, StreamOptions } from './streamer.js';

export { SourceError } from './streamer.js';

export interface MeshletStreamOptions extends StreamOptions {
  /** Allowed error on the screen, in pixels; default 1. */
  pixels?: number;
  /** Ends the stream, as `dispose`. */
  signal?: AbortSignal;
}

/**
 * A glTF file that loads the detail that a camera needs, in a fixed amount of memory.
 *
 * ```
 * const stream = new MeshletStream('model.glb', scene, { maxBytes: 64e6 });
 * await stream.ready;
 * scene.onBeforeRenderObservable.add(() => stream.update(scene.activeCamera));
 * ```
 */
export declare class MeshletStream extends TransformNode {
  /** @param place a URL, or the bytes of a .glb. */
  constructor(place: string | URL | Blob, scene: Scene, options?: MeshletStreamOptions);
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
  animationGroups: AnimationGroup[];
  /** The scene is there; again after the file has changed. */
  readonly onLoadObservable: Observable<undefined>;
  /** Data has arrived: call `update`, and draw if it says so. */
  readonly onProgressObservable: Observable<undefined>;
  /** Something went wrong that the stream goes on without. */
  readonly onWarningObservable: Observable<string>;
  /** The stream has ended. `ready` rejects with the same error, if it still waits. */
  readonly onErrorObservable: Observable<Error>;
  /** Without a scene, before `ready`: zeros, and not `complete`. */
  readonly statistics: Statistics;
  /** Chooses what is drawn. Call it before each frame. Returns whether the picture changes. */
  update(camera: Camera): boolean;
  /**
   * Requests again what was given up, such as pages that the server had refused: after a signature
   * was renewed, or when the browser is online again. A stream that has ended with an error opens
   * the file again.
   */
  retry(): void;
  /** Throws: make another stream of the same file. */
  clone(): never;
}
