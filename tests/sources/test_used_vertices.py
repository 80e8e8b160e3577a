"""Vertices that triangles use: found once, and again when the rows of a source change."""

import numpy as np

from gltf_ext.sources.primitives import Primitive
from gltf_ext.sources.repair import read_finite_bounds
from gltf_ext.sources.source import ArrayRows, Source


def fan(count):
    """Triangles 0 1 2, 0 2 3, ... of points on a circle."""
    turns = np.linspace(0, 6, count, dtype=np.float32)
    positions = np.stack([np.cos(turns), np.sin(turns), turns], axis=1)
    corners = np.arange(1, count - 1)
    triangles = np.stack([np.zeros_like(corners), corners, corners + 1], axis=1)
    return Source.of(Primitive(0, 0, triangles.astype(np.uint32), {"POSITION": positions}, []))


def test_they_are_found_once(monkeypatch):
    looks = []
    find = Source._find_used
    monkeypatch.setattr(Source, "_find_used", lambda *args: looks.append(1) or find(*args))
    source = fan(9)
    source.read_bounds()
    assert len(source.used_rows()) == 9 and len(looks) == 1


def test_they_are_found_again_for_other_rows():
    source = fan(9)
    assert len(source.used_rows()) == 9
    ((names, numbers),) = source.numberings
    source.numberings = [(names, ArrayRows(numbers.values[:6]))]
    assert source.used_rows().tolist() == [0, 1, 2, 3]
    positions = source.attributes["POSITION"].values.copy()
    positions[2] = positions[3]
    source.attributes["POSITION"] = ArrayRows(positions)
    assert source.used_rows().tolist() == [0, 1, 2], "0 2 3 is degenerate now"


def test_they_are_found_again_after_a_repair():
    source = fan(9)
    source.attributes["POSITION"].values[8] = np.nan
    assert len(source.used_rows()) == 9
    read_finite_bounds(source)
    assert source.used_rows().tolist() == list(range(8))
    assert np.isfinite(source.bounds["POSITION"]).all()
