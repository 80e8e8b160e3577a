// MeshletStream of three.js, as web pages import it.
export { MeshletStream } from './engine/three.js';
export { SourceError } from './io/source.js';
