"""Streams in Node whose options are wrong, whose server misbehaves, or that end at any moment."""

from __future__ import annotations

from functools import partial

import pytest

from tests.helpers import streams
from tests.helpers.environment import ROOT

stream = partial(streams.stream, "stream_faults.mjs")
VECTORS = ROOT / "spec" / "lod_vectors"
LEVELS = VECTORS / "lod_levels.glb"


def test_workers_that_never_answer_are_an_error():
    """Such as those of a file of one's own that does not import the package's."""
    result = stream("silentWorker", LEVELS)
    assert "no answer in 30 seconds; does its file import the package's?" in result["ready"]
    assert len(result["error"]) == 1


def test_options_that_are_no_numbers_are_refused():
    """One that is right afterwards counts as ever."""
    result = stream("options", LEVELS)
    given = ["NaN", "-1", "64", "null", "Infinity"]
    least = {"maxBytes": "1,000,000", "stallMs": "1", "maxWholeBytes": "1", "pixels": "0"}
    for name, bound in least.items():
        problem = f"RangeError: {name} must be a number of at least {bound}, not "
        assert result[name] == [problem + value for value in given]
    assert result["threshold"] == 1


@pytest.mark.parametrize("status", [403, 404])
def test_pages_that_were_refused_are_tried_again_if_asked_to(bunny, status):
    result = stream("refused", bunny, status)
    assert (result["before"], result["after"], result["broken"]) == (False, True, [])
    assert result["warnings"][0].endswith(f"the server answered {status}")


def test_own_fetch_renews_signatures(bunny):
    result = stream("signed", bunny)
    assert (result["complete"], result["warnings"], result["broken"]) == (True, [], [])
    assert result["signature"] > 2


def test_streams_that_have_ended_open_again():
    result = stream("reopened", LEVELS)
    assert [text[-23:] for text in result["ready"][:2]] == 2 * ["the server answered 403"]
    assert result["ready"][2] == "nothing"
    assert (len(result["load"]), len(result["error"])) == (1, 2)


def test_retry_after_is_respected(bunny):
    """As seconds or a date, up to two minutes."""
    result = stream("retryAfter", bunny)
    seven, minute, day, word, nothing = result["seconds"]
    assert (seven, day, word, nothing) == (7, 120, 0.5, 0.5)
    assert 50 < minute <= 60
    assert 1 <= result["opened"] < 20
    assert result["pages"] == [False, True]


def test_files_that_are_stored_compressed_load_whole(bunny):
    result = stream("storedCompressed", bunny)
    assert (result["complete"], result["broken"]) == (True, [])
    assert result["warnings"][-1].endswith("so that the whole file is loaded")
    assert "cannot be reached" in result["offline"]


def test_files_that_change_while_they_open_are_opened_again(bunny):
    """An ETag that is weak now and then, as behind a proxy, is no other file."""
    result = stream("etags", bunny)
    for name in ("second", "third"):
        (warning,) = result[name]["warning"]
        assert warning.endswith("the file has changed; starting again")
    assert result["weak"]["warning"] == []
    for one in result.values():
        assert (one["ready"], len(one["load"]), one["error"]) == ("nothing", 1, [])


def test_endless_answers_end():
    assert stream("endless") == (
        "SourceError: PLACE: without ranges the file is loaded whole, and has more than "
        "1,000,000 bytes (maxWholeBytes)"
    )


def test_what_is_no_model_is_named():
    empty, page, cut, blob = stream("noFile", LEVELS)
    assert empty == "SourceError: PLACE: the file is empty"
    assert page == "MalformedError: PLACE: it is no .glb, and its JSON cannot be read"
    assert cut == "MalformedError: PLACE: it is not a .glb of version 2"
    assert blob == "MalformedError: the file: it is no .glb, and its JSON cannot be read"


def test_files_without_levels_to_stream_are_told():
    version, none = stream("noLevels", LEVELS, ROOT / "spec" / "vectors" / "gltf_attributes.glb")
    whole = "no primitive has levels that can be streamed (EXT_meshlet_lod): "
    whole += "all of it is loaded at once"
    assert version == ["mesh 0 primitive 0: levels of unknown version 7; loaded whole", whole]
    assert none == [whole]


def test_signals_of_a_page_hold_no_stream_that_has_ended():
    result = stream("signals", LEVELS)
    assert result["counts"][0] >= 3
    assert result["counts"][1] == 0
    assert result["ended"] is True


def test_streams_end_at_any_moment(bunny):
    """Nothing stays in the engine, and an end that the page asked for is no error."""
    result = stream("endsAnywhere", bunny)
    assert result["moments"] > 12
    assert (result["left"], result["errors"], result["unhandled"]) == ([], [], [])
    assert set(result["ready"]) == {"nothing", "Error: the stream is disposed"}


def test_a_worker_has_one_unpacker():
    result = stream("unpackers", VECTORS / "lod_packed.glb")
    assert result == {"modules": 2, "same": True}
