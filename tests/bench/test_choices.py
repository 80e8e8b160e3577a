"""bench.choices: costs by hand, and figures of small blobs."""

import random
from collections import Counter

import pytest

from bench import choices
from bench.generated import torus
from gltf_ext.compression.extension import require_compressed
from gltf_ext.gltf.importers import open_model
from gltf_meshlet.demo.model import write_glb
from spec import make_vectors
from spec.reference_decoder import Decoder


def test_costs_of_a_class_by_hand():
    # One meshlet, two vertices of one element: width 4 for both,
    # or Rice with k = 2: 2 low bits and the unary quotients 0 and 2,
    # or exp-Golomb with k = 2: 1 + 2 = 2 + 1 bits for 1, 3 + 2 for 9 = 4 + 5.
    costs = choices.class_costs([[[1], [9]], []])
    assert costs["fixed"] == (3 + 5 + 2 * 4) / 2
    assert costs["rice"] == costs["rice, one k"] + 3 / 2 == (3 + (1 + 2) + (3 + 2)) / 2
    assert costs["exp-Golomb"] == (3 + 3 + (3 + 2)) / 2
    assert costs["all"] == costs["rice"]
    # Chains do without exp-Golomb codes, and have more Rice codes.
    outlier = [[[1], [9], [500]]]
    assert choices.class_costs(outlier)["all"] == choices.class_costs(outlier)["exp-Golomb"]
    chains = choices.class_costs(outlier, chains=True)
    assert chains["all"] == min(chains["rice"], chains["fixed"]) > chains["exp-Golomb"]


def test_exp_golomb_costs_are_those_of_the_specification():
    for u, k in [(0, 0), (1, 0), (2, 0), (3, 0), (5, 1), (9, 2), (1000, 3)]:
        q = (u + 2**k).bit_length() - 1 - k
        assert choices.exponential_cost([[u]], k) == 3 + (q + 1) + (k + q)


def test_better_codes_never_cost_more():
    rng = random.Random(1)
    meshlets = [
        [[rng.getrandbits(rng.randint(0, 9)) for _ in range(3)] for _ in range(rng.randint(0, 20))]
        for _ in range(50)
    ]
    costs = choices.class_costs(meshlets)
    assert costs["all"] <= min(costs["fixed"], costs["rice"], costs["exp-Golomb"])


def test_replayed_residuals_are_the_stored_ones():
    """The format's own predictors give the residuals that the reference decoder reads."""
    decoder = Decoder(make_vectors.several_groups())
    predictor = decoder.file.streams[0].predictor
    for m in range(decoder.file.meshlet_count):
        meshlet, (_, (values,)) = decoder.file.meshlet(m), decoder.meshlet(m)
        runs = decoder.boundary(meshlet)
        replayed = choices.traversed_residuals(decoder, m, values, runs, predictor)
        (stored,) = decoder.interior(meshlet, [len(replayed)])
        assert replayed == zigzagged(stored)
        chains = choices.chain_residuals(meshlet, values, runs, choices.toward)
        assert predictor == choices.COPY or chains == zigzagged(meshlet.chain_residuals[0])


def zigzagged(residuals):
    return [[choices.zigzag(r) for r in vertex] for vertex in residuals]


def test_predictions_of_a_chain_by_hand():
    run = [[0], [9], [5], [12]]
    assert [choices.toward(run, i) for i in (1, 2)] == [[4], [11]]
    assert [choices.chord(run, i) for i in (1, 2)] == [[4], [8]]
    assert [choices.previous(run, i) for i in (1, 2)] == [[0], [9]]


@pytest.mark.parametrize("options", [{"cheapest_of": (choices.MEAN, choices.COPY)}, {}])
def test_predictors_can_be_taken_away(tmp_path, options):
    """Whole files: positions, normals and texture coordinates of a torus."""
    path = tmp_path / "torus.glb"
    write_glb([torus(1000)], path)
    as_is, output = choices.totals(path, tmp_path)
    predictor = choices.one_for_all(choices.GEO) if not options else None
    with choices.encoder(choose=predictor, **options):
        changed, output = choices.totals(path, tmp_path)
    (compressed,) = require_compressed(open_model(output))
    used = [stream.predictor for stream in compressed.streams]
    if options:
        assert set(used) <= {choices.MEAN, choices.COPY}
        assert changed["bits_per_triangle"]["total"] > as_is["bits_per_triangle"]["total"]
    else:
        assert used[1] == choices.GEO and used[0] != choices.GEO


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
