// A server of one file on 127.0.0.1 that answers ranges, with the faults of real servers.
import { createServer } from 'node:http';
import { gzipSync } from 'node:zlib';

// bytes: of the file. answer(request, response, next): may handle a request itself; next() gives
// the ordinary answer. Returns {url, log, close, bytes}; `bytes` and `answer` may be replaced. log:
// the ranges that were asked for.
export async function serveFile(bytes, { answer, rate = 0 } = {}) {
  const served = { bytes, answer, log: [], etag: '"1"' };
  const send = async (response, status, headers, body) => {
    response.writeHead(status, { 'content-length': body.length, ...headers });
    if (!rate) return response.end(body);
    const step = 16384;
    for (let at = 0; at < body.length && !response.destroyed; at += step) {
      response.write(body.subarray(at, at + step));
      await new Promise((resolve) => setTimeout(resolve, (1000 * step) / rate));
    }
    response.end();
  };
  const ordinary = (request, response) => {
    const common = {
      'accept-ranges': 'bytes',
      etag: served.etag,
      'access-control-allow-origin': '*',
    };
    const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '') ?? [];
    if (first === undefined) return send(response, 200, common, served.bytes);
    const total = served.bytes.length;
    const begin = Number(first);
    if (begin >= total)
      return send(response, 416, { 'content-range': `bytes */${total}` }, Buffer.alloc(0));
    const end = Math.min(Number(last) + 1, total);
    const range = { ...common, 'content-range': `bytes ${begin}-${end - 1}/${total}` };
    return send(response, 206, range, served.bytes.subarray(begin, end));
  };
  const server = createServer((request, response) => {
    served.log.push(request.headers.range);
    const next = () => ordinary(request, response);
    if (served.answer) served.answer(request, response, next, served);
    else next();
  });
  server.keepAliveTimeout = 0; // a slow machine sends its next request when it can
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  served.url = `http://127.0.0.1:${server.address().port}/model.glb`;
  served.close = () => {
    server.closeAllConnections();
    server.close();
  };
  return served;
}

// The faults: name -> answer, which misbehaves for requests after the first `after` ones.
const later = (after, misbehave) => (request, response, next, served) =>
  served.log.length > after ? misbehave(request, response, next, served) : next();

export const faults = {
  none: undefined,
  'ignores ranges': (request, _response, next) => {
    delete request.headers.range;
    next();
  },
  'ignores later ranges': later(2, (request, _response, next) => {
    delete request.headers.range;
    next();
  }),
  'compresses ranges': (request, response, next, { bytes }) => {
    if (!request.headers.range) return next();
    const packed = gzipSync(bytes).subarray(0, 65536);
    response.writeHead(206, {
      'content-encoding': 'gzip',
      'content-range': `bytes 0-${packed.length - 1}/${bytes.length}`,
    });
    response.end(packed);
  },
  'other range': later(1, (_request, response, next, served) => {
    if (served.log.length % 2) return next();
    response.writeHead(206, { 'content-range': `bytes 4-1003/${served.bytes.length}` });
    response.end(served.bytes.subarray(4, 1004));
  }),
  'too short': later(1, (request, response, next, served) => {
    if (served.log.length % 2) return next();
    const [, first, last] = /=(\d+)-(\d+)/.exec(request.headers.range);
    response.writeHead(206, { 'content-range': `bytes ${first}-${last}/${served.bytes.length}` });
    response.end(served.bytes.subarray(Number(first), Number(last) - 10));
  }),
  'too long': later(1, (request, response, next, served) => {
    if (served.log.length % 2) return next();
    const [, first, last] = /=(\d+)-(\d+)/.exec(request.headers.range);
    response.writeHead(206, { 'content-range': `bytes ${first}-${last}/${served.bytes.length}` });
    response.end(Buffer.alloc(Number(last) - Number(first) + 4001));
  }),
  'cuts connections': later(1, (request, response, next, served) => {
    if (served.log.length % 2) return next();
    const [, first, last] = /=(\d+)-(\d+)/.exec(request.headers.range);
    response.writeHead(206, { 'content-range': `bytes ${first}-${last}/${served.bytes.length}` });
    response.write(Buffer.alloc(100));
    setTimeout(() => response.destroy(), 20);
  }),
  '503 at first': (_request, response, next, served) => {
    if (served.log.length % 2 === 0) return next();
    response.writeHead(503).end();
  },
  // As a page from elsewhere sees a server that exposes no headers.
  'hides its headers': (request, response, _next, { bytes }) => {
    const [, first, last] = /=(\d+)-(\d+)/.exec(request.headers.range);
    response.writeHead(206);
    response.end(bytes.subarray(Number(first), Number(last) + 1));
  },
  hangs: later(1, (_request, _response, next, served) => {
    if (served.log.length % 2) next();
  }),
};
