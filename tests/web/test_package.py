"""The npm package: version, files, entry points."""

from __future__ import annotations

import json
import posixpath
import re
import subprocess
from pathlib import Path

import pytest

import gltf_ext
from tests.helpers import environment, web_package
from tests.helpers.environment import ROOT

WEB = ROOT / "web"
PACKAGE = json.loads((WEB / "package.json").read_text())


def test_version_is_that_of_the_python_package():
    assert PACKAGE["version"] == re.sub(r"\.dev(\d+)$", r"-dev.\1", gltf_ext.__version__)


def test_package_holds_every_entry_point_and_what_it_imports():
    targets = set()
    for entry in PACKAGE["exports"].values():
        targets |= {entry} if isinstance(entry, str) else set(entry.values())
    shipped = set(PACKAGE["files"])
    assert {target.removeprefix("./") for target in targets} <= shipped
    for name in shipped - {"decoder.wasm", "unpacker.wasm"}:  # compiled by make web
        imported = re.findall(r"(?:from |import\()'(\.\.?/[^']+)'", (WEB / name).read_text())
        paths = {posixpath.normpath(f"{posixpath.dirname(name)}/{file}") for file in imported}
        assert {path.removeprefix("/") for path in paths} <= shipped, name
    assert "dependencies" not in PACKAGE


def run_module(code: str, folder: Path = WEB) -> str:
    """What a module in a folder prints that can import the package."""
    environment.need_program("node", "Debian: apt install nodejs")
    command = ["node", "--input-type=module", "-e", code]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.stderr == ""
    return done.stdout.strip()


def test_unpacker_agrees_with_the_vectors():
    if not (WEB / "unpacker.wasm").is_file():
        environment.missing("no web/unpacker.wasm; run: make web")
    environment.need_program("node", "Debian: apt install nodejs")
    vectors = ROOT / "spec" / "transport_vectors"
    mutations = "100000" if environment.full else "2000"
    command = ["node", ROOT / "tests" / "web" / "unpack.mjs", WEB, vectors, mutations]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.stdout == ""
    assert done.returncode == 0, done.stderr


def test_unpacker_is_small():
    if not (WEB / "unpacker.wasm").is_file():
        environment.missing("no web/unpacker.wasm; run: make web")
    code = """
        import { readFileSync } from 'node:fs';
        import { brotliCompressSync } from 'node:zlib';
        console.log(brotliCompressSync(readFileSync('unpacker.wasm')).length);
    """
    assert int(run_module(code)) <= 20_000


def test_manuals_tell_the_size_of_the_unpacker():
    if not (WEB / "unpacker.wasm").is_file():
        environment.missing("no web/unpacker.wasm; run: make web")
    kilobytes = round((WEB / "unpacker.wasm").stat().st_size / 1000)
    for name in ("web.md", "stream.md"):
        text = (ROOT / "docs" / name).read_text()
        assert f"of {kilobytes} kB" in text, name


def test_bundlers_keep_what_a_worker_imports(tmp_path):
    """Of a file of one's own. And webpack finds no import whose name it does not know."""
    program = environment.need_npm_package("esbuild") / "bin" / "esbuild"
    folder = web_package.install(tmp_path / "user")
    for name in ("worker", "stream/worker"):
        (folder / "own.js").write_text(f"import 'gltf-meshlet/{name}';\n")
        command = [program, "own.js", "--bundle", "--format=esm", "--log-level=warning"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
        assert done.stderr == "" and "validate" in done.stdout, name
    # webpack replaces import.meta.url by the path on the developer's machine, but for these.
    scripts = [path.read_text() for path in (folder / "node_modules/gltf-meshlet").rglob("*.js")]
    imports = [found for text in scripts for found in re.findall(r"import\(([^')]*)\)", text)]
    places = [re.sub(r"new URL\([^)]*, import\.meta\.url\)", "", text) for text in scripts]
    assert not any("import.meta" in text for text in places)
    assert imports == ["/* webpackIgnore: true */ /* @vite-ignore */ node"] * 4


def test_package_contains_the_licence():
    assert (WEB / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_entry_points_import_in_node(tmp_path):
    code = """
        const { createDecoder } = await import('gltf-meshlet');
        const { createDecoderPool } = await import('gltf-meshlet/pool');
        const { MeshletStream, meshletPlugin } = await import('gltf-meshlet/three');
        const { openStreamer } = await import('gltf-meshlet/stream/core');
        const { registerMeshletExtension } = await import('gltf-meshlet/babylon');
        const all = [createDecoder, createDecoderPool, meshletPlugin, registerMeshletExtension];
        const babylon = await import('gltf-meshlet/stream/babylon');
        all.push(MeshletStream, openStreamer, babylon.MeshletStream);
        console.log(all.every((value) => typeof value === 'function'));
    """
    packages = ("three", "@babylonjs/core", "@babylonjs/loaders")
    assert run_module(code, web_package.install(tmp_path / "user", *packages)) == "true"


@pytest.mark.parametrize("create", ["createDecoder", "createDecoderPool"])
def test_decoder_that_cannot_be_loaded_is_an_error_that_names_it(create, tmp_path):
    missing = (tmp_path / "missing.wasm").as_uri()
    code = f"""
        const {{ createDecoder }} = await import('gltf-meshlet');
        const pool = await import('gltf-meshlet/pool');
        const createDecoderPool = (source) => pool.createDecoderPool({{ source }});
        await {create}('{missing}').catch((error) => console.log(error.message));
    """
    assert "missing.wasm" in run_module(code)


def test_three_plugin_passes_on_the_error_of_a_decoder_that_cannot_be_loaded():
    code = """
        const { meshletPlugin } = await import('./three_plugin.js');
        const decoder = Promise.reject(new Error('no decoder'));
        const parser = { json: { extensionsUsed: ['EXT_meshlet_edgebreaker'] } };
        await meshletPlugin(decoder)(parser).beforeRoot().catch((e) => console.log(e.message));
    """
    assert run_module(code) == "no decoder"


def test_babylon_plugin_passes_on_the_error_of_a_decoder_that_cannot_be_loaded():
    code = """
        const { registerMeshletExtension } = await import('gltf-meshlet/babylon');
        const extensions = { EXT_meshlet_edgebreaker: { bufferView: 0, attributes: {} } };
        const primitive = { attributes: { POSITION: 0 }, indices: 1, extensions };
        const meshes = [{ primitives: [primitive] }];
        const gltf = { meshes, accessors: [{}, {}], bufferViews: [{}] };
        const loadBufferViewAsync = async () => new Uint8Array(4);
        const loader = { gltf, isExtensionUsed: () => true, loadBufferViewAsync };
        let extension;
        const register = (name, isExtension, create) => (extension = create(loader));
        registerMeshletExtension(register, Promise.reject(new Error('no decoder')));
        extension.onLoading();
        const view = extension.loadBufferViewAsync('', gltf.bufferViews[1]);
        await view.catch((error) => console.log(error.message));
    """
    assert run_module(code) == "mesh 0 primitive 0: no decoder"


def test_blobs_of_more_workgroups_than_a_dispatch_has_are_refused_on_the_gpu():
    code = """
        const { decodeToGPU } = await import('gltf-meshlet/webgpu');
        globalThis.GPUBufferUsage = globalThis.GPUShaderStage = {};
        const limits = { maxStorageBufferBindingSize: 1e12, maxBufferSize: 1e12 };
        const nothing = () => ({ getCompilationInfo: async () => ({ messages: [] }) });
        const known = { limits, pushErrorScope() {}, popErrorScope: async () => null };
        const device = new Proxy(known, { get: (of, name) => of[name] ?? nothing });
        for (const [method, meshletCount] of [['interior', 131071], ['traversal', 524281]]) {
          const blob = { bytes: new Uint8Array(64), meshletCount, triangleCount: 1, streams: [] };
          const decoder = { blobs: () => [blob] };
          await decodeToGPU(device, blob.bytes, { decoder, method }).catch((error) =>
            console.log(error.name, /a dispatch may have .*/.exec(error.message)[0]));
        }
    """
    assert run_module(code).splitlines() == [
        f"RangeError a dispatch may have ({most} meshlets); compress it with --page-bytes"
        for most in (131070, 524280)
    ]


def test_rooms_of_streaming_import_from_those_before_them():
    rooms = ("io", "core", "engine")
    for number, room in enumerate(rooms):
        for path in (WEB / "stream" / room).glob("*.js"):
            for other in re.findall(r"from '\.\./(\w+)/", path.read_text()):
                assert other in rooms[:number], path
