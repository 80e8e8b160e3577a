"""bench/efforts.py: its page and its plot."""

from __future__ import annotations

import pytest

from bench import efforts

ORIGIN = {
    "script": "bench.efforts",
    "date": "2026-01-01T00:00:00+00:00",
    "commit": "abc",
    "machine": {"cpu": "CPU", "cores": 2},
    "repetitions": 1,
    "peers": {"Draco": "1.5"},
    "missing": [],
}


def way(effort: str, threads: int, seconds: float, size: int, **more: int) -> dict:
    times = {"low": seconds, "median": seconds, "high": seconds}
    return {"effort": effort, "threads": threads, "seconds": times, "bytes": size, **more}


@pytest.fixture
def result() -> dict:
    ways = [
        way("fast", 1, 1.0, 1030, peak_bytes=90_000),
        way("fast", 2, 0.5, 1030, peak_bytes=95_000),
        way("normal", 1, 2.0, 1005, peak_bytes=90_000),
        way("normal", 2, 1.25, 1005, peak_bytes=95_000),
        way("high", 1, 3.0, 1000, peak_bytes=90_000),
        way("high", 2, 1.5, 1000, peak_bytes=95_000),
        way("before", 1, 5.0, 1000, peak_bytes=99_000),
        way("before", 2, 4.0, 1000, peak_bytes=99_000),
        way("gltfpack", 1, 0.1, 2000),
    ]
    return {**ORIGIN, "models": [{"model": "bunny", "triangles": 1000, "ways": ways}]}


def test_ratios_are_relative_to_the_build_before(result):
    page = efforts.report(result)
    assert 'relative to "before" on 1 thread' in page
    ratios = "| bunny | 1,000 | 2.50 | +0.50 | 1.60 | 5.00 | +3.00 | 2.00 | 1.67 | +0.00 | 2.00 |"
    assert ratios in page
    assert "| bunny, gltfpack | 1 | 0.01 | 50.00 | 1.00 | 2,000 | +100.00 | - |" in page


def test_without_a_build_before_they_are_relative_to_high(result):
    (model,) = result["models"]
    model["ways"] = [row for row in model["ways"] if row["effort"] != "before"]
    assert 'relative to "high" on 1 thread' in efforts.report(result)


def test_page_has_a_section_on_more_cores(result, monkeypatch):
    cores = {**result, "machine": {"cpu": "CPU", "cores": 16}}
    monkeypatch.setattr(efforts, "read_result", {"efforts_cores": cores}.get)
    first, _, section = efforts.report(result).partition("## On more cores")
    assert "CPU, 2 cores" in first and "CPU, 16 cores" in section
    assert first.count("| bunny | 1,000 |") == section.count("| bunny | 1,000 |") == 1


@pytest.mark.parametrize("sizes", [(1000,), (1000, 2000)])
def test_plot(result, sizes, tmp_path):
    [model] = result["models"]
    result["models"] = [{**model, "triangles": triangles} for triangles in sizes]
    assert efforts.save_plot(result, tmp_path / "efforts.png").stat().st_size > 0
