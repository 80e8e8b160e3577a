// MeshletStream of Babylon.js, as web pages import it.
export { MeshletStream } from './engine/babylon.js';
export { SourceError } from './io/source.js';
