"""How many bits does each choice of the format save, on real models?

Writes docs/choices.md, which the specification's rationale cites. Predictors and codes are compared
on the encoder's meshlets: the reference decoder gives every vertex and its neighbours, and each
alternative pays for its residuals and its code fields, meshlet by meshlet. Choices that the encoder
can switch off are compared by whole files. For options of `compress` see bench.parameters.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gltf_ext
from bench.common import markdown_table, origin_line, progress
from bench.models import real_models
from bench.size import section_bits
from gltf_ext import _codec
from gltf_ext.compression.extension import require_compressed
from gltf_ext.gltf.importers import open_model
from spec import predictors
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

NAMES = ("bunny", "beast", "igea", "engine")
NAMES_SWITCHED = (*NAMES, "dragon", "DamagedHelmet", "sponza_like")
OPTIONS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12}
# Predictors of any stream, and those that predict other streams from the positions.
PREDICTORS = {"parallelogram": PARALLELOGRAM, "mean": MEAN, "copy": COPY, "damped": DAMPED}
GEOMETRIC = {"GEO": GEO, "AFFINE": AFFINE}
CHOOSE = -1  # in place of a predictor: the encoder chooses
PARAMETERS = range(32)
# Parameters that a meshlet can choose from
RICE_CODES, EXPONENTIAL_CODES = 4, 3  # of traversed vertices
CHAIN_RICE_CODES = 7  # of chains, which have no exp-Golomb codes


# --- costs in bits ---


def zigzag(difference: int) -> int:
    return 2 * difference if difference >= 0 else -2 * difference - 1


def fixed_cost(residuals: list[list[int]]) -> int:
    """Bits: a code of 3, and per element a width of 5 and the residuals in that width."""
    return 3 + sum(5 + len(column) * max(column).bit_length() for column in zip(*residuals))


def rice_cost(residuals: list[list[int]], k: int) -> int:
    """Bits: a code of 3, and per residual a unary quotient and k low bits."""
    return 3 + sum((u >> k) + 1 + k for vertex in residuals for u in vertex)


def exponential_cost(residuals: list[list[int]], k: int) -> int:
    """Bits: a code of 3, and per residual the exp-Golomb code of parameter k."""
    return 3 + sum(2 * ((u >> k) + 1).bit_length() - 1 + k for vertex in residuals for u in vertex)


def class_costs(meshlets: list[list[list[int]]], chains: bool = False) -> dict[str, float]:
    """Bits per vertex of one class of residuals, [meshlet][vertex][element], for each code.

    "rice" and "exp-Golomb": with the format's number of parameters to choose from per meshlet.
    "all": the format's choice of codes per meshlet, with one base for the model.
    chains: the format's codes of chains, not those of traversed vertices.
    """
    rice_codes = CHAIN_RICE_CODES if chains else RICE_CODES
    meshlets = [residuals for residuals in meshlets if residuals]
    count = sum(map(len, meshlets))
    fixed = [fixed_cost(residuals) for residuals in meshlets]
    rice = [[rice_cost(residuals, k) for k in PARAMETERS] for residuals in meshlets]
    exponential = [[exponential_cost(residuals, k) for k in PARAMETERS] for residuals in meshlets]

    def best_rice(base: int) -> list[int]:
        return [min(of_k[base : base + rice_codes]) for of_k in rice]

    def best_exponential(first: int) -> list[int]:
        return [min(of_k[first : first + EXPONENTIAL_CODES]) for of_k in exponential]

    def best(base: int) -> list[int]:
        codes = [fixed, best_rice(base)]
        if not chains:
            codes.append(best_exponential(max(base, 1) - 1))
        return [min(costs) for costs in zip(*codes)]

    return {
        "fixed": sum(fixed) / count,
        "rice, one k": min(sum(of_k[k] - 3 for of_k in rice) for k in PARAMETERS) / count,
        "rice": min(sum(best_rice(base)) for base in PARAMETERS) / count,
        "exp-Golomb": min(sum(best_exponential(first)) for first in PARAMETERS[:-1]) / count,
        "all": min(sum(best(base)) for base in PARAMETERS) / count,
    }


# --- residuals of the alternatives ---


def traversed_residuals(decoder: Decoder, m: int, values, runs, predictor: int) -> list[list[int]]:
    """Residuals of stream 0's traversed vertices by one predictor."""
    residuals = []
    for v, a, b, o in decoder.traversed(decoder.file.meshlet(m), runs):
        prediction = values[b]  # of the root gate's a
        if a != b:
            prediction = predictors.apex(predictor, values, values, a, b, o, v)
        residuals.append([zigzag(x - p) for x, p in zip(values[v], prediction)])
    return residuals


def toward(run: list[list[int]], i: int) -> list[int]:
    """The format's prediction of vertex i: a step from the one before it toward the end."""
    return predictors.toward(run[i - 1], run[-1], len(run) - i)


def chord(run: list[list[int]], i: int) -> list[int]:
    """Vertex i of equal steps on the line between the two ends."""
    n = len(run) - 1
    return [a + (i * (b - a) + n // 2) // n for a, b in zip(run[0], run[-1])]


def previous(run: list[list[int]], i: int) -> list[int]:
    """The vertex before vertex i."""
    return run[i - 1]


CHAINS = {"toward the end": toward, "chord": chord, "previous": previous}


def chain_residuals(meshlet, values, runs, predict) -> list[list[int]]:
    """Residuals of stream 0 inside owned references. predict: one of CHAINS."""
    residuals = []
    for reference, run in zip(meshlet.references, runs):
        if reference.kind != OWNED:
            continue
        points = [values[v] for v in run]
        for i in range(1, len(points) - 1):
            prediction = predict(points, i)
            residuals.append([zigzag(x - p) for x, p in zip(points[i], prediction)])
    return residuals


def count_hops(decoder: Decoder, meshlet, j: int) -> int:
    hops = 0
    here = meshlet, j
    while (here := decoder.hop(*here, lambda reference: reference.shares(0))) is not None:
        hops += 1
    return hops


# --- measurements ---


def measure_meshlets(blobs: list[bytes]) -> dict:
    """Figures per vertex and per meshlet of some blobs."""
    traversed = {name: [] for name in PREDICTORS}
    chains = {name: [] for name in CHAINS}
    kinds, hops, symbols, stored = Counter(), Counter(), Counter(), Counter()
    meshlets = disks = 0
    for blob in blobs:
        decoder = Decoder(blob)
        for m in range(decoder.file.meshlet_count):
            meshlet = decoder.file.meshlet(m)
            values = decoder.meshlet(m)[1][0]
            runs = decoder.boundary(meshlet)
            for name, predictor in PREDICTORS.items():
                traversed[name].append(traversed_residuals(decoder, m, values, runs, predictor))
            for name, predict in CHAINS.items():
                chains[name].append(chain_residuals(meshlet, values, runs, predict))
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
        "traversed": {name: class_costs(residuals) for name, residuals in traversed.items()},
        "chains": {name: class_costs(residuals, True) for name, residuals in chains.items()},
        "references_per_meshlet": {
            kind: kinds[kind] / meshlets for kind in (OWNED, FOREIGN, PRIVATE)
        },
        "corners_by_hops": {str(n): hops[n] / sum(hops.values()) for n in sorted(hops)},
        "disks_per_meshlet": disks / meshlets,
    }


def totals(path: Path, folder: Path, **options) -> tuple[dict, Path]:
    output = folder / "out.glb"
    gltf_ext.compress(path, output, **OPTIONS, **options)
    return gltf_ext.inspect(output)["totals"], output


Row = Mapping[str, Any]  # of the stream table, for _codec.encode
Chooser = Callable[[int, Row], int]


def one_for_all(predictor: int) -> Chooser:
    """The predictor for every stream that allows it; of the others the encoder chooses."""

    def choose(s: int, row: Row) -> int:
        return predictor if is_allowed(predictor, s, row) else CHOOSE

    return choose


def is_allowed(predictor: int, s: int, row: Row) -> bool:
    """True if stream s may have the predictor; stream 0 has positions."""
    if predictor == GEO:
        return s > 0 and row["kind"] == OCT
    if predictor == AFFINE and (s == 0 or row["kind"] in (OCT, SIGN)):
        return False
    return row["bits"] <= MAX_PREDICTED_BITS


@contextmanager
def encoder(choose: Chooser | None = None, cheapest_of: Sequence[int] = (), **options):
    """Makes gltf_ext.compress use other predictors and other options of _codec.encode.

    choose: (number of a stream, its row of the table) -> predictor
    cheapest_of: instead, each stream gets the one of these with the fewest bits
    """
    original = _codec.encode

    def encode(triangles, ids, positions, streams, values, **rest):
        def with_predictors(choose: Chooser):
            rows = [{**row, "predictor": choose(s, row)} for s, row in enumerate(streams)]
            return original(triangles, ids, positions, rows, values, **rest, **options)

        if cheapest_of:
            bits = {p: with_predictors(one_for_all(p))[1]["bits"]["streams"] for p in cheapest_of}
            best = [min(bits, key=lambda p: bits[p][s]) for s in range(len(streams))]
            return with_predictors(lambda s, row: one_for_all(best[s])(s, row))
        return with_predictors(choose or one_for_all(CHOOSE))

    _codec.encode = encode
    try:
        yield
    finally:
        _codec.encode = original


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
    paths = {path.stem: path for path in real_models()}
    rows, switched = [], []
    for name, path in paths.items():
        if name in NAMES:
            rows.append(measure_model(path))
            progress(name)
    for name, path in paths.items():
        if name in NAMES_SWITCHED:
            switched.append(measure_switched(path))
            progress(f"{name}, choices switched off")
    return {"options": OPTIONS, "models": rows, "switched": switched}


def measure_model(path: Path) -> dict:
    """One model at the usual options."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole, output = totals(path, folder)
        blobs = [b for p in require_compressed(open_model(output)) for b in p.blobs]
        figures = measure_meshlets(blobs)
        return {
            "model": path.stem,
            "bits_per_triangle": whole["bits_per_triangle"],
            "reference_bits_per_meshlet": sum(
                _codec.describe(blob)["bits"]["references"] for blob in blobs
            )
            / whole["meshlets"],
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
    rows = result["models"]
    connectivity = [
        [
            row["model"],
            *figures((100 * row["symbols"][s] for s in "CLERS"), 1),
            *figures((plain_bits(row["symbols"]),)),
            *figures((row["bits_per_triangle"]["connectivity"], row["entropy"])),
        ]
        for row in rows
    ]
    codes = list(rows[0]["traversed"]["parallelogram"])
    traversed = [
        [f"{row['model']}, {name}", *figures((costs[code] for code in codes), 1)]
        for row in rows
        for name, costs in row["traversed"].items()
    ]
    chains = [
        [f"{row['model']}, {name}", *figures((costs[code] for code in codes), 1)]
        for row in rows
        for name, costs in row["chains"].items()
    ]
    boundary = []
    for row in rows:
        hops = row["corners_by_hops"]
        more_hops = sum(share for n, share in hops.items() if int(n) > 2)
        boundary.append(
            [
                row["model"],
                *figures(row["references_per_meshlet"].values()),
                *figures((row["disks_per_meshlet"],)),
                *figures((row["reference_bits_per_meshlet"],), 1),
                *figures((100 * hops.get(n, 0) for n in ("0", "1", "2")), 1),
                *figures((100 * more_hops,), 1),
            ]
        )
    boundary_headings = [
        *("model", "owned", "foreign", "private", "disks", "bits"),
        *("stored", "1 hop", "2 hops", "more"),
    ]
    sharing = []
    for row in rows:
        shared, alone = row["boundary_bits_per_triangle"].values()
        larger = 100 * (alone - shared) / row["bits_per_triangle"]["total"]
        sharing.append([row["model"], *figures((shared, alone)), *figures((larger,), 1)])
    switched = [[row["model"], *figures(row["bits"].values())] for row in result["switched"]]
    return f"""# What each choice of the format is worth

{origin_line(result)}
Positions have 12 bits, normals 8 + 8, texture coordinates 12.

## Connectivity

Share of each symbol in percent. Bits per triangle in the paper's code (2 for C, R, E; 3 for L, S)
and as stored: 1 for R, 2 to 4 for the others in one of two orders per group of meshlets, none for
the last E of a meshlet. Last, the entropy of the stored symbols.

{markdown_table(["model", *"CLERS", "paper's code", "stored", "entropy"], connectivity)}
## Positions of traversed vertices

Bits per vertex (three elements, codes included) in these codes:

* fixed: widths per meshlet,
* rice, one k: one Rice parameter for the model,
* rice: the best of four neighbouring Rice parameters per meshlet,
* exp-Golomb: the best of three neighbouring exp-Golomb parameters per meshlet,
* all: the best of fixed, rice and exp-Golomb per meshlet, as in the format.

The format has two more predictors: GEO and AFFINE predict other streams from the positions. The
last table has their gain.

{markdown_table(["model, predictor", *codes], traversed)}
## Positions of chain vertices

The same for the vertices between two corners of an owned run: predicted by a step from the vertex
before toward the run's end, as in the format, from the chord between the corners, or from the
vertex before alone. Of Rice codes, a meshlet has seven to choose from; the format uses no
exp-Golomb codes here, since neighbours could not find their low bits without a scan.

{markdown_table(["model, predictor", *codes], chains)}
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
