"""tests/codec/package/files.c: runs it and compares its records with the conformance vectors."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.helpers.environment import ROOT

SOURCE = ROOT / "tests" / "codec" / "package" / "files.c"
VECTORS = ROOT / "spec" / "vectors"
STRICT = ("-std=c11", "-Wall", "-Wextra", "-pedantic", "-Werror")

Records = list[tuple[str, bytes]]


def blobs() -> list[Path]:
    """The conformance vectors that are no glTF files."""
    return sorted(VECTORS.glob("*.bin"))


def run(command: Sequence[str | Path], files: Sequence[Path], folder: Path) -> bytes:
    """What the program says about files. command: how it is started, without arguments.

    Its files go to `folder`, which is its current folder.
    """
    (folder / "list").write_text("".join(f"{path}\n" for path in files))
    result = subprocess.run(
        [*command, "list", "records"], cwd=folder, capture_output=True, text=True, timeout=1800
    )
    assert result.returncode == 0, result.stderr
    return (folder / "records").read_bytes()


def records_of(data: bytes) -> dict[str, Records]:
    """Name of a file -> (key, contents) of its records."""
    files: dict[str, Records] = {}
    at = 0
    while at < len(data):
        end = data.index(b"\n", at)
        key, size = data[at:end].decode().split(" ")
        at = end + 1 + int(size)
        contents = data[end + 1 : at]
        if key == "file":
            current = files[contents.decode()] = []
        else:
            current.append((key, contents))
    return files


def check_vectors(data: bytes) -> None:
    """All vectors decode to their values, and malformed ones are refused with a sentence."""
    found = records_of(data)
    assert set(found) == {path.name for path in blobs()}
    for name, records in found.items():
        statuses = [text for key, text in records if key in ("open", "validate", "decode")]
        if name.startswith("malformed"):
            assert any(statuses), name
            continue
        assert len(statuses) == 3 and not any(statuses), (name, statuses)
        expected = json.loads((VECTORS / name).with_suffix(".json").read_text())
        rows = [expected["triangles"], *expected["values"]]
        arrays = [np.frombuffer(d, np.uint32) for k, d in records if k in ("triangles", "integers")]
        assert len(arrays) == len(rows), name
        for array, wanted in zip(arrays, rows):
            assert np.array_equal(array, np.array(wanted, np.uint32).ravel()), name
        values = [d for key, d in records if key == "values"]
        for array, wanted in zip(values, expected.get("components", ())):
            is_real = any(isinstance(number, float) for row in wanted for number in row)
            kinds = (np.float32,) if is_real else (np.uint32, np.float32)
            assert array in [np.array(wanted, kind).tobytes() for kind in kinds], name
        assert not any(text for key, text in records if key == "meshlet"), name
