"""The TypeScript declarations, compiled as a user of the package would."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tests.helpers import environment, web_package

OPTIONS = ["--noEmit", "--strict", "--skipLibCheck", "--target", "esnext", "--module", "esnext"]
OPTIONS += ["--moduleResolution", "bundler", "--lib", "esnext,dom"]
PACKAGES = ("three", "@types/three", "@babylonjs/core", "@babylonjs/loaders")
PACKAGES += ("@gltf-transform/core",)


def test_declarations_compile(tmp_path):
    compiler = environment.need_npm_package("typescript") / "bin" / "tsc"
    folder = web_package.install(tmp_path / "user", *PACKAGES)
    shutil.copy(Path(__file__).with_name("types.ts"), folder)
    command = ["node", compiler, *OPTIONS, "types.ts"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
