// For three.js: a plugin that loads whole files, and an object that streams them.
export { MeshletStream, SourceError } from './stream/three.js';
export { meshletPlugin } from './three_plugin.js';
