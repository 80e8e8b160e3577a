import type { ReaderContext, WriterContext } from '@gltf-transform/core';
import { Extension } from '@gltf-transform/core';

/** The key of the decoder: `io.registerDependencies({ [DECODER]: await createDecoder() })`. */
export declare const DECODER: 'meshlet.decoder';

/**
 * EXT_meshlet_edgebreaker for glTF-Transform: `io.registerExtensions([EXTMeshletEdgebreaker])`.
 *
 * Reading decodes; throws if `DECODER` is not registered, or for bytes that are malformed. Writing
 * keeps the compressed bytes of primitives that still have exactly the decoded values and share no
 * accessor with others; all other primitives are written uncompressed.
 */
export declare class EXTMeshletEdgebreaker extends Extension {
  static readonly EXTENSION_NAME: 'EXT_meshlet_edgebreaker';
  readonly extensionName: 'EXT_meshlet_edgebreaker';
  read(context: ReaderContext): this;
  write(context: WriterContext): this;
}

/** The key of the unpacker: `io.registerDependencies({ [UNPACKER]: await createUnpacker() })`. */
export declare const UNPACKER: 'meshlet.unpacker';

/** EXT_meshlet_transport for glTF-Transform: reading unpacks, writing leaves out. */
export declare class EXTMeshletTransport extends Extension {
  static readonly EXTENSION_NAME: 'EXT_meshlet_transport';
  readonly extensionName: 'EXT_meshlet_transport';
  read(context: ReaderContext): this;
  write(context: WriterContext): this;
}
