"""Memory of streams that changes while they are open: its amount, and where pages lie."""

from __future__ import annotations

from functools import partial

from tests.helpers import streams

stream = partial(streams.stream, "stream_memory.mjs")
SHOWN = ("triangles", "threshold", "complete", "drawn", "digest")


def picture(one):
    return [one[name] for name in SHOWN]


def test_max_bytes_changes_as_if_the_stream_had_begun_with_it(bunny):
    result = stream("changed", bunny)
    many, few, again = result["changing"]
    assert picture(many) == picture(again) == picture(result["fresh"][0])
    assert picture(few) == picture(result["fresh"][1])
    assert few["threshold"] > many["threshold"] == 0.2
    assert few["bytes"]["total"] <= 2_500_000 < many["bytes"]["total"]
    assert "too small for this file" in result["refused"]
    assert result["after"] == 64e6
    assert result["told"] == {"warnings": [], "broken": []}


def test_pages_lie_where_the_engine_wants_them(bunny):
    """Without a copy in arrays there, and decoded again if that is lost."""
    result = stream("stores", bunny)
    arrays, stored, again, back = result["result"]
    assert picture(arrays) == picture(stored) == picture(again) == picture(back)
    assert arrays["bytes"]["arrays"] == arrays["bytes"]["gpu"] > 0
    assert back["bytes"]["arrays"] == back["bytes"]["gpu"]
    for one in (stored, again):
        assert one["bytes"]["arrays"] == 0
        assert one["bytes"]["gpu"] > 0
    assert result["released"] == [False, True]
    assert result["told"] == {"warnings": [], "broken": []}


def test_streams_of_a_page_share_requests(bunny):
    """Six at once; each stream may have one whatever the others do."""
    result = stream("requests", bunny)
    assert result == {"before": [6, 1, 1], "after": 5}
