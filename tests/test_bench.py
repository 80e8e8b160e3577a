"""The committed tables are what their scripts make of the committed measurements."""

import json

import pytest

from bench import common, size


def result(name: str) -> dict:
    return json.loads((common.RESULTS / f"{name}.json").read_text())


def test_size_tables_match_their_measurements():
    measured = result("size")
    assert measured["script"] == "bench.size"
    assert (common.ROOT / "docs" / "size.md").read_text() == size.report(measured)
    assert size.readme_block(measured) in (common.ROOT / "README.md").read_text()


def test_size_rows_add_up():
    for row in result("size")["models"]:
        bits = dict(row["bits_per_triangle"])
        assert sum(bits.values()) == pytest.approx(2 * bits.pop("total"))
        assert row["ratio"] == pytest.approx(row["raw_bytes"] / row["compressed_bytes"])


def test_speed_table_matches_its_measurements():
    speed = pytest.importorskip("bench.speed", reason="DracoPy is not installed")
    measured = result("speed")
    assert measured["script"] == "bench.speed"
    assert (common.ROOT / "docs" / "speed.md").read_text() == speed.report(measured)


def test_block_replacement_keeps_the_rest(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- begin x -->\nold\n<!-- end x -->\nb\n")
    common.replace_block(page, "x", "new\n")
    assert page.read_text() == "a\n<!-- begin x -->\nnew\n<!-- end x -->\nb\n"
