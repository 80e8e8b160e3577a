"""The pool of Workers, in Node: the decoder's results, in parallel; abort, progress, errors."""

from __future__ import annotations

import json
import random
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gltf_ext import compress
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from tests.helpers import environment
from tests.helpers.environment import ROOT, VECTORS

WEB = ROOT / "web"
POOL = Path(__file__).with_name("pool.mjs")
VERTEX_COUNT = 12  # bytes of a blob's header
BYTE_LENGTH = 20


def need_decoder() -> None:
    environment.need_program("node", "Debian: apt install nodejs")
    if not (WEB / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")


def compressed_views(path: Path, folder: Path, **options) -> list[bytes]:
    compress(path, folder / "compressed.glb", **options)
    return [c.blob for c in require_compressed(open_model(folder / "compressed.glb"))]


def blob_count(view: bytes) -> int:
    count = at = 0
    while at < len(view):
        at += struct.unpack_from("<I", view, at + BYTE_LENGTH)[0]
        count += 1
    return count


def differences(views: list[bytes], folder: Path, *workers: int) -> list[str]:
    """What pool.mjs prints for views."""
    need_decoder()
    ends = np.cumsum([len(v) for v in views]).tolist()
    (folder / "views.bin").write_bytes(b"".join(views))
    places = [[end - len(v), len(v)] for end, v in zip(ends, views)]
    options = {"packed": str(folder / "views.bin"), "views": places, "workers": workers}
    (folder / "list.json").write_text(json.dumps(options))
    command = ["node", str(POOL), str(WEB), str(folder / "list.json")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_vectors_decode_and_are_refused_alike(tmp_path):
    views = [path.read_bytes() for path in sorted(VECTORS.glob("*.bin"))]
    assert differences(views, tmp_path, 3) == []


@pytest.mark.parametrize("page_bytes", [0, 16384])
@pytest.mark.parametrize("name", ["DamagedHelmet.glb", "bunny.glb"])
def test_models_with_and_without_pages(name, page_bytes, model, tmp_path):
    views = compressed_views(model(name), tmp_path, page_bytes=page_bytes)
    assert differences(views, tmp_path, 1, 2, 5) == []


@pytest.mark.parametrize("page_bytes", [0, 16384])
def test_damaged_views_are_refused_alike(page_bytes, model, tmp_path):
    (view,) = compressed_views(model("bunny.glb"), tmp_path, page_bytes=page_bytes)
    source = random.Random(1)
    damaged = [bytearray(view) for _ in range(20)]
    for copy in damaged[2:]:
        copy[source.randrange(len(view) // 4, len(view))] ^= 1 << source.randrange(8)
    (vertices,) = struct.unpack_from("<I", view, VERTEX_COUNT)
    for copy, change in zip(damaged, (-1, 1)):
        struct.pack_into("<I", copy, VERTEX_COUNT, vertices + change)
    assert differences([bytes(copy) for copy in damaged], tmp_path, 2) == []


SCRIPT = """
const [web, file] = process.argv.slice(1);
const { readFileSync } = require('fs');
const { pathToFileURL } = require('url');
(async () => {
  const { createDecoderPool } = await import(pathToFileURL(web + '/pool.js'));
  const view = readFileSync(file); // a Buffer, whose slice() does not copy
  const refused = (promise) => promise.then(() => 'decoded', (error) => error.message);
  const pool = await createDecoderPool({ workers: 2 });
  const shares = [];
  const options = { onProgress: (share) => shares.push(share) };
  const { triangleCount } = await pool.decodePrimitive(view, options);
  const abort = new AbortController();
  const stopped = [];
  const stop = new AbortController();
  const onProgress = (share) => stopped.push(share) && stop.abort(new Error('stopped'));
  const early = await refused(pool.decodePrimitive(view, { signal: stop.signal, onProgress }));
  await pool.decodePrimitive(view);
  const fail = () => {
    throw new Error('failed');
  };
  const failed = await refused(pool.decodePrimitive(view, { onProgress: fail }));
  const later = refused(pool.decodePrimitive(view, { signal: abort.signal }));
  abort.abort(new Error('stopped'));
  const { signal } = abort;
  const results = {
    shares,
    stopped,
    failed,
    triangleCount,
    aborted: [early, await later, await refused(pool.decodePrimitive(view, { signal }))],
    after: (await pool.decodePrimitive(view)).triangleCount,
  };
  const waiting = refused(pool.decodePrimitive(view));
  pool.close();
  const late = [pool.decodePrimitive(view), pool.run({ task: 'validate', bytes: view })];
  results.closed = await Promise.all([waiting, ...late.map(refused)]);
  const { Worker } = require('worker_threads');
  const createWorker = () => new Worker('throw new Error("no such script")', { eval: true });
  const broken = await createDecoderPool({ workers: 1, createWorker });
  results.broken = await refused(broken.decodePrimitive(view));
  // Its second job kills it: two errors, and an answer that comes too late.
  const workers = [];
  class Mortal extends require('events') {
    jobs = 0;
    postMessage({ task }) {
      if (!task) return;
      const dies = workers.length === 1 && ++this.jobs === 2;
      const events = dies ? ['error', 'error', 'message'] : ['message'];
      setTimeout(() => events.forEach((name) => this.emit(name, { message: 'dead', result: 1 })));
    }
    terminate() {
      this.isEnded = true;
    }
  }
  const start = () => workers[workers.push(new Mortal()) - 1];
  const mortal = await createDecoderPool({ workers: 1, createWorker: start });
  const jobs = [0, 1, 2, 3].map(() => refused(mortal.run({ task: 'validate', bytes: view })));
  results.mortal = await Promise.all(jobs);
  mortal.close();
  results.ended = workers.map(({ isEnded }) => isEnded);
  console.log(JSON.stringify(results));
})();
"""


def test_progress_abort_and_errors(model, tmp_path):
    need_decoder()
    (view,) = compressed_views(model("bunny.glb"), tmp_path, page_bytes=16384)
    (tmp_path / "view.bin").write_bytes(view)
    command = ["node", "-e", SCRIPT, WEB, tmp_path / "view.bin"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert len(results["shares"]) == blob_count(view)
    assert results["shares"] == sorted(results["shares"])
    assert results["shares"][-1] == 1
    assert len(results["stopped"]) == 1
    assert results["mortal"] == ["decoded", "a decoder's Worker failed: dead", "decoded", "decoded"]
    assert results["ended"] == [True, True]
    assert results["aborted"] == ["stopped"] * 3
    assert results["failed"] == "failed"
    assert results["after"] == results["triangleCount"]
    assert results["closed"] == ["the decoder pool is closed"] * 3
    assert results["broken"] == "a decoder's Worker failed: no such script"
