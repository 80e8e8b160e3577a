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
from contextlib import contextmanager
from pathlib import Path

import gltf_ext
from bench.common import Question, markdown_table, origin_line, progress, write_page
from bench.models import real_models
from bench.size import section_bits
from gltf_ext import _codec
from gltf_ext.compression.extension import require_compressed
from gltf_ext.gltf.importers import open_model
from spec.reference_decoder import (
    COPY,
    DAMPED,
    FOREIGN,
    MEAN,
    OWNED,
    PARALLELOGRAM,
    PRIVATE,
    Decoder,
)

NAMES = ("bunny", "beast", "igea", "engine")
NAMES_SWITCHED = (*NAMES, "dragon", "DamagedHelmet", "sponza_like")
OPTIONS = {"position_bits": 12, "normal_bits": 8, "texcoord_bits": 12}
PREDICTORS = {"parallelogram": PARALLELOGRAM, "mean": MEAN, "copy": COPY, "damped": DAMPED}
RICE_CODES = 7
MASK = 0xFFFFFFFF


# --- costs in bits ---


def zigzag(difference: int) -> int:
    return 2 * difference if difference >= 0 else -2 * difference - 1


def fixed_cost(residuals: list[list[int]]) -> int:
    """Bits: a code of 3, and per element a width of 5 and the residuals in that width."""
    return 3 + sum(5 + len(column) * max(column).bit_length() for column in zip(*residuals))


def rice_cost(residuals: list[list[int]], k: int) -> int:
    """Bits: a code of 3, and per residual a unary quotient and k low bits."""
    return 3 + sum((u >> k) + 1 + k for vertex in residuals for u in vertex)


def class_costs(meshlets: list[list[list[int]]]) -> dict[str, float]:
    """Bits per vertex of one class of residuals, [meshlet][vertex][element], for each code."""
    meshlets = [residuals for residuals in meshlets if residuals]
    count = sum(map(len, meshlets))
    fixed = [fixed_cost(residuals) for residuals in meshlets]
    rice = [[rice_cost(residuals, k) for k in range(32)] for residuals in meshlets]
    base = min(
        range(32 - RICE_CODES + 1),
        key=lambda b: sum(min(f, *r[b : b + RICE_CODES]) for f, r in zip(fixed, rice)),
    )
    best = [min(r[base : base + RICE_CODES]) for r in rice]
    model_wide = min(sum(r[k] - 3 for r in rice) for k in range(32))
    return {
        "fixed": sum(fixed) / count,
        "rice, one k for the model": model_wide / count,
        "rice": sum(best) / count,
        "either": sum(map(min, fixed, best)) / count,
    }


# --- residuals of the alternatives ---


def traversed_residuals(decoder: Decoder, m: int, values, runs, predictor: int) -> list[list[int]]:
    """Residuals of stream 0's traversed vertices by one predictor."""
    residuals = []
    for v, a, b, o in decoder.traversed(decoder.file.meshlet(m), runs):
        prediction = decoder.predict(
            predictor, values[a], values[b], None if o is None else values[o]
        )
        residuals.append([zigzag(x - p) for x, p in zip(values[v], prediction)])
    return residuals


def chain_residuals(meshlet, values, runs, chord: bool) -> list[list[int]]:
    """Residuals of stream 0 inside owned references, from the chord or the previous vertex."""
    residuals = []
    for reference, run in zip(meshlet.references, runs):
        if reference.kind != OWNED:
            continue
        points = [values[v] for v in run]
        predictions = (
            Decoder.chain(meshlet.streams[0], points[0], points[-1], [[0] * 3] * (len(run) - 2))
            if chord
            else points
        )
        for point, prediction in zip(points[1:-1], predictions):
            residuals.append([zigzag(x - p) for x, p in zip(point, prediction)])
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
    chains = {"chord": [], "previous": []}
    kinds, hops, symbols = Counter(), Counter(), Counter()
    meshlets = disks = 0
    for blob in blobs:
        decoder = Decoder(blob)
        for m in range(decoder.file.meshlet_count):
            meshlet = decoder.file.meshlet(m)
            values = decoder.meshlet(m)[1][0]
            runs = decoder.boundary(meshlet)
            for name, predictor in PREDICTORS.items():
                traversed[name].append(traversed_residuals(decoder, m, values, runs, predictor))
            for name in chains:
                chains[name].append(chain_residuals(meshlet, values, runs, name == "chord"))
            kinds.update(reference.kind for reference in meshlet.references)
            hops.update(count_hops(decoder, meshlet, j) for j in range(len(meshlet.references)))
            symbols.update(meshlet.symbols)
            disks += len(meshlet.loops)
            meshlets += 1
    total = sum(symbols.values())
    return {
        "symbols": {symbol: symbols[symbol] / total for symbol in "CLERS"},
        "entropy": -sum(n / total * math.log2(n / total) for n in symbols.values()),
        "traversed": {name: class_costs(residuals) for name, residuals in traversed.items()},
        "chains": {name: class_costs(residuals) for name, residuals in chains.items()},
        "references_per_meshlet": {
            kind: kinds[kind] / meshlets for kind in (OWNED, FOREIGN, PRIVATE)
        },
        "corners_by_hops": {str(n): hops[n] / sum(hops.values()) for n in sorted(hops)},
        "components_per_meshlet": disks / meshlets,
    }


def totals(path: Path, folder: Path, **options) -> tuple[dict, Path]:
    output = folder / "out.glb"
    gltf_ext.compress(path, output, **OPTIONS, **options)
    return gltf_ext.inspect(output)["totals"], output


@contextmanager
def encoder(predictor: int = -1, **options):
    """Makes gltf_ext.compress use one predictor and other options of _codec.encode."""
    original = _codec.encode

    def changed(triangles, ids, positions, streams, values, **rest):
        streams = [
            {**stream, "predictor": predictor if stream["bits"] <= 24 else -1} for stream in streams
        ]
        return original(triangles, ids, positions, streams, values, **rest, **options)

    _codec.encode = changed
    try:
        yield
    finally:
        _codec.encode = original


def measure_switched(path: Path) -> dict:
    """Bits per triangle of whole files with single choices switched off."""
    cases = {
        "as is": {},
        "seams stored twice": {"share_seams": False},
        **{name: {"predictor": p} for name, p in PREDICTORS.items()},
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


# --- the page ---


def figures(values, digits: int = 2) -> list[str]:
    """Numbers as text."""
    return [f"{value:.{digits}f}" for value in values]


def report(result: dict) -> str:
    """docs/choices.md."""
    rows = result["models"]
    connectivity = [
        [
            row["model"],
            *figures((100 * row["symbols"][s] for s in "CLERS"), 1),
            *figures((row["bits_per_triangle"]["connectivity"], row["entropy"])),
        ]
        for row in rows
    ]
    codes = ("fixed", "rice, one k for the model", "rice", "either")
    traversed = [
        [f"{row['model']}, {name}", *figures((row["traversed"][name][code] for code in codes), 1)]
        for row in rows
        for name in PREDICTORS
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
                *figures((row["components_per_meshlet"],)),
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

Share of each symbol in percent, bits per triangle as stored (2 for C, R, E; 3 for L, S),
and entropy of the symbols.

{markdown_table(["model", *"CLERS", "stored", "entropy"], connectivity)}
## Positions of traversed vertices

Bits per vertex (three elements, codes included) with fixed widths per meshlet, with one Rice
parameter k for the model, with one of seven Rice parameters per meshlet, and with the better of
fixed and Rice per meshlet, as in the format.

{markdown_table(["model, predictor", "fixed", "one k", "k per meshlet", "either"], traversed)}
## Positions of chain vertices

The same for the vertices between two corners of an owned run, predicted from the chord between
the corners or from the previous vertex.

{markdown_table(["model, predictor", "fixed", "one k", "k per meshlet", "either"], chains)}
## Boundaries

References and disks per meshlet; bits per meshlet of references, header and tables; and where
corner values are stored: percent in the meshlet itself, and after one, two and more hops.

{markdown_table(boundary_headings, boundary)}
## Sharing boundaries

Bits per triangle of boundary vertices (corners and chains, all attributes): as they are, each
stored by one meshlet; an estimate if every meshlet stored all of its own, with the same bits for
each; and how much larger the file would be, in percent.

{markdown_table(["model", "shared", "stored by each", "larger by, %"], sharing)}
## Choices switched off

Bits per triangle of whole files: as they are (the encoder chooses a predictor for each stream),
with both sides of every seam stored, and with one predictor for all streams.

{markdown_table(["model", *result["switched"][0]["bits"]], switched)}"""


def write_pages(result: dict) -> list[Path]:
    """docs/choices.md."""
    return [write_page("choices", report(result))]


QUESTION = Question("choices", __doc__, measure, report, write_pages)


def main() -> None:
    QUESTION.run()


if __name__ == "__main__":
    main()
