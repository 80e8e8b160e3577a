"""What compress, decompress and transcode make of a document: files, or a GLTF2 in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gltf_ext.document.buffer_layout import Pieces
from gltf_ext.document.container import fallback_of, model_files
from gltf_ext.document.document import Document
from gltf_ext.document.gltf2 import File, Model, is_path, name_of, size_of, to_gltf2
from gltf_ext.files import check_output, write_files

if TYPE_CHECKING:
    import pygltflib


def output_path(output: File | None, input: Model) -> Path | None:
    """Return the path to write, None for a GLTF2. Raises MeshletError for one that cannot be."""
    if output is None:
        return None
    check_output(Path(output), [input] if is_path(input) else [])
    return Path(output)


@dataclass
class Result:
    """A document that is laid out.

    Attributes:
        files: path -> pieces of its contents, the model last; empty for a GLTF2.
        gltf: the GLTF2, if there is no output path.
        output_bytes, fallback_bytes: of the result, and of its plain buffers for other readers.
    """

    files: dict[Path, Pieces]
    gltf: pygltflib.GLTF2 | None
    output_bytes: int
    fallback_bytes: int

    @classmethod
    def of(cls, document: Document, output: Path | None) -> Result:
        """Lay out a document for a path, or as a GLTF2. Raises MeshletError."""
        if output is None:
            return cls({}, *to_gltf2(document))
        files = model_files(document, output)
        sizes = {path: sum(map(len, pieces)) for path, pieces in files.items()}
        fallback = sizes.get(fallback_of(output), 0)
        return cls(files, None, sum(sizes.values()) - fallback, fallback)

    def write(self, input: Model, input_files: Sequence[Path]) -> dict[str, Any]:
        """Write the files, if any, and begin a command's report.

        Args:
            input: the model that was read.
            input_files: further files that were read.

        Returns:
            input, input_bytes (with those of input_files, but without a fallback), output and
            output_bytes; instead of writing, gltf: the GLTF2.

        Raises:
            MeshletError: an output is one of the files that were read.
            OSError: a file cannot be written.
        """
        report: dict[str, Any] = {"input": name_of(input), "output": None}
        report["input_bytes"] = _input_bytes(input, input_files)
        report["output_bytes"] = self.output_bytes
        if not self.files:
            return {**report, "gltf": self.gltf}
        write_files(self.files, [*([input] if is_path(input) else []), *input_files])
        *_, model = self.files
        return {**report, "output": str(model)}


def _input_bytes(input: Model, input_files: Sequence[Path]) -> int:
    fallback = fallback_of(Path(input)) if is_path(input) else None
    files = [path for path in dict.fromkeys(input_files) if path != fallback and path.is_file()]
    return size_of(input) + sum(path.stat().st_size for path in files)
