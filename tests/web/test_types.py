"""The TypeScript declarations, compiled as a user would; the types of the sources."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from tests.helpers import environment, web_package
from tools import check_web_types

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


# File, what is in it, what takes its place, and a part of the error.
FAULTS = [
    ("stream/core/page.js", "this.#go(DECODED,", "this.#set(DECODED,", "'#set' does not exist"),
    ("stream/streamer.js", "{ SourceError }", "{ pause }", "'SourceError' is missing"),
    ("pool.js", "  close() {", "  shut() {", "'close' does not exist"),
    ("stream/engine/session.js", "get ready()", "ready()", "'() => any' is not assignable"),
    ("stream/core/attempts.js", "delay + 1, signal", "delay + 1, signal, again", "arguments, but"),
]


def check(capsys) -> str:
    status = check_web_types.main()
    text = capsys.readouterr().out
    assert bool(status) == bool(text)
    return text


def need_compiler() -> None:
    for package in ("typescript", *PACKAGES, "@webgpu/types", "@types/node"):
        environment.need_npm_package(package)


def test_sources_have_the_published_types(capsys):
    need_compiler()
    assert check(capsys) == ""


def test_wrong_types_are_found(tmp_path, monkeypatch, capsys):
    need_compiler()
    web = tmp_path / "web"
    shutil.copytree(check_web_types.WEB, web, ignore=shutil.ignore_patterns("*.wasm"))
    for file, before, after, _ in FAULTS:
        text = (web / file).read_text()
        assert before in text
        (web / file).write_text(text.replace(before, after, 1))
    monkeypatch.setattr(check_web_types, "WEB", web)
    monkeypatch.setattr(check_web_types, "FOLDER", tmp_path / "build" / "web-types")
    text = check(capsys)
    for _, _, _, error in FAULTS:
        assert error in text, text
