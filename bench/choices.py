"""How many bits does each choice of the format save, on real models?

Writes docs/choices.md. Choices that the encoder can switch off are compared by whole files; the
reference decoder counts symbols, references and hops. For options of `compress` see
bench.parameters.
"""

from __future__ import annotations

import argparse
import functools
import math
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import gltf_ext
from bench.common import BITS, markdown_table, origin_line, progress
from bench.models import blobs_of, real_models
from bench.size import section_bits
from gltf_ext import _codec
from spec.reference_decoder import (
    AFFINE,
    COPY,
    DAMPED,
    FOREIGN,
    GEO,
    MAX_PREDICTED_BITS,
    MEAN,
    OCT,
    OWNED,
    PARALLELOGRAM,
    PRIVATE,
    SIGN,
    Decoder,
)
from tools import paper_encoder

NAMES = ("bunny", "beast", "igea", "engine")
NAMES_SWITCHED = (*NAMES, "dragon", "DamagedHelmet", "sponza_like")
# Predictors of any stream, and those that predict other streams from the positions.
PREDICTORS = {"parallelogram": PARALLELOGRAM, "mean": MEAN, "copy": COPY, "damped": DAMPED}
GEOMETRIC = {"GEO": GEO, "AFFINE": AFFINE}
CHOOSE = -1  # in place of a predictor: the encoder chooses


def count_hops(decoder: Decoder, meshlet, j: int) -> int:
    hops = 0
    here = meshlet, j
    while (here := decoder.hop(*here, lambda reference: reference.shares(0))) is not None:
        hops += 1
    return hops


# --- measurements ---


def measure_meshlets(blobs: list[bytes]) -> dict:
    """Figures per vertex and per meshlet of some blobs."""
    kinds, hops, symbols, stored = Counter(), Counter(), Counter(), Counter()
    meshlets = disks = 0
    for blob in blobs:
        decoder = Decoder(blob)
        for m in range(decoder.file.meshlet_count):
            meshlet = decoder.file.meshlet(m)
            kinds.update(reference.kind for reference in meshlet.references)
            hops.update(count_hops(decoder, meshlet, j) for j in range(len(meshlet.references)))
            symbols.update(meshlet.symbols)
            stored.update(meshlet.symbols[:-1])  # the last one is always E
            disks += len(meshlet.loops)
            meshlets += 1
    total = sum(symbols.values())
    return {
        "symbols": {symbol: symbols[symbol] / total for symbol in "CLERS"},
        "entropy": -sum(n * math.log2(n / stored.total()) for n in stored.values()) / total,
        "references_per_meshlet": {
            kind: kinds[kind] / meshlets for kind in (OWNED, FOREIGN, PRIVATE)
        },
        "corners_by_hops": {str(n): hops[n] / sum(hops.values()) for n in sorted(hops)},
        "disks_per_meshlet": disks / meshlets,
    }


def totals(path: Path, folder: Path, **options) -> tuple[dict, Path]:
    output = folder / "out.glb"
    gltf_ext.compress(path, output, **{**BITS, **options})
    return gltf_ext.inspect(output)["totals"], output


Chooser = Callable[[int, _codec.Stream], int]


def one_for_all(predictor: int) -> Chooser:
    """The predictor for every stream that allows it; of the others the encoder chooses."""

    def choose(s: int, stream: _codec.Stream) -> int:
        return predictor if is_allowed(predictor, s, stream) else CHOOSE

    return choose


def is_allowed(predictor: int, s: int, stream: _codec.Stream) -> bool:
    """True if stream s may have the predictor; stream 0 has positions."""
    if predictor == GEO:
        return s > 0 and stream.kind == OCT
    if predictor == AFFINE and (s == 0 or stream.kind in (OCT, SIGN)):
        return False
    return stream.bits <= MAX_PREDICTED_BITS


@contextmanager
def encoder(choose: Chooser | None = None, cheapest_of: Sequence[int] = (), **options):
    """Makes gltf_ext.compress use other predictors and options of tools.paper_encoder.

    choose: (number of a stream, the stream) -> predictor
    cheapest_of: instead, each stream gets the one of these with the fewest bits
    """
    replaced = _codec.encode
    original = replaced
    if "share_seams" in options:
        original = functools.partial(paper_encoder.encode, as_paper=False)

    def encode(triangles, ids, positions, streams, values, **rest):
        def with_predictors(choose: Chooser):
            chosen = [replace(t, predictor=choose(s, t)) for s, t in enumerate(streams)]
            return original(triangles, ids, positions, chosen, values, **rest, **options)

        if cheapest_of:
            bits = {p: with_predictors(one_for_all(p))[1]["bits"]["streams"] for p in cheapest_of}
            best = [min(bits, key=lambda p: bits[p][s]) for s in range(len(streams))]
            return with_predictors(lambda s, stream: one_for_all(best[s])(s, stream))
        return with_predictors(choose or one_for_all(CHOOSE))

    _codec.encode = encode
    try:
        yield
    finally:
        _codec.encode = replaced


def measure_switched(path: Path) -> dict:
    """Bits per triangle of whole files with single choices switched off."""
    every = {**PREDICTORS, **GEOMETRIC}
    cases = {
        "as is": {},
        "seams stored twice": {"share_seams": False},
        "no GEO, no AFFINE": {"cheapest_of": tuple(PREDICTORS.values())},
        **{name: {"choose": one_for_all(p)} for name, p in every.items()},
    }
    bits = {}
    with tempfile.TemporaryDirectory() as name:
        for case, options in cases.items():
            with encoder(**options):
                bits[case] = totals(path, Path(name))[0]["bits_per_triangle"]["total"]
    return {"model": path.stem, "bits": bits}


def measure(options: argparse.Namespace) -> dict:
    """Figures of single meshlets, and of whole files with choices switched off."""
    rows, switched = [], []
    for path in real_models():
        if path.stem in NAMES:
            rows.append(measure_model(path))
        if path.stem in NAMES_SWITCHED:
            switched.append(measure_switched(path))
        progress(path.stem)
    return {"models": rows, "switched": switched}


def measure_model(path: Path) -> dict:
    """One model at the usual options."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole, output = totals(path, folder)
        blobs = blobs_of(output)
    figures = measure_meshlets(blobs)
    reference_bits = sum(_codec.describe(blob)["bits"]["references"] for blob in blobs)
    return {
        "model": path.stem,
        "bits_per_triangle": whole["bits_per_triangle"],
        "reference_bits_per_meshlet": reference_bits / whole["meshlets"],
        **figures,
        "boundary_bits_per_triangle": boundary_bits(blobs, whole["triangles"], figures),
    }


def boundary_bits(blobs: list[bytes], triangles: int, figures: dict) -> dict[str, float]:
    """Bits per triangle for boundary vertices: shared, and if every meshlet stored all of its own.

    The second assumes the same cost per vertex as now.
    """
    sections = sum((section_bits(blob) for blob in blobs), Counter())
    kinds = figures["references_per_meshlet"]
    chains = sections["chains"] * (kinds[OWNED] + kinds[FOREIGN]) / kinds[OWNED]
    anchors = sections["anchors"] / figures["corners_by_hops"]["0"]
    return {
        "shared": (sections["chains"] + sections["anchors"]) / triangles,
        "alone": (chains + anchors) / triangles,
    }


# --- the document ---


def figures(values, digits: int = 2) -> list[str]:
    """Numbers as text."""
    return [f"{value:.{digits}f}" for value in values]


def plain_bits(symbols: dict[str, float]) -> float:
    """Bits per symbol of the code that the format does not use: 2 for C, R, E and 3 for L, S."""
    return sum(share * (3 if symbol in "LS" else 2) for symbol, share in symbols.items())


def report(result: dict) -> str:
    """docs/choices.md."""
    connectivity, boundary, sharing = [], [], []
    for row in result["models"]:
        symbols, hops = row["symbols"], row["corners_by_hops"]
        more_hops = sum(share for n, share in hops.items() if int(n) > 2)
        bits = row["bits_per_triangle"]
        shared, alone = row["boundary_bits_per_triangle"].values()
        connectivity.append([
            row["model"],
            *figures((100 * symbols[s] for s in "CLERS"), 1),
            *figures((plain_bits(symbols), bits["connectivity"], row["entropy"])),
        ])  # fmt: skip
        boundary.append([
            row["model"],
            *figures((*row["references_per_meshlet"].values(), row["disks_per_meshlet"])),
            *figures((row["reference_bits_per_meshlet"],), 1),
            *figures((100 * share for share in (*(hops.get(n, 0) for n in "012"), more_hops)), 1),
        ])  # fmt: skip
        larger = 100 * (alone - shared) / bits["total"]
        sharing.append([row["model"], *figures((shared, alone)), *figures((larger,), 1)])
    boundary_headings = [
        *("model", "owned", "foreign", "private", "disks", "bits"),
        *("stored", "1 hop", "2 hops", "more"),
    ]
    switched = [[row["model"], *figures(row["bits"].values())] for row in result["switched"]]
    return f"""# What each choice of the format is worth

{origin_line(result)}
Positions have 12 bits, normals 8 + 8, texture coordinates 12.

## Connectivity

Share of each symbol in percent. Bits per triangle in the paper's code (2 for C, R, E; 3 for L, S)
and as stored: 1 for R, 2 to 4 for the others in one of two orders per group of meshlets, none for
the last E of a meshlet. Last, the entropy of the stored symbols.

{markdown_table(["model", *"CLERS", "paper's code", "stored", "entropy"], connectivity)}
## Boundaries

References and disks per meshlet; bits per meshlet of references, codes, headers and tables; and
where corner values are stored: percent in the meshlet itself, and after one, two and more hops.

{markdown_table(boundary_headings, boundary)}
## Sharing boundaries

Bits per triangle of boundary vertices (corners and chains, all attributes): as they are, each
stored by one meshlet; an estimate if every meshlet stored all of its own, with the same bits for
each; and how much larger the file would be, in percent.

{markdown_table(["model", "shared", "stored by each", "larger by, %"], sharing)}
## Choices switched off

Bits per triangle of whole files:

* as they are: the encoder chooses a predictor for each stream;
* with both sides of every seam stored;
* without the predictors from positions: each stream has the best of the other four;
* with one predictor for all streams that allow it. GEO is only for normals, AFFINE for all but
  positions and normals; the encoder chooses the predictors of the other streams.

{markdown_table(["model", *result["switched"][0]["bits"]], switched)}"""
