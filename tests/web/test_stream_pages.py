"""The states of a page, by the table in web/stream/core/page.js, under random events."""

from __future__ import annotations

import re
from functools import partial

from tests.helpers import streams

stream = partial(streams.stream, "stream_pages.mjs")
PAGE = streams.WEB / "stream" / "core" / "page.js"
STATES = ["NONE", "REQUESTED", "STORED", "DECODING", "DECODED", "RESIDENT"]


def table() -> dict[tuple[str, str], str]:
    """The transitions that the header of page.js names: (state, event) -> state."""
    rows = re.findall(r"^// \| (\w+) +\| ([A-Z, ]+?) +\| ([A-Z]+) +\|", PAGE.read_text(), re.M)
    return {(state, event): to for event, all_from, to in rows for state in all_from.split(", ")}


def test_a_page_goes_the_ways_of_the_table_only():
    known = table()
    seen = set()
    for before, event, after, has_bytes, has_place in stream("transitions", 20_000):
        way = (STATES[before], event)
        if after is None:
            assert way not in known
            continue
        seen.add(way)
        state = STATES[after]
        if event == "evict" and not has_bytes:
            assert state == "NONE"
        else:
            assert known.get(way) == state, way
        assert has_bytes or state not in ("STORED", "DECODING", "DECODED")
        assert not has_bytes or state not in ("NONE", "REQUESTED")
        assert has_place == (state == "RESIDENT")
    assert seen == set(known)


def test_residency_adds_up_whatever_happens():
    """Servers and Workers fail, views change, pages are evicted and tried again."""
    result = stream("residency", 1500)
    assert (result["wrong"], result["rest"], result["transit"]) == ([], 0, 0)
    assert result["states"] == len(STATES)


def test_streams_of_a_page_share_workers(bunny):
    """They end with the last stream; the next one starts others."""
    result = stream("sharing", bunny)
    assert (result["first"], result["last"], result["another"]) == (True, True, True)
    assert result["firstBytes"] < 30_000_000
    assert result["kept"] == {"started": 1, "ended": 0}
    assert result["counts"] == {"started": 2, "ended": 2}


def test_workers_that_do_not_start_are_tried_again(bunny):
    assert stream("failing", bunny) == ["no Workers here", "no Workers here", "open"]
