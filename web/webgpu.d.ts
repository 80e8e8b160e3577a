import type { Decoder, Stream } from './decoder.js';

export interface GPUOptions {
  /** Checks the blob's header and tables. Default: a new decoder; share one between calls. */
  decoder?: Decoder | Promise<Decoder>;
  /** Numbers of the streams to decode. Default: all. */
  streams?: number[];
  /** Fills the streams' buffers with the stored integers instead of values. */
  integers?: boolean;
  /** More `GPUBufferUsage` flags for the buffers, besides what drawing, shaders and copies need. */
  usage?: number;
  /** Most bytes of the temporary buffer of decoded integers. Default: 32 MiB. */
  scratchBytes?: number;
  /**
   * How the vertices inside a meshlet are decoded. `interior`: by a workgroup; blobs of up to 8
   * streams of 20 elements together. `traversal`: by one invocation per stream; any blob. Default:
   * the faster one, `interior` for fewer than 4,000 meshlets.
   */
  method?: 'interior' | 'traversal';
  /** Names the buffers in the messages of WebGPU. */
  label?: string;
}

export interface GPUStream extends Stream {
  /** Its number in the blob. */
  stream: number;
  /** Numbers per vertex: three for OCT (a unit vector), else `elements`. */
  width: number;
  /** Of the numbers of a vertex, without padding between vertices. */
  format: GPUVertexFormat;
  /** `vertexCount` vertices. VERTEX | STORAGE | COPY_SRC. */
  buffer: GPUBuffer;
}

/** A blob in GPU memory. */
export interface GPUPrimitive {
  triangleCount: number;
  meshletCount: number;
  /**
   * 64 per meshlet: vertex v of meshlet m is vertex 64 m + v. Vertices on borders between meshlets
   * are stored in each of them; those that a meshlet lacks are 0.
   */
  vertexCount: number;
  /** Three uint32 per triangle. INDEX | STORAGE | COPY_SRC. */
  indices: GPUBuffer;
  /** Arguments of drawIndexedIndirect for all triangles. INDIRECT | STORAGE | COPY_SRC. */
  indirect: GPUBuffer;
  /** In the order of `options.streams`. */
  streams: GPUStream[];
  /** GPU memory that it takes. */
  byteLength: number;
  /**
   * Waits for the GPU and reads 8 bytes. Rejects with `MalformedError` if a meshlet is malformed;
   * the buffers then draw all others. Keep the blob's bytes unchanged until then.
   */
  check(): Promise<void>;
  /** Destroys all buffers. */
  destroy(): void;
}

/**
 * Decodes one blob (page) on the GPU. The work is submitted when the promise resolves: commands
 * that are submitted to the device's queue after it find the buffers filled. Nothing is read back.
 * Needs no features, and no more than WebGPU's default limits.
 *
 * GRID, OCT and SIGN streams become floats that may differ from the native decoder's by one unit in
 * the last place; integers are the same.
 *
 * Rejects with `MalformedError` if header or tables are malformed, with `RangeError` if the view
 * has more than one blob, `method` does not take it, or its buffers would be larger than the device
 * allows, and with `Error` if GPU memory is short.
 */
export declare function decodeToGPU(
  device: GPUDevice,
  blob: Uint8Array,
  options?: GPUOptions,
): Promise<GPUPrimitive>;
