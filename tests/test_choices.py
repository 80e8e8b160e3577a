"""bench.choices: the committed page is what the script makes of the committed figures, and the figures are plausible."""

import json
import random

import make_vectors
import pytest

from bench import choices, common


def test_page_matches_its_measurements():
    measured = json.loads((common.RESULTS / "choices.json").read_text())
    assert measured["script"] == "bench.choices"
    assert (common.ROOT / "docs" / "choices.md").read_text() == choices.report(measured)


def test_costs_of_a_class_by_hand():
    # one meshlet, two vertices of one component: width 4 for both, or Rice with k = 2: 2 low bits and unary 0 and 2
    costs = choices.class_costs([[[1], [9]], []])
    assert costs["fixed"] == (3 + 5 + 2 * 4) / 2
    assert costs["rice"] == (3 + (1 + 2) + (3 + 2)) / 2
    assert costs["either"] == costs["rice"]


def test_better_codes_never_cost_more():
    rng = random.Random(1)
    meshlets = [[[rng.getrandbits(rng.randint(0, 9)) for _ in range(3)] for _ in range(rng.randint(0, 20))] for _ in range(50)]
    costs = choices.class_costs(meshlets)
    assert costs["either"] <= min(costs["fixed"], costs["rice"])


def test_measured_blobs():
    figures = choices.measure_meshlets([make_vectors.several_groups(), make_vectors.seams_between_meshlets()])
    assert sum(figures["symbols"].values()) == pytest.approx(1)
    assert sum(figures["corners_by_hops"].values()) == pytest.approx(1)
    assert max(map(int, figures["corners_by_hops"])) <= 8
