"""The server of `gltf-meshlet view`: one user, this machine only.

Every address begins with a secret token, and only names in a table are served. The Host header
must name this machine, so that a page from elsewhere cannot reach the server under its own name
(DNS rebinding).
"""

from __future__ import annotations

import hmac
import json
import os
import re
import secrets
import shutil
import socket
import sys
import tempfile
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import metadata
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import parse_qs, urlsplit

from gltf_ext.errors import MeshletError, printable
from gltf_ext.portable import IS_WINDOWS
from gltf_ext.sources.importers import GLTF_SUFFIXES, MESH_SUFFIXES
from gltf_meshlet.view_models import Model, prepare_upload

ADDRESS = "127.0.0.1"
HOSTS = (ADDRESS, "localhost")  # with any port: a tunnel may have another
PAGE = Path(__file__).with_name("view_page")
MODELS = "models.json"
UPLOAD = "compress"
MAX_UPLOAD_BYTES = 2**31
MAX_NAME = 200  # characters of an uploaded file's name
PIECE = 1 << 20  # bytes read at a time
TOKEN_BYTES = 18
REQUEST_SECONDS = 60  # without a byte from the browser
RANGE = re.compile(r"bytes=(\d{1,15})-(\d{0,15})", re.ASCII)
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript",
    ".css": "text/css",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".wasm": "application/wasm",
    ".txt": "text/plain; charset=utf-8",
    ".glb": "model/gltf-binary",
}


def page_files() -> dict[str, Path]:
    """Name -> file of everything that the page consists of."""
    return {path.name: path for path in sorted(PAGE.iterdir()) if path.suffix in TYPES}


class _Refusal(Exception):
    """A request that is answered with a status and one line."""

    def __init__(self, status: HTTPStatus, problem: str) -> None:
        super().__init__(problem)
        self.status = status


class ViewServer(ThreadingHTTPServer):
    """Serves the page and a model, and compresses what the page sends.

    Raises OSError if the port cannot be used. port: 0 for any free one. folder: for uploads.
    """

    daemon_threads = True
    # On Windows this would let two servers have one port.
    allow_reuse_address = not IS_WINDOWS

    def __init__(
        self, model: Model, folder: Path, port: int = 0, max_upload: int = MAX_UPLOAD_BYTES
    ) -> None:
        super().__init__((ADDRESS, port), _Handler)
        self.token = secrets.token_urlsafe(TOKEN_BYTES)
        self.address = f"http://{ADDRESS}:{self.server_port}/{self.token}/"
        self.max_upload = max_upload
        self._folder = folder
        self._lock = threading.Lock()  # one upload at a time
        self._uploads = 0
        self._page = {"": PAGE / "index.html", **page_files()}
        self._first_files = _routes("first/", model)
        self._upload_files: dict[str, Path] = {}
        listing = {"server": True, "models": [model.description("first/")]}
        self.models = json.dumps(listing).encode()

    def server_bind(self) -> None:
        """Takes the port for this process alone."""
        if sys.platform == "win32":
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        super().server_bind()

    def file(self, name: str) -> Path | None:
        """The file behind a name, if there is one."""
        return {**self._page, **self._first_files, **self._upload_files}.get(name)

    def compress(self, name: str, suffix: str, stream: Any, length: int) -> dict[str, Any]:
        """Compresses an uploaded file; returns the model for the page.

        The files of the upload before are deleted: the page holds what it shows. Raises _Refused.
        """
        if not self._lock.acquire(blocking=False):
            raise _Refusal(
                HTTPStatus.SERVICE_UNAVAILABLE, "another file is being compressed; try again then"
            )
        try:
            self._uploads += 1
            folder = Path(tempfile.mkdtemp(dir=self._folder))
            route = f"upload-{self._uploads}/"
            try:
                model = _compress_upload(name, suffix, stream, length, folder)
            except BaseException:
                shutil.rmtree(folder, ignore_errors=True)
                raise
            old_files, self._upload_files = self._upload_files, _routes(route, model)
            for old_folder in {path.parent for path in old_files.values()}:
                shutil.rmtree(old_folder, ignore_errors=True)
            return model.description(route)
        finally:
            self._lock.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away is no error; anything else is one line."""
        error = sys.exc_info()[1]
        if not isinstance(error, ConnectionError | TimeoutError):
            line = printable(f"gltf-meshlet: view: {type(error).__name__}: {error}")
            print(line, file=sys.stderr)


def _routes(folder: str, model: Model) -> dict[str, Path]:
    return {folder + name: path for name, path in model.files().items()}


def _compress_upload(name: str, suffix: str, stream: Any, length: int, folder: Path) -> Model:
    path = folder / f"upload{suffix}"
    try:
        with open(path, "wb") as file:
            remaining = length
            while remaining:
                piece = stream.read(min(PIECE, remaining))
                if not piece:
                    raise ConnectionAbortedError
                file.write(piece)
                remaining -= len(piece)
        return prepare_upload(path, name, folder)
    except MeshletError as error:
        raise _Refusal(HTTPStatus.UNPROCESSABLE_ENTITY, error.message) from None
    except MemoryError:
        problem = "there is not enough memory; split the model"
        raise _Refusal(HTTPStatus.INSUFFICIENT_STORAGE, problem) from None
    except ConnectionError:
        raise
    except OSError as error:
        problem = f"{error.strerror}; free some space in {folder.parent}"
        raise _Refusal(HTTPStatus.INSUFFICIENT_STORAGE, problem) from None


class _Handler(BaseHTTPRequestHandler):
    server: ViewServer
    protocol_version = "HTTP/1.1"
    timeout = REQUEST_SECONDS

    def version_string(self) -> str:
        return f"gltf-meshlet/{metadata.version('gltf-meshlet')}"

    def log_message(self, format: str, *arguments: Any) -> None:
        """Silent: an address in a log would tell the token."""

    def do_GET(self) -> None:
        self._answer(self._get)

    def do_POST(self) -> None:
        self.close_connection = True  # a body may be left unread
        self._answer(self._post)

    def _answer(self, method: Any) -> None:
        try:
            self._check_host()
            method(self._name())
        except _Refusal as refusal:
            self._send_json({"error": str(refusal)}, refusal.status)

    def _check_host(self) -> None:
        """A page from elsewhere has its own host in Host or in Origin."""
        host = self.headers.get("Host", "")
        if host.rpartition(":")[0] not in HOSTS and host not in HOSTS:
            raise _Refusal(HTTPStatus.FORBIDDEN, f"open http://{ADDRESS}:{self.server.server_port}")
        if self.headers.get("Origin", f"http://{host}") != f"http://{host}":
            raise _Refusal(HTTPStatus.FORBIDDEN, "the request comes from another page")

    def _name(self) -> str:
        """What is asked for: the path after the token."""
        token, slash, name = urlsplit(self.path).path.removeprefix("/").partition("/")
        if not slash or not hmac.compare_digest(token.encode(), self.server.token.encode()):
            raise _Refusal(
                HTTPStatus.FORBIDDEN, "open the address that gltf-meshlet view has printed"
            )
        return name

    def _get(self, name: str) -> None:
        if name == MODELS:
            self._send(self.server.models, TYPES[".json"])
            return
        path = self.server.file(name)
        if path is None:
            raise _Refusal(HTTPStatus.NOT_FOUND, "there is no such file")
        try:
            with open(path, "rb") as file:
                self._send_file(file, TYPES[path.suffix.lower()])
        except (FileNotFoundError, PermissionError) as error:  # the user's file, since the start
            problem = f"{path.name} cannot be read: {error.strerror}"
            raise _Refusal(HTTPStatus.NOT_FOUND, problem) from None

    def _send_file(self, file: BinaryIO, kind: str) -> None:
        """The whole file, or the one range of bytes that is asked for."""
        state = os.fstat(file.fileno())
        size = state.st_size
        headers = {"Accept-Ranges": "bytes", "ETag": f'"{state.st_mtime_ns:x}-{size:x}"'}
        range_match = RANGE.fullmatch(self.headers.get("Range", ""))
        if range_match is None:
            self._send_headers(HTTPStatus.OK, kind, size, headers)
            shutil.copyfileobj(file, self.wfile, PIECE)
            return
        begin = int(range_match[1])
        end = min(int(range_match[2]) + 1, size) if range_match[2] else size
        if begin >= end:
            headers["Content-Range"] = f"bytes */{size}"
            self._send_headers(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, kind, 0, headers)
            return
        headers["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
        self._send_headers(HTTPStatus.PARTIAL_CONTENT, kind, end - begin, headers)
        file.seek(begin)
        while begin < end and (piece := file.read(min(PIECE, end - begin))):
            self.wfile.write(piece)
            begin += len(piece)

    def _post(self, name: str) -> None:
        if name != UPLOAD:
            raise _Refusal(HTTPStatus.NOT_FOUND, "there is nothing to write to")
        file_name = parse_qs(urlsplit(self.path).query).get("name", [""])[0][:MAX_NAME]
        suffix = Path(file_name).suffix.lower()
        if suffix not in GLTF_SUFFIXES + MESH_SUFFIXES:
            problem = f"use one of {' '.join(GLTF_SUFFIXES + MESH_SUFFIXES)}"
            raise _Refusal(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, problem)
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise _Refusal(HTTPStatus.LENGTH_REQUIRED, "Content-Length is missing")
        if int(length[:MAX_NAME]) > self.server.max_upload:
            problem = f"has more than {self.server.max_upload:,} bytes; use gltf-meshlet compress"
            raise _Refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, problem)
        size = int(length.lstrip("0") or "0")  # int() refuses thousands of zeros
        model = self.server.compress(file_name, suffix, self.rfile, size)
        self._send_json(model, HTTPStatus.OK)

    def _send_json(self, value: Any, status: HTTPStatus) -> None:
        self._send(json.dumps(value).encode(), TYPES[".json"], status)

    def _send(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send_headers(status, kind, len(body))
        self.wfile.write(body)

    def _send_headers(
        self, status: HTTPStatus, kind: str, length: int, extra: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        headers = {**HEADERS, "Content-Type": kind, "Content-Length": str(length), **(extra or {})}
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
