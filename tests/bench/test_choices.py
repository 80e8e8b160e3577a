"""bench.choices: costs by hand, and figures of small blobs."""

import random
from collections import Counter

import pytest

from bench import choices
from spec import make_vectors


def test_costs_of_a_class_by_hand():
    # One meshlet, two vertices of one element: width 4 for both,
    # or Rice with k = 2: 2 low bits and the unary quotients 0 and 2.
    costs = choices.class_costs([[[1], [9]], []])
    assert costs["fixed"] == (3 + 5 + 2 * 4) / 2
    assert costs["rice"] == (3 + (1 + 2) + (3 + 2)) / 2
    assert costs["either"] == costs["rice"]


def test_better_codes_never_cost_more():
    rng = random.Random(1)
    meshlets = [
        [[rng.getrandbits(rng.randint(0, 9)) for _ in range(3)] for _ in range(rng.randint(0, 20))]
        for _ in range(50)
    ]
    costs = choices.class_costs(meshlets)
    assert costs["either"] <= min(costs["fixed"], costs["rice"])


def test_measured_blobs():
    figures = choices.measure_meshlets(
        [make_vectors.several_groups(), make_vectors.seams_between_meshlets()]
    )
    assert sum(figures["symbols"].values()) == pytest.approx(1)
    assert sum(figures["corners_by_hops"].values()) == pytest.approx(1)
    assert max(map(int, figures["corners_by_hops"])) <= 8


def test_sharing_boundaries_by_hand(monkeypatch):
    # A chain of 60 bits that one meshlet owns and another references;
    # corners of 30 bits, of which each meshlet stores a third.
    monkeypatch.setattr(
        choices, "section_bits", lambda blob: Counter(chains=60, anchors=30, interior=1000)
    )
    figures = {
        "references_per_meshlet": {choices.OWNED: 2.0, choices.FOREIGN: 2.0, choices.PRIVATE: 5.0},
        "corners_by_hops": {"0": 1 / 3},
    }
    bits = choices.boundary_bits([b""], 10, figures)
    assert bits == pytest.approx({"shared": 9, "alone": (120 + 90) / 10})


def test_boundaries_of_a_real_blob_cost_more_unshared():
    blobs = [make_vectors.several_groups()]
    bits = choices.boundary_bits(blobs, 1, choices.measure_meshlets(blobs))
    assert 0 < bits["shared"] < bits["alone"]
