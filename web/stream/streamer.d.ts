import type { DecoderSource } from '../decoder.js';

export { MalformedError } from '../decoder.js';

/** A file cannot be read, or does not fit into `maxBytes`. */
export declare class SourceError extends Error {
  /** It may work later. */
  retry: boolean;
  /** It is another file than before. */
  changed: boolean;
  /** There was no answer. */
  unreachable: boolean;
  /** Milliseconds to wait until then, if the server says so. */
  retryAfter: number;
}

/** What the tags of ranges name: `'page'`, for example, gives each range the number of its page. */
export type Colour = 'none' | 'page' | 'level' | 'meshlet';

export interface StreamOptions {
  /**
   * Bytes for everything but textures and primitives without levels: buffers on the GPU, arrays,
   * the memory of Workers. At least 1,000,000; default 64,000,000. What does not fit is shown with
   * a larger error.
   */
  maxBytes?: number;
  /** For fetch: headers, credentials. Not for .bin files on another server than the file's. */
  requestInit?: RequestInit;
  /**
   * Fetches in place of the global function: each request of the file and of its .bin files goes
   * through it, with a header `Range` but for whole files. To sign URLs, or to renew what has expired.
   * `init.signal` ends a request: pass it on.
   */
  fetch?: (url: string, init: RequestInit) => Promise<Response>;
  /**
   * Bytes of a file that is loaded whole, where the server gives no ranges, at most; default
   * 1,000,000,000.
   */
  maxWholeBytes?: number;
  /** Milliseconds without a byte until a request is given up; default 20,000. */
  stallMs?: number;
  /** The WebAssembly module, as for `createDecoder`. */
  source?: DecoderSource;
  /** As `source`, of the unpacker: for files with `EXT_meshlet_transport`. */
  unpacker?: DecoderSource;
  /**
   * Starts a Worker that runs `gltf-meshlet/stream/worker`, for bundlers that do not find it. Streams
   * with the same function share Workers.
   */
  createWorker?: () => Worker | Promise<Worker>;
}

export interface CoreOptions extends StreamOptions {
  signal?: AbortSignal;
  onWarning?: (message: string) => void;
  /** Data has arrived: call `update`. */
  onChange?: () => void;
  /** The stream cannot go on: the file has changed, its levels are malformed, or Workers do not start. */
  onBroken?: (error: Error) => void;
  /** Keys of primitives that are not streamed. */
  exclude?: string[];
}

export interface Statistics {
  /** Bytes of all answers. */
  fetched: number;
  requests: number;
  /** Requests for pages and decodings under way. */
  waiting: number;
  pages: number;
  resident: number;
  /** Pages that the view needs and that are not there. */
  missing: number;
  triangles: number;
  /** Of level 0, each primitive once. */
  fullTriangles: number;
  /** Draw calls. */
  ranges: number;
  /** The error in pixels that fits into the memory: at least the allowed one. */
  threshold: number;
  /** The largest error in pixels of what is drawn; larger than the threshold while pages arrive. */
  error: number;
  /** Nothing is missing, also of the tables. */
  complete: boolean;
  bytes: {
    gpu: number;
    arrays: number;
    wasm: number;
    compressed: number;
    /** Requested, or being decoded. */
    transit: number;
    /** Arrays for all groups, also for those that were not read. */
    tables: number;
    total: number;
  };
}

/** A camera, in the coordinates to which the instances' matrices lead. */
export interface View {
  /** null: orthographic. */
  eye: number[] | null;
  /** Pixels of one unit at distance one; orthographic: at any distance. */
  pixelsPerUnit: number;
  near: number;
  /** Four numbers for each plane of the view; positive inside. null: everything is in view. */
  planes: number[] | null;
}

export interface Instance {
  /**
   * Puts it where a matrix says, column by column, from POSITION; null hides it, as it is at first.
   * Call it when that changes.
   */
  place(matrix: ArrayLike<number> | null): void;
  /** Of the ranges of indices to draw. */
  starts: number[];
  counts: number[];
  tags: number[];
  /** Changes with them. */
  version: number;
}

export interface Format {
  /** Of the glTF attribute. */
  name: string;
  size: number;
  normalized: boolean;
  /** Of positions: value = offset + scale * stored. */
  scale?: number;
  offset?: number[];
}

export interface Pool {
  formats: Format[];
  /** One for each format; none if the pages lie in a `Store`, and no index then. */
  arrays: (Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Float32Array)[];
  index: Uint32Array | null;
  /** Set it: called with an array and the elements [begin, end) that were written. */
  written: (array: ArrayBufferView, begin: number, end: number) => void;
  /**
   * Set it: called when arrays and index are new ones, as when they grow. They hold what the earlier
   * ones held; `written` tells what comes next.
   */
  resized: () => void;
}

/**
 * Memory of an engine for the pages of a pool. Numbers are those of its formats; the last one, after
 * them, is the index. Lengths, `begin` and `end` count elements of the arrays' types.
 */
export interface Store {
  /** Of all buffers; they keep what they held. Called before anything is written. */
  resize(lengths: number[]): void;
  write(number: number, begin: number, part: ArrayBufferView): void;
  read(number: number, begin: number, end: number): ArrayBufferView;
  /** Nothing of it is needed any more. */
  release(): void;
}

export interface StreamedPrimitive {
  key: string;
  name: string;
  pool: Pool;
  formats: Format[];
}

/** Streams for any engine: an adapter gives matrices and a camera, and draws ranges of arrays. */
export interface Streamer {
  readonly json: Record<string, unknown>;
  readonly primitives: StreamedPrimitive[];
  readonly refused: { name: string; key: string; error: Error }[];
  readonly pools: Pool[];
  readonly ready: boolean;
  readonly complete: boolean;
  readonly statistics: Statistics;
  colour: Colour;
  /** As the option; what does not fit any more goes with the next `update`. */
  get maxBytes(): number;
  set maxBytes(maxBytes: number);
  /**
   * Moves decoded pages to buffers of an engine, so that no copy of them stays in arrays; null: to
   * arrays. `wasLost`: what held them is lost, as with a context of WebGL; they are decoded again.
   */
  moveTo(storeOf: ((pool: Pool) => Store) | null, wasLost?: boolean): Promise<void>;
  addInstance(primitive: StreamedPrimitive): Instance;
  /** The bytes of a buffer view. */
  readView(number: number): Promise<Uint8Array>;
  /** null: the view before. Returns whether the ranges of an instance have changed. */
  update(view: View | null, pixels: number): boolean;
  /** Requests again what was given up, such as pages that the server had refused. */
  retry(): void;
  close(): void;
}

/** Opens a .glb or .gltf. Throws SourceError or MalformedError. */
export declare function openStreamer(
  place: string | URL | Blob,
  options?: CoreOptions,
): Promise<Streamer>;
