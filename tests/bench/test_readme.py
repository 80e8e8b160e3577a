"""README.md's chart of the peers shows today's measurements."""

from pathlib import Path

from PIL import Image

from bench import common, figures

ROOT = Path(__file__).resolve().parent.parent.parent


def bars_of_today():
    return figures.peers(common.read_result("size"), common.read_result("transport"))


def test_readme_shows_the_chart_of_the_peers():
    readme = (ROOT / "README.md").read_text()
    assert "](docs/peers.png)" in readme and "](docs/results.md)" in readme
    bars = bars_of_today()
    assert set(bars) == {*figures.PEERS, *figures.PUBLISHED}
    with Image.open(ROOT / "docs" / "peers.png") as picture:
        assert picture.text[common.DIGEST] == common.digest(bars)


def test_readme_claims_a_thirteenth_of_the_raw_size():
    """The first paragraph rounds the chart's figures."""
    readme = (ROOT / "README.md").read_text()
    assert "in a 13th at 12 bits for positions and 8 for normals" in " ".join(readme.split())
    as_file, on_gpu = bars_of_today()["ours"]
    assert 12.5 <= as_file < 13.5 and 12.5 <= on_gpu < 13.5


def test_peers_are_medians_over_the_papers_models():
    def row(model, ratio):
        ours = {"ratio": ratio, "resident_ratio": 2 * ratio}
        return {"model": model, "raw_bytes": 60, "codecs": {"ours": ours}}

    names = ("bunny", "dragon", "suzanne", "igea")
    models = [row(name, ratio) for name, ratio in zip(names, (1, 2, 9, 100))]
    packed = [{"model": name, "bytes": {"packed": n}} for name, n in zip(names, (30, 20, 10, 1))]
    measured = figures.peers({"models": models}, {"models": packed})
    assert {name: bars for name, bars in measured.items() if name not in figures.PUBLISHED} == {
        "ours": [2, 4],
        "ours, packed": [3, 4],
    }
