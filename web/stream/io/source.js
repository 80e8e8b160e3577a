// Reads ranges of bytes of a file: by HTTP range requests, from a whole file where a server refuses
// them, or from a Blob. An answer that does not fit the request is an error, never data.

export const HEAD_BYTES = 32768; // of the first request
const STALL_MS = 20_000; // without a byte
const TRIES = 5; // to read what a stream cannot begin without
const FIRST_DELAY_MS = 500; // doubles with each try
const LONGEST_DELAY_MS = 16_000;
const LONGEST_RETRY_AFTER_MS = 120_000; // that a server may ask for
const LONGEST_TIMER_MS = 2 ** 31 - 1;
const MOST_WHOLE = 1e9; // bytes of a file whose server refuses ranges
const RETRY_STATUS = [408, 425, 429, 500, 502, 503, 504];

// A file cannot be read. `retry`: it may work later, after at least `retryAfter` milliseconds if the
// server says so. `changed`: it is another file than before. `unreachable`: there was no answer.
export class SourceError extends Error {
  constructor(
    message,
    { retry = false, changed = false, unreachable = false, retryAfter = 0, cause = null } = {},
  ) {
    super(message, cause && { cause });
    this.name = 'SourceError';
    this.retry = retry;
    this.changed = changed;
    this.unreachable = unreachable;
    this.retryAfter = retryAfter;
  }
}

// Milliseconds to wait after so many failed tries, of which an error was the last.
export const delayAfter = (tries, error = null) =>
  Math.max(
    Math.min(FIRST_DELAY_MS * 2 ** (tries - 1), LONGEST_DELAY_MS),
    Math.min(error?.retryAfter || 0, LONGEST_RETRY_AFTER_MS),
  );

// Milliseconds of a Retry-After header, which holds seconds or a date; 0 without one.
function retryAfterOf(headers) {
  const text = headers.get('retry-after')?.trim();
  if (!text) return 0;
  const seconds = /^\d+$/.test(text) ? Number(text) : (Date.parse(text) - Date.now()) / 1000;
  return Math.max(0, 1000 * seconds) || 0;
}

// Opens a URL or a Blob. Options: signal; onWarning(text); fetch, in place of the global function;
// requestInit for it, as headers or credentials; stallMs; maxWholeBytes. Throws SourceError.
export async function openSource(place, options = {}) {
  if (place instanceof Blob) return new Source('file', options, place);
  const source = new Source(String(place), options);
  await retrying(() => source.open(), options);
  return source;
}

// Tries again what may work later, a few times.
async function retrying(action, { onWarning = null, signal = null }) {
  for (let tries = 1; ; tries++) {
    try {
      return await action();
    } catch (error) {
      if (!error?.retry || tries === TRIES) throw error;
      onWarning?.(`${error.message}; trying again`);
      await pause(delayAfter(tries, error), signal);
    }
  }
}

class Source {
  #url;
  #options;
  #identity = null; // of the first answer: {etag, modified, total}
  #head = null; // the first bytes, until forgetHead
  #blob; // the whole file, where ranges are refused
  #unreached = 0; // first requests without an answer

  constructor(url, options, blob = null) {
    this.#url = url;
    this.#options = options;
    this.#blob = blob;
    this.fetched = 0; // bytes, of all answers
    this.requests = 0;
  }

  // The whole file, where ranges are refused; else null.
  get blob() {
    return this.#blob;
  }

  // Bytes of the file; NaN where the server does not tell.
  get total() {
    return this.#blob?.size ?? this.#identity.total;
  }

  // Bytes in memory. A Blob is the browser's, which may keep it on disk.
  get held() {
    return this.#head?.byteLength ?? 0;
  }

  async open() {
    try {
      this.#head = await this.#fetchRange(0, HEAD_BYTES, null);
    } catch (error) {
      if (!error?.unreachable || ++this.#unreached < 2 || !(await this.#answersHead())) throw error;
      await this.#guarded(null, (guard) =>
        this.#fetchWhole(0, 0, guard, 'gives no ranges that can be read'),
      );
    }
  }

  // Whether the server can be reached, and may have stored the file compressed: browsers do not unpack
  // a part. Other origins hide that.
  async #answersHead() {
    const ask = (guard) => this.#fetch({ method: 'HEAD' }, guard);
    return this.#guarded(null, ask).then(
      ({ ok, type, headers }) => ok && (type === 'cors' || encoded(headers)),
      () => false,
    );
  }

  forgetHead() {
    this.#head = null;
  }

  // The first bytes, before forgetHead.
  async readHead() {
    return this.#blob ? bytesOf(this.#blob, 0, HEAD_BYTES) : this.#head;
  }

  // The whole file, of at most so many bytes. Tries again.
  async readAll(most) {
    const fetchAll = () =>
      this.#guarded(null, (guard) => this.#fetchWhole(0, 0, guard, null, most));
    if (!this.#blob) await retrying(fetchAll, this.#options);
    return bytesOf(this.#blob, 0, this.#blob.size);
  }

  // As read, but tries again.
  readSurely(begin, end) {
    return retrying(() => this.read(begin, end), this.#options);
  }

  // The bytes [begin, end). Throws SourceError, or the reason of an aborted signal.
  async read(begin, end, signal = null) {
    if (end > this.total) throw new SourceError(`${this.#url}: the file ends before byte ${end}`);
    if (this.#blob) return bytesOf(this.#blob, begin, end);
    const known = this.#head?.byteLength ?? 0;
    if (end <= known) return this.#head.slice(begin, end);
    if (begin >= known) return this.#fetchRange(begin, end, signal);
    const first = this.#head.slice(begin);
    const result = new Uint8Array(end - begin);
    const rest = await this.#fetchRange(known, end, signal);
    result.set(first);
    result.set(rest, first.length);
    return result;
  }

  // One request, or two. At the end of the file an answer may be shorter, if nothing was known before.
  #fetchRange(begin, end, signal) {
    return this.#guarded(signal, async (guard) => {
      const headers = Object.fromEntries(new Headers(this.#options.requestInit?.headers));
      headers.Range = `bytes=${begin}-${end - 1}`;
      return this.#take(await this.#fetch({ headers }, guard), begin, end, guard);
    });
  }

  // Runs action({signal, alive, fail}), which calls alive() with each sign of life. An error, or
  // fail(error), ends what it requests. Throws SourceError, or the reason of an aborted signal.
  async #guarded(signal, action) {
    const { stallMs = STALL_MS } = this.#options;
    const stop = new AbortController();
    const fail = (error) => {
      stop.abort(error);
      return stop.signal.reason; // that of the first
    };
    const abort = (event) => fail(event.target.reason);
    const signals = [signal, this.#options.signal].filter(Boolean);
    for (const one of signals) {
      one.throwIfAborted();
      one.addEventListener('abort', abort);
    }
    const stalled = this.#error(`no answer for ${stallMs / 1000} seconds`, { retry: true });
    let timer;
    const alive = () => {
      clearTimeout(timer);
      timer = setTimeout(fail, Math.min(stallMs, LONGEST_TIMER_MS), stalled);
    };
    alive();
    try {
      return await action({ signal: stop.signal, alive, fail });
    } catch (error) {
      throw fail(error instanceof SourceError ? error : this.#unreachable(error));
    } finally {
      clearTimeout(timer);
      for (const one of signals) one.removeEventListener('abort', abort);
    }
  }

  #unreachable(cause) {
    const problem = `cannot be reached (offline, or refused by CORS): ${cause?.message}`;
    return this.#error(problem, { retry: true, unreachable: true, cause });
  }

  async #fetch(init, { signal, alive }) {
    this.requests++;
    const { requestInit, fetch = globalThis.fetch } = this.#options;
    const response = await fetch(this.#url, { ...requestInit, ...init, signal, cache: 'no-store' });
    alive();
    return response;
  }

  async #take(response, begin, end, guard) {
    const { status, headers } = response;
    if (status === 200) {
      if (!/^(data|blob):/.test(this.#url)) this.#warnOfWhole('does not answer ranges');
      return this.#takeWhole(response, begin, end, guard);
    }
    if (status !== 206) throw this.#statusError(response);
    const range = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(headers.get('content-range') ?? '');
    const total = range ? Number(range[3]) : Number.NaN;
    this.#compare(headers, total);
    if (encoded(headers)) {
      response.body?.cancel().catch(() => {}); // frees the connection
      return this.#fetchWhole(begin, end, guard, 'compresses its answers');
    }
    if (
      range &&
      (Number(range[1]) !== begin || Number(range[2]) + 1 !== Math.min(end, total || end))
    )
      throw this.#error(`the server answered with another range: ${range[0]}`, { retry: true });
    const length = range ? Number(range[2]) + 1 - begin : end - begin;
    const bytes = await this.#body(response, length, guard);
    const mayBeShort = !range && begin === 0;
    if (bytes.length !== length && !mayBeShort)
      throw this.#error(`an answer has ${bytes.length} bytes instead of ${length}`, {
        retry: true,
      });
    if (!range) this.#warnOfHidden(headers);
    return bytes;
  }

  // The body of an answer, at most `limit` bytes.
  async #body(response, limit, { alive }) {
    const bytes = new Uint8Array(limit);
    const reader = response.body.getReader();
    let at = 0;
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return bytes.subarray(0, at);
      alive();
      this.fetched += value.length;
      if (at + value.length > limit)
        throw this.#error(`an answer has more than ${limit} bytes`, { retry: true });
      bytes.set(value, at);
      at += value.length;
    }
  }

  async #takeWhole(response, begin, end, { alive, fail }, most) {
    this.#compare(response.headers, Number.NaN);
    const { maxWholeBytes = MOST_WHOLE } = this.#options;
    const tooLarge = () =>
      this.#error(
        most < maxWholeBytes
          ? `the file has more than ${most.toLocaleString('en')} bytes, too many for a JSON`
          : `without ranges the file is loaded whole, and has more than ` +
              `${maxWholeBytes.toLocaleString('en')} bytes (maxWholeBytes)`,
      );
    const limit = Math.min(most ?? maxWholeBytes, maxWholeBytes);
    const length = Number(response.headers.get('content-length') ?? Number.NaN);
    if (length > limit) throw tooLarge();
    let size = 0;
    const watched = response.body.pipeThrough(
      new TransformStream({
        transform: (chunk, controller) => {
          alive();
          this.fetched += chunk.length;
          size += chunk.length;
          // By fail, as Chromium tells no error of a stream.
          if (size > limit) throw fail(tooLarge());
          controller.enqueue(chunk);
        },
      }),
    );
    const blob = await new Response(watched).blob();
    // Other origins hide whether these are compressed bytes.
    if (response.type !== 'cors' && !encoded(response.headers) && blob.size < length)
      throw this.#error(`an answer has ${blob.size} bytes instead of ${length}`, { retry: true });
    this.#blob = blob;
    return bytesOf(blob, begin, Math.min(end, blob.size));
  }

  // Without a range: those of compressed answers count compressed bytes.
  async #fetchWhole(begin, end, guard, reason, most) {
    if (reason) this.#warnOfWhole(reason);
    const response = await this.#fetch({}, guard);
    if (response.status === 200) return this.#takeWhole(response, begin, end, guard, most);
    throw this.#statusError(response);
  }

  #warnOfWhole(reason) {
    this.#warn(`the server ${reason}, so that the whole file is loaded`);
  }

  // Compares the file of an answer with that of the first one.
  #compare(headers, total) {
    const given = headers.get('etag');
    const etag = given?.replace(/^W\//, ''); // a proxy may weaken it
    const seen = { given, etag, modified: headers.get('last-modified'), total };
    this.#identity ??= seen;
    const before = this.#identity;
    const differs = (name) => before[name] && seen[name] && before[name] !== seen[name];
    // Servers that share a file may have copied it at different times.
    const isSame = etag && etag === given && given === before.given;
    if (differs('etag') || differs('total') || (!isSame && differs('modified')))
      throw this.#error('the file has changed', { changed: true });
  }

  #warnOfHidden(headers) {
    const more = headers.get('etag') ? '' : ' and ETag';
    this.#warn(
      `the server hides Content-Range${more}: a changed file may go unnoticed; ` +
        'let it send Access-Control-Expose-Headers: Content-Range, ETag',
    );
  }

  #warned = new Set();
  #warn(text) {
    if (this.#warned.has(text)) return;
    this.#warned.add(text);
    this.#options.onWarning?.(`${this.#url}: ${text}`);
  }

  #statusError({ status, headers }) {
    if (status === 416 && !this.#identity) return this.#error('the file is empty');
    if (status === 416) return this.#error('the file has changed (416)', { changed: true });
    const retry = RETRY_STATUS.includes(status);
    return this.#error(`the server answered ${status}`, {
      retry,
      retryAfter: retryAfterOf(headers),
    });
  }

  #error(problem, kind) {
    return new SourceError(`${this.#url}: ${problem}`, kind);
  }
}

const encoded = (headers) => !['', 'identity'].includes(headers.get('content-encoding') ?? '');

async function bytesOf(blob, begin, end) {
  return new Uint8Array(await blob.slice(begin, end).arrayBuffer());
}

// Rejects with the reason of a signal that is aborted meanwhile.
export async function pause(milliseconds, signal) {
  signal?.throwIfAborted();
  return /** @type {Promise<void>} */ (
    new Promise((resolve, reject) => {
      const stop = () => {
        clearTimeout(timer);
        reject(signal.reason);
      };
      const timer = setTimeout(() => {
        signal?.removeEventListener('abort', stop);
        resolve();
      }, milliseconds);
      signal?.addEventListener('abort', stop, { once: true });
    })
  );
}
