/** What a stream's integers mean (specification, appendix A.3). */
export declare const Kind: Readonly<{
  GRID: 0;
  OCT: 1;
  INTEGER: 2;
  FLOAT32: 3;
  SIGN: 4;
}>;

/** The bytes break a rule of the format: `message` says which, as the native decoder does. */
export declare class MalformedError extends Error {}

export interface Stream {
  /** One of `Kind`. */
  kind: number;
  /** Integers per vertex, 1 to 4. */
  elements: number;
  /** Bits per integer, 1 to 32. */
  bits: number;
  /** GRID: value = offset[c] + integer * step. */
  step: number;
  offset: number[];
}

export interface DecodedStream extends Stream {
  /**
   * Vertex after vertex. Floats: three per vertex for OCT (a unit vector), else `elements`.
   * Unsigned integers, `elements` per vertex, for INTEGER, and for all with `integers: true`.
   */
  values: Float32Array | Uint32Array;
}

export interface DecodedPrimitive {
  triangleCount: number;
  vertexCount: number;
  meshletCount: number;
  /** Three vertex numbers per triangle. */
  indices: Uint32Array;
  /** By number; glTF's extension object says which attribute begins with which stream. */
  streams: DecodedStream[];
}

/** A part of a view that decodes alone. */
export interface Blob {
  /** A part of the view's bytes, without a copy. */
  bytes: Uint8Array;
  triangleCount: number;
  vertexCount: number;
  meshletCount: number;
  streams: Stream[];
}

export interface DecodedMeshlet {
  /** At most 64. */
  triangleCount: number;
  /** At most 64. */
  vertexCount: number;
  /** Three local vertex numbers per triangle. */
  triangles: Uint8Array;
  /** The integers of each stream, vertex after vertex. */
  values: Uint32Array[];
}

/**
 * Decodes buffer views of compressed primitives: one blob, or several back to back (pages).
 * The bytes may be anything: every method throws `MalformedError` for bytes that it cannot decode.
 */
export interface Decoder {
  /** Decodes everything. `integers`: the stored integers instead of values. */
  decodePrimitive(view: Uint8Array, options?: { integers?: boolean }): DecodedPrimitive;
  /**
   * Decodes one meshlet without the others. Meshlets are numbered through all blobs. Consecutive
   * calls with the same `view` object read its headers once: do not change its bytes between them.
   * Throws `RangeError` if there is no such meshlet.
   */
  decodeMeshlet(view: Uint8Array, meshlet: number): DecodedMeshlet;
  /** Bytes of the module's memory, which never shrinks. */
  readonly memoryBytes: number;
  /** The blobs (pages) of a view. Checks their headers and tables, not their meshlets. */
  blobs(view: Uint8Array): Blob[];
  /**
   * Throws `MalformedError` unless the view is valid in every way. Decodes each meshlet alone,
   * so it also finds errors that decoding does not meet.
   */
  validate(view: Uint8Array): void;
}

/** What loaders need: a `Decoder` or a `DecoderPool`. */
export interface PrimitiveDecoder {
  decodePrimitive(view: Uint8Array): DecodedPrimitive | Promise<DecodedPrimitive>;
}

/** The WebAssembly module, its bytes, or where to fetch it. */
export type DecoderSource =
  | BufferSource
  | WebAssembly.Module
  | Response
  | Promise<Response>
  | string
  | URL;

/**
 * Compiles the WebAssembly module and returns a decoder. Its memory grows with the largest
 * blob that it decodes, and is freed with the decoder.
 *
 * @param source default: decoder.wasm beside the module.
 */
export declare function createDecoder(source?: DecoderSource): Promise<Decoder>;
