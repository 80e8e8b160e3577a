"""docs/stream.md claims nothing that the committed measurement does not show."""

from bench import common, stream


def test_first_picture_and_budgets():
    result = common.read_result("stream")
    for browser in stream.BROWSERS:
        runs = [run for run in result["runs"] if run["browser"] == browser]
        (first,) = (run for run in runs if run["task"] == "first")
        assert first["first"]["bytes"] <= 150_000 and first["first"]["pixels"] <= 30
        assert first["last"]["bytes"] <= 1.3 * result["cut_bytes"]
        flights = [run for run in runs if run["task"] == "flight"]
        assert len(flights) == 2 * len(stream.BUDGETS)
        for run in flights:
            assert run["most"] <= run["budget"]
            assert run["complete"]
