"""Whether stated errors hold: each level of each primitive, and random cuts. For bench.lod."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from bench.common import progress
from gltf_ext.checks.samples import distances_to, sample_surface
from gltf_ext.lod import Cut, LodPrimitive, View, cut_at_level, cut_for_view, error_of, open_lod
from gltf_ext.lod.tables import Tables

SAMPLES = 50_000  # of each surface
CUTS = 100  # of a file, in turns in its primitives, the largest first
PIXELS = 1000  # per unit at distance one

Shares = tuple[float, float]


def measure(path: str) -> dict[str, list[Shares]]:
    """Of a file: shares_within of all levels but 0, and of CUTS random cuts."""
    primitives = [p for p in open_lod(path) if isinstance(p, LodPrimitive)]
    primitives.sort(key=lambda p: -p.compressed.triangle_count)
    random = np.random.default_rng(0)
    shares: dict[str, list[Shares]] = {"levels": [], "cuts": []}
    for number, primitive in enumerate(primitives):
        progress(f"errors of primitive {number + 1} of {len(primitives)}")
        tables, turns = primitive.tables, len(range(number, CUTS, len(primitives)))
        levels = [cut_at_level(tables, level) for level in range(1, tables.level_count)]
        cuts = [*levels, *islice(random_cuts(tables, random), turns)]
        found = shares_within(primitive, cuts)
        shares["levels"] += found[: len(levels)]
        shares["cuts"] += found[len(levels) :]
    return shares


def random_cuts(tables: Tables, random: np.random.Generator) -> Iterator[Cut]:
    """Cuts that replace something, for eyes from inside the model to ten diagonals away, at
    thresholds at which levels change somewhere; about half of them with some of the pages only."""
    error = tables.groups["error"].astype(np.float64)
    errors = np.sort(error[np.isfinite(error) & (error > 0)])
    centre, size = tables.groups["centre"][0].astype(float), 2.0 * float(tables.groups["radius"][0])
    while len(errors):
        direction = random.normal(size=3)
        distance = size * 10 ** random.uniform(-1, 1)
        at = np.exp(random.uniform(np.log(errors[len(errors) // 10]), np.log(errors[-1])))
        x, y, z = centre + direction / np.linalg.norm(direction) * distance
        resident = random.random(len(tables.pages)) < random.choice([0.9, 1.0])
        resident[: tables.root_pages] = True
        cut = cut_for_view(tables, View((x, y, z), PIXELS), at * PIXELS / distance, resident)
        if error_of(tables, cut) > 0:
            yield cut


def shares_within(primitive: LodPrimitive, cuts: list[Cut]) -> list[Shares]:
    """For each cut the shares of the samples of level 0, and of the cut, that lie within its stated
    error."""
    finest = primitive.compressed.decode()
    back = sample_surface(finest, SAMPLES)
    stated = [error_of(primitive.tables, cut) for cut in cuts]
    points, here = [], []
    for cut, error in zip(cuts, stated):
        mesh = primitive.mesh(cut)
        points.append(sample_surface(mesh, SAMPLES))
        here.append(float((distances_to(back, mesh) <= error).mean()))
    # One call, since it builds a tree of the finest level.
    there = np.split(distances_to(np.concatenate(points), finest), len(cuts)) if cuts else []
    return [(h, float((t <= error).mean())) for h, t, error in zip(here, there, stated)]
