"""`gltf-meshlet view`: shows a model in the browser, or exports the web page that does."""

from __future__ import annotations

import argparse
import errno
import json
import os
import shutil
import signal
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

from gltf_ext.errors import MeshletError, printable
from gltf_ext.portable import replace
from gltf_meshlet.view_models import Model, prepare
from gltf_meshlet.view_server import MODELS, PAGE, ViewServer, page_files

LARGEST_PORT = 65535
MODEL_FOLDER = "model/"  # of an exported page


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Adds the arguments of `view`."""
    command.add_argument("input", metavar="FILE", help="file that compress wrote, or any model")
    command.add_argument(
        "--original",
        metavar="ORIGINAL",
        help="the original of a compressed FILE, to show beside it",
    )
    command.add_argument(
        "--export",
        metavar="DIR",
        help="write the page with the model into a new folder for any web server, and exit",
    )
    command.add_argument(
        "--port", type=int, default=0, metavar="N", help="port on 127.0.0.1 (default: a free one)"
    )
    command.add_argument(
        "--no-browser", action="store_true", help="print the address and open no browser"
    )


def run(options: argparse.Namespace) -> int:
    """Serves until Ctrl-C, or exports; returns the exit status. Raises MeshletError, OSError."""
    _check(options)
    original = options.original and Path(options.original)
    # Windows deletes no file that a thread of the server still sends.
    with tempfile.TemporaryDirectory(
        prefix="gltf-meshlet-view-", ignore_cleanup_errors=True
    ) as folder:
        _exit_on_signals()  # a closed terminal: delete the folder
        model = prepare(Path(options.input), original, Path(folder))
        for warning in model.warnings:
            line = printable(f"gltf-meshlet: {options.input}: warning: {warning}")
            print(line, file=sys.stderr)
        if options.export is not None:
            export(model, Path(options.export))
            exported = printable(options.export)
            print(f"{exported}: put this folder on a web server, or try it:")
            print(f"  python3 -m http.server --directory {exported}")
            print("Models with levels of detail stream from servers that answer range requests,")
            print("which this one does not. From another origin they also have to send:")
            print("  Access-Control-Allow-Origin: *")
            print("  Access-Control-Expose-Headers: Content-Range, ETag")
            return 0
        return _serve(model, Path(folder), options)


def _exit_on_signals() -> None:
    """SIGBREAK is Windows's for Ctrl-Break and a closed terminal."""
    for name in ("SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _exit)


def _exit(number: int, frame: Any) -> None:
    raise SystemExit(128 + number)


def _check(options: argparse.Namespace) -> None:
    """Raises MeshletError before any work."""
    if not 0 <= options.port <= LARGEST_PORT:
        raise MeshletError(f"port is {options.port}", f"use 0 to {LARGEST_PORT}", options=("port",))
    if not (PAGE / "view.js").is_file():
        raise MeshletError("the page is not installed", "run: make web", str(PAGE))
    if options.export is not None:
        _check_folder(Path(options.export))


def _check_folder(folder: Path) -> None:
    if not folder.absolute().parent.is_dir():
        raise MeshletError("its folder does not exist", "create it first", str(folder))
    if os.path.lexists(folder):
        raise MeshletError("exists", "name a new folder, or delete it first", str(folder))


def export(model: Model, folder: Path) -> None:
    """Writes the page and the model into a new folder: all of it or nothing. Raises OSError."""
    described = {"server": False, "models": [model.description(MODEL_FOLDER)]}
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.absolute().parent))
    try:
        (unfinished / MODEL_FOLDER).mkdir()
        for name, path in page_files().items():
            shutil.copyfile(path, unfinished / name)
        for name, path in model.files().items():
            shutil.copyfile(path, unfinished / MODEL_FOLDER / name)
        (unfinished / MODELS).write_bytes(json.dumps(described, indent=2).encode() + b"\n")
        unfinished.chmod(0o755)  # mkdtemp's is for its user only; a web server may be another
        replace(unfinished, folder)
    except OSError as error:
        error.filename = error.filename and str(folder)
        raise
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _serve(model: Model, folder: Path, options: argparse.Namespace) -> int:
    try:
        server = ViewServer(model, folder, options.port)
    except OSError as error:
        if error.errno not in (errno.EADDRINUSE, errno.EACCES):
            raise
        raise MeshletError(
            f"port {options.port} cannot be used: {error.strerror}",
            "choose another, or 0 for a free one",
            options=("port",),
        ) from None
    with server:
        try:
            print(f"{printable(options.input)}: {server.address} (Ctrl-C stops)", flush=True)
            if not options.no_browser and _has_display():
                webbrowser.open(server.address)
            server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0


def _has_display() -> bool:
    """Without one, webbrowser starts a browser for the terminal, which cannot show the page.

    Windows and macOS always have one.
    """
    variables = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, variables))
