"""The npm package: version, files, entry points."""

from __future__ import annotations

import json
import re
import subprocess

import pytest

import gltf_ext
from tests.helpers import environment
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
    for name in shipped - {"decoder.wasm"}:  # compiled by make web
        imported = re.findall(r"from '\./([^']+)'", (WEB / name).read_text())
        assert set(imported) <= shipped, name
    assert "dependencies" not in PACKAGE


def run_module(code: str) -> str:
    """What a module prints that can import the package."""
    environment.need_program("node", "Debian: apt install nodejs")
    command = ["node", "--input-type=module", "-e", code]
    done = subprocess.run(command, cwd=WEB, capture_output=True, text=True)
    assert done.stderr == ""
    return done.stdout.strip()


def test_package_contains_the_licence():
    assert (WEB / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_entry_points_import_in_node():
    code = """
        const { createDecoder } = await import('gltf-meshlet');
        const { createDecoderPool } = await import('gltf-meshlet/pool');
        const { meshletPlugin } = await import('gltf-meshlet/three');
        const { registerMeshletExtension } = await import('gltf-meshlet/babylon');
        const all = [createDecoder, createDecoderPool, meshletPlugin, registerMeshletExtension];
        console.log(all.every((value) => typeof value === 'function'));
    """
    assert run_module(code) == "true"


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
        const { meshletPlugin } = await import('gltf-meshlet/three');
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
