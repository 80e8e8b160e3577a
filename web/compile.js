// Compiles the WebAssembly modules, wherever they come from.

const LOAD_MS = 60_000; // for a module of 50 kB

// Bundlers look for this expression, and put the place of their copy there.
export const decoderUrl = () => new URL('./decoder.wasm', import.meta.url);

// The compiled decoder; source: as createDecoder's. A Response can be used again, as
// by a stream that starts again.
export async function compileDecoder(/** @type {any} */ given = decoderUrl()) {
  const source = await given;
  if (source instanceof WebAssembly.Module) return source;
  if (typeof source === 'string' || source instanceof URL)
    return compileDecoder(await load(String(source)));
  if (typeof Response !== 'undefined' && source instanceof Response) {
    if (!source.ok) throw new Error(`${source.url}: the server answered ${source.status}`);
    return WebAssembly.compile(await source.clone().arrayBuffer());
  }
  return WebAssembly.compile(source);
}

async function load(url) {
  if (url.startsWith('file:')) {
    const node = 'node:fs/promises'; // Node fetches no files; in a variable, for bundlers
    const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ node);
    return readFile(new URL(url));
  }
  const signal = AbortSignal.timeout(LOAD_MS);
  try {
    const response = await fetch(url, { signal });
    return response.ok ? await response.arrayBuffer() : response;
  } catch (error) {
    throw signal.aborted ? new Error(`${url}: no answer in ${LOAD_MS / 1000} seconds`) : error;
  }
}
