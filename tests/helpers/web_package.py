"""The npm package in web/, packed and installed as a user would."""

from __future__ import annotations

import subprocess
import tarfile
from pathlib import Path

from tests.helpers import environment
from tests.helpers.environment import NODE_MODULES, ROOT

WEB = ROOT / "web"


def install(folder: Path, *packages: str) -> Path:
    """Packs web/ and installs it in folder/node_modules, with npm packages of the test machine.

    Returns the folder.
    """
    environment.need_program("npm", "Debian: apt install npm")
    if not (WEB / "decoder.wasm").is_file():
        environment.missing("no web/decoder.wasm; run: make web")
    modules = folder / "node_modules"
    modules.mkdir(parents=True)
    for package in packages:
        environment.need_npm_package(package)
        scope = package.split("/")[0]
        if not (modules / scope).exists():
            (modules / scope).symlink_to(NODE_MODULES / scope)
    command = ["npm", "pack", "--silent", "--pack-destination", folder]
    packed = subprocess.run(command, cwd=WEB, check=True, capture_output=True, text=True)
    with tarfile.open(folder / packed.stdout.strip()) as archive:
        archive.extractall(modules, filter="data")
    (modules / "package").rename(modules / "gltf-meshlet")
    return folder
