"""What streams in Node request, and what they tell of requests that fail."""

from __future__ import annotations

from functools import partial
from typing import Any

from tests.helpers import streams
from tests.helpers.environment import ROOT

stream = partial(streams.stream, "stream_sources.mjs")
LEVELS = ROOT / "spec" / "lod_vectors" / "lod_levels.glb"


def run(task: str) -> Any:
    return stream(task, LEVELS)


def test_headers_of_each_form_go_with_ranges():
    assert run("headers") == 3 * [["Bearer 1", "bytes=0-32767"]]


def test_files_that_are_too_large_are_asked_for_once():
    """Also in Chromium, where an error of a stream is told as one of the network."""
    stated, unstated = run("tooLarge")
    for result in (stated, unstated):
        assert result["problem"].endswith("has more than 1,000,000 bytes (maxWholeBytes)")
        assert result["requests"] == 1


def test_answers_that_are_refused_hold_no_connection():
    result = run("refusedAnswers")
    assert result["problems"] == [
        "SourceError: PLACE: the file has changed",
        "SourceError: PLACE: the server answered with another range: bytes 8-9/1932",
        "SourceError: PLACE: the server answered 403",
    ]
    assert result["open"] == 0


def test_a_server_that_asks_for_a_pause_has_it(bunny):
    """Not only of the pages that it has refused."""
    result = stream("busyServer", bunny)
    assert result["pages"] > 12
    assert (result["asked"], result["again"]) == (6, 12)


def test_errors_of_an_own_fetch_are_told():
    assert run("ownFetch").endswith(": nobody is logged in")


def test_secrets_are_for_the_server_of_the_file():
    """A file may be of someone else."""
    assert run("secrets") == {"file": "secret", "own": "secret", "other": "none"}


def test_a_server_that_breaks_connections_at_first_is_asked_for_ranges_again():
    result = run("brokenStart")
    assert result["whole"] is False
    assert len(result["warnings"]) == 2


def test_other_origins_may_hide_that_a_file_is_compressed():
    assert run("hiddenCompression") == "nothing"


def test_requests_may_wait_as_long_as_they_want():
    assert run("patience") == "nothing"


def test_decoders_that_do_not_start_are_no_fault_of_the_file():
    assert run("noDecoder") == ["TypeError: fetch failed", "TypeError: Workers are not allowed"]


def test_a_decoder_from_a_response_serves_a_stream_that_opens_again():
    assert run("responseTwice") == ["SourceError: PLACE: the server answered 403", "nothing"]


def test_streams_end_at_once_while_they_tell_and_show():
    for result in run("ends").values():
        assert (result["ready"], result["loads"]) == ("Error: the stream is disposed", 0)
        assert result["left"] == 0
        assert result["seconds"] < 25


def test_levels_that_were_malformed_stream_when_the_file_is_mended(bunny):
    assert stream("mended", bunny) == ["Error: loaded whole", "nothing"]


def test_workers_end_if_another_one_does_not_start():
    result = run("oneWorkerFails")
    assert result == {"started": 2, "ended": 2, "problem": "Error: no more Workers"}


def test_workers_start_from_every_address():
    script = run("apostrophe")
    assert script.startswith('import "file:') and script.endswith("/o'brien/worker.js\"")
