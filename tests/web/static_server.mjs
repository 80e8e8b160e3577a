// A server of this repository's pages and a test's files on 127.0.0.1, for pages in browsers.
import { closeSync, createReadStream, existsSync, openSync, readSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import path from 'node:path';

const TYPES = {
  '.html': 'text/html',
  '.css': 'text/css',
  '.js': 'text/javascript',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};

// For whatever a page waits for: software rendering on a busy machine compiles shaders for minutes,
// and Babylon.js unbundled is thousands of requests.
export const TIMEOUT = 600_000; // milliseconds

// Whether a file is stored compressed.
function isGzip(file) {
  const first = Buffer.alloc(2);
  const opened = openSync(file);
  readSync(opened, first);
  closeSync(opened);
  return first.readUInt16BE() === 0x1f8b;
}

// Answers ranges, also to pages of other origins. Serves web/, examples/, tests/web/ (as tests/), the npm modules and a folder (as
// files/) of ROOT.
export async function serve(root, modules, folder) {
  const roots = {
    node_modules: modules,
    files: folder,
    web: path.join(root, 'web'),
    examples: path.join(root, 'examples'),
    tests: path.join(root, 'tests', 'web'),
  };
  const server = createServer((request, response) => {
    const [first, ...rest] = new URL(request.url, 'http://host').pathname.slice(1).split('/');
    const file = path.join(roots[first] ?? '/missing', ...rest);
    if (!existsSync(file)) return response.writeHead(404).end();
    response.setHeader('access-control-allow-origin', '*');
    response.setHeader('access-control-expose-headers', 'content-range, etag');
    if (isGzip(file)) response.setHeader('content-encoding', 'gzip');
    response.setHeader('content-type', TYPES[path.extname(file)] ?? 'application/octet-stream');
    // Babylon.js unbundled is thousands of files, which only the first page loads.
    if (first === 'node_modules') response.setHeader('cache-control', 'max-age=3600');
    const [, from, to] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '') ?? [];
    if (from === undefined) return createReadStream(file).pipe(response);
    const { size } = statSync(file);
    const [start, end] = [Number(from), Math.min(Number(to), size - 1)];
    response.setHeader('content-range', `bytes ${start}-${end}/${size}`);
    response.writeHead(206);
    createReadStream(file, { start, end }).pipe(response);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}
