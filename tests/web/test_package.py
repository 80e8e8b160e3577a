"""The npm package: version, files, entry points."""

from __future__ import annotations

import json
import re
import subprocess

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


def test_entry_points_import_in_node():
    environment.need_program("node", "Debian: apt install nodejs")
    code = """
        const [decoder, three] = [await import('gltf-meshlet'), await import('gltf-meshlet/three')];
        console.log(typeof decoder.createDecoder, typeof three.meshletPlugin);
    """
    command = ["node", "--input-type=module", "-e", code]
    done = subprocess.run(command, cwd=WEB, capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("function function", "")


def test_decoder_that_cannot_be_loaded_is_an_error_that_names_it(tmp_path):
    environment.need_program("node", "Debian: apt install nodejs")
    missing = (tmp_path / "missing.wasm").as_uri()
    code = f"""
        const {{ createDecoder }} = await import('gltf-meshlet');
        await createDecoder('{missing}').catch((error) => console.log(error.message));
    """
    command = ["node", "--input-type=module", "-e", code]
    done = subprocess.run(command, cwd=WEB, capture_output=True, text=True)
    assert "missing.wasm" in done.stdout


def test_three_plugin_passes_on_the_error_of_a_decoder_that_cannot_be_loaded():
    environment.need_program("node", "Debian: apt install nodejs")
    code = """
        const { meshletPlugin } = await import('gltf-meshlet/three');
        const decoder = Promise.reject(new Error('no decoder'));
        const parser = { json: { extensionsUsed: ['EXT_meshlet_edgebreaker'] } };
        await meshletPlugin(decoder)(parser).beforeRoot().catch((e) => console.log(e.message));
    """
    command = ["node", "--input-type=module", "-e", code]
    done = subprocess.run(command, cwd=WEB, capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("no decoder", "")
