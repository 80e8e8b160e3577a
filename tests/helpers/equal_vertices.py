"""The conformance vector of the table of equal vertices."""

from __future__ import annotations

import json

import numpy as np

from spec.make_vectors import FOLDER

VECTOR = FOLDER / "gltf_equal_vertices.glb"


def assert_equal_vertices(indices, positions):
    """Assert that triangles have the vertices that the vector says, in any order of these."""
    expected = json.loads(VECTOR.with_suffix(".json").read_text())
    corners = np.asarray(indices, int).reshape(-1)
    numbers = {vertex: number for number, vertex in enumerate(dict.fromkeys(corners.tolist()))}
    assert [numbers[vertex] for vertex in corners.tolist()] == expected["sourceIndices"]
    assert len(positions) == len(numbers)
    values = np.array(expected["attributes"]["POSITION"])[expected["indices"]]
    assert np.array_equal(np.asarray(positions)[corners], values)
