"""bench.web: what is missing is named before any measurement; tables show every codec."""

import argparse

import pytest

from bench import peers, web

OPTIONS = argparse.Namespace(models=["bunny"])


def test_missing_npm_package_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(peers, "NODE_MODULES", tmp_path)
    with pytest.raises(SystemExit, match="npm install --prefix build/node draco3d"):
        web.check(OPTIONS)


def test_tables_show_rates_cold_starts_and_sizes():
    warm = ["native", *web.CODECS, "ours, 1 worker", "ours, 2 workers"]
    model = {
        "model": "cube",
        "triangles": 12_000_000,
        "warm": {codec: {"low": seconds} for seconds, codec in enumerate(warm, 1)},
        "cold": {codec: {"low": 0.25} for codec in web.CODECS},
    }
    row = web.speed_table({"models": [model]}).splitlines()[2]
    assert row == (
        "| cube | 12,000,000 | 12.0 | 6.0 | 2.4 | 2.0 | 4.0 | 3.0 | 250 ms | 250 ms | 250 ms |"
    )
    sizes = {"version": "1.0", "files": ["a.js"], "bytes": 1500, "brotli_bytes": 700}
    packages = dict.fromkeys((web.OURS, *web.NPM_PACKAGES), sizes)
    assert "| draco3d 1.0 | `a.js` | 1.5 | 0.7 |" in web.size_table({"packages": packages})
