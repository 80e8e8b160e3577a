"""The models that the web page of `gltf-meshlet view` shows, as files that a browser can read.

The page reads models.json: {"server": whether it may send files to compress, "models": [...]},
each model as `Model.described` gives it.
"""

from __future__ import annotations

import os
import re
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gltf_ext
from gltf_ext.attributes.extension import has_compressed
from gltf_ext.document.container import model_files
from gltf_ext.document.document import Document
from gltf_ext.document.images import embed_images
from gltf_ext.errors import MeshletError, blaming
from gltf_ext.files import write_files
from gltf_ext.lod.simplifier import has_simplifier
from gltf_ext.sources.importers import open_model
from gltf_ext.sources.primitives import all_primitives

MATERIAL_LIBRARY = re.compile(b"mtllib", re.IGNORECASE)
# Below, a view of the whole model at one pixel takes more bytes with levels: docs/lod.md.
MIN_TRIANGLES = 300_000


@dataclass(frozen=True)
class File:
    """A .glb without references to other files.

    Attributes:
        path: where it is.
        source_bytes: size of the user's file with the files that it refers to.
    """

    path: Path
    source_bytes: int


@dataclass(frozen=True)
class Model:
    """A compressed file and, if it is known, its original.

    Attributes:
        name: of the user's file.
        seconds: what compressing took; None if the user's file is compressed.
        warnings: one line each.
    """

    name: str
    compressed: File
    original: File | None
    seconds: float | None
    warnings: tuple[str, ...]

    def description(self, folder: str) -> dict[str, Any]:
        """For models.json. folder: of the model's files, as `files` names them; ends with "/"."""
        original = self.original and self.original.source_bytes
        return {
            "name": self.name,
            "compressed": {
                "file": folder + "compressed.glb",
                "bytes": self.compressed.source_bytes,
            },
            "original": original and {"file": folder + "original.glb", "bytes": original},
            "seconds": self.seconds,
            "warnings": list(self.warnings),
        }

    def files(self) -> dict[str, Path]:
        """Name on the page -> file."""
        candidates = {"compressed.glb": self.compressed, "original.glb": self.original}
        return {name: file.path for name, file in candidates.items() if file is not None}


def prepare(path: Path, original: Path | None, folder: Path) -> Model:
    """Compresses a file that is not compressed. Draws a progress bar on a terminal.

    original: of a compressed file. folder: empty, for files that have to be written.

    Raises MeshletError, OSError.
    """
    with blaming(path):
        document = open_model(path)
        if not has_compressed(document):
            if original is not None:
                raise MeshletError(
                    "is not compressed, so it is the original", "leave out --original"
                )
            return _compress(path, document, path.name, folder)
        file = _as_glb(path, document, folder / "compressed.glb")
    original_file = None
    if original is not None:
        with blaming(original):
            original_file = _as_glb(original, open_model(original), folder / "original.glb")
    return Model(path.name, file, original_file, None, ())


def prepare_upload(path: Path, name: str, folder: Path) -> Model:
    """Compresses a file that the page sent. name: of the user's file. Raises MeshletError, OSError.

    The file comes alone: paths in it would lead to files that the user did not choose.
    """
    warnings = []
    if path.suffix == ".obj" and MATERIAL_LIBRARY.search(content := path.read_bytes()):
        path.write_bytes(MATERIAL_LIBRARY.sub(b"#", content))
        warnings.append("its materials are left out; to keep them, name it on the command line")
    document = open_model(path)
    if document.files():
        raise MeshletError("refers to other files", "drop them together with it")
    model = _compress(path, document, name, folder)
    return replace(model, warnings=(*model.warnings, *warnings))


def _compress(path: Path, document: Document, name: str, folder: Path) -> Model:
    output = folder / "compressed.glb"
    start = time.perf_counter()
    report = gltf_ext.compress(path, output, progress=True, lod=_gains_from_levels(document))
    seconds = time.perf_counter() - start
    file = File(output, report["output_bytes"])
    original = _as_glb(path, document, folder / "original.glb")
    return Model(name, file, original, seconds, tuple(gltf_ext.compress_warnings(report)))


def _gains_from_levels(document: Document) -> bool:
    """Whether the model is large enough, and levels of detail can be built."""
    corners = (
        document.accessors[p["indices"]].get("count", 0)
        for _, _, p in all_primitives(document)
        if p.get("indices") in range(len(document.accessors))
    )
    is_large = sum(corners) >= 3 * MIN_TRIANGLES
    return is_large and has_simplifier()


def _as_glb(path: Path, document: Document, output: Path) -> File:
    """The file itself if it is a .glb that refers to no other, else one that is written."""
    references = document.files()
    source_bytes = sum(map(os.path.getsize, filter(os.path.isfile, {path, *references})))
    if path.suffix.lower() == ".glb" and not references:
        return File(path, source_bytes)
    embed_images(document)
    write_files(model_files(document, output), {path, *references})
    return File(output, source_bytes)
