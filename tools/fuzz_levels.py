"""Mutated tables and pages of levels through the reader: python -m tools.fuzz_levels [N [SEED]].

Each of N mutated files must be refused with one line, or give cuts whose meshes have indices in
range, within seconds. Run it with tools.sanitized to have the native code checked, too.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from gltf_ext.attributes.extension import compressed_primitives
from gltf_ext.checks.level_errors import measure_levels
from gltf_ext.checks.levels import lod_problems
from gltf_ext.document.container import parse_glb
from gltf_ext.errors import MeshletError
from gltf_ext.lod.cuts import View, cut_at_level, cut_for_view
from gltf_ext.lod.reading import read_lod

VECTORS = Path(__file__).resolve().parent.parent / "spec" / "lod_vectors"
MUTATIONS = 100_000
TOO_LONG = 5.0  # seconds for one file, with sanitizers on a busy machine
EXTREMES = (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f")
SAMPLES = 10  # points of each surface, to measure distances between


def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """Some bytes of a .glb's binary chunk changed: to anything, by a bit, or to extremes."""
    result = bytearray(data)
    start = data.index(b"BIN\0") + 4
    for _ in range(random.integers(1, 4)):
        at = int(random.integers(start, len(data)))
        kind = random.integers(3)
        if kind == 0:
            result[at] = random.integers(256)
        elif kind == 1:
            result[at] ^= 1 << random.integers(8)
        else:
            result[at : at + 4] = EXTREMES[random.integers(len(EXTREMES))]
    return bytes(result[: len(data)])


def use(data: bytes) -> bool:
    """Reads levels and cuts of a file, and measures them. Returns whether it was accepted.

    Raises AssertionError for an index out of range, or a refusal of several lines.
    """
    try:
        document = parse_glb(data)
        lod_problems(document)
        primitives = [read_lod(document, c) for c in compressed_primitives(document)]
        for primitive in filter(None, primitives):
            tables = primitive.tables
            cuts = [cut_at_level(tables, level) for level in range(tables.level_count)]
            cuts.append(cut_for_view(tables, View((0.0, 0.0, 9.0), 1000.0), 1.0))
            for cut in cuts:
                mesh = primitive.mesh(cut)
                assert len(mesh.indices) == 0 or mesh.indices.max() < mesh.vertex_count
        measure_levels(document, SAMPLES)
        return bool(primitives)
    except MeshletError as error:
        assert "\n" not in str(error)
        return False


def run(mutations: int, seed: int = 0) -> dict[str, float]:
    """Uses mutated files. Returns the number that was accepted, and the most seconds of one."""
    files = [path.read_bytes() for path in sorted(VECTORS.glob("lod_*.glb"))]
    assert files and all(use(data) for data in files)
    random = np.random.default_rng(seed)
    accepted, slowest = 0, 0.0
    for i in range(mutations):
        data = mutated(files[i % len(files)], random)
        start = time.perf_counter()
        try:
            accepted += use(data)
        except BaseException:
            print(f"mutation {i} of seed {seed}", file=sys.stderr)
            raise
        slowest = max(slowest, time.perf_counter() - start)
        assert slowest < TOO_LONG
    return {"accepted": accepted, "slowest": slowest}


def main() -> None:
    mutations = int(sys.argv[1]) if len(sys.argv) > 1 else MUTATIONS
    found = run(mutations, int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    print(
        f"levels: {mutations} run, {found['accepted']} decoded, "
        f"slowest {1000 * found['slowest']:.1f} ms"
    )


if __name__ == "__main__":
    main()
