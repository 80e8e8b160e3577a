import type { Decoder } from './decoder.js';
import type { DecoderPool } from './pool.js';

export const TRANSPORT: 'EXT_meshlet_transport';

/** A page of a packed view: its bytes there, its resident size, and whether it is stored as it is. */
export interface PackedPage {
  bytes: Uint8Array;
  size: number;
  raw: boolean;
}

/** Reads the page table of a packed view. Throws MalformedError. */
export function packedPages(view: Uint8Array): PackedPage[];

/** unpacker.wasm; `source`: as createDecoder takes that of decoder.wasm. */
export function compileUnpacker(
  source?: WebAssembly.Module | BufferSource | Response | string | URL | Promise<Response>,
): Promise<WebAssembly.Module>;

export interface Unpacker {
  /** Of its WebAssembly. */
  readonly memoryBytes: number;
  /**
   * The resident bytes of a packed view. `byteLength`: what the extension object says. Throws
   * MalformedError.
   */
  unpack(view: Uint8Array, byteLength: number): Uint8Array;
}

/** `source`: of unpacker.wasm, as createDecoder takes that of decoder.wasm. */
export function createUnpacker(
  source?: WebAssembly.Module | BufferSource | Response | string | URL | Promise<Response>,
): Promise<Unpacker>;

/**
 * A function that unpacks one page of `packedPages` to its resident bytes; it rejects with
 * MalformedError. With `pool`, its Workers do it. `source`: of unpacker.wasm.
 */
export function createPageUnpacker(
  pool?: DecoderPool | null,
  source?: WebAssembly.Module | BufferSource | Response | string | URL | Promise<Response>,
): Promise<(page: PackedPage, signal?: AbortSignal) => Promise<Uint8Array>>;

/**
 * `load`, or a function that also unpacks what it loads; in Workers, page by page, if `decoder` is
 * a pool.
 */
export function unpacking(
  json: object,
  load: (bufferView: number) => Promise<Uint8Array>,
  decoder?: Decoder | DecoderPool | Promise<Decoder | DecoderPool>,
): (bufferView: number) => Promise<Uint8Array>;
