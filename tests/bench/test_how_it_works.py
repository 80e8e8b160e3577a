"""The picture "How it works": its figures add up, and the committed picture shows them."""

import pytest
from PIL import Image

from bench import common, how_it_works
from spec.reference_decoder import MESHLETS_PER_GROUP, PARALLELOGRAM


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    path = tmp_path_factory.mktemp("picture") / "how_it_works.png"
    return path, how_it_works.draw(path)


def test_picture_is_drawn(drawn):
    path, numbers = drawn
    with Image.open(path) as picture:
        assert picture.width == 1600 and picture.text[common.DIGEST] == common.digest(numbers)


def test_bits_add_up(drawn):
    """The sections are the meshlet's bytes and entry; a letter but the last takes 1 to 4 bits."""
    numbers = drawn[1]
    sections, symbols = numbers["sections"], numbers["symbols"]
    file, m = how_it_works.compressed_model().file, numbers["meshlet"]
    group = file.groups[m // MESHLETS_PER_GROUP]
    span = 8 * (file.ends[m] - file.starts[m])
    assert sum(sections.values()) == numbers["total"] == group.entry_width + span
    lengths = {"R": 1, **dict(zip("LCES" if group.second_table else "CELS", (2, 3, 4, 4)))}
    assert sections["symbols"] == sum(lengths[symbol] for symbol in symbols[:-1])
    assert group.entry_width <= sections[how_it_works.PLACE] < group.entry_width + 8
    assert min(sections.values()) > 0 and numbers["raw"] > numbers["total"]


def test_committed_picture_shows_todays_figures(drawn):
    with Image.open(common.ROOT / "docs" / "how_it_works.png") as picture:
        assert picture.text[common.DIGEST] == common.digest(drawn[1]), (
            "run python -m bench how_it_works"
        )


def test_positions_are_predicted_as_the_caption_says():
    assert how_it_works.compressed_model().file.streams[0].predictor == PARALLELOGRAM
