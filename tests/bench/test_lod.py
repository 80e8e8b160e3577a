"""bench.lod: cuts beside a chain and beside files of an earlier builder."""

import argparse
import sys

import pytest

from bench import lod
from tests.helpers.environment import ROOT

VECTOR = str(ROOT / "spec" / "lod_vectors" / "lod_levels.glb")
LEVELS = [
    {"triangles": 192, "error": 0.0, "bytes": 1000},
    {"triangles": 12, "error": 1.0, "bytes": 100},
]
# The steps of the vector's levels lie between 0.5 and 8 pixels.
CHAINS = {"longest_side": 500.0, "chains": {"0 0": {"scale": 1.0, "levels": LEVELS}}}


def test_cuts_are_those_of_each_error():
    rows = lod.sweep({"": VECTOR, "before_": VECTOR}, CHAINS)
    assert len(rows) == len(lod.THRESHOLDS)
    for row in rows:
        error = row["pixels"] * 500.0 / lod.PIXELS
        assert row["chain_triangles"] == (12 if error >= 1.0 else 192)
        assert row["triangles"] == row["before_triangles"]
        assert row["bytes"] == row["before_bytes"]
        assert row["whole_bytes"] == row["bytes"]  # tables of a small file are whole
    counts = [row["triangles"] for row in rows]
    assert counts[0] == 192 and counts[-1] == 48 and counts == sorted(counts, reverse=True)


def test_the_worst_error_counts():
    rows = [
        {"triangles": 2, "bytes": 40, "before_triangles": 4, "before_bytes": 40},
        {"triangles": 3, "bytes": 50, "before_triangles": 2, "before_bytes": 40},
    ]
    rows = [{**row, "chain_triangles": 1, "chain_bytes": 10} for row in rows]
    costs = {"bytes": 3, "cpu_seconds": 6, "peak_bytes": 9}
    model = {"lod": costs, "before": {name: value / 2 for name, value in costs.items()}}
    result = {"before": "abc", "models": {"one": model}, "sweeps": {"one": rows}}
    text = lod.before_section(result)
    assert "commit abc" in text
    cells = [cell.strip() for cell in text.splitlines()[-2].split("|")]
    assert cells[1:-1] == ["one", "2.83", "2.45", "1.50", "4.00", "4.47", "1.25", *["2.00"] * 3]
    assert lod.before_section({**result, "before": None}) == ""


def test_before_needs_another_package():
    with pytest.raises(SystemExit, match="no other gltf_ext"):
        lod.check(argparse.Namespace(before=("abc", sys.executable)))
