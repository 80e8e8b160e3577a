// Streams without an engine, as web pages import them.
export { MalformedError } from '../blob.js';
export { openStreamer } from './core/streamer.js';
export { SourceError } from './io/source.js';
