import type { DecodedPrimitive, DecoderSource } from './decoder.js';

/** Decodes in Workers. Methods reject as those of `Decoder` throw. */
export interface DecoderPool {
  /**
   * Decodes everything, the blobs (pages) of a view in parallel. A view of one blob takes one Worker.
   *
   * @param options.integers the stored integers instead of values.
   * @param options.signal rejects with its reason when it is aborted; blobs that a Worker has begun
   * run to their end.
   * @param options.onProgress called with the decoded share of the triangles, up to 1.
   */
  decodePrimitive(
    view: Uint8Array,
    options?: { integers?: boolean; signal?: AbortSignal; onProgress?: (share: number) => void },
  ): Promise<DecodedPrimitive>;
  /** Rejects with `MalformedError` unless the view is valid in every way. */
  validate(view: Uint8Array, options?: { signal?: AbortSignal }): Promise<void>;
  /** Ends the Workers; calls that wait, and later ones, reject. */
  close(): void;
}

export interface PoolOptions {
  /** Number of Workers; default: one for each processor, at most 8. */
  workers?: number;
  /** The WebAssembly module, as for `createDecoder`. */
  source?: DecoderSource;
  /** Starts a Worker that runs `gltf-meshlet/worker`, for bundlers that do not find it. */
  createWorker?: () => Worker | Promise<Worker>;
}

/**
 * Compiles the WebAssembly module once and starts the Workers. Rejects if the module cannot be
 * loaded. A Worker that fails before any has answered makes all calls reject. Later, a Worker that dies
 * of a call makes that one reject, and another takes its place.
 */
export declare function createDecoderPool(options?: PoolOptions): Promise<DecoderPool>;
