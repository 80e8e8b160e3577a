"""bench.choices: costs by hand, and figures of small blobs."""

from collections import Counter

import pytest

from bench import choices
from bench.generated import torus
from gltf_ext.attributes.extension import require_compressed
from gltf_ext.sources.importers import open_model
from gltf_meshlet.demo.model import write_glb
from spec import make_vectors


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
        [make_vectors.committed("several_groups"), make_vectors.committed("seams_between_meshlets")]
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
    blobs = [make_vectors.committed("several_groups")]
    bits = choices.boundary_bits(blobs, 1, choices.measure_meshlets(blobs))
    assert 0 < bits["shared"] < bits["alone"]
