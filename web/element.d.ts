import type { MeshletStream } from './stream/three.js';

/**
 * `<meshlet-view src="model.glb" alt="A scan">`: a glTF file in a web page, drawn by three.js; files
 * with levels of detail stream. It opens its file when it comes into view.
 *
 * Attributes: `src`; `alt`, a text for those who do not see it; `pixels` and `max-bytes`, as the options
 * of `MeshletStream`; `turntable`: it turns. Events: `load`, and `error`, a `CustomEvent` whose `detail`
 * is the `Error`.
 */
export declare class MeshletView extends HTMLElement {
  /** null unless the file is open. */
  stream: MeshletStream | null;
}
