"""Streams and pools leave nothing behind that has ended, and wait for nothing for ever."""

from __future__ import annotations

from functools import partial

from tests.helpers import streams
from tests.helpers.environment import ROOT

stream = partial(streams.stream, "stream_leftovers.mjs")
LEVELS = ROOT / "spec" / "lod_vectors" / "lod_levels.glb"


def test_a_worker_that_does_not_start_ends_no_pool_that_works():
    """Its jobs go to the others."""
    dead = "Error: a decoder's Worker failed: dead"
    assert stream("idleWorker") == ["nothing", "nothing", dead, "nothing"]


def test_timers_end_with_their_stream(bunny):
    before, after = stream("timers", bunny)
    assert before > 0
    assert after == 0


def test_object_urls_of_workers_are_revoked():
    assert stream("scripts") == {"made": 4, "left": [0, 0]}


def test_a_hidden_length_is_no_way_around_the_limit_of_a_json():
    assert stream("hiddenLength") == (
        "SourceError: PLACE: the file has more than 268,435,456 bytes, too many for a JSON"
    )


def test_a_strong_etag_decides_alone(bunny):
    strong, weak = stream("modified", bunny)
    assert strong == "nothing"
    assert weak == "SourceError: PLACE: the file has changed"


def test_a_place_that_is_no_url_leaves_no_listener():
    assert stream("noPlace") == {"problem": "TypeError", "listeners": 0}


def test_nothing_is_done_with_what_a_closed_stream_has_freed():
    assert stream("closedWhileShown", LEVELS) == "Error: the stream is disposed"


def test_an_end_without_a_reason_has_a_message(bunny):
    assert stream("aborted", bunny) == 3 * ["SourceError: the stream is closed"]


def test_a_module_that_never_comes_is_an_error():
    result = stream("hangingModule", LEVELS)
    assert result == {"waits": [60_000], "ended": "Error: PLACE: no answer in 60 seconds"}
