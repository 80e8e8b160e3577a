"""The other formats of meshlets that a GPU decodes one by one, on the same integers as ours.

    found, missing = available()
    run = found[0].run(integers_of(primitives))

Each runs a program of bench/peer_programs, built on first use from a checkout of the other project:
GLTF_MESHLET_MESHOPTIMIZER names one of github.com/zeux/meshoptimizer (1.2 or later),
GLTF_MESHLET_DGF one of github.com/GPUOpen-LibrariesAndSDKs/DGF-SDK.
"""

from __future__ import annotations

import functools
import itertools
import json
import os
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import gltf_ext
from bench import peers
from bench.common import BITS, ROOT
from bench.models import blobs_of
from bench.peers import PeerMissing, checkout_version, plan_of, position_grids, write_primitives
from gltf_ext.attributes.streams import Bits
from gltf_ext.sources.primitives import Primitive
from tools.native_build import build_folder

PROGRAMS = ROOT / "bench" / "peer_programs"
DEFAULT_BITS = Bits()
POSITION_ELEMENTS = 3


@dataclass(frozen=True)
class Integers:
    """One primitive as our encoder gets it.

    triangles: uint32[T, 3]; values: uint32[V, E], of all streams, the position first; bits: of each
    of the E elements.
    """

    triangles: np.ndarray
    values: np.ndarray
    bits: tuple[int, ...]


@dataclass(frozen=True)
class Run:
    """What a format made of primitives.

    bytes: all that a GPU needs to decode meshlets one by one; meshlets: their number; decoded: the
    primitives, with a vertex for each that a meshlet stores; decode_seconds: one per repetition, on
    one thread.
    """

    bytes: int
    meshlets: int
    decoded: list[Integers]
    decode_seconds: list[float]


def integers_of(primitives: list[Primitive], bits: Bits = DEFAULT_BITS) -> list[Integers]:
    """Primitives on the grids of gltf_ext.compress."""
    grids = position_grids(primitives, bits)
    result = []
    for primitive in primitives:
        plan = plan_of(primitive, grids[primitive.mesh], bits)
        bits_of_elements = [s.bits for s in plan.streams for _ in range(s.elements)]
        quantised = plan.quantise(primitive.attributes)
        values = np.concatenate([quantised[s] for s in range(len(plan.streams))], axis=1)
        result.append(Integers(primitive.indices, values, tuple(bits_of_elements)))
    return result


def compressed(primitives: list[Primitive], **options) -> tuple[dict, list[bytes]]:
    """Ours: (inspect's totals of the primitives' file, its blobs). options: of compress."""
    with tempfile.TemporaryDirectory() as folder:
        source, output = Path(folder) / "in.glb", Path(folder) / "out.glb"
        write_primitives(primitives, source)
        gltf_ext.compress(source, output, **{**BITS, **options})
        return gltf_ext.inspect(output)["totals"], blobs_of(output)


class MeshoptMeshlets:
    """meshoptimizer's meshlet codec; each meshlet has its vertices, packed with the least bits.

    The limits of a meshlet are those that meshoptimizer recommends for NVIDIA's GPUs.
    """

    name = "meshopt meshlets"
    limits = ("64", "126")  # vertices, triangles

    def __init__(self) -> None:
        self.checkout = _checkout(
            "GLTF_MESHLET_MESHOPTIMIZER", "zeux/meshoptimizer", "src/meshletcodec.cpp"
        )
        self.version = f"meshoptimizer {checkout_version(self.checkout)}"

    def run(self, parts: list[Integers]) -> Run:
        """Encodes, decodes and times."""
        program = _program("meshopt_meshlets", "MESHOPTIMIZER", self.checkout)
        return _run([program, *self.limits], parts)


class DenseGeometry:
    """AMD's DGF by its SDK's baker: positions and triangles, in blocks of 128 bytes.

    Other attributes lie beside the blocks: an array of the vertices of each block, in whole bytes
    per attribute, found through the blocks' user data, as the SDK's manual describes.

    packer: "SAH", which the SDK recommends, or "HPG24", which packs more into a block.
    """

    def __init__(self, packer: str = "SAH"):
        self.checkout = _checkout(
            "GLTF_MESHLET_DGF", "GPUOpen-LibrariesAndSDKs/DGF-SDK", "DGFLib/DGF.cpp"
        )
        self.packer, self.name = packer, f"AMD DGF, {packer}"
        self.version = f"DGF-SDK {checkout_version(self.checkout)}"

    def run(self, parts: list[Integers]) -> Run:
        """Encodes, decodes and times. Decodes positions only."""
        program = _program("dgf_blocks", "DGF_SDK", self.checkout)
        bare = [
            Integers(p.triangles, p.values[:, :POSITION_ELEMENTS], p.bits[:POSITION_ELEMENTS])
            for p in parts
        ]
        has_attributes = any(len(part.bits) > POSITION_ELEMENTS for part in parts)
        run = _run([program, self.packer, "4" if has_attributes else "0"], bare)
        attributes = sum(
            _attribute_bytes(part.bits) * len(own.values) for part, own in zip(parts, run.decoded)
        )
        return replace(run, bytes=run.bytes + attributes)


def _attribute_bytes(bits: tuple[int, ...]) -> int:
    """Bytes of a vertex without its position; all further attributes have two elements."""
    return sum(-(-(a + b) // 8) for a, b in zip(bits[3::2], bits[4::2]))


def available() -> tuple[list, list[str]]:
    """(the installed formats, a line per missing one: what to do)."""
    return peers.available([MeshoptMeshlets, DenseGeometry, lambda: DenseGeometry("HPG24")])


# --- their programs ---


def _checkout(variable: str, repository: str, file: str) -> Path:
    folder = os.environ.get(variable, "")
    if not folder or not (Path(folder) / file).is_file():
        raise PeerMissing(
            f"{repository}: check it out from github.com/{repository} and set {variable} to its "
            "folder; the programs build on first use"
        )
    return Path(folder).resolve()


@functools.cache
def _program(name: str, option: str, checkout: Path) -> Path:
    return build_folder(PROGRAMS, ROOT / "build" / name, f"-D{option}={checkout}") / name


def _run(command: list[object], parts: list[Integers]) -> Run:
    with tempfile.TemporaryDirectory() as folder:
        source, decoded = Path(folder) / "in", Path(folder) / "decoded"
        _words(parts).tofile(source)
        arguments = [*command, source, decoded]
        done = subprocess.run(list(map(str, arguments)), stdout=subprocess.PIPE, check=True)
        return Run(**json.loads(done.stdout), decoded=_parts(np.fromfile(decoded, np.uint32)))


def _words(parts: list[Integers]) -> np.ndarray:
    """The file of bench/peer_programs/parts.h."""
    words = [np.array([len(parts)])]
    for part in parts:
        words.append(np.array([len(part.triangles), *part.values.shape, *part.bits]))
        words += [part.triangles.ravel(), part.values.ravel()]
    return np.concatenate(words).astype(np.uint32)


def _parts(words: np.ndarray) -> list[Integers]:
    parts, at = [], 1
    for _ in range(words[0]):
        triangles, vertices, elements = map(int, words[at : at + 3])
        ends = np.cumsum([at + 3, elements, 3 * triangles, elements * vertices])
        bits, corners, values = (words[a:b] for a, b in itertools.pairwise(ends))
        shaped = corners.reshape(-1, 3), values.reshape(-1, elements)
        parts.append(Integers(*shaped, tuple(bits.tolist())))
        at = int(ends[-1])
    return parts
