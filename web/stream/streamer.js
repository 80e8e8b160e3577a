// Streams without an engine, as web pages import them.
export { openStreamer } from './core/streamer.js';
